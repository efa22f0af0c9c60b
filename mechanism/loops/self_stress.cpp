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

/// Scalar product of n numbers. For a few numbers Eigen's overhead exceeds the work.
template <class S>
S Dot(const S* a, const S* b, Eigen::Index n) {
  S sum(0);
  for (Eigen::Index i = 0; i < n; ++i) sum += a[i] * b[i];
  return sum;
}
/// y = A x for the first columns of A, n of them.
template <class S>
void Multiply(const MatrixX<S>& A, const S* x, Eigen::Index n, S* y) {
  std::fill_n(y, A.rows(), S(0));
  for (Eigen::Index j = 0; j < n; ++j) {
    const S *a = A.data() + j * A.rows(), factor = x[j];
    for (Eigen::Index i = 0; i < A.rows(); ++i) y[i] += a[i] * factor;
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
  W_.setZero(m + D_, d_);
  W_.middleRows(r_, d_).setIdentity();
  C_.setIdentity(d_, d_);
  z_.setZero(m + D_);
  y_.setZero(H_ + D_);
  along_.setZero(d_);
  const bool has_others = mechanism.num_moving_rows() > 0 || !coupled_.empty();
  feedback_.setZero(has_others ? mechanism.num_equations() : mechanism.num_rows());
  share_ = feedback_;
  is_exact_ = D_ == 0 && loops_.size() == 1 && loops_.front().num_drives == 0 && !has_others;
}

/// In joint coordinates the forest is the tree of the mechanism, in absolute ones a forest of
/// joints without released directions; with couplings it contains only joints of the same tree.
/// All other constraints close loops.
template <class Space, class S>
void SelfStress<Space, S>::Span() {
  const auto& joints = mechanism_->joints();
  const bool in_joints = mechanism_->coordinates() == Coordinates::kJoint;
  std::vector<std::vector<int>> joints_of(static_cast<std::size_t>(mechanism_->num_bodies()));
  for (int c = 0; c < mechanism_->num_coordinate_couplings(); ++c) {
    if (mechanism_->couplings()[c].in_loops) coupled_.push_back({c, {}});
  }
  const auto usable = [&](int j) {
    if (in_joints) return joints[j].in_tree();
    return !joints[j].in_tree() && joints[j].num_released == 0 &&
           (coupled_.empty() || !joints[j].is_cut);
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
  r_ += static_cast<int>(coupled_.size()) + mechanism_->num_moving_rows();
  d_ -= mechanism_->num_moving_rows();
}

template <class Space, class S>
void SelfStress<Space, S>::Couple() {
  for (std::size_t i = 0; i < coupled_.size(); ++i) {
    CoupledRow& coupled = coupled_[i];
    coupled.coefficients.clear();
    S sum(0);
    for (const auto& [joint, ratio] : mechanism_->couplings()[coupled.coupling].parts) {
      const auto edge = std::ranges::find(edges_, joint, &Edge::joint);
      if (edge == edges_.end() || edge->num_columns == 0) continue;  // prescribed in the tree
      const int column = ColumnOf(*edge, 0);
      coupled.coefficients.push_back({column, ratio * column_scale_[column]});
      sum += coupled.coefficients.back().value * coupled.coefficients.back().value;
    }
    using std::sqrt;
    const int row = FirstCoupledRow() + static_cast<int>(i);
    inverse_scale_[row] = sqrt(sum);
    row_scale_[row] = S(1) / inverse_scale_[row];
    for (Coefficient& coefficient : coupled.coefficients) {
      coefficient.value *= row_scale_[row];
      if (coefficient.column < H_) rows_(coefficient.column, row) = coefficient.value;
    }
  }
}

/// Rotations count as lengths.
template <class Space, class S>
void SelfStress<Space, S>::Arrange(const Kinematics<Space, S>& kinematics) {
  is_arranged_ = true;
  arranged_ = kinematics.released();
  rows_.setZero();  // other columns may belong to a moving row
  int next_moving = FirstMovingRow(), next = r_;
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
  Couple();
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
  const auto row = [&](int k) { return rows_.data() + static_cast<Eigen::Index>(k) * H_; };
  for (int j = 0; j < r_; ++j) {
    for (int i = j; i < r_; ++i) gram_(i, j) = Dot(row(i), row(j), H_);
  }
  // at a singular configuration T belongs to regularized rows
  const S trace = gram_.trace();
  gram_.diagonal().array() += S(64) * std::numeric_limits<S>::epsilon() * trace;
  const S pivot = FactorInPlace(gram_) / trace;
  for (int q = 0; q < d_; ++q) {
    for (int k = 0; k < r_; ++k) W_(k, q) = -Dot(row(k), row(r_ + q), H_);
    SolveBoth(gram_, W_.col(q).data());
  }
  return pivot;
}

template <class Space, class S>
bool SelfStress<Space, S>::Factor(Kinematics<Space, S>& kinematics) {
  if (!is_arranged_ || kinematics.released() != arranged_) Arrange(kinematics);
  for (Loop& loop : loops_) FillRows(kinematics, loop);
  const S pivot = r_ > 0 ? FactorRows() : S(1);
  if (D_ > 0) SetForest(kinematics, W_.data(), d_);
  for (int j = 0; j < d_; ++j) {
    for (int i = j; i < d_; ++i) C_(i, j) = Dot(W_.col(i).data(), W_.col(j).data(), W_.rows());
  }
  FactorInPlace(C_);
  if (mechanism_->is_redundant()) Turn(kinematics);
  // Rows within the accuracy: speeds err by T^2, accelerations by T^3 times the rounding.
  const S most = mechanism_->is_redundant() ? S(10) : S(2);
  // without imposed rows T is empty
  const bool is_small = d_ == 0 || r_ == 0 || W_.topRows(r_).cwiseAbs().maxCoeff() <= most;
  return is_small && (d_ == 0 || pivot >= S(1e-4));
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
  for (int row = FirstCoupledRow(); row < FirstMovingRow(); ++row) {
    quotas.push_back({next, 1, 1, 1});
    joints.push_back(-1);
    rows.row(next++) = rows_.col(row).transpose().template cast<double>();
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
void SelfStress<Space, S>::SetForest(const Kinematics<Space, S>& kinematics, S* z, int count) {
  const int m = r_ + d_, size = m + D_;
  for (int q = 0; q < count; ++q) {
    std::fill_n(z + q * size + m, D_, S(0));
    for (std::size_t i = 0; i < coupled_.size(); ++i) {
      const S force = z[q * size + FirstCoupledRow() + static_cast<int>(i)];
      for (const Coefficient& one : coupled_[i].coefficients) {
        if (one.column >= H_) z[q * size + m + one.column - H_] -= one.value * force;
      }
    }
  }
  for (const Loop& loop : loops_) {
    for (int q = 0; q < count; ++q) {
      Wrench<Space, S> F = Wrench<Space, S>::Zero();
      for (int k = 0; k < loop.directions(); ++k) {
        const int row = loop.row(k), i = loop.num_u + k;
        Add(loop.parts[i], loop.basis[i], S(row_scale_[row] * z[q * size + row]), F);
      }
      for (const Link& link : loop.links) {
        const Edge& edge = edges_[link.child];
        const Basis<Space, S>& basis = kinematics.joints()[edge.joint].basis;
        const Wrench<Space, S> at = ShiftForce<Space, S>(F, link.arm);
        S* part = z + q * size + m + edge.D_column - edge.num_u;
        for (int i = edge.num_u; i < edge.num_columns; ++i) {
          const S value = Dot(edge.parts[i], basis[i], at) * column_scale_[ColumnOf(edge, i)];
          link.is_reversed ? part[i] += value : part[i] -= value;
        }
      }
    }
  }
}

template <class Space, class S>
void SelfStress<Space, S>::ColumnsOfRates(const Kinematics<Space, S>& kinematics) {
  y_.setZero();
  for (const Loop& loop : loops_) {
    Wrench<Space, S> F = Wrench<Space, S>::Zero(), F_rate = F;
    for (int k = 0; k < loop.directions(); ++k) {
      const int i = loop.num_u + k;
      const S force = row_scale_[loop.row(k)] * z_[loop.row(k)];
      Add(loop.parts[i], loop.basis[i], force, F);
      if (loop.parts[i].moves) Add(loop.parts[i], loop.own_rates[i], force, F_rate);
    }
    F_rate += TurnWithP(kinematics, loop.joint, F);
    for (const Link& link : loop.links) {
      const Edge& edge = edges_[link.child];
      const Basis<Space, S>& basis = kinematics.joints()[edge.joint].basis;
      const Wrench<Space, S> at = ShiftForce<Space, S>(F, link.arm);
      Wrench<Space, S> at_rate =
          ShiftForce<Space, S>(F_rate, link.arm) - TurnWithP(kinematics, edge.joint, at);
      at_rate.angular += Moment<S>(link.arm_rate, F.linear);
      for (int i = 0; i < edge.num_columns; ++i) {
        const int column = ColumnOf(edge, i);
        S part = Dot(edge.parts[i], basis[i], at_rate);
        if (edge.parts[i].moves) part += Dot(edge.parts[i], edge.own_rates[i], at);
        part *= column_scale_[column];
        link.is_reversed ? y_[column] -= part : y_[column] += part;
      }
    }
  }
}

template <class Space, class S>
void SelfStress<Space, S>::MeasureSpeeds(const Kinematics<Space, S>& kinematics) {
  for (const Loop& loop : loops_) {
    const Velocity<Space, S>& V = kinematics.joints()[loop.joint].V_rel;
    for (int k = 0; k < loop.directions(); ++k) {
      const int row = loop.row(k), i = loop.num_u + k;
      z_[row] = row_scale_[row] * Dot(loop.parts[i], loop.basis[i], V);
    }
    if (loop.num_drives == 0) continue;
    const Components<Space, S> speed = kinematics.ConstraintSpeed(loop.joint);
    for (int k = 0; k < loop.num_drives; ++k) z_[loop.row(k)] = row_scale_[loop.row(k)] * speed[k];
  }
  for (std::size_t i = 0; i < coupled_.size(); ++i) {
    const int row = FirstCoupledRow() + static_cast<int>(i);
    z_[row] = row_scale_[row] * kinematics.CouplingSpeed(coupled_[i].coupling);
  }
  for (const int child : forest_) {
    const Edge& edge = edges_[child];
    if (edge.D_column < 0) continue;
    const Components<Space, S> speed = kinematics.ConstraintSpeed(edge.joint);
    for (int k = 0; k < kinematics.joints()[edge.joint].rows(); ++k) {
      const bool turns = edge.parts[edge.num_u + k].turns;
      z_[r_ + d_ + edge.D_column + k] = speed[k] * (turns ? mechanism_->length() : S(1));
    }
  }
}

template <class Space, class S>
void SelfStress<Space, S>::ProjectOnStress() {
  for (int q = 0; q < d_; ++q) along_[q] = Dot(W_.col(q).data(), z_.data(), z_.size());
  SolveBoth(C_, along_.data());
  Multiply(W_, along_.data(), d_, z_.data());
}

template <class Space, class S>
const VectorX<S>& SelfStress<Space, S>::Feedback(const Kinematics<Space, S>& kinematics) {
  FillRates(kinematics);
  MeasureSpeeds(kinematics);
  ProjectOnStress();
  // z = W' W'^T e + W (..): J^T z = J'^T W W^T e'; released rows have no part of z
  ColumnsOfRates(kinematics);
  for (int k = 0; k < r_; ++k) z_[k] = Dot(rows_.col(k).data(), y_.data(), H_);
  z_.segment(r_, d_).setZero();
  SolveBoth(gram_, z_.data());
  if (D_ > 0) {
    SetForest(kinematics, z_.data(), 1);
    z_.tail(D_) += y_.tail(D_);
  }
  ToRows(feedback_);
  return feedback_;
}

template <class Space, class S>
const VectorX<S>& SelfStress<Space, S>::ShareOfSpeeds(const Kinematics<Space, S>& kinematics) {
  for (const Loop& loop : loops_) {
    const Velocity<Space, S>& V = kinematics.joints()[loop.joint].V_rel;
    for (int q = 0; q < loop.num_released; ++q) {
      const int row = loop.rows_released[q];
      if (row < r_) continue;
      z_[row] = row_scale_[row] * loop.basis[loop.num_u + loop.num_imposed + q].dot(V);
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
      z_[row] = row_scale_[row] * left[loop.num_imposed + q];
    }
  }
  return Share();
}

template <class Space, class S>
const VectorX<S>& SelfStress<Space, S>::Share() {
  // of W^T rho, rho = [-T_b; 1] missed
  z_.head(r_).setZero();
  for (const Loop& loop : loops_) {
    for (int k = loop.num_drives; k < loop.num_imposed; ++k) {
      const int row = loop.imposed + k;
      for (const int q : loop.rows_released) {
        if (q >= r_) z_[row] += W_(row, q - r_) * z_[q];
      }
    }
  }
  z_.tail(D_).setZero();
  ProjectOnStress();
  ToRows(share_);
  return share_;
}

template <class Space, class S>
void SelfStress<Space, S>::ToRows(VectorX<S>& rows) const {
  for (const Loop& loop : loops_) {
    for (int k = 0; k < loop.num_imposed; ++k) {
      const int row = loop.imposed + k;
      S sum = z_[row];
      for (const int q : loop.rows_released) {
        if (k >= loop.num_drives && q >= r_) sum -= W_(row, q - r_) * z_[q];
      }
      rows[mechanism_->joints()[loop.joint].row + k] = sum * inverse_scale_[row];
    }
  }
  for (int i = 0; i < mechanism_->num_moving_rows(); ++i) {
    const int row = FirstMovingRow() + i;
    rows[FirstMovingEquation() + i] = z_[row] * inverse_scale_[row];
  }
  for (std::size_t i = 0; i < coupled_.size(); ++i) {
    const int row = FirstCoupledRow() + static_cast<int>(i);
    rows[mechanism_->num_rows() + coupled_[i].coupling] = z_[row] * inverse_scale_[row];
  }
  for (const int child : forest_) {
    const Edge& edge = edges_[child];
    if (edge.D_column < 0) continue;
    const Joint<Space, S>& joint = mechanism_->joints()[edge.joint];
    const S *from = z_.data() + r_ + d_ + edge.D_column,
            *scale = column_scale_.data() + H_ + edge.D_column;
    for (int k = 0; k < joint.num_constraints(); ++k) rows[joint.row + k] = from[k] * scale[k];
  }
}

#define LOOPBENCH_INSTANTIATE(Space, S) template class SelfStress<Space, S>;
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
