// Names are those of self_stress.h. Columns of J_ are the speeds a, then b.
#include "mechanism/loops/self_stress.h"

#include <algorithm>
#include <limits>

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
  const Eigen::LLT<Eigen::Ref<MatrixX<S>>> factor(A);
  const S least = A.diagonal().minCoeff();
  A.diagonal() = A.diagonal().cwiseInverse().eval();
  return least * least;
}

template <class S>
void SolveBoth(const MatrixX<S>& L, S* x) {
  SolveLower(L.data(), static_cast<int>(L.rows()), x);
  SolveLowerTransposed(L.data(), static_cast<int>(L.rows()), x);
}

/// Velocity of Mo, as a point of Q.
template <class Space, class S>
Linear<Space, S> SpeedOfPoint(const Kinematics<Space, S>& kinematics, int joint) {
  const int body = kinematics.mechanism().joints()[joint].to;
  return ShiftMotion<Space, S>(kinematics.motions()[body], kinematics.joints()[joint].r_Q).linear;
}

/// Rotations count as lengths.
template <class Space, class S>
S ScaleOf(const Direction<Space, S>& direction, S length) {
  return direction.angular.squaredNorm() > S(0) ? length : S(1);
}

}  // namespace

template <class Space, class S>
SelfStress<Space, S>::SelfStress(const Mechanism<Space, S>& mechanism) : mechanism_(&mechanism) {
  Span();
  const int m = r_ + d_;
  J_.setZero(m, H_ + D_);
  J_rate_.setZero(m, H_ + D_);
  row_scale_.setOnes(m);
  column_scale_.setOnes(H_ + D_);
  gram_.setIdentity(r_, r_);
  T_.setZero(r_, d_);
  C_.setIdentity(d_, d_);
  W_c_.setZero(m, d_);
  W_t_.setZero(D_, d_);
  e_t_.setZero(D_);
  z_t_ = e_t_;
  e_c_.setZero(m);
  z_c_ = e_c_;
  x_.setZero(H_ + D_);
  y_ = x_;
  missed_.setZero(d_);
  along_ = missed_;
  feedback_.setZero(mechanism.num_rows());
  share_ = feedback_;
  if (D_ == 0) force_.setZero(mechanism.num_u());
}

/// In joint coordinates the forest is that of the mechanism, in absolute ones a forest of joints
/// that release nothing. All other constraints close loops.
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
        edges_[child] = {j,
                         parent,
                         joints[j].to == child ? 1 : -1,
                         edges_[parent].depth + 1,
                         H_,
                         in_joints ? -1 : D_};
        H_ += joints[j].num_u();
        if (in_joints) continue;
        D_ += joints[j].num_constraints();
        forest_.push_back(child);
      }
    }
  }
  for (const int j : mechanism_->constraints()) {
    if (spans[j]) continue;
    loops_.push_back({j, r_, d_});
    r_ += joints[j].num_constraints();
    d_ += joints[j].num_released;
  }
  for (Loop& loop : loops_) loop.released += r_;
}

template <class Space, class S>
template <class Sink>
void SelfStress<Space, S>::ForEachEdge(const Loop& loop, const Sink& sink) const {
  int to_Q = mechanism_->joints()[loop.joint].to, to_P = mechanism_->joints()[loop.joint].from;
  while (to_Q != to_P) {
    const bool on_Q = edges_[to_Q].depth >= edges_[to_P].depth;
    int& body = on_Q ? to_Q : to_P;
    const Edge& edge = edges_[body];
    sink(edge, S(on_Q ? edge.sign : -edge.sign));
    body = edge.parent;
  }
}

/// D^T S(p - p_j) [H_j D_j] of all joints j between the two sides of the loop's joint at p.
template <class Space, class S>
void SelfStress<Space, S>::FillRows(const Kinematics<Space, S>& kinematics, const Loop& loop) {
  const S length = mechanism_->length();
  const JointState<Space, S>& cut = kinematics.joints()[loop.joint];
  const Linear<Space, S> p = kinematics.JointPoint(loop.joint);
  for (int k = 0; k < cut.directions(); ++k) {
    row_scale_[RowOf(loop, k)] = ScaleOf<Space, S>(cut.D(k), length);
  }
  ForEachEdge(loop, [&](const Edge& edge, S sign) {
    const JointState<Space, S>& state = kinematics.joints()[edge.joint];
    const Linear<Space, S> arm = p - kinematics.JointPoint(edge.joint);
    const int columns = edge.D_column < 0 ? state.num_u : Space::kDim;
    for (int i = 0; i < columns; ++i) {
      const int column = i < state.num_u ? edge.column + i : H_ + edge.D_column + i - state.num_u;
      const S scale = column_scale_[column] = ScaleOf<Space, S>(state.basis[i], length);
      const Velocity<Space, S> V =
          ShiftMotion<Space, S>(Velocity<Space, S>(state.basis[i] * (sign / scale)), arm);
      for (int k = 0; k < cut.directions(); ++k) {
        const int row = RowOf(loop, k);
        J_(row, column) = row_scale_[row] * cut.D(k).dot(V);
      }
    }
  });
}

/// Rates of the same, in axes that turn with P of each joint.
template <class Space, class S>
void SelfStress<Space, S>::FillRates(const Kinematics<Space, S>& kinematics, const Loop& loop) {
  const JointState<Space, S>& cut = kinematics.joints()[loop.joint];
  const Linear<Space, S> p = kinematics.JointPoint(loop.joint);
  const Linear<Space, S> p_rate = SpeedOfPoint(kinematics, loop.joint);
  Basis<Space, S> D_rate, rate;
  kinematics.BasisRate(loop.joint, Space::kDim, D_rate);
  ForEachEdge(loop, [&](const Edge& edge, S sign) {
    const JointState<Space, S>& state = kinematics.joints()[edge.joint];
    const Linear<Space, S> arm = p - kinematics.JointPoint(edge.joint);
    const Linear<Space, S> arm_rate = p_rate - SpeedOfPoint(kinematics, edge.joint);
    const int columns = edge.D_column < 0 ? state.num_u : Space::kDim;
    kinematics.BasisRate(edge.joint, columns, rate);
    for (int i = 0; i < columns; ++i) {
      const int column = i < state.num_u ? edge.column + i : H_ + edge.D_column + i - state.num_u;
      const S factor = sign / column_scale_[column];
      const Velocity<Space, S> V_j(state.basis[i] * factor);
      const Velocity<Space, S> V = ShiftMotion<Space, S>(V_j, arm);
      Velocity<Space, S> V_rate = ShiftMotion<Space, S>(Velocity<Space, S>(rate[i] * factor), arm);
      V_rate.linear += Cross<S>(V_j.angular, arm_rate);
      for (int k = 0; k < cut.directions(); ++k) {
        const int row = RowOf(loop, k);
        const S sum = D_rate[cut.num_u + k].dot(V) + cut.D(k).dot(V_rate);
        J_rate_(row, column) = row_scale_[row] * sum;
      }
    }
  });
}

template <class Space, class S>
void SelfStress<Space, S>::Factor(const Kinematics<Space, S>& kinematics) {
  for (const Loop& loop : loops_) FillRows(kinematics, loop);
  if (r_ > 0) {
    const auto J_HR = J_.topLeftCorner(r_, H_);
    gram_.noalias() = J_HR.lazyProduct(J_HR.transpose());
    // at a singular position T is that of regularised rows
    const S trace = gram_.trace();
    gram_.diagonal().array() += S(64) * std::numeric_limits<S>::epsilon() * trace;
    pivot_ = FactorInPlace(gram_) / trace;
    T_.noalias() = J_HR.lazyProduct(J_.block(r_, 0, d_, H_).transpose());
    for (int k = 0; k < d_; ++k) SolveBoth(gram_, T_.col(k).data());
    // stages of a step are off the loops by more than steps, and terms of second order count there
    if (T_.cwiseAbs().maxCoeff() > S(2.5)) pivot_ = S(0);
  }
  W_c_.topRows(r_) = -T_;
  W_c_.bottomRows(d_).setIdentity();
  C_.noalias() = W_c_.transpose().lazyProduct(W_c_);
  if (D_ > 0) {
    W_t_.noalias() = -J_.rightCols(D_).transpose().lazyProduct(W_c_);
    C_.noalias() += W_t_.transpose().lazyProduct(W_t_);
  }
  FactorInPlace(C_);
  // W := W C^-T
  for (MatrixX<S>* W : {&W_c_, &W_t_}) {
    for (int j = 0; j < d_; ++j) {
      for (int k = 0; k < j; ++k) W->col(j) -= C_(j, k) * W->col(k);
      W->col(j) *= C_(j, j);
    }
  }
}

template <class Space, class S>
std::vector<Released> SelfStress<Space, S>::Choose(const Kinematics<Space, S>& kinematics) const {
  Eigen::MatrixXd rows(r_ + d_, H_);
  std::vector<Quota> quotas;
  std::vector<int> joints;
  int next = 0;
  for (const Loop& loop : loops_) {
    const Joint<Space, S>& joint = mechanism_->joints()[loop.joint];
    quotas.push_back({next, joint.num_directions(), joint.num_drives, joint.num_constraints()});
    joints.push_back(loop.joint);
    for (int k = 0; k < joint.num_directions(); ++k) {
      rows.row(next++) = J_.row(RowOf(loop, k)).head(H_).template cast<double>();
    }
  }
  RowChoice choice(rows, quotas);
  choice.TakeFixed();
  choice.TakeBest(r_, [](int) { return true; });
  std::vector<Released> released = choice.NotTaken(joints);
  // rows count imposed directions first
  for (Released& out : released) {
    const int drives = mechanism_->joints()[out.joint].num_drives;
    for (int& direction : out.directions) {
      direction = kinematics.DirectionOf(out.joint, drives + direction);
    }
    std::ranges::sort(out.directions);
  }
  return released;
}

template <class Space, class S>
void SelfStress<Space, S>::Measure(const Kinematics<Space, S>& kinematics) {
  for (const Loop& loop : loops_) {
    const JointState<Space, S>& state = kinematics.joints()[loop.joint];
    const Velocity<Space, S> mismatch = kinematics.ConstraintMismatch(loop.joint);
    for (int k = 0; k < state.directions(); ++k) {
      const int row = RowOf(loop, k);
      e_c_[row] = row_scale_[row] * state.D(k).dot(mismatch);
    }
  }
  for (const int child : forest_) {
    const Edge& edge = edges_[child];
    const JointState<Space, S>& state = kinematics.joints()[edge.joint];
    const Velocity<Space, S> mismatch = kinematics.ConstraintMismatch(edge.joint);
    for (int k = 0; k < state.rows(); ++k) {
      const int row = edge.D_column + k;
      e_t_[row] = column_scale_[H_ + row] * state.D(k).dot(mismatch);
    }
  }
}

template <class Space, class S>
const VectorX<S>& SelfStress<Space, S>::Feedback(const Kinematics<Space, S>& kinematics) {
  for (const Loop& loop : loops_) FillRates(kinematics, loop);
  Measure(kinematics);
  const auto J_HR = J_.topLeftCorner(r_, H_);
  const auto J_D = J_.rightCols(D_);
  // J [a; b] = e
  z_c_ = e_c_;
  if (D_ > 0) z_c_.noalias() -= J_D.lazyProduct(e_t_);
  SolveBoth(gram_, z_c_.data());
  x_.head(H_).noalias() = J_HR.transpose().lazyProduct(z_c_.head(r_));
  x_.tail(D_) = e_t_;
  // -W'^T e, by the rates of loops alone: those of J_t vanish
  z_c_.noalias() = J_rate_.lazyProduct(x_);
  along_.noalias() = W_c_.transpose().lazyProduct(z_c_);
  // z = W' W'^T e: J^T z = J'^T W (-W'^T e) and W^T z = 0
  z_c_.noalias() = W_c_.lazyProduct(along_);
  y_.noalias() = J_rate_.transpose().lazyProduct(z_c_);
  z_c_.head(r_).noalias() = J_HR.lazyProduct(y_.head(H_));
  z_c_.tail(d_).setZero();
  SolveBoth(gram_, z_c_.data());
  along_.noalias() = W_c_.transpose().lazyProduct(z_c_);
  if (D_ > 0) {
    z_t_ = y_.tail(D_);
    z_t_.noalias() -= J_D.transpose().lazyProduct(z_c_);
    along_.noalias() += W_t_.transpose().lazyProduct(z_t_);
    z_t_.noalias() -= W_t_.lazyProduct(along_);
  }
  z_c_.noalias() -= W_c_.lazyProduct(along_);
  ToRows(z_t_, z_c_, feedback_);
  return feedback_;
}

template <class Space, class S>
const VectorX<S>& SelfStress<Space, S>::ShareOfSpeeds(const Kinematics<Space, S>& kinematics) {
  for (const Loop& loop : loops_) {
    const JointState<Space, S>& state = kinematics.joints()[loop.joint];
    for (int k = state.rows(); k < state.directions(); ++k) {
      const int row = RowOf(loop, k);
      missed_[row - r_] = row_scale_[row] * state.D(k).dot(state.V_rel);
    }
  }
  return Share();
}

template <class Space, class S>
const VectorX<S>& SelfStress<Space, S>::ShareOfAccelerations(
    const Kinematics<Space, S>& kinematics, std::span<const Acceleration<Space, S>> A) {
  for (const Loop& loop : loops_) {
    const Joint<Space, S>& joint = mechanism_->joints()[loop.joint];
    if (joint.num_released == 0) continue;
    const Components<Space, S> left = JointAcceleration<Space, S>(kinematics, loop.joint, A);
    for (int k = joint.num_constraints(); k < joint.num_directions(); ++k) {
      const int row = RowOf(loop, k);
      missed_[row - r_] = row_scale_[row] * left[k] + z_c_[row];
    }
  }
  return Share();
}

template <class Space, class S>
const VectorX<S>& SelfStress<Space, S>::ForceOfStress(const VectorX<S>& lambda) {
  if (D_ > 0) return force_;
  e_c_.setZero();
  for (const Loop& loop : loops_) {
    const Joint<Space, S>& joint = mechanism_->joints()[loop.joint];
    for (int k = 0; k < joint.num_constraints(); ++k) {
      e_c_[loop.imposed + k] = lambda[joint.row + k] / row_scale_[loop.imposed + k];
    }
  }
  along_.noalias() = W_c_.transpose().lazyProduct(e_c_);
  e_c_.noalias() = W_c_.lazyProduct(along_);
  force_.noalias() = -J_.transpose().lazyProduct(e_c_);
  force_ = force_.cwiseProduct(column_scale_);
  return force_;
}

template <class Space, class S>
const VectorX<S>& SelfStress<Space, S>::Share() {
  along_.noalias() = W_c_.bottomRows(d_).transpose().lazyProduct(missed_);
  y_.tail(D_).noalias() = W_t_.lazyProduct(along_);
  e_c_.noalias() = W_c_.lazyProduct(along_);
  ToRows(y_.tail(D_), e_c_, share_);
  return share_;
}

template <class Space, class S>
void SelfStress<Space, S>::ToRows(const Eigen::Ref<const VectorX<S>>& forest,
                                  const VectorX<S>& loops, VectorX<S>& rows) const {
  for (const Loop& loop : loops_) {
    const Joint<Space, S>& joint = mechanism_->joints()[loop.joint];
    for (int k = 0; k < joint.num_constraints(); ++k) {
      rows[joint.row + k] = loops[loop.imposed + k] / row_scale_[loop.imposed + k];
    }
  }
  for (const int child : forest_) {
    const Edge& edge = edges_[child];
    const Joint<Space, S>& joint = mechanism_->joints()[edge.joint];
    for (int k = 0; k < joint.num_constraints(); ++k) {
      rows[joint.row + k] = forest[edge.D_column + k] / column_scale_[H_ + edge.D_column + k];
    }
  }
}

#define LOOPBENCH_INSTANTIATE(Space, S) template class SelfStress<Space, S>;
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
