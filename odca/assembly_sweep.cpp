#include "odca/assembly_sweep.h"

#include <algorithm>
#include <cmath>

#include "odca/sines.h"

namespace loopbench::odca::pins {

namespace {

using Map = Eigen::Map<MatrixX<double>>;

/// A moment of F about the point that the arm leads from.
double Moment(const Vector2<double>& arm, const Vector2<double>& F) {
  return arm.x * F.y - arm.y * F.x;
}

/// No product of Eigen's: this file compiles them with fused multiply-add, and the linker could use
/// them elsewhere.
double Dot(const double* a, const double* b, int n) {
  Lanes sums = {};
  int i = 0;
  for (; i + kLanes <= n; i += kLanes) sums += Load<Lanes>(a + i) * Load<Lanes>(b + i);
  double sum = 0.0;
  for (int lane = 0; lane < (i > 0 ? kLanes : 0); ++lane) sum += sums[lane];
  for (; i < n; ++i) sum += a[i] * b[i];
  return sum;
}

}  // namespace

template <AssemblySweep::GapKind kGap>
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
template <AssemblySweep::GapKind kGap>
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

double AssemblySweep::LargestGap() const {
  double largest = 0.0;
  for (const CutJoint& cut : cuts_) {
    largest = std::max(largest, cut.v.x * cut.v.x + cut.v.y * cut.v.y);
  }
  return std::sqrt(largest);
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
    if (!(node.pins == 1 ? JoinOne(node) : JoinSeveral(node))) return false;
  }
  return true;
}

/// Computes zeta of the remaining handles: the old value less product(e, f).
template <class Product>
void AssemblySweep::Eliminate(const Node& node, const Product& product) {
  const Side* kept = kept_.data() + node.first_kept;
  Matrix* zeta = zeta_.data() + node.first_block;
  for (int f = 0; f < node.kept; ++f) {
    for (int e = f; e < node.kept; ++e) {
      Matrix Z = {0.0, 0.0, 0.0, 0.0};
      const int child = kept[e].child;
      if (child == kept[f].child) {
        Z = zeta_[node.blocks[child] + kept[e].place + node.handles[child] * kept[f].place];
      }
      const Matrix less = product(e, f);
      Z = {Z.xx - less.xx, Z.xy - less.xy, Z.yx - less.yx, Z.yy - less.yy};
      if (e == f) {
        Z.yx = Z.xy;
      } else {
        zeta[f + node.kept * e] = Transpose(Z);
      }
      zeta[e + node.kept * f] = Z;
    }
  }
}

/// X = zeta_QQ + zeta_PP (16), and Y a block of zeta for each handle that stays (67); where both
/// sides are on one assembly, with their cross responses.
bool AssemblySweep::JoinOne(const Node& node) {
  const Pin& pin = pins_[node.first_pin];
  const auto block = [&](const Side& row, int child, int column) -> const Matrix& {
    return zeta_[node.blocks[child] + row.place + node.handles[child] * column];
  };
  const bool P = pin.P.place >= 0, Q = pin.Q.place >= 0;
  Symmetric2<double> X = {0.0, 0.0, 0.0};
  if (Q) {
    const Matrix& QQ = block(pin.Q, pin.Q.child, pin.Q.place);
    X = {QQ.xx, QQ.xy, QQ.yy};
  }
  if (P) {
    const Matrix& PP = block(pin.P, pin.P.child, pin.P.place);
    X = X + Symmetric2<double>{PP.xx, PP.xy, PP.yy};
  }
  if (P && Q && pin.P.child == pin.Q.child) {
    const Matrix& QP = block(pin.Q, pin.P.child, pin.P.place);
    X = X + Symmetric2<double>{-(QP.xx + QP.xx), -(QP.xy + QP.yx), -(QP.yy + QP.yy)};
  }
  double slack = 0.0;
  const Factored2<double> factors = FactorsOf(X, node.limit, slack);
  if (!(slack >= 0.0)) return false;
  factors_[node.factors] = factors;
  const Side* kept = kept_.data() + node.first_kept;
  Matrix* W = W_.data() + node.matrix;
  for (int e = 0; e < node.kept; ++e) {
    Matrix Y = {0.0, 0.0, 0.0, 0.0};
    if (Q && pin.Q.child == kept[e].child) Y = block(pin.Q, kept[e].child, kept[e].place);
    if (P && pin.P.child == kept[e].child) {
      const Matrix& PE = block(pin.P, kept[e].child, kept[e].place);
      Y = {Y.xx - PE.xx, Y.xy - PE.xy, Y.yx - PE.yx, Y.yy - PE.yy};
    }
    Y_[e] = Y;
    W[e] = factors * Y;
  }
  Eliminate(node, [&](int e, int f) { return TransposeTimes(Y_[e], W[f]); });  // (26-28)
  return true;
}

/// Returns the free response of the two bodies of a pin.
JointMatrix<double> AssemblySweep::FreeResponse(const FreeBody* bodies) const {
  JointMatrix<double> X = JointMatrix<double>::Zero(2, 2);
  for (const FreeBody* free = bodies; free != bodies + 2; ++free) {
    if (free->body < 0) continue;
    const double s = sine_[free->body], c = cosine_[free->body];
    const Vector r = {free->arm.x * c - free->arm.y * s, free->arm.x * s + free->arm.y * c};
    X(0, 0) += free->mobility + free->inverse_inertia * (r.y * r.y);
    X(1, 0) -= free->inverse_inertia * (r.x * r.y);
    X(1, 1) += free->mobility + free->inverse_inertia * (r.x * r.x);
  }
  X(0, 1) = X(1, 0);
  return X;
}

/// X of several pins (66), and V = T Y.
bool AssemblySweep::JoinSeveral(const Node& node) {
  const int n = 2 * node.pins;
  const Pin* pins = pins_.data() + node.first_pin;
  const Side* kept = kept_.data() + node.first_kept;
  LoopSolver<double>& loop = loops_[node.factors];
  Map V(V_.data() + node.matrix, n, 2 * node.kept);
  auto X = X_.topLeftCorner(n, n);
  X.setZero();
  V.setZero();
  const auto add = [](auto&& to, double sign, const Matrix& block) {
    to(0, 0) += sign * block.xx;
    to(0, 1) += sign * block.xy;
    to(1, 0) += sign * block.yx;
    to(1, 1) += sign * block.yy;
  };
  for (int i = 0; i < node.pins; ++i) {
    loop.SetScale(i, FreeResponse(free_.data() + (node.first_free + 2 * i)));
    for (const bool at_Q : {true, false}) {
      const Side& row = at_Q ? pins[i].Q : pins[i].P;
      if (row.place < 0) continue;
      const auto block = [&](int place) -> const Matrix& {
        return zeta_[node.blocks[row.child] + row.place + node.handles[row.child] * place];
      };
      for (int j = 0; j < node.pins; ++j) {
        for (const bool to_Q : {true, false}) {
          const Side& column = to_Q ? pins[j].Q : pins[j].P;
          if (column.place < 0 || column.child != row.child) continue;
          add(X.block<2, 2>(2 * i, 2 * j), at_Q == to_Q ? 1.0 : -1.0, block(column.place));
        }
      }
      for (int e = 0; e < node.kept; ++e) {
        if (kept[e].child != row.child) continue;
        add(V.block<2, 2>(2 * i, 2 * e), at_Q ? 1.0 : -1.0, block(kept[e].place));
      }
    }
  }
  if (!loop.FactorScaled(X) && !(loop.rcond() >= node.limit)) return false;
  if (node.kept == 0) return true;
  loop.Apply(V);
  Eliminate(node, [&](int e, int f) {  // (71)
    const double *ex = V.col(2 * e).data(), *ey = ex + n;
    const double *fx = V.col(2 * f).data(), *fy = fx + n;
    return Matrix{Dot(ex, fx, n), Dot(ex, fy, n), Dot(ey, fx, n), Dot(ey, fy, n)};
  });
  return true;
}

/// C b + c0 of each pin; for one of them then X^-1 of it, for several T of it (21, 68).
template <Pass kPass>
void AssemblySweep::Up(const Node& node) {
  double* s = s_.data() + node.first_row;
  for (int i = 0; i < node.pins; ++i) {
    const Pin& pin = pins_[node.first_pin + i];
    Vector sum = {0.0, 0.0};
    if (pin.cut >= 0) {
      const CutJoint& cut = cuts_[pin.cut];
      if constexpr (kPass == Pass::kSpeeds) sum = cut.v;
      if constexpr (kPass == Pass::kAccelerations) sum = -Cross(cut.w_P + cut.w_P, cut.v);  // (7)
    }
    if (pin.Q.place >= 0) sum = sum + b_[pin.Q.slot];
    if (pin.P.place >= 0) sum = sum - b_[pin.P.slot];
    s[2 * i] = sum.x;
    s[2 * i + 1] = sum.y;
  }
  const Side* kept = kept_.data() + node.first_kept;
  Vector* b = b_.data() + node.first_slot;
  if (node.pins == 1) {
    const Vector sum = {s[0], s[1]};
    const Matrix* W = W_.data() + node.matrix;
    for (int e = 0; e < node.kept; ++e) {  // (29-30)
      b[e] = b_[kept[e].slot] - TransposeTimes(W[e], sum);
    }
    const Vector y = factors_[node.factors] * sum;
    s[0] = y.x;
    s[1] = y.y;
    return;
  }
  const int n = 2 * node.pins;
  loops_[node.factors].Apply(Map(s, n, 1));
  const double* V = V_.data() + node.matrix;
  for (int e = 0; e < node.kept; ++e, V += 2 * n) {  // (72)
    Vector sum = b_[kept[e].slot];
    for (int i = 0; i < n; ++i) {
      sum.x -= V[i] * s[i];
      sum.y -= V[n + i] * s[i];
    }
    b[e] = sum;
  }
}

/// phi (17, 64), and forces on the handles of the children.
void AssemblySweep::Down(const Node& node) {
  const double* s = s_.data() + node.first_row;
  const Vector* F = F_.data() + node.first_slot;
  const Side* kept = kept_.data() + node.first_kept;
  double* phi = phi_.data();
  const int n = 2 * node.pins;
  for (int i = 0; i < n; ++i) phi[i] = -s[i];
  if (node.pins == 1) {
    const Matrix* W = W_.data() + node.matrix;
    Vector sum = {phi[0], phi[1]};
    for (int e = 0; e < node.kept; ++e) sum = sum - W[e] * F[e];
    phi[0] = sum.x;
    phi[1] = sum.y;
  } else {
    const double* V = V_.data() + node.matrix;
    for (int e = 0; e < node.kept; ++e, V += 2 * n) {
      for (int i = 0; i < n; ++i) phi[i] -= V[i] * F[e].x + V[n + i] * F[e].y;
    }
    loops_[node.factors].ApplyTransposed(Eigen::Map<VectorX<double>>(phi, n));
  }
  for (int e = 0; e < node.kept; ++e) F_[kept[e].slot] = F[e];
  for (int i = 0; i < node.pins; ++i) {
    const Pin& pin = pins_[node.first_pin + i];
    const Vector force = {phi[2 * i], phi[2 * i + 1]};
    if (pin.Q.place >= 0) F_[pin.Q.slot] = force;
    if (pin.P.place >= 0) F_[pin.P.slot] = -force;
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
  for (const Node& node : nodes_) Up<kPass>(node);
  for (std::size_t n = nodes_.size(); n-- > 0;) Down(nodes_[n]);
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
  tree_.ToBodies(q, u, angle_.data(), speed_.data(), *pool_);
  if (!Turn<GapKind::kSpeeds>() || !Assemble()) return false;
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

bool AssemblySweep::FindChange() {
  if (!Assemble()) return false;
  Solve<Pass::kSpeeds>();
  return true;
}

std::optional<Correction<double>> AssemblySweep::Project(std::span<double> q, std::span<double> u,
                                                         double goal) {
  return PinProjection::Of(*this, q, u, goal);
}

}  // namespace loopbench::odca::pins
