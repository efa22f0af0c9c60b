// O-DCA for planar mechanisms of revolute joints (pins) with branches: trees, several loops on one
// body, grids, and for all with forces other than gravity. Computes rates directly from joint
// coordinates and speeds, like path_sweep.cpp for paths, along an assembly tree (plan.h).
//
//   angles and speeds of bodies   along the spanning tree (tree_angles.h)
//   violations of cut joints      along the same tree
//   up, matrices                  zeta of each body, then X, W and zeta of each join
//   up and down, vectors          zeta_i3, then forces: once, or twice where speeds are completed
//
// Handles are those of pins.h; a body has as many as pins. A tree pin on Ground is a property
// of its body, not a joint of an assembly. A join factors X = L D L^T, two rows of one pin at a
// time. It keeps L and W = D^-1 L^-1 Y. The rank of a pin that closes a loop is uncertain under the
// condition for paths: then the general sweep decides.
//
// Threads share the pieces of the plan. One thread goes along the spanning tree and through the
// last piece. A rejection depends on the positions alone.
#include <algorithm>
#include <atomic>
#include <cmath>

#include "mechanism/algebra/known_size.h"
#include "mechanism/loops/loop_solver.h"
#include "odca/path_links.h"
#include "odca/tree_angles.h"

namespace loopbench::odca::pins {

namespace {

/// A pin of the tree on Ground: a property of its body.
bool HoldsBody(const Joint<Planar, double>& joint) {
  return joint.in_tree() && (joint.from == kGround || joint.to == kGround);
}

/// [xx xy; yx yy].
struct Matrix2 {
  double xx, xy, yx, yy;

  friend Matrix2 operator-(const Matrix2& A, const Matrix2& B) {
    return {A.xx - B.xx, A.xy - B.xy, A.yx - B.yx, A.yy - B.yy};
  }
};

/// A moment of F about the point that the arm leads from.
double Moment(const Vector2<double>& arm, const Vector2<double>& F) {
  return arm.x * F.y - arm.y * F.x;
}

template <class Size>
LOOPBENCH_INLINE double Dot(const double* a, const double* b, Size size) {
  if constexpr (kKnownSize<Size> == 2) {
    return a[0] * b[0] + a[1] * b[1];
  } else {
    const int n = size;
    Lanes sums = {};
    int i = 0;
    for (; i + kLanes <= n; i += kLanes) sums += Load<Lanes>(a + i) * Load<Lanes>(b + i);
    double sum = 0.0;
    for (int lane = 0; lane < (i > 0 ? kLanes : 0); ++lane) sum += sums[lane];
    for (; i < n; ++i) sum += a[i] * b[i];
    return sum;
  }
}

/// Calls `call` with the rows of a join, as a constant for one pin or two.
template <class Call>
LOOPBENCH_INLINE auto WithRows(int pins, const Call& call) {
  return WithSize<double, 2, 4>(2 * pins, call);
}

}  // namespace

class AssemblySweep final : public ShortCut<Planar> {
 public:
  static std::unique_ptr<AssemblySweep> Make(const Mechanism<Planar, double>& mechanism,
                                             const Plan& plan, int threads);

  bool IsUsable(const Kinematics<Planar, double>& kinematics) override {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      angle_[i] = kinematics.poses()[bodies_[i].index].angle;
      speed_[i] = 0.0;
    }
    return Turn<true>() && Assemble();
  }

 private:
  using Vector = Vector2<double>;
  using Matrix = Matrix2;

  struct Body {
    int index = 0;      ///< of the mechanism's bodies
    Link<double> link;  ///< arms belong to handles
    int first_handle = 0, handles = 0;
    int first_block = 0;  ///< of zeta
    Vector stand = {};    ///< position of a fixed point of reference, if any
    Vector centre = {};   ///< of mass, from the point of reference, in axes of the body
  };
  /// Effect of forces other than gravity on a body alone.
  struct Applied {
    Vector a = {};       ///< acceleration of the point of reference
    double alpha = 0.0;  ///< sqrt(I) times angular acceleration
  };
  /// A joint of the tree between two bodies: position of the child.
  struct Step {
    int parent = 0, child = 0;                ///< bodies
    int parent_handle = 0, child_handle = 0;  ///< handles at their common joint
  };
  /// A joint that is cut. On Ground there is no handle.
  struct CutJoint {
    int P = -1, Q = -1;            ///< handles
    int body_P = -1, body_Q = -1;  ///< -1: Ground
    Vector ground = {};            ///< the point there
    Vector v = {};                 ///< relative velocity (pins.h), Q against P, or the gap
    double w_P = 0.0;
  };
  /// One of a node's joints on one of its children.
  struct Side {
    int child = 0;
    int place = -1;   ///< among its handles; -1: Ground
    int handle = -1;  ///< in handles_
  };
  struct Pin {
    Side P, Q;
    int cut = -1;        ///< in cuts_
    double limit = 0.0;  ///< least response; 0 if it closes no loop
  };
  /// A join. Children's zeta are blocks by columns.
  struct Node {
    int blocks[2] = {0, 0}, handles[2] = {0, 0};  ///< first block and number of handles of each
    int first_pin = 0, pins = 0;
    int first_kept = 0, kept = 0;  ///< in kept_
    int first_block = 0;           ///< of its own zeta
    int matrix = 0;                ///< first number of W_
  };
  /// A piece of the plan, with memory for its nodes alone.
  struct alignas(64) Piece {
    int first_body = 0, last_body = 0;
    int first_node = 0, last_node = 0;
    std::vector<double> U;  ///< L^-1 Y of one join, with the columns of W_
  };
  static constexpr int kBodiesPerTask = 512;

  struct Layout;

  bool Place(Unknowns unknowns, std::span<const double> q, std::span<const double> u) override {
    tree_.ToBodies(q, u, angle_.data(), speed_.data(), *pool_);
    return unknowns == Unknowns::kPositions ? Turn<false>() : Turn<true>();
  }
  Correction<double> LargestGap() const override {
    double largest = 0.0;
    for (const CutJoint& cut : cuts_) {
      largest = std::max(largest, cut.v.x * cut.v.x + cut.v.y * cut.v.y);
    }
    return {.shift = std::sqrt(largest)};
  }
  bool Find(Unknowns unknowns) override {
    if (unknowns != Unknowns::kCompleted && !Assemble()) return false;
    unknowns == Unknowns::kAccelerations ? Solve<Unknowns::kAccelerations>()
    : unknowns == Unknowns::kCompleted   ? Solve<Unknowns::kCompleted>()
                                         : Solve<Unknowns::kSpeeds>();
    return true;
  }
  bool AddChange(std::span<const double> base, std::span<double> sum) override {
    return tree_.ToJoints(alpha_.data(), base, sum, *pool_);
  }
  void AddToSpeeds() override {
    for (std::size_t i = 0; i < bodies_.size(); ++i) speed_[i] += alpha_[i];
  }
  void TakeForces(Kinematics<Planar, double>& kinematics, std::span<const double> q,
                  std::span<const double> u) override {
    using Numbers = Eigen::Map<const VectorX<double>>;
    if (applied_.empty()) return;
    kinematics.UpdatePosition(Numbers(q.data(), std::ssize(q)));
    kinematics.UpdateVelocity(Numbers(u.data(), std::ssize(u)));
    ForcesBesideGravity<Planar, double>(kinematics, wrenches_);
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const Body& body = bodies_[i];
      const double s = sine_[i], c = cosine_[i];
      const Vector r = {body.centre.x * c - body.centre.y * s,
                        body.centre.x * s + body.centre.y * c};
      const Vector F = {wrenches_[body.index].linear[0], wrenches_[body.index].linear[1]};
      applied_[i] = {Scaled(body.link.mobility, F),
                     (wrenches_[body.index].angular[0] + Moment(r, F)) / body.link.radius};
    }
  }

  /// Calls `call` with all pieces but the last one; threads share these.
  void ForPieces(const auto& call) {
    pool_->ForEach(static_cast<int>(pieces_.size()) - 1, [&](int i) { call(pieces_[i]); });
  }

  /// Bodies at moved angles. False for angles beyond kLargestAngle.
  template <bool kOfSpeeds>
  bool Turn() {
    std::atomic<bool> good = true;
    ForParts<kBodiesPerTask>(angle_.size(), [&](std::size_t first, std::size_t last) {
      if (!SinesAndCosines(&angle_[first], static_cast<int>(last - first), &sine_[first],
                           &cosine_[first])) {
        good = false;
      }
      for (std::size_t i = first; i < std::min(last, bodies_.size()); ++i) {
        const Body& body = bodies_[i];
        const double s = sine_[i], c = cosine_[i];
        for (int h = body.first_handle; h < body.first_handle + body.handles; ++h) {
          const Vector& arm = handles_[h];
          arm_[h] = {arm.x * c - arm.y * s, arm.x * s + arm.y * c};
        }
      }
    });
    if (!good) return false;
    if (!cuts_.empty()) Close<kOfSpeeds>();
    return true;
  }

  /// A cut joint is imposed at a point of Q; there the arm of P ends (pins.h).
  template <bool kOfSpeeds>
  void Close() {
    const auto leads = [&](int body, int handle) {
      const Vector r = Scaled(bodies_[body].link.radius, arm_[handle]);
      return Point<double>{r, Cross(speed_[body], r)};
    };
    for (const Step& step : steps_) {
      reference_[step.child] = reference_[step.parent] + leads(step.parent, step.parent_handle) -
                               leads(step.child, step.child_handle);
    }
    for (CutJoint& cut : cuts_) {
      const auto at = [&](int body, int handle) {
        return body < 0 ? Point<double>{cut.ground, {}} : reference_[body] + leads(body, handle);
      };
      const Point<double> gap = at(cut.body_Q, cut.Q) - at(cut.body_P, cut.P);
      cut.w_P = cut.body_P < 0 ? 0.0 : speed_[cut.body_P];
      cut.v = kOfSpeeds ? RelativeVelocity(cut.w_P, gap) : gap.p;
      if (cut.body_P >= 0) {
        arm_[cut.P] = arm_[cut.P] + Scaled(1.0 / bodies_[cut.body_P].link.radius, gap.p);
      }
    }
  }

  bool Assemble() {
    operations_ += of_matrices_;
    std::atomic<bool> good = true;
    ForPieces([&](Piece& piece) { JoinPiece(piece, good); });
    JoinPiece(pieces_.back(), good);
    return good;
  }

  /// Stops if `good` is false. Sets `good` to false at a node that may be degenerate.
  [[gnu::noinline]] void JoinPiece(Piece& piece, std::atomic<bool>& good) {
    for (int i = piece.first_body; i < piece.last_body; ++i) {
      const Body& body = bodies_[i];
      const Vector* arm = arm_.data() + body.first_handle;
      Matrix* zeta = zeta_.data() + body.first_block;
      for (int k = 0; k < body.handles; ++k) {
        for (int j = 0; j < body.handles; ++j) {  // (1-4): 1/m + t t^T / I, t = z x r
          *zeta++ = {body.link.mobility + arm[j].y * arm[k].y, -(arm[j].y * arm[k].x),
                     -(arm[j].x * arm[k].y), body.link.mobility + arm[j].x * arm[k].x};
        }
      }
    }
    const Node *node = nodes_.data() + piece.first_node, *end = nodes_.data() + piece.last_node;
    double* U = piece.U.data();
    for (; node != end && good; ++node) {
      if (!WithRows(node->pins, [&](auto rows) { return Join(*node, U, rows); })) good = false;
    }
  }

  /// Y = C zeta of a pin at a handle of a child (67).
  LOOPBENCH_INLINE Matrix ResponseAt(const Node& node, const Pin& pin, const Side& at) const {
    const Matrix* zeta = zeta_.data() + node.blocks[at.child] + node.handles[at.child] * at.place;
    Matrix Y = {0.0, 0.0, 0.0, 0.0};
    if (pin.Q.place >= 0 && pin.Q.child == at.child) Y = zeta[pin.Q.place];
    if (pin.P.place >= 0 && pin.P.child == at.child) Y = Y - zeta[pin.P.place];
    return Y;
  }

  /// X = Y C^T of one pin (16), its lower triangle. Both sides may be on one assembly.
  LOOPBENCH_INLINE Factors<double, kRows> Across(const Node& node, const Pin& pin) const {
    const auto block = [&](const Side& row, const Side& column) -> const Matrix& {
      const int child = row.child;
      return zeta_[node.blocks[child] + row.place + node.handles[child] * column.place];
    };
    double xx = 0.0, xy = 0.0, yy = 0.0;
    const auto add = [&](double x, double mixed, double y) LOOPBENCH_INLINED {
      xx += x;
      xy += mixed;
      yy += y;
    };
    for (const Side* side : {&pin.Q, &pin.P}) {
      if (side->place < 0) continue;
      const Matrix& own = block(*side, *side);
      add(own.xx, own.xy, own.yy);
    }
    if (pin.P.place >= 0 && pin.Q.place >= 0 && pin.P.child == pin.Q.child) {
      const Matrix& QP = block(pin.Q, pin.P);
      add(-(QP.xx + QP.xx), -(QP.xy + QP.yx), -(QP.yy + QP.yy));
    }
    return {{xx, xy, yy}};
  }

  /// X = Y C^T (16, 66) is factored pin by pin. Rows of L are columns of W of the pins.
  template <class Rows>
  bool Join(const Node& node, double* U, Rows rows) {
    const int n = rows;
    const Pin* pins = pins_.data() + node.first_pin;
    const Side* kept = kept_.data() + node.first_kept;
    Factors<double, kRows>* factors = factors_.data() + node.first_pin;
    double* W = W_.data() + node.matrix;
    const double* L = W + 2 * n * node.kept;
    // two columns of U and W in the rows of the first pins, from columns of X or Y
    const auto reduce = [&](int place, int num_pins, const auto& block) LOOPBENCH_INLINED {
      double *ux = U + 2 * n * place, *uy = ux + n;
      double *wx = W + 2 * n * place, *wy = wx + n;
      for (int i = 0; i < num_pins; ++i) {
        const Matrix Y = block(pins[i]);
        const double *Lx = L + 2 * n * i, *Ly = Lx + n;
        const auto column = [&](double* u, double* w, double x, double y) LOOPBENCH_INLINED {
          u[2 * i] = x - Dot(Lx, u, 2 * i);
          u[2 * i + 1] = y - Dot(Ly, u, 2 * i);
          double solved[] = {u[2 * i], u[2 * i + 1]};
          factors[i].Solve(solved);
          w[2 * i] = solved[0];
          w[2 * i + 1] = solved[1];
        };
        column(ux, wx, Y.xx, Y.yx);
        column(uy, wy, Y.xy, Y.yy);
      }
    };
    double slack = 0.0;
    for (int i = 0; i < n / 2; ++i) {
      reduce(node.kept + i, i, [&](const Pin& row) LOOPBENCH_INLINED {
        Matrix X = {0.0, 0.0, 0.0, 0.0};
        if (pins[i].Q.place >= 0) X = ResponseAt(node, row, pins[i].Q);
        return pins[i].P.place < 0 ? X : X - ResponseAt(node, row, pins[i].P);
      });
      const double *Lx = L + 2 * n * i, *Ly = Lx + n;
      const double *ux = U + 2 * n * (node.kept + i), *uy = ux + n;
      Factors<double, kRows> X = Across(node, pins[i]);
      X.L(0, 0) -= Dot(Lx, ux, 2 * i);
      X.L(1, 0) -= Dot(Ly, ux, 2 * i);
      X.L(1, 1) -= Dot(Ly, uy, 2 * i);
      const double trace = X.L(0, 0) + X.L(1, 1);
      Factor(X, pins[i].limit, slack);
      if (!(slack >= 0.0) || !(trace > 0.0)) return false;
      factors[i] = X;
    }
    for (int e = 0; e < node.kept; ++e) {
      reduce(e, n / 2,
             [&](const Pin& row) LOOPBENCH_INLINED { return ResponseAt(node, row, kept[e]); });
    }
    Eliminate(node, U, rows);
    return true;
  }

  /// Computes zeta of the remaining handles (26-28, 71).
  template <class Rows>
  LOOPBENCH_INLINE void Eliminate(const Node& node, const double* U, Rows rows) {
    const int n = rows;
    const Side* kept = kept_.data() + node.first_kept;
    Matrix* zeta = zeta_.data() + node.first_block;
    const double* W = W_.data() + node.matrix;
    for (int f = 0; f < node.kept; ++f) {
      const double *wx = W + 2 * n * f, *wy = wx + n;
      for (int e = f; e < node.kept; ++e) {
        const double *ux = U + 2 * n * e, *uy = ux + n;
        Matrix Z = {0.0, 0.0, 0.0, 0.0};
        const int child = kept[e].child;
        if (child == kept[f].child) {
          Z = zeta_[node.blocks[child] + kept[e].place + node.handles[child] * kept[f].place];
        }
        Z = Z - Matrix{Dot(ux, wx, rows), Dot(ux, wy, rows), Dot(uy, wx, rows), Dot(uy, wy, rows)};
        if (e == f) {
          Z.yx = Z.xy;
        } else {
          zeta[f + node.kept * e] = {Z.xx, Z.yx, Z.xy, Z.yy};
        }
        zeta[e + node.kept * f] = Z;
      }
    }
  }

  /// L^-1 (C b + c0) of all pins (68), b of the remaining handles, and s = D^-1 of the former (21).
  template <Unknowns kUnknowns, class Rows>
  LOOPBENCH_INLINE void Up(const Node& node, Rows rows) {
    const int n = rows;
    const Side* kept = kept_.data() + node.first_kept;
    const double *W = W_.data() + node.matrix, *L = W + 2 * n * node.kept;
    double* s = s_.data() + 2 * node.first_pin;
    for (int i = 0; i < n / 2; ++i) {
      const Pin& pin = pins_[node.first_pin + i];
      Vector sum = {0.0, 0.0};
      if (pin.cut >= 0) {
        const CutJoint& cut = cuts_[pin.cut];
        if constexpr (kUnknowns == Unknowns::kSpeeds) sum = cut.v;
        if constexpr (kUnknowns == Unknowns::kAccelerations)
          sum = -Cross(cut.w_P + cut.w_P, cut.v);  // (7)
      }
      if (pin.Q.place >= 0) sum = sum + b_[pin.Q.handle];
      if (pin.P.place >= 0) sum = sum - b_[pin.P.handle];
      s[2 * i] = sum.x - Dot(L + 2 * n * i, s, 2 * i);
      s[2 * i + 1] = sum.y - Dot(L + 2 * n * i + n, s, 2 * i);
    }
    for (int e = 0; e < node.kept; ++e, W += 2 * n) {
      Vector& b = b_[kept[e].handle];
      b = b - Vector{Dot(W, s, rows), Dot(W + n, s, rows)};  // (29-30, 72)
    }
    for (int i = 0; i < n / 2; ++i) {
      double solved[] = {s[2 * i], s[2 * i + 1]};
      factors_[node.first_pin + i].Solve(solved);
      s[2 * i] = solved[0];
      s[2 * i + 1] = solved[1];
    }
  }

  /// phi = -L^-T (s + W F) (17, 64), and forces on the handles of the pins.
  template <class Rows>
  LOOPBENCH_INLINE void Down(const Node& node, Rows rows) {
    const int n = rows;
    const Side* kept = kept_.data() + node.first_kept;
    const double *W = W_.data() + node.matrix, *L = W + 2 * n * node.kept;
    double* phi = s_.data() + 2 * node.first_pin;
    const auto subtract = [&](const double* columns, auto size, const Vector& F) {
      Repeat(size, [&](int r) { phi[r] -= columns[r] * F.x + columns[n + r] * F.y; });
    };
    for (int r = 0; r < n; ++r) phi[r] = -phi[r];
    for (int e = 0; e < node.kept; ++e) subtract(W + 2 * n * e, rows, F_[kept[e].handle]);
    for (int i = n / 2 - 1; i >= 0; --i) {
      const Pin& pin = pins_[node.first_pin + i];
      const Vector force = {phi[2 * i], phi[2 * i + 1]};
      subtract(L + 2 * n * i, 2 * i, force);
      if (pin.Q.place >= 0) F_[pin.Q.handle] = force;
      if (pin.P.place >= 0) F_[pin.P.handle] = -force;
    }
  }

  template <Unknowns kUnknowns>
  void Solve() {
    operations_ += of_vectors_;
    ForPieces([&](const Piece& piece) { UpPiece<kUnknowns>(piece); });
    UpPiece<kUnknowns>(pieces_.back());
    DownPiece(pieces_.back());
    ForPieces([&](const Piece& piece) { DownPiece(piece); });
  }

  template <Unknowns kUnknowns>
  [[gnu::noinline]] void UpPiece(const Piece& piece) {
    for (int i = piece.first_body; i < piece.last_body; ++i) {
      const Body& body = bodies_[i];
      const Applied applied = applied_.empty() ? Applied{} : applied_[i];
      const double a = body.link.cosine * cosine_[i] + body.link.sine * sine_[i] + applied.alpha;
      const double gx = body.link.gx + applied.a.x, gy = body.link.gy + applied.a.y;
      const double w2 = speed_[i] * speed_[i] * body.link.radius;
      alpha_[i] = kUnknowns == Unknowns::kSpeeds ? 0.0 : a;
      for (int h = body.first_handle; h < body.first_handle + body.handles; ++h) {
        const Vector& r = arm_[h];
        b_[h] = kUnknowns == Unknowns::kSpeeds
                    ? Vector{0.0, 0.0}
                    : Vector{gx - a * r.y - w2 * r.x, gy + a * r.x - w2 * r.y};
      }
    }
    for (int n = piece.first_node; n < piece.last_node; ++n) {
      const Node& node = nodes_[n];
      WithRows(node.pins, [&](auto rows) { Up<kUnknowns>(node, rows); });
    }
  }

  [[gnu::noinline]] void DownPiece(const Piece& piece) {
    for (int n = piece.last_node; n-- > piece.first_node;) {
      const Node& node = nodes_[n];
      WithRows(node.pins, [&](auto rows) { Down(node, rows); });
    }
    for (int i = piece.first_body; i < piece.last_body; ++i) {
      const Body& body = bodies_[i];
      double alpha = alpha_[i];
      for (int h = body.first_handle; h < body.first_handle + body.handles; ++h) {
        alpha += Moment(arm_[h], F_[h]);
      }
      alpha_[i] = alpha / body.link.radius;
    }
  }

  std::vector<Body> bodies_;     ///< piece after piece, as nodes
  std::vector<Vector> handles_;  ///< arms by radius in axes of the body, body after body
  std::vector<Step> steps_;
  std::vector<CutJoint> cuts_;
  std::vector<Node> nodes_;
  std::vector<Piece> pieces_;
  std::vector<Pin> pins_;
  std::vector<Side> kept_;

  std::vector<double> angle_, speed_, alpha_;  ///< by body, Ground's last, then padding of lanes
  std::vector<double> sine_, cosine_;          ///< as in the line above
  std::vector<Vector> arm_;                    ///< of handles, in ground axes, over radius
  std::vector<Applied> applied_;               ///< by body; empty if only gravity acts
  std::vector<Wrench<Planar, double>> wrenches_;
  std::vector<Point<double>> reference_;  ///< of bodies
  std::vector<Matrix> zeta_;
  /// Two columns for each handle that stays, then of L^T for each pin if there are several. A
  /// column has two numbers for each pin.
  std::vector<double> W_;
  std::vector<Factors<double, kRows>> factors_;  ///< D, by pin
  std::vector<Vector> b_, F_;                    ///< by handle: a join changes those that stay
  std::vector<double> s_;                        ///< two for each pin; in the downward pass phi
  TreeAngles<double> tree_;
  long of_matrices_ = 0, of_vectors_ = 0;
};

struct AssemblySweep::Layout {
  /// A body or an assembly during the layout of joins.
  struct Assembly {
    int handles = 0, first_block = 0, bodies = 1;
    bool held = false;      ///< by Ground
    std::vector<int> pins;  ///< of each handle the joint, twice its index, and one more at its Q
  };

  AssemblySweep& sweep;
  const Mechanism<Planar, double>& mechanism;
  const Plan& plan;
  std::vector<int> handle_of = std::vector<int>(2 * mechanism.joints().size(), -1);  ///< as pins
  std::vector<int> cut_of = std::vector<int>(mechanism.joints().size(), -1);
  std::vector<Assembly> assemblies = std::vector<Assembly>(plan.num_nodes());
  /// In bodies_, Ground last.
  std::vector<int> place_of = std::vector<int>(mechanism.num_bodies(), mechanism.num_bodies() - 1);
  double most_work = static_cast<double>(plan.operations());
  int handles = 0;
  double blocks = 0.0, W = 0.0, most_U = 0.0, work = 0.0, vectors = 0.0;

  /// Returns false if the general pass is less work, or places exceed an int.
  bool Fits() const { return work + vectors <= most_work && blocks < 5e8 && W < 5e8; }
  bool AddBodies() {
    std::vector<std::vector<int>> joints_of_body(mechanism.num_bodies());
    for (int j = 0; j < static_cast<int>(mechanism.joints().size()); ++j) {
      const Joint<Planar, double>& joint = mechanism.joints()[j];
      joints_of_body[joint.from].push_back(2 * j);
      joints_of_body[joint.to].push_back(2 * j + 1);
    }
    for (const PlanPiece& part : plan.pieces()) {
      Piece& piece = sweep.pieces_.emplace_back();
      piece.first_body = static_cast<int>(sweep.bodies_.size());
      for (const int leaf : part.leaves) {
        place_of[leaf + 1] = static_cast<int>(sweep.bodies_.size());
        if (!AddBody(leaf + 1, joints_of_body[leaf + 1])) return false;
      }
      piece.last_body = static_cast<int>(sweep.bodies_.size());
    }
    return true;
  }

  bool AddBody(int index, const std::vector<int>& joints) {
    const auto joint = [&](int side) -> const Joint<Planar, double>& {
      return mechanism.joints()[side / 2];
    };
    Body body;
    body.index = index;
    Assembly& assembly = assemblies[index - 1];
    Vector origin = {0.0, 0.0};
    const auto held =
        std::ranges::find_if(joints, [&](int side) { return HoldsBody(joint(side)); });
    assembly.held = held != joints.end();
    if (assembly.held) {
      origin = ArmOf(joint(*held), index);
      body.stand = ArmOf(joint(*held), kGround);
      body.centre = -origin;
    }
    body.link = MeasureLink(mechanism.bodies()[index], mechanism.gravity(),
                            assembly.held ? &origin : nullptr);
    body.first_handle = handles;
    body.first_block = static_cast<int>(blocks);
    for (const int side : joints) {
      if (HoldsBody(joint(side))) continue;
      handle_of[side] = handles++;
      assembly.pins.push_back(side);
      sweep.handles_.push_back(Scaled(1.0 / body.link.radius, ArmOf(joint(side), index) - origin));
    }
    body.handles = assembly.handles = handles - body.first_handle;
    assembly.first_block = body.first_block;
    blocks += static_cast<double>(body.handles) * body.handles;
    work += 4.0 * body.handles * body.handles;
    sweep.bodies_.push_back(body);
    return Fits();
  }

  void AddSteps() {
    for (const TreeStep& step : mechanism.tree()) {
      if (step.parent == kGround) continue;
      const int parent_side = mechanism.joints()[step.joint].from == step.parent ? 0 : 1;
      sweep.steps_.push_back({.parent = place_of[step.parent],
                              .child = place_of[step.child],
                              .parent_handle = handle_of[2 * step.joint + parent_side],
                              .child_handle = handle_of[2 * step.joint + 1 - parent_side]});
    }
    for (const int j : mechanism.constraints()) {
      const Joint<Planar, double>& joint = mechanism.joints()[j];
      cut_of[j] = static_cast<int>(sweep.cuts_.size());
      sweep.cuts_.push_back({.P = handle_of[2 * j],
                             .Q = handle_of[2 * j + 1],
                             .body_P = joint.from == kGround ? -1 : place_of[joint.from],
                             .body_Q = joint.to == kGround ? -1 : place_of[joint.to],
                             .ground = ArmOf(joint, kGround)});
    }
  }

  Pin MakePin(const PlanNode& planned, const NodeJoint& closed) const {
    const auto side = [&](int handle, int pin) {
      if (handle < 0) return Side{};
      const int child = planned.handles[handle].child;
      const Assembly& assembly = assemblies[planned.children[child]];
      const auto place = std::ranges::find(assembly.pins, pin) - assembly.pins.begin();
      return Side{child, static_cast<int>(place), handle_of[pin]};
    };
    return {side(closed.from, 2 * closed.index), side(closed.to, 2 * closed.index + 1),
            cut_of[closed.index]};
  }

  /// Keeps the remaining handles, the first child's first.
  void Keep(const PlanNode& planned, Node& node, Assembly& all) {
    const auto closes = [&](int pin) {
      return std::ranges::find(planned.joints, pin / 2, &NodeJoint::index) != planned.joints.end();
    };
    all.bodies = 0;
    for (const int c : {0, 1}) {
      if (planned.children[c] < 0) continue;
      const Assembly& child = assemblies[planned.children[c]];
      all.bodies += child.bodies;
      all.held = all.held || child.held;
      node.blocks[c] = child.first_block;
      node.handles[c] = child.handles;
      for (int place = 0; place < child.handles; ++place) {
        if (closes(child.pins[place])) continue;
        all.pins.push_back(child.pins[place]);
        sweep.kept_.push_back({c, place, handle_of[child.pins[place]]});
      }
    }
    const auto on_ground = [](const Pin& pin) { return pin.P.place < 0 || pin.Q.place < 0; };
    all.held =
        all.held || std::any_of(sweep.pins_.begin() + node.first_pin, sweep.pins_.end(), on_ground);
    node.kept = all.handles = static_cast<int>(all.pins.size());
  }

  /// A pin closes a loop if Ground holds both its sides, both are on one assembly, or the join has
  /// several pins. The lighter side determines the response of one pin, all `bodies` of several.
  void SetLimits(const PlanNode& planned, std::span<const int> joints, int bodies) {
    const Assembly& one = assemblies[planned.children[0]];
    Pin* pin = &sweep.pins_.back() + 1 - joints.size();
    const bool on_ground = pin->P.place < 0 || pin->Q.place < 0;
    bool closes = on_ground ? one.held : true;
    int lighter = one.bodies;
    if (planned.children[1] >= 0) {
      const Assembly& other = assemblies[planned.children[1]];
      closes = one.held && other.held;
      lighter = std::min(lighter, other.bodies);
    }
    const bool several = joints.size() > 1;
    if (!closes && !several) return;
    const double share = ShareOfLimit(several ? bodies : lighter);
    for (const int joint : joints) (pin++)->limit = share * LimitOf(mechanism, joint);
  }

  bool AddNode(const PlanNode& planned, Assembly& all) {
    Node node;
    node.first_pin = static_cast<int>(sweep.pins_.size());
    node.first_kept = static_cast<int>(sweep.kept_.size());
    std::vector<int> joints;
    for (const NodeJoint& closed : planned.joints) {
      if (HoldsBody(mechanism.joints()[closed.index])) continue;
      sweep.pins_.push_back(MakePin(planned, closed));
      joints.push_back(closed.index);
    }
    node.pins = static_cast<int>(joints.size());
    if (node.pins == 0) {  // a body already held by Ground
      all = std::move(assemblies[planned.children[0]]);
      return true;
    }
    Keep(planned, node, all);
    node.first_block = all.first_block = static_cast<int>(blocks);
    node.matrix = static_cast<int>(W);
    SetLimits(planned, joints, all.bodies);
    const double n = 2.0 * node.pins, d = 2.0 * node.kept;
    blocks += static_cast<double>(node.kept) * node.kept;
    work += n * n * n / 6.0 + n * n * d / 2.0 + n * d * d / 2.0;
    vectors += 2.0 * n * (n + d);
    W += n * (node.pins > 1 ? n + d : d);
    most_U = std::max(most_U, n * (n + d));
    sweep.nodes_.push_back(node);
    return Fits();
  }

  bool AddNodes(const PlanPiece& part, Piece& piece) {
    piece.first_node = static_cast<int>(sweep.nodes_.size());
    most_U = 0.0;
    for (const int n : part.leaves) {
      const PlanSide& hold = plan.leaves()[n].hold;
      if (hold.joint < 0 || HoldsBody(mechanism.joints()[hold.joint])) continue;
      const Handle leaf{.body = n + 1};
      const NodeJoint closed{
          .index = hold.joint, .from = hold.at_Q ? -1 : 0, .to = hold.at_Q ? 0 : -1};
      PlanNode node;
      node.children[0] = n;
      node.handles = std::span(&leaf, 1);
      node.joints = std::span(&closed, 1);
      Assembly all;
      if (!AddNode(node, all)) return false;
      assemblies[n] = std::move(all);
    }
    for (const int n : part.nodes) {
      if (!AddNode(plan.nodes()[n - plan.num_leaves()], assemblies[n])) return false;
    }
    piece.last_node = static_cast<int>(sweep.nodes_.size());
    piece.U.resize(static_cast<std::size_t>(most_U));
    return true;
  }

  void Resize(int threads) {
    const auto places = static_cast<std::size_t>(mechanism.num_bodies() + kLanes - 1) / kLanes;
    sweep.angle_.assign(places * kLanes, 0.0);
    sweep.speed_ = sweep.alpha_ = sweep.sine_ = sweep.cosine_ = sweep.angle_;
    sweep.arm_ = sweep.handles_;
    for (const Body& body : sweep.bodies_) sweep.reference_.push_back({body.stand, {0.0, 0.0}});
    if (!mechanism.forces().empty()) {
      sweep.applied_.resize(sweep.bodies_.size());
      sweep.wrenches_.resize(mechanism.num_bodies());
    }
    sweep.SetSize(mechanism.num_u(), mechanism.length(),
                  std::min(threads, static_cast<int>(sweep.pieces_.size()) - 1));
    sweep.zeta_.resize(static_cast<std::size_t>(blocks));
    sweep.W_.resize(static_cast<std::size_t>(W));
    sweep.factors_.resize(sweep.pins_.size());
    sweep.s_.assign(2 * sweep.pins_.size(), 0.0);
    sweep.b_.assign(sweep.handles_.size(), {0.0, 0.0});
    sweep.F_ = sweep.b_;
    sweep.of_matrices_ = static_cast<long>(work);
    sweep.of_vectors_ =
        static_cast<long>(vectors + 8.0 * static_cast<double>(sweep.handles_.size()));
  }
};

std::unique_ptr<AssemblySweep> AssemblySweep::Make(const Mechanism<Planar, double>& mechanism,
                                                   const Plan& plan, int threads) {
  if (!HasOnlyPins(mechanism)) return nullptr;
  std::unique_ptr<AssemblySweep> sweep(new AssemblySweep);
  Layout layout{*sweep, mechanism, plan};
  if (!layout.AddBodies()) return nullptr;
  layout.AddSteps();
  for (std::size_t i = 0; i < sweep->pieces_.size(); ++i) {
    if (!layout.AddNodes(plan.pieces()[i], sweep->pieces_[i])) return nullptr;
  }
  layout.Resize(threads);
  sweep->tree_ = TreeAngles<double>(mechanism, layout.place_of,
                                    std::vector<double>(mechanism.num_bodies(), 0.0));
  return sweep;
}

std::unique_ptr<ShortCut<Planar>> MakeAssemblySweep(const Mechanism<Planar, double>& mechanism,
                                                    const Plan& plan, int threads) {
  return AssemblySweep::Make(mechanism, plan, threads);
}

}  // namespace loopbench::odca::pins
