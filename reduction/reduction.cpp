#include "reduction/reduction.h"

#include <Eigen/QR>
#include <algorithm>
#include <limits>
#include <numeric>

#include "mechanism/loop_solver.h"

namespace loopbench::reduction {

namespace {

std::vector<int> Complement(const std::vector<int>& chosen, int n) {
  std::vector<int> rest;
  for (int i = 0; i < n; ++i) {
    if (std::ranges::find(chosen, i) == chosen.end()) rest.push_back(i);
  }
  return rest;
}

/// The first `rank` pivots of a column-pivoted QR, ascending.
template <class QR>
std::vector<int> FirstPivots(const QR& qr, int rank) {
  std::vector<int> pivots(rank);
  for (int i = 0; i < rank; ++i) pivots[i] = static_cast<int>(qr.colsPermutation().indices()[i]);
  std::ranges::sort(pivots);
  return pivots;
}

}  // namespace

template <class Space, class S>
Reduction<Space, S>::Reduction(const Mechanism<Space, S>& mechanism, FormulationOptions options)
    : Base(mechanism, options),
      dynamics_(mechanism),
      M_(MatrixX<S>::Zero(mechanism.num_u(), mechanism.num_u())),
      J_(MatrixX<S>::Zero(mechanism.num_rows(), mechanism.num_u())),
      h_(VectorX<S>::Zero(mechanism.num_u())),
      gamma_(VectorX<S>::Zero(mechanism.num_rows())),
      c_(h_),
      residual_(h_) {}

template <class Space, class S>
Outcome Reduction<Space, S>::Start(const VectorX<S>& q, const VectorX<S>& u) {
  Base::Start(q, u);
  dynamics_.Jacobian(kinematics_, J_);
  const int n = mechanism_.num_u(), m = mechanism_.num_rows();
  const bool fixed = Base::options_.solver == SolverKind::kAsPublished;
  // as published knows no redundancy: as many dependent speeds as constraints
  const int rank = fixed ? std::min(m, n) : GeometricRank();
  Partition partition = BestPartition(rank);
  if (fixed) {
    const std::vector<int>& wanted = mechanism_.independent();
    if (static_cast<int>(wanted.size()) == n - rank) partition.dependent = Complement(wanted, n);
    partition.rows.resize(m);
    std::iota(partition.rows.begin(), partition.rows.end(), 0);
  }
  SetPartition(partition);
  return Outcome::kFinished;
}

template <class Space, class S>
int Reduction<Space, S>::num_state_speeds() const {
  const bool velocity = Base::options_.enforcement == Enforcement::kVelocity;
  return velocity ? static_cast<int>(independent_.size()) : mechanism_.num_u();
}

template <class Space, class S>
int Reduction<Space, S>::state_speed(int i) const {
  return Base::options_.enforcement == Enforcement::kVelocity ? independent_[i] : i;
}

template <class Space, class S>
int Reduction<Space, S>::GeometricRank() {
  std::vector<int> rows;
  for (int index : mechanism_.constraints()) {
    rows.push_back(mechanism_.joints()[index].kind->num_constraints());
  }
  LoopSolver<S> loop(rows);
  if (loop.size() == 0) return 0;
  for (int j = 0; j < static_cast<int>(rows.size()); ++j) {
    loop.SetScale(
        j, FreeResponse(kinematics_, mechanism_.geometric_bodies(), mechanism_.constraints()[j]));
  }
  MatrixX<S> M;
  dynamics_.MassMatrix(kinematics_, mechanism_.geometric_bodies(), M);
  const MatrixX<S> response = J_ * M.llt().solve(J_.transpose());
  loop.FactorGeometric(response);
  return loop.rank();
}

template <class Space, class S>
typename Reduction<Space, S>::Partition Reduction<Space, S>::BestPartition(int rank) const {
  using std::abs;
  Partition partition;
  if (rank == 0) return partition;
  partition.dependent = FirstPivots(Eigen::ColPivHouseholderQR<MatrixX<S>>(J_), rank);
  MatrixX<S> transposed(rank, J_.rows());
  for (int i = 0; i < rank; ++i) transposed.row(i) = J_.col(partition.dependent[i]).transpose();
  const Eigen::ColPivHouseholderQR<MatrixX<S>> qr(transposed);
  partition.rows = FirstPivots(qr, rank);
  partition.rcond = abs(qr.matrixQR()(rank - 1, rank - 1)) / abs(qr.matrixQR()(0, 0));
  return partition;
}

template <class Space, class S>
void Reduction<Space, S>::SetPartition(const Partition& partition) {
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
  dependent_speeds_.setZero(r);
  independent_speeds_.setZero(f);
  lu_ = Eigen::PartialPivLU<MatrixX<S>>(r);
  reduced_factor_ = Eigen::LLT<MatrixX<S>>(f);
  factored_version_ = -1;
}

template <class Space, class S>
Outcome Reduction<Space, S>::FactorOnce() {
  if (factored_version_ == kinematics_.position_version()) return Outcome::kFinished;
  const int r = static_cast<int>(dependent_.size());
  diagnostics_.rank = Base::LoopRank(mechanism_.num_rows() - r);
  diagnostics_.rcond = 0.0;
  if (static_cast<int>(rows_.size()) > r) return Outcome::kSingular;  // redundant, as published
  dynamics_.Jacobian(kinematics_, J_);
  for (int k = 0; k < r; ++k) {
    for (int i = 0; i < r; ++i) J_D_(k, i) = J_(rows_[k], dependent_[i]);
    for (int i = 0; i < J_I_.cols(); ++i) J_I_(k, i) = J_(rows_[k], independent_[i]);
  }
  S rcond = S(1);
  if (r > 0) {
    lu_.compute(J_D_);
    // Eigen's estimate is meaningless behind an exactly zero pivot
    const bool lost_pivot = (lu_.matrixLU().diagonal().array() == S(0)).any();
    rcond = lost_pivot ? S(0) : lu_.rcond();
  }
  diagnostics_.rcond = static_cast<double>(rcond);
  // below a few eps the matrix cannot be told from a singular one
  if (!(rcond > S(16) * std::numeric_limits<S>::epsilon())) return Outcome::kSingular;
  if (r > 0) solved_ = lu_.solve(J_I_);
  for (int i = 0; i < J_I_.cols(); ++i) B_(independent_[i], i) = S(1);
  for (int k = 0; k < r; ++k) B_.row(dependent_[k]) = -solved_.row(k);
  factored_version_ = kinematics_.position_version();
  return Outcome::kFinished;
}

template <class Space, class S>
Outcome Reduction<Space, S>::CompleteSpeeds() {
  if (const Outcome outcome = FactorOnce(); outcome != Outcome::kFinished) return outcome;
  for (std::size_t i = 0; i < independent_.size(); ++i) {
    independent_speeds_[i] = u_[independent_[i]];
  }
  u_.noalias() = B_ * independent_speeds_;
  return Outcome::kFinished;
}

template <class Space, class S>
Outcome Reduction<Space, S>::Accelerations() {
  if (const Outcome outcome = FactorOnce(); outcome != Outcome::kFinished) return outcome;
  dynamics_.MassMatrix(kinematics_, mechanism_.bodies(), M_);
  dynamics_.Bias(kinematics_, h_);
  dynamics_.JacobianBias(kinematics_, gamma_);
  c_.setZero();
  if (!dependent_.empty()) {
    for (std::size_t k = 0; k < rows_.size(); ++k) rows_rhs_[k] = gamma_[rows_[k]];
    dependent_speeds_ = lu_.solve(rows_rhs_);
    for (std::size_t k = 0; k < dependent_.size(); ++k) c_[dependent_[k]] = dependent_speeds_[k];
  }
  residual_ = h_;
  residual_.noalias() += M_ * c_;
  MB_.noalias() = M_ * B_;
  reduced_.noalias() = B_.transpose() * MB_;
  reduced_factor_.compute(reduced_);
  independent_speeds_.noalias() = -(B_.transpose() * residual_);
  reduced_factor_.solveInPlace(independent_speeds_);
  udot_ = c_;
  udot_.noalias() += B_ * independent_speeds_;
  return udot_.allFinite() ? Outcome::kFinished : Outcome::kNonFinite;
}

template <class Space, class S>
bool Reduction<Space, S>::ChangeMode() {
  if (Base::options_.solver == SolverKind::kAsPublished || dependent_.empty()) return false;
  dynamics_.Jacobian(kinematics_, J_);
  const Partition best = BestPartition(static_cast<int>(dependent_.size()));
  MatrixX<S> current(rows_.size(), dependent_.size());
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    for (std::size_t i = 0; i < dependent_.size(); ++i) {
      current(k, i) = J_(rows_[k], dependent_[i]);
    }
  }
  const Eigen::ColPivHouseholderQR<MatrixX<S>> qr(current);
  const auto pivots = qr.matrixQR().diagonal().cwiseAbs();
  if (pivots.minCoeff() >= S(kReplaceBelow) * best.rcond * pivots.maxCoeff()) return false;
  SetPartition(best);
  return true;
}

template class Reduction<Planar, double>;
template class Reduction<Spatial, double>;

}  // namespace loopbench::reduction
