// Symbols are defined in self_stress.h. Columns of J are the speeds a along H, then b along D.
#include "mechanism/loops/self_stress.h"

#include <algorithm>
#include <limits>

#include "mechanism/algebra/factors.h"
#include "mechanism/algebra/instantiate.h"
#include "mechanism/algebra/lower_triangle.h"
#include "mechanism/loops/row_choice.h"

namespace loopbench {

namespace {

/// A = L L^T in A's place, as lower_triangle.h has it; the smallest pivot.
template <class S>
S FactorInPlace(MatrixX<S>& A) {
  const auto size = static_cast<int>(A.rows());
  if (size <= kSmallTriangle) return FactorLower(A.data(), size);
  CholeskyFactor<MatrixX<S>>::InPlace(A);
  const S least = A.diagonal().minCoeff();
  A.diagonal() = A.diagonal().cwiseInverse().eval();
  return least * least;
}

template <class S>
void SolveBoth(const MatrixX<S>& L, S* x) {
  SolveLower(L.data(), static_cast<int>(L.rows()), x);
  SolveLowerTransposed(L.data(), static_cast<int>(L.rows()), x);
}

/// Scalar product of columns i of A and j of B. For a few numbers Eigen's overhead exceeds the
/// work.
template <class S>
S Dot(const MatrixX<S>& A, int i, const MatrixX<S>& B, int j) {
  const auto size = A.rows();
  const S *a = A.data() + i * size, *b = B.data() + j * size;
  S sum(0);
  for (Eigen::Index k = 0; k < size; ++k) sum += a[k] * b[k];
  return sum;
}

/// y = A x for the first columns of A, as many as x has. As for Dot(), Eigen's overhead exceeds the
/// work.
template <class S, class X, class Y>
void Multiply(const MatrixX<S>& A, const X& x, Y&& y) {
  y.setZero();
  for (Eigen::Index j = 0; j < x.size(); ++j) {
    const S *a = A.data() + j * A.rows(), factor = x[j];
    for (Eigen::Index i = 0; i < A.rows(); ++i) y[i] += a[i] * factor;
  }
}
/// y = A^T x for the first columns of A, as many as y has.
template <class S, class X, class Y>
void MultiplyTransposed(const MatrixX<S>& A, const X& x, Y&& y) {
  for (Eigen::Index j = 0; j < y.size(); ++j) {
    const S* a = A.data() + j * A.rows();
    S sum(0);
    for (Eigen::Index i = 0; i < A.rows(); ++i) sum += a[i] * x[i];
    y[j] = sum;
  }
}

/// sum += direction * s.
template <class Space, class S, class Kind>
LOOPBENCH_INLINE void Add(const DirectionParts& parts, const Direction<Space, S>& direction,
                          const S& s, SpatialVector<Space, S, Kind>& sum) {
  if (parts.turns) sum.angular += direction.angular * s;
  if (parts.shifts) sum.linear += direction.linear * s;
}
template <class Space, class S, class Kind>
LOOPBENCH_INLINE S Dot(const DirectionParts& parts, const Direction<Space, S>& direction,
                       const SpatialVector<Space, S, Kind>& V) {
  if (!parts.shifts) return direction.angular.dot(V.angular);
  if (!parts.turns) return direction.linear.dot(V.linear);
  return direction.dot(V);
}

}  // namespace

template <class Space, class S>
SelfStress<Space, S>::SelfStress(const Mechanism<Space, S>& mechanism) : mechanism_(&mechanism) {
  Span();
  const int m = r_ + d_;
  rows_.setZero(H_, m);
  row_scale_.setOnes(m);
  inverse_scale_ = row_scale_;
  column_scale_.setOnes(H_ + D_);
  gram_.setIdentity(r_, r_);
  T_.setZero(r_, d_);
  C_.setIdentity(d_, d_);
  W_t_.setZero(D_, d_);
  e_t_.setZero(D_);
  z_t_ = e_t_;
  e_c_.setZero(m);
  z_c_ = e_c_;
  x_.setZero(H_ + D_);
  y_ = x_;
  missed_.setZero(d_);
  along_ = missed_;
  feedback_.setZero(mechanism.num_moving_rows() > 0 ? mechanism.num_equations()
                                                    : mechanism.num_rows());
  share_ = feedback_;
  if (D_ == 0) force_.setZero(mechanism.num_u());
  is_exact_ = D_ == 0 && loops_.size() == 1 && loops_.front().num_drives == 0 &&
              mechanism.num_moving_rows() == 0;
}

/// In joint coordinates the forest is the tree of the mechanism, in absolute ones a forest of
/// joints without released directions. All other constraints close loops.
template <class Space, class S>
void SelfStress<Space, S>::Span() {
  const auto& joints = mechanism_->joints();
  const bool in_joints = mechanism_->coordinates() == Coordinates::kJoint;
  std::vector<std::vector<int>> joints_of(static_cast<std::size_t>(mechanism_->num_bodies()));
  const auto usable = [&](int j) {
    return in_joints ? joints[j].in_tree() : !joints[j].in_tree() && joints[j].num_released == 0;
  };
  for (int j = 0; j < static_cast<int>(joints.size()); ++j) {
    if (!usable(j)) continue;
    joints_of[joints[j].from].push_back(j);
    joints_of[joints[j].to].push_back(j);
  }
  edges_.assign(joints_of.size(), Edge());
  std::vector<bool> reached(joints_of.size(), false), spans(joints.size(), false);
  for (int root = 0; root < mechanism_->num_bodies(); ++root) {
    std::vector<int> bodies;
    if (!reached[root]) bodies.push_back(root);
    reached[root] = true;
    for (std::size_t next = 0; next < bodies.size(); ++next) {
      const int parent = bodies[next];
      for (const int j : joints_of[parent]) {
        const int child = joints[j].from == parent ? joints[j].to : joints[j].from;
        if (reached[child]) continue;
        reached[child] = spans[j] = true;
        bodies.push_back(child);
        edges_[child] = {.joint = j,
                         .parent = parent,
                         .sign = joints[j].to == child ? 1 : -1,
                         .depth = edges_[parent].depth + 1,
                         .column = in_joints ? joints[j].u_offset : H_,
                         .D_column = in_joints ? -1 : D_,
                         .num_u = joints[j].num_u(),
                         .num_columns = in_joints ? joints[j].num_u() : Space::kDim,
                         .parts = {},
                         .own_rates = {}};
        forest_.push_back(child);
        H_ += joints[j].num_u();
        if (!in_joints) D_ += joints[j].num_constraints();
      }
    }
  }
  for (const int j : mechanism_->constraints()) {
    if (spans[j]) continue;
    loops_.push_back({.joint = j,
                      .imposed = r_,
                      .rows_released = std::vector<int>(joints[j].num_released),
                      .num_u = joints[j].num_u(),
                      .num_imposed = joints[j].num_constraints(),
                      .num_released = joints[j].num_released,
                      .num_drives = joints[j].num_drives,
                      .links = LinksOf(j),
                      .parts = {},
                      .basis = {},
                      .own_rates = {}});
    r_ += joints[j].num_constraints();
    d_ += joints[j].num_released;
  }
  r_ += mechanism_->num_moving_rows();
  d_ -= mechanism_->num_moving_rows();
}

/// Rotations count as lengths.
template <class Space, class S>
void SelfStress<Space, S>::Arrange(const Kinematics<Space, S>& kinematics) {
  is_arranged_ = true;
  arranged_ = kinematics.released();
  rows_.setZero();  // other columns may belong to a moving row
  int next_moving = r_ - mechanism_->num_moving_rows(), next = r_;
  for (const Released& out : arranged_) {
    Loop& loop = *std::ranges::find(loops_, out.joint, &Loop::joint);
    for (std::size_t q = 0; q < out.directions.size(); ++q) {
      loop.rows_released[q] = out.IsMoving(out.directions[q]) ? next_moving++ : next++;
    }
  }
  const S length = mechanism_->length(), per_length = S(1) / length;
  for (Loop& loop : loops_) {
    loop.parts = kinematics.PartsOf(loop.joint);
    for (int k = 0; k < loop.directions(); ++k) {
      const bool turns = loop.parts[loop.num_u + k].turns;
      row_scale_[loop.row(k)] = turns ? length : S(1);
      inverse_scale_[loop.row(k)] = turns ? per_length : S(1);
    }
  }
  for (const int child : forest_) {
    Edge& edge = edges_[child];
    edge.parts = kinematics.PartsOf(edge.joint);
    for (int i = 0; i < edge.num_columns; ++i) {
      column_scale_[ColumnOf(edge, i)] = edge.parts[i].turns ? per_length : S(1);
    }
  }
}

template <class Space, class S>
auto SelfStress<Space, S>::LinksOf(int joint) const -> std::vector<Link> {
  std::vector<Link> links;
  int to_Q = mechanism_->joints()[joint].to, to_P = mechanism_->joints()[joint].from;
  while (to_Q != to_P) {
    const bool on_Q = edges_[to_Q].depth >= edges_[to_P].depth;
    int& body = on_Q ? to_Q : to_P;
    const Edge& edge = edges_[body];
    links.push_back({body, on_Q != (edge.sign > 0), {}, {}});
    body = edge.parent;
  }
  return links;
}

/// D^T S(p - p_j) H_j of all joints j between the two sides of the loop's joint at p.
template <class Space, class S>
void SelfStress<Space, S>::FillRows(const Kinematics<Space, S>& kinematics, Loop& loop) {
  const Linear<Space, S> p = kinematics.JointPoint(loop.joint);
  loop.basis = kinematics.joints()[loop.joint].basis;
  for (Link& link : loop.links) {
    const Edge& edge = edges_[link.child];
    link.arm = p - kinematics.JointPoint(edge.joint);
    for (int i = 0; i < edge.num_u; ++i) {
      const int column = ColumnOf(edge, i);
      const S scale = link.is_reversed ? S(-column_scale_[column]) : column_scale_[column];
      Velocity<Space, S> V = Velocity<Space, S>::Zero();
      Add(edge.parts[i], kinematics.joints()[edge.joint].basis[i], scale, V);
      V = ShiftMotion<Space, S>(V, link.arm);
      for (int k = 0; k < loop.directions(); ++k) {
        const int row = loop.row(k), d = loop.num_u + k;
        rows_(column, row) = row_scale_[row] * Dot(loop.parts[d], loop.basis[d], V);
      }
    }
  }
}

/// Rates of directions, in axes that turn with P of each joint, and of arms.
template <class Space, class S>
void SelfStress<Space, S>::FillRates(const Kinematics<Space, S>& kinematics) {
  // velocity of Mo, as a point of Q
  const auto speed = [&](int joint) {
    const int body = mechanism_->joints()[joint].to;
    return ShiftMotion<Space, S>(kinematics.motions()[body], kinematics.joints()[joint].r_Q).linear;
  };
  for (const int child : forest_) {
    Edge& edge = edges_[child];
    kinematics.OwnRates(edge.joint, edge.parts, edge.num_columns, edge.own_rates);
  }
  for (Loop& loop : loops_) {
    kinematics.OwnRates(loop.joint, loop.parts, Space::kDim, loop.own_rates);
    const Linear<Space, S> p_rate = speed(loop.joint);
    for (Link& link : loop.links) link.arm_rate = p_rate - speed(edges_[link.child].joint);
  }
}

template <class Space, class S>
S SelfStress<Space, S>::FactorRows() {
  for (int j = 0; j < r_; ++j) {
    for (int i = j; i < r_; ++i) gram_(i, j) = Dot(rows_, i, rows_, j);
  }
  // at a singular configuration T belongs to regularized rows
  const S trace = gram_.trace();
  gram_.diagonal().array() += S(64) * std::numeric_limits<S>::epsilon() * trace;
  const S pivot = FactorInPlace(gram_) / trace;
  for (int q = 0; q < d_; ++q) {
    for (int k = 0; k < r_; ++k) T_(k, q) = Dot(rows_, k, rows_, r_ + q);
    SolveBoth(gram_, T_.col(q).data());
  }
  return pivot;
}

template <class Space, class S>
bool SelfStress<Space, S>::Factor(Kinematics<Space, S>& kinematics) {
  if (!is_arranged_ || kinematics.released() != arranged_) Arrange(kinematics);
  for (Loop& loop : loops_) FillRows(kinematics, loop);
  const S pivot = r_ > 0 ? FactorRows() : S(1);
  for (int q = 0; q < d_ && D_ > 0; ++q) {
    z_c_.head(r_) = -T_.col(q);
    z_c_.tail(d_) = VectorX<S>::Unit(d_, q);
    TransposedTimes<false>(kinematics, z_c_, y_);
    W_t_.col(q) = -y_.tail(D_);
  }
  for (int j = 0; j < d_; ++j) {
    for (int i = j; i < d_; ++i) {
      C_(i, j) = S(i == j) + Dot(T_, i, T_, j) + Dot(W_t_, i, W_t_, j);
    }
  }
  FactorInPlace(C_);
  if (mechanism_->is_redundant()) Turn(kinematics);
  // Rows within the accuracy: speeds err by T^2, accelerations by T^3 times the rounding.
  const S most = mechanism_->is_redundant() ? S(10) : S(2);
  return T_.size() == 0 || (pivot >= S(1e-4) && T_.cwiseAbs().maxCoeff() <= most);
}

template <class Space, class S>
std::vector<Released> SelfStress<Space, S>::Choose(const Kinematics<Space, S>& kinematics) const {
  Eigen::MatrixXd rows(r_ + d_, H_);
  std::vector<Quota> quotas;
  std::vector<int> joints;
  int next = 0;
  for (const Loop& loop : loops_) {
    quotas.push_back({next, loop.directions(), loop.num_drives, loop.num_imposed});
    joints.push_back(loop.joint);
    for (int k = 0; k < loop.directions(); ++k) {
      rows.row(next++) = rows_.col(loop.row(k)).transpose().template cast<double>();
    }
  }
  std::vector<Released> released = RowChoice(rows, quotas, r_).BeyondQuotas(joints);
  // rows count imposed directions first
  for (Released& out : released) {
    const int drives = mechanism_->joints()[out.joint].num_drives;
    for (std::vector<int>* directions : {&out.directions, &out.moving}) {
      for (int& direction : *directions) {
        direction = kinematics.DirectionOf(out.joint, drives + direction);
      }
      std::ranges::sort(*directions);
    }
  }
  return released;
}

template <class Space, class S>
template <class Kind>
SpatialVector<Space, S, Kind> SelfStress<Space, S>::TurnWithP(
    const Kinematics<Space, S>& kinematics, int joint,
    const SpatialVector<Space, S, Kind>& V) const {
  const Angular<Space, S>& w = kinematics.motions()[mechanism_->joints()[joint].from].angular;
  return {CrossAngular<S>(w, V.angular), Cross<S>(w, V.linear)};
}

template <class Space, class S>
template <bool kRates>
void SelfStress<Space, S>::Times(const Kinematics<Space, S>& kinematics, const VectorX<S>& x,
                                 VectorX<S>& rows) const {
  for (const Loop& loop : loops_) {
    Velocity<Space, S> V = Velocity<Space, S>::Zero(), V_rate = V;
    for (const Link& link : loop.links) {
      const Edge& edge = edges_[link.child];
      const Basis<Space, S>& basis = kinematics.joints()[edge.joint].basis;
      Velocity<Space, S> at = Velocity<Space, S>::Zero(), at_rate = at;
      for (int i = kRates ? 0 : edge.num_u; i < edge.num_columns; ++i) {
        const int column = ColumnOf(edge, i);
        const S speed = x[column] * column_scale_[column];
        Add(edge.parts[i], basis[i], speed, at);
        if (kRates && edge.parts[i].moves) Add(edge.parts[i], edge.own_rates[i], speed, at_rate);
      }
      if constexpr (kRates) {
        at_rate = ShiftMotion<Space, S>(at_rate + TurnWithP(kinematics, edge.joint, at), link.arm);
        at_rate.linear += Cross<S>(at.angular, link.arm_rate);
      }
      at = ShiftMotion<Space, S>(at, link.arm);
      link.is_reversed ? V -= at : V += at;
      if constexpr (kRates) link.is_reversed ? V_rate -= at_rate : V_rate += at_rate;
    }
    // (w x D) . V = -D . (w x V)
    if constexpr (kRates) V_rate -= TurnWithP(kinematics, loop.joint, V);
    for (int k = 0; k < loop.directions(); ++k) {
      const int row = loop.row(k), i = loop.num_u + k;
      S sum = Dot(loop.parts[i], loop.basis[i], kRates ? V_rate : V);
      if (kRates && loop.parts[i].moves) sum += Dot(loop.parts[i], loop.own_rates[i], V);
      rows[row] = row_scale_[row] * sum;
    }
  }
}

template <class Space, class S>
template <bool kRates>
void SelfStress<Space, S>::TransposedTimes(const Kinematics<Space, S>& kinematics,
                                           const VectorX<S>& z, VectorX<S>& columns) const {
  columns.setZero();
  for (const Loop& loop : loops_) {
    Wrench<Space, S> F = Wrench<Space, S>::Zero(), F_rate = F;
    for (int k = 0; k < loop.directions(); ++k) {
      const int i = loop.num_u + k;
      const S force = row_scale_[loop.row(k)] * z[loop.row(k)];
      Add(loop.parts[i], loop.basis[i], force, F);
      if (kRates && loop.parts[i].moves) Add(loop.parts[i], loop.own_rates[i], force, F_rate);
    }
    if constexpr (kRates) F_rate += TurnWithP(kinematics, loop.joint, F);
    for (const Link& link : loop.links) {
      const Edge& edge = edges_[link.child];
      const Basis<Space, S>& basis = kinematics.joints()[edge.joint].basis;
      const Wrench<Space, S> at = ShiftForce<Space, S>(F, link.arm);
      Wrench<Space, S> at_rate = at;
      if constexpr (kRates) {
        at_rate = ShiftForce<Space, S>(F_rate, link.arm) - TurnWithP(kinematics, edge.joint, at);
        at_rate.angular += Moment<S>(link.arm_rate, F.linear);
      }
      for (int i = kRates ? 0 : edge.num_u; i < edge.num_columns; ++i) {
        const int column = ColumnOf(edge, i);
        S part = Dot(edge.parts[i], basis[i], at_rate);
        if (kRates && edge.parts[i].moves) part += Dot(edge.parts[i], edge.own_rates[i], at);
        part *= column_scale_[column];
        link.is_reversed ? columns[column] -= part : columns[column] += part;
      }
    }
  }
}

template <class Space, class S>
void SelfStress<Space, S>::Measure(const Kinematics<Space, S>& kinematics) {
  for (const Loop& loop : loops_) {
    const Velocity<Space, S> mismatch = kinematics.ConstraintMismatch(loop.joint);
    for (int k = 0; k < loop.directions(); ++k) {
      const int row = loop.row(k);
      const int i = loop.num_u + k;
      e_c_[row] = row_scale_[row] * Dot(loop.parts[i], loop.basis[i], mismatch);
    }
  }
  for (const int child : forest_) {
    const Edge& edge = edges_[child];
    if (edge.D_column < 0) continue;
    const JointState<Space, S>& state = kinematics.joints()[edge.joint];
    const Velocity<Space, S> mismatch = kinematics.ConstraintMismatch(edge.joint);
    for (int k = 0; k < state.rows(); ++k) {
      const int row = edge.D_column + k;
      const DirectionParts& parts = edge.parts[edge.num_u + k];
      e_t_[row] = Dot(parts, state.D(k), mismatch) * (parts.turns ? mechanism_->length() : S(1));
    }
  }
}

template <class Space, class S>
void SelfStress<Space, S>::ProjectOnStress(VectorX<S>& z_t, VectorX<S>& z_c) {
  MultiplyTransposed(T_, z_c, along_);
  MultiplyTransposed(W_t_, z_t, missed_);
  for (int q = 0; q < d_; ++q) along_[q] = z_c[r_ + q] - along_[q] + missed_[q];
  SolveBoth(C_, along_.data());
  Multiply(T_, along_, z_c.head(r_));
  Multiply(W_t_, along_, z_t);
  for (int k = 0; k < r_; ++k) z_c[k] = -z_c[k];
  z_c.tail(d_) = along_;
}

template <class Space, class S>
const VectorX<S>& SelfStress<Space, S>::Feedback(const Kinematics<Space, S>& kinematics) {
  FillRates(kinematics);
  Measure(kinematics);
  // J [a; b] = e
  x_.head(H_).setZero();
  x_.tail(D_) = e_t_;
  if (D_ > 0) {
    Times<false>(kinematics, x_, z_c_);
    e_c_ -= z_c_;
  }
  SolveBoth(gram_, e_c_.data());
  Multiply(rows_, e_c_.head(r_), x_.head(H_));
  // W (-W'^T e), from the rates of loops; rates of J_t vanish
  Times<true>(kinematics, x_, z_c_);
  z_t_.setZero();
  ProjectOnStress(z_t_, z_c_);
  // z = W' W'^T e: J^T z = J'^T W (-W'^T e) and W^T z = 0
  TransposedTimes<true>(kinematics, z_c_, y_);
  MultiplyTransposed(rows_, y_, z_c_.head(r_));
  z_c_.tail(d_).setZero();
  SolveBoth(gram_, z_c_.data());
  if (D_ > 0) {
    TransposedTimes<false>(kinematics, z_c_, x_);
    z_t_ = y_.tail(D_) - x_.tail(D_);
  }
  e_c_ = z_c_;
  e_t_ = z_t_;
  ProjectOnStress(z_t_, z_c_);
  z_c_ = e_c_ - z_c_;
  z_t_ = e_t_ - z_t_;
  ToRows(z_t_, z_c_, feedback_);
  return feedback_;
}

template <class Space, class S>
const VectorX<S>& SelfStress<Space, S>::ShareOfSpeeds(const Kinematics<Space, S>& kinematics) {
  for (const Loop& loop : loops_) {
    const Velocity<Space, S>& V = kinematics.joints()[loop.joint].V_rel;
    for (int q = 0; q < loop.num_released; ++q) {
      const int row = loop.rows_released[q];
      if (row < r_) continue;
      missed_[row - r_] = row_scale_[row] * loop.basis[loop.num_u + loop.num_imposed + q].dot(V);
    }
  }
  return Share();
}

template <class Space, class S>
const VectorX<S>& SelfStress<Space, S>::ShareOfAccelerations(
    const Kinematics<Space, S>& kinematics, std::span<const Acceleration<Space, S>> A) {
  for (const Loop& loop : loops_) {
    if (loop.num_released == 0) continue;
    const Components<Space, S> left = JointAcceleration<Space, S>(kinematics, loop.joint, A);
    for (int q = 0; q < loop.num_released; ++q) {
      const int row = loop.rows_released[q];
      if (row < r_) continue;
      missed_[row - r_] = row_scale_[row] * left[loop.num_imposed + q] + z_c_[row];
    }
  }
  return Share();
}

template <class Space, class S>
const VectorX<S>& SelfStress<Space, S>::ForceOfStress(const VectorX<S>& lambda) {
  if (!needs_multipliers()) return force_;
  e_c_.setZero();
  for (const Loop& loop : loops_) {
    for (int k = 0; k < loop.num_imposed; ++k) {
      const int row = loop.imposed + k;
      e_c_[row] = lambda[mechanism_->joints()[loop.joint].row + k] * inverse_scale_[row];
      if (k < loop.num_drives) continue;
      for (const int q : loop.rows_released) {
        if (q >= r_) e_c_[q] += T_(row, q - r_) * e_c_[row];
      }
    }
  }
  for (int i = 0; i < mechanism_->num_moving_rows(); ++i) {
    const int row = r_ - mechanism_->num_moving_rows() + i;
    e_c_[row] = lambda[FirstMovingEquation() + i] * inverse_scale_[row];
  }
  ProjectOnStress(e_t_, e_c_);
  force_.setZero();
  for (int k = 0; k < r_ + d_; ++k) force_ -= rows_.col(k) * e_c_[k];
  force_ = force_.cwiseQuotient(column_scale_);
  return force_;
}

template <class Space, class S>
const VectorX<S>& SelfStress<Space, S>::Share() {
  // of W^T rho, rho = [-T_b; 1] missed
  e_c_.tail(d_) = missed_;
  e_c_.head(r_).setZero();
  for (const Loop& loop : loops_) {
    for (int k = loop.num_drives; k < loop.num_imposed; ++k) {
      for (const int q : loop.rows_released) {
        if (q >= r_) e_c_[loop.imposed + k] -= T_(loop.imposed + k, q - r_) * e_c_[q];
      }
    }
  }
  e_t_.setZero();
  ProjectOnStress(e_t_, e_c_);
  ToRows(e_t_, e_c_, share_);
  return share_;
}

template <class Space, class S>
void SelfStress<Space, S>::ToRows(const VectorX<S>& forest, const VectorX<S>& loops,
                                  VectorX<S>& rows) const {
  for (const Loop& loop : loops_) {
    for (int k = 0; k < loop.num_imposed; ++k) {
      const int row = loop.imposed + k;
      S sum = loops[row];
      for (const int q : loop.rows_released) {
        if (k >= loop.num_drives && q >= r_) sum += T_(row, q - r_) * loops[q];
      }
      rows[mechanism_->joints()[loop.joint].row + k] = sum * inverse_scale_[row];
    }
  }
  for (int i = 0; i < mechanism_->num_moving_rows(); ++i) {
    const int row = r_ - mechanism_->num_moving_rows() + i;
    rows[FirstMovingEquation() + i] = loops[row] * inverse_scale_[row];
  }
  for (const int child : forest_) {
    const Edge& edge = edges_[child];
    if (edge.D_column < 0) continue;
    const Joint<Space, S>& joint = mechanism_->joints()[edge.joint];
    for (int k = 0; k < joint.num_constraints(); ++k) {
      rows[joint.row + k] = forest[edge.D_column + k] * column_scale_[H_ + edge.D_column + k];
    }
  }
}

#define LOOPBENCH_INSTANTIATE(Space, S) template class SelfStress<Space, S>;
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
