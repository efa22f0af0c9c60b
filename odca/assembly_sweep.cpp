#include "odca/assembly_sweep.h"

#include <algorithm>
#include <cmath>

#include "mechanism/algebra/known_size.h"
#include "odca/sines.h"

/// Behind the parameters of a lambda: its captures must not go through memory.
#define LOOPBENCH_INLINED __attribute__((always_inline))

namespace loopbench::odca::pins {

namespace {

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

template <GapKind kGap>
bool AssemblySweep::Turn() {
  const int places = static_cast<int>(angle_.size());
  if (!SinesAndCosines(angle_.data(), places, sine_.data(), cosine_.data())) return false;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Body& body = bodies_[i];
    const double s = sine_[i], c = cosine_[i];
    for (int h = body.first_handle; h < body.first_handle + body.handles; ++h) {
      const Vector& arm = handles_[h];
      arm_[h] = {arm.x * c - arm.y * s, arm.x * s + arm.y * c};
    }
  }
  if (!cuts_.empty()) Close<kGap>();
  return true;
}

/// A cut joint is imposed at a point of Q; there the arm of P ends (two_handle.h).
template <GapKind kGap>
void AssemblySweep::Close() {
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
    cut.v = kGap == GapKind::kSpeeds ? RelativeVelocity(cut.w_P, gap) : gap.p;
    if (cut.body_P >= 0) {
      arm_[cut.P] = arm_[cut.P] + Scaled(1.0 / bodies_[cut.body_P].link.radius, gap.p);
    }
  }
}

Correction<double> AssemblySweep::LargestGap() const {
  double largest = 0.0;
  for (const CutJoint& cut : cuts_) {
    largest = std::max(largest, cut.v.x * cut.v.x + cut.v.y * cut.v.y);
  }
  return {.shift = std::sqrt(largest)};
}

bool AssemblySweep::Assemble() {
  operations_ += of_matrices_;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
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
  for (const Node& node : nodes_) {
    if (!WithRows(node.pins, [&](auto rows) { return Join(node, rows); })) return false;
  }
  return true;
}

/// Y = C zeta of a pin at a handle of a child (67).
LOOPBENCH_INLINE AssemblySweep::Matrix AssemblySweep::ResponseAt(const Node& node, const Pin& pin,
                                                                 const Side& at) const {
  const Matrix* zeta = zeta_.data() + node.blocks[at.child] + node.handles[at.child] * at.place;
  Matrix Y = {0.0, 0.0, 0.0, 0.0};
  if (pin.Q.place >= 0 && pin.Q.child == at.child) Y = zeta[pin.Q.place];
  if (pin.P.place >= 0 && pin.P.child == at.child) Y = Y - zeta[pin.P.place];
  return Y;
}

/// X = Y C^T of one pin (16). Both sides may be on one assembly.
LOOPBENCH_INLINE Symmetric2<double> AssemblySweep::Across(const Node& node, const Pin& pin) const {
  const auto block = [&](const Side& row, const Side& column) -> const Matrix& {
    const int child = row.child;
    return zeta_[node.blocks[child] + row.place + node.handles[child] * column.place];
  };
  Symmetric2<double> X = {0.0, 0.0, 0.0};
  for (const Side* side : {&pin.Q, &pin.P}) {
    if (side->place < 0) continue;
    const Matrix& own = block(*side, *side);
    X = X + Symmetric2<double>{own.xx, own.xy, own.yy};
  }
  if (pin.P.place < 0 || pin.Q.place < 0 || pin.P.child != pin.Q.child) return X;
  const Matrix& QP = block(pin.Q, pin.P);
  return X + Symmetric2<double>{-(QP.xx + QP.xx), -(QP.xy + QP.yx), -(QP.yy + QP.yy)};
}

/// X = Y C^T (16, 66) is factored pin by pin. Rows of L are columns of W of the pins.
template <class Rows>
bool AssemblySweep::Join(const Node& node, Rows rows) {
  const int n = rows;
  const Pin* pins = pins_.data() + node.first_pin;
  const Side* kept = kept_.data() + node.first_kept;
  Factored2<double>* factors = factors_.data() + node.first_pin;
  double *U = U_.data(), *W = W_.data() + node.matrix;
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
        const Vector solved = factors[i].Solve(u[2 * i], u[2 * i + 1]);
        w[2 * i] = solved.x;
        w[2 * i + 1] = solved.y;
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
    Symmetric2<double> rest = Across(node, pins[i]);
    rest.xx -= Dot(Lx, ux, 2 * i);
    rest.xy -= Dot(Ly, ux, 2 * i);
    rest.yy -= Dot(Ly, uy, 2 * i);
    factors[i] = FactorsOf(rest, pins[i].limit, slack);
    if (!(slack >= 0.0) || !(rest.xx + rest.yy > 0.0)) return false;
  }
  for (int e = 0; e < node.kept; ++e) {
    reduce(e, n / 2,
           [&](const Pin& row) LOOPBENCH_INLINED { return ResponseAt(node, row, kept[e]); });
  }
  Eliminate(node, rows);
  return true;
}

/// Computes zeta of the remaining handles (26-28, 71).
template <class Rows>
LOOPBENCH_INLINE void AssemblySweep::Eliminate(const Node& node, Rows rows) {
  const int n = rows;
  const Side* kept = kept_.data() + node.first_kept;
  Matrix* zeta = zeta_.data() + node.first_block;
  const double *U = U_.data(), *W = W_.data() + node.matrix;
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
        zeta[f + node.kept * e] = Transpose(Z);
      }
      zeta[e + node.kept * f] = Z;
    }
  }
}

/// L^-1 (C b + c0) of all pins (68), b of the remaining handles, and s = D^-1 of the former (21).
template <Pass kPass, class Rows>
LOOPBENCH_INLINE void AssemblySweep::Up(const Node& node, Rows rows) {
  const int n = rows;
  const Side* kept = kept_.data() + node.first_kept;
  const double *W = W_.data() + node.matrix, *L = W + 2 * n * node.kept;
  double* s = s_.data() + 2 * node.first_pin;
  for (int i = 0; i < n / 2; ++i) {
    const Pin& pin = pins_[node.first_pin + i];
    Vector sum = {0.0, 0.0};
    if (pin.cut >= 0) {
      const CutJoint& cut = cuts_[pin.cut];
      if constexpr (kPass == Pass::kSpeeds) sum = cut.v;
      if constexpr (kPass == Pass::kAccelerations) sum = -Cross(cut.w_P + cut.w_P, cut.v);  // (7)
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
    const Vector solved = factors_[node.first_pin + i].Solve(s[2 * i], s[2 * i + 1]);
    s[2 * i] = solved.x;
    s[2 * i + 1] = solved.y;
  }
}

/// phi = -L^-T (s + W F) (17, 64), and forces on the handles of the pins.
template <class Rows>
LOOPBENCH_INLINE void AssemblySweep::Down(const Node& node, Rows rows) {
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

void AssemblySweep::SetApplied(const Kinematics<Planar, double>& kinematics) {
  ForcesBesideGravity<Planar, double>(kinematics, wrenches_);
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Body& body = bodies_[i];
    const double s = sine_[i], c = cosine_[i];
    const Vector r = {body.centre.x * c - body.centre.y * s, body.centre.x * s + body.centre.y * c};
    const Vector F = {wrenches_[i + 1].linear[0], wrenches_[i + 1].linear[1]};
    applied_[i] = {Scaled(body.link.mobility, F),
                   (wrenches_[i + 1].angular[0] + Moment(r, F)) / body.link.radius};
  }
}

template <Pass kPass>
void AssemblySweep::Solve() {
  operations_ += of_vectors_;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Body& body = bodies_[i];
    const Applied applied = applied_.empty() ? Applied{} : applied_[i];
    const double a = body.link.cosine * cosine_[i] + body.link.sine * sine_[i] + applied.alpha;
    const double gx = body.link.gx + applied.a.x, gy = body.link.gy + applied.a.y;
    const double w2 = speed_[i] * speed_[i] * body.link.radius;
    alpha_[i] = kPass == Pass::kSpeeds ? 0.0 : a;
    for (int h = body.first_handle; h < body.first_handle + body.handles; ++h) {
      const Vector& r = arm_[h];
      b_[h] = kPass == Pass::kSpeeds ? Vector{0.0, 0.0}
                                     : Vector{gx - a * r.y - w2 * r.x, gy + a * r.x - w2 * r.y};
    }
  }
  for (const Node& node : nodes_) {
    WithRows(node.pins, [&](auto rows) { Up<kPass>(node, rows); });
  }
  for (std::size_t n = nodes_.size(); n-- > 0;) {
    WithRows(nodes_[n].pins, [&](auto rows) { Down(nodes_[n], rows); });
  }
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Body& body = bodies_[i];
    double alpha = alpha_[i];
    for (int h = body.first_handle; h < body.first_handle + body.handles; ++h) {
      alpha += Moment(arm_[h], F_[h]);
    }
    alpha_[i] = alpha / body.link.radius;
  }
}

bool AssemblySweep::Evaluate(SpeedsUsed speeds, Kinematics<Planar, double>* kinematics,
                             std::span<const double> q, std::span<const double> u,
                             std::span<double> qdot, std::span<double> udot) {
  using Numbers = Eigen::Map<const VectorX<double>>;
  operations_ = 0;
  if (!Place(GapKind::kSpeeds, q, u) || !Assemble()) return false;
  const auto take_forces = [&] {
    if (applied_.empty()) return;
    kinematics->UpdatePosition(Numbers(q.data(), std::ssize(q)));
    kinematics->UpdateVelocity(Numbers(qdot.data(), std::ssize(qdot)));
    SetApplied(*kinematics);
  };
  if (speeds == SpeedsUsed::kGiven) {
    std::ranges::copy(u, qdot.begin());
    take_forces();
    Solve<Pass::kAccelerations>();
  } else {
    Solve<Pass::kSpeeds>();
    if (!tree_.ToJoints(alpha_.data(), u, qdot, *pool_)) return false;
    for (std::size_t i = 0; i < bodies_.size(); ++i) speed_[i] += alpha_[i];
    take_forces();
    Solve<Pass::kCompleted>();
  }
  return tree_.ToJoints(alpha_.data(), {}, udot, *pool_);
}

bool AssemblySweep::IsUsable(const Kinematics<Planar, double>& kinematics) {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    angle_[i] = kinematics.poses()[i + 1].angle;
    speed_[i] = 0.0;
  }
  return Turn<GapKind::kSpeeds>() && Assemble();
}

bool AssemblySweep::Place(GapKind kind, std::span<const double> q, std::span<const double> u) {
  tree_.ToBodies(q, u, angle_.data(), speed_.data(), *pool_);
  return kind == GapKind::kSpeeds ? Turn<GapKind::kSpeeds>() : Turn<GapKind::kPositions>();
}

bool AssemblySweep::FindChange(GapKind) {
  if (!Assemble()) return false;
  Solve<Pass::kSpeeds>();
  return true;
}

bool AssemblySweep::AddChange(std::span<const double> base, std::span<double> sum) {
  return tree_.ToJoints(alpha_.data(), base, sum, *pool_);
}

}  // namespace loopbench::odca::pins
