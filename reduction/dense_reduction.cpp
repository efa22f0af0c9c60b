// Equations (1) to (3) are in dense_reduction.h. Rows of J are components along D of the cut joints
// at Mo, in ground axes; columns belong to the speeds of the forest.
#include "reduction/dense_reduction.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "mechanism/algebra/instantiate.h"

namespace loopbench::reduction {

namespace {

std::vector<int> Complement(const std::vector<int>& chosen, int n) {
  std::vector<int> rest;
  for (int i = 0; i < n; ++i) {
    if (std::ranges::find(chosen, i) == chosen.end()) rest.push_back(i);
  }
  return rest;
}

}  // namespace

template <class Space, class S>
DenseReduction<Space, S>::DenseReduction(const Mechanism<Space, S>& mechanism,
                                         const FormulationOptions& options)
    : mechanism_(mechanism),
      kind_(options.solver),
      at_velocity_(options.enforcement == Enforcement::kVelocity),
      dynamics_(mechanism),
      M_(MatrixX<S>::Zero(mechanism.num_u(), mechanism.num_u())),
      J_(MatrixX<S>::Zero(mechanism.num_rows(), mechanism.num_u())),
      zero_(VectorX<S>::Zero(mechanism.num_u())),
      c_(zero_),
      residual_(zero_),
      bias_(VectorX<S>::Zero(mechanism.num_rows())),
      speed_scale_(VectorX<S>::Ones(mechanism.num_u())) {
  for (const Joint<Space, S>& joint : mechanism.joints()) {
    for (int i = 0, u = joint.u_offset; i < (joint.in_tree() ? joint.kind->num_u : 0); ++i) {
      if (mechanism.DriveOf(joint, i) >= 0) continue;
      const bool turns = joint.kind->axes[i] < Space::kRot;
      if (turns) speed_scale_[u] = S(1) / mechanism.length();
      ++u;
    }
  }
  if (kind_ == SolverKind::kRankRevealing && !at_velocity_ && mechanism.num_rows() > 0) {
    null_space_ = std::make_unique<NullSpace<Space, S>>(mechanism);
  }
}

template <class Space, class S>
void DenseReduction<Space, S>::Start(const Kinematics<Space, S>& kinematics) {
  dynamics_.Jacobian(kinematics, J_);
  const int n = mechanism_.num_u(), m = mechanism_.num_rows();
  const bool fixed = kind_ == SolverKind::kAsPublished;
  // as published ignores redundancy: as many dependent speeds as constraints
  const int rank = fixed ? std::min(m, n) : GeometricRank(kinematics, dynamics_, J_);
  Partition<S> partition = BestPartition(J_, rank);
  if (fixed) {
    const std::vector<int>& wanted = mechanism_.independent();
    if (static_cast<int>(wanted.size()) == n - rank) partition.dependent = Complement(wanted, n);
    partition.rows.resize(m);
    std::iota(partition.rows.begin(), partition.rows.end(), 0);
  }
  SetPartition(partition);
}

template <class Space, class S>
void DenseReduction<Space, S>::SetPartition(const Partition<S>& partition) {
  const int n = mechanism_.num_u();
  dependent_ = partition.dependent;
  rows_ = partition.rows;
  independent_ = Complement(dependent_, n);
  const int r = static_cast<int>(dependent_.size()), f = n - r;
  J_D_.setZero(rows_.size(), r);
  J_I_.setZero(rows_.size(), f);
  solved_.setZero(r, f);
  B_.setZero(n, f);
  MB_.setZero(n, f);
  reduced_.setZero(f, f);
  rows_rhs_.setZero(rows_.size());
  independent_speeds_.setZero(f);
  pivot_scale_.setZero(r);
  for (int k = 0; k < r; ++k) pivot_scale_[k] = speed_scale_[dependent_[k]];
  lu_ = PivotedLu<S>(r);
  if (f > 0) reduced_factor_.compute(MatrixX<S>::Identity(f, f).eval());
}

/// J_D and J_I of (1) from the chosen rows and columns of J.
template <class Space, class S>
S DenseReduction<Space, S>::FactorDependencies() {
  const int r = static_cast<int>(dependent_.size());
  if (r == 0) return S(1);
  for (int k = 0; k < r; ++k) {
    for (int i = 0; i < r; ++i) J_D_(k, i) = J_(rows_[k], dependent_[i]);
    for (int i = 0; i < J_I_.cols(); ++i) J_I_(k, i) = J_(rows_[k], independent_[i]);
  }
  lu_.Factor(J_D_);
  return lu_.PivotRatio(&pivot_scale_);
}

template <class Space, class S>
void DenseReduction<Space, S>::FactorNullSpace(const Kinematics<Space, S>& kinematics) {
  null_space_->Factor(kinematics, dynamics_, J_);
  uses_null_space_ = true;
  Conditioning& found = this->conditioning_;
  found.rank = LoopRank(mechanism_, mechanism_.num_rows() - null_space_->rank());
  found.rcond = static_cast<double>(null_space_->rcond());
  found.smallest_weight = static_cast<double>(null_space_->smallest_weight());
  found.is_regularized = null_space_->smallest_weight() < S(1);
}

template <class Space, class S>
bool DenseReduction<Space, S>::FactorPartition(const Kinematics<Space, S>& kinematics) {
  const int r = static_cast<int>(dependent_.size());
  Conditioning& found = this->conditioning_;
  found.rank = LoopRank(mechanism_, mechanism_.num_rows() - r);
  found.rcond = 0.0;
  found.smallest_weight = 1.0;
  found.is_regularized = false;
  kinematics_ = &kinematics;
  uses_null_space_ = mass_is_current_ = false;
  // more rows than dependent speeds: redundant constraints, as published; or a rank that has grown
  const bool fits = static_cast<int>(rows_.size()) == r && !outgrown_;
  if (!fits && !null_space_) return false;
  dynamics_.Jacobian(kinematics, J_);
  // omitted rows stay omitted at regular positions, too
  if (null_space_ && r != mechanism_.num_rows()) return false;
  const S rcond = FactorDependencies();
  found.rcond = static_cast<double>(rcond);
  // a pivot below a few eps of the largest is round-off of the elimination
  const S least = null_space_ ? S(kSuspicious) : S(16) * std::numeric_limits<S>::epsilon();
  if (!(rcond >= least)) return false;
  // B of (2), in the order of u
  solved_ = J_I_;
  lu_.Solve(solved_);
  for (int i = 0; i < J_I_.cols(); ++i) B_(independent_[i], i) = S(1);
  for (int k = 0; k < r; ++k) B_.row(dependent_[k]) = -solved_.row(k);
  return true;
}

template <class Space, class S>
Outcome DenseReduction<Space, S>::Factor(const Kinematics<Space, S>& kinematics) {
  if (FactorPartition(kinematics)) return Outcome::kFinished;
  if (null_space_ == nullptr) return Outcome::kSingular;
  FactorNullSpace(kinematics);
  return Outcome::kFinished;
}

/// B^T M B of (3) = R R^T.
template <class Space, class S>
void DenseReduction<Space, S>::FactorMass() {
  if (mass_is_current_) return;
  mass_is_current_ = true;
  dynamics_.MassMatrix(*kinematics_, Masses::kPhysical, M_);
  if (uses_null_space_ || independent_.empty()) return;
  MB_.noalias() = M_ * B_;
  reduced_.noalias() = B_.transpose() * MB_;
  reduced_factor_.compute(reduced_);
}

/// (1): u = B u_I, less J_D^-1 b where motions are prescribed.
template <class Space, class S>
bool DenseReduction<Space, S>::CompleteSpeeds(Kinematics<Space, S>& kinematics, VectorX<S>& u) {
  for (std::size_t i = 0; i < independent_.size(); ++i) {
    independent_speeds_[i] = u[independent_[i]];
  }
  u.noalias() = B_ * independent_speeds_;
  if (mechanism_.drives().empty() || dependent_.empty()) return true;
  SpeedBias(kinematics, zero_, bias_);
  for (std::size_t k = 0; k < rows_.size(); ++k) rows_rhs_[k] = bias_[rows_[k]];
  lu_.Solve(rows_rhs_);
  for (std::size_t k = 0; k < dependent_.size(); ++k) u[dependent_[k]] -= rows_rhs_[k];
  return true;
}

template <class Space, class S>
void DenseReduction<Space, S>::Dependent(const VectorX<S>& target, VectorX<S>& x) {
  x.setZero();
  if (dependent_.empty()) return;
  for (std::size_t k = 0; k < rows_.size(); ++k) rows_rhs_[k] = target[rows_[k]];
  lu_.Solve(rows_rhs_);
  for (std::size_t k = 0; k < dependent_.size(); ++k) x[dependent_[k]] = rows_rhs_[k];
}

template <class Space, class S>
void DenseReduction<Space, S>::Correct(const VectorX<S>& target, VectorX<S>& x) {
  if (!uses_null_space_) return Dependent(target, x);
  ConstraintSolver<Space, S>::Correct(target, x);
}

/// Solves (2) and (3) with `force` instead of -h: B^T M B z = B^T (force - M c), x = B z + c.
template <class Space, class S>
void DenseReduction<Space, S>::Solve(const VectorX<S>& given, const VectorX<S>& target,
                                     VectorX<S>& x, VectorX<S>* lambda) {
  FactorMass();
  const VectorX<S>& force = given.size() > 0 ? given : zero_;
  if (uses_null_space_) {
    residual_ = -force;
    if (!null_space_->Accelerate(M_, residual_, target, x)) {
      x.setConstant(std::numeric_limits<S>::quiet_NaN());
    }
  } else {
    Dependent(target, c_);
    x = c_;
    if (!independent_.empty()) {
      residual_ = force;
      residual_.noalias() -= M_ * c_;
      independent_speeds_.noalias() = B_.transpose() * residual_;
      reduced_factor_.solveInPlace(independent_speeds_);
      x.noalias() += B_ * independent_speeds_;
    }
  }
  if (lambda != nullptr) SolveForces(force, x, *lambda);
}

/// Solves the dependent equations of motion: J_D^T lambda = (M x - force)_D, zero for unused rows.
template <class Space, class S>
void DenseReduction<Space, S>::SolveForces(const VectorX<S>& force, const VectorX<S>& x,
                                           VectorX<S>& lambda) {
  residual_ = -force;
  residual_.noalias() += M_ * x;
  if (uses_null_space_) {
    null_space_->Multipliers(residual_, lambda);
    return;
  }
  lambda.setZero();
  if (dependent_.empty()) return;
  for (std::size_t k = 0; k < dependent_.size(); ++k) rows_rhs_[k] = residual_[dependent_[k]];
  lu_.SolveTransposed(rows_rhs_);
  for (std::size_t k = 0; k < rows_.size(); ++k) lambda[rows_[k]] = rows_rhs_[k];
}

template <class Space, class S>
bool DenseReduction<Space, S>::Review(const Kinematics<Space, S>& kinematics) {
  if (kind_ == SolverKind::kAsPublished || J_.rows() == 0) return false;
  dynamics_.Jacobian(kinematics, J_);
  const int rank = GeometricRank(kinematics, dynamics_, J_);
  if (null_space_ && rank != static_cast<int>(dependent_.size())) {
    SetPartition(BestPartition(J_, rank));
    return true;
  }
  // after a singular start, the partition omits constraints that are independent again
  outgrown_ = rank > static_cast<int>(dependent_.size());
  if (outgrown_ || dependent_.empty()) return false;
  const Partition<S> best = BestPartition(J_, static_cast<int>(dependent_.size()));
  const S current = PartitionCondition(J_, {dependent_, rows_, S(1)});
  if (current >= S(kReplaceBelow) * best.rcond) return false;
  SetPartition(best);
  return true;
}

template <class Space, class S>
void DenseReduction<Space, S>::AppendMode(std::vector<int>& mode) const {
  mode.push_back(outgrown_);
  mode.insert(mode.end(), dependent_.begin(), dependent_.end());
  mode.push_back(-1);
  mode.insert(mode.end(), rows_.begin(), rows_.end());
}

template <class Space, class S>
void DenseReduction<Space, S>::TakeMode(std::span<const int> mode) {
  const auto end = std::ranges::find(mode, -1);
  SetPartition({{mode.begin() + 1, end}, {end + 1, mode.end()}, S(1)});
  outgrown_ = mode.front() != 0;
}

#define LOOPBENCH_INSTANTIATE(Space, S) template class DenseReduction<Space, S>;
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench::reduction
