#include "mechanism/formulation/coupled_solver.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

#include "mechanism/algebra/instantiate.h"

namespace loopbench {

namespace {

/// Pivots of the scaled X below this are round-off of the inner solver. Mass ratios of 1e9 leave
/// pivots of 1e-9.
template <class S>
S LeastPivot() {
  return S(4096) * std::numeric_limits<S>::epsilon();
}

}  // namespace

template <class Space, class S>
CoupledSolver<Space, S>::CoupledSolver(const Mechanism<Space, S>& mechanism,
                                       std::unique_ptr<ConstraintSolver<Space, S>> inner,
                                       SolverKind kind)
    : mechanism_(mechanism),
      inner_(std::move(inner)),
      kind_(kind),
      dynamics_(mechanism),
      num_couplings_(std::ssize(mechanism.couplings())),
      rows_(VectorX<S>::Zero(mechanism.num_rows())),
      lambda_(rows_),
      lambda_change_(rows_),
      rest_(VectorX<S>::Zero(mechanism.num_u())),
      force_(rest_),
      column_(rest_),
      A_(mechanism.num_bodies(), Acceleration<Space, S>::Zero()) {
  const std::vector<Rotor<S>>& rotors = mechanism.rotors();
  const Eigen::Index rows = num_couplings_ + std::ssize(rotors);
  G_.setZero(rows, mechanism.num_u());
  Y_.setZero(mechanism.num_u(), rows);
  X_.setZero(rows, rows);
  scale_.setZero(rows);
  mu_ = left_ = yield_ = scale_;
  for (std::size_t r = 0; r < rotors.size(); ++r) {
    yield_[num_couplings_ + static_cast<Eigen::Index>(r)] = S(1) / rotors[r].inertia;
  }
  order_.resize(static_cast<std::size_t>(rows));
}

template <class Space, class S>
Outcome CoupledSolver<Space, S>::Factor(const Kinematics<Space, S>& kinematics) {
  using std::sqrt;
  rank_ = static_cast<int>(order_.size());
  const Outcome outcome = inner_->Factor(kinematics);
  this->conditioning_ = inner_->conditioning();
  if (outcome != Outcome::kFinished) return outcome;
  dynamics_.CouplingJacobian(kinematics, G_, true);
  rows_.setZero();
  for (int c = 0; c < G_.rows(); ++c) {
    force_ = G_.row(c).transpose();
    inner_->Solve(force_, rows_, column_, nullptr);
    Y_.col(c) = column_;
    const S free =
        yield_[c] + (c < num_couplings_
                         ? FreeResponseOf(kinematics, Masses::kPhysical, c)
                         : FreeResponseOfCoordinate(kinematics, Masses::kPhysical,
                                                    mechanism_.rotors()[c - num_couplings_].joint));
    scale_[c] = free > S(0) ? S(S(1) / sqrt(free)) : S(0);
  }
  rank_ = FactorResponse();
  const auto independent = std::count_if(order_.begin(), order_.begin() + rank_,
                                         [&](int row) { return row < num_couplings_; });
  this->conditioning_.rank += static_cast<int>(independent);
  const bool depends = independent < num_couplings_;
  return depends && kind_ == SolverKind::kAsPublished ? Outcome::kSingular : Outcome::kFinished;
}

template <class Space, class S>
int CoupledSolver<Space, S>::FactorResponse() {
  using std::sqrt;
  const int n = static_cast<int>(order_.size());
  X_.noalias() = G_ * Y_;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j <= i; ++j) {
      X_(i, j) = X_(j, i) = (X_(i, j) + X_(j, i)) * S(0.5) * scale_[i] * scale_[j];
    }
    X_(i, i) += yield_[i] * scale_[i] * scale_[i];
  }
  std::iota(order_.begin(), order_.end(), 0);
  for (int p = 0; p < n; ++p) {
    int best = p;
    for (int i = p + 1; i < n; ++i) {
      if (X_(i, i) > X_(best, best)) best = i;
    }
    if (!(X_(best, best) > LeastPivot<S>())) return p;
    if (best != p) {
      X_.row(p).swap(X_.row(best));
      X_.col(p).swap(X_.col(best));
      std::swap(order_[p], order_[best]);
    }
    X_(p, p) = sqrt(X_(p, p));
    for (int i = p + 1; i < n; ++i) X_(i, p) /= X_(p, p);
    for (int j = p + 1; j < n; ++j) {
      for (int i = j; i < n; ++i) {
        X_(i, j) -= X_(i, p) * X_(j, p);
        X_(j, i) = X_(i, j);
      }
    }
  }
  return n;
}

template <class Space, class S>
void CoupledSolver<Space, S>::SetTarget(const VectorX<S>& target) {
  rows_.setZero();
  left_.setZero();
  const Eigen::Index rows = std::min(target.size(), rows_.size());
  rows_.head(rows) = target.head(rows);
  if (target.size() > rows_.size()) left_.head(num_couplings_) = target.tail(num_couplings_);
}

template <class Space, class S>
void CoupledSolver<Space, S>::Couple(VectorX<S>& x) {
  left_.noalias() -= G_ * x;
  mu_.setZero();
  // L z = scaled left, then L^T z
  for (int i = 0; i < rank_; ++i) {
    S z = left_[order_[i]] * scale_[order_[i]];
    for (int j = 0; j < i; ++j) z -= X_(i, j) * mu_[order_[j]];
    mu_[order_[i]] = z / X_(i, i);
  }
  for (int i = rank_ - 1; i >= 0; --i) {
    S z = mu_[order_[i]];
    for (int j = i + 1; j < rank_; ++j) z -= X_(j, i) * mu_[order_[j]];
    mu_[order_[i]] = z / X_(i, i);
  }
  mu_ = mu_.cwiseProduct(scale_);
  x.noalias() += Y_ * mu_;
}

template <class Space, class S>
void CoupledSolver<Space, S>::PutMultipliers(VectorX<S>& lambda) {
  force_.noalias() = G_.transpose() * mu_;
  rows_.setZero();
  inner_->Solve(force_, rows_, column_, &lambda_change_);
  lambda.resize(lambda_.size() + num_couplings_);
  lambda << lambda_ + lambda_change_, mu_.head(num_couplings_);
}

template <class Space, class S>
void CoupledSolver<Space, S>::Solve(const VectorX<S>& force, const VectorX<S>& target,
                                    VectorX<S>& x, VectorX<S>* lambda) {
  SetTarget(target);
  inner_->Solve(force, rows_, x, lambda != nullptr ? &lambda_ : nullptr);
  Couple(x);
  if (lambda != nullptr) PutMultipliers(*lambda);
}

/// Without forces of inertia, left_ contains the accelerations for udot = 0, also of rotors.
template <class Space, class S>
bool CoupledSolver<Space, S>::Accelerate(const Kinematics<Space, S>& kinematics,
                                         const VectorX<S>& feedback, VectorX<S>& udot,
                                         VectorX<S>* lambda) {
  SetTarget(feedback);
  if (!inner_->Accelerate(kinematics, rows_, udot, lambda != nullptr ? &lambda_ : nullptr)) {
    return false;
  }
  dynamics_.BodyAccelerations(kinematics, rest_, A_);
  for (int c = 0; c < num_couplings_; ++c) {
    left_[c] += CouplingAcceleration<Space, S>(kinematics, c, nullptr, A_);
  }
  for (std::size_t r = 0; r < mechanism_.rotors().size(); ++r) {
    left_[num_couplings_ + static_cast<Eigen::Index>(r)] =
        CoordinateAcceleration<Space, S>(kinematics, mechanism_.rotors()[r].joint, A_);
  }
  left_ = -left_;
  Couple(udot);
  if (lambda != nullptr) PutMultipliers(*lambda);
  return true;
}

template <class Space, class S>
void CoupledSolver<Space, S>::SolveWrenches(const VectorX<S>& wrenches, VectorX<S>& x,
                                            VectorX<S>* lambda) {
  left_.setZero();
  inner_->SolveWrenches(wrenches, x, lambda != nullptr ? &lambda_ : nullptr);
  Couple(x);
  if (lambda != nullptr) PutMultipliers(*lambda);
}

template <class Space, class S>
void CoupledSolver<Space, S>::Correct(const VectorX<S>& target, VectorX<S>& x) {
  SetTarget(target);
  inner_->Correct(rows_, x);
  Couple(x);
}

template <class Space, class S>
std::string CoupledSolver<Space, S>::WhySingular() const {
  const std::string why = inner_->WhySingular();
  if (!why.empty()) return why;
  std::string names;
  for (std::size_t i = static_cast<std::size_t>(rank_); i < order_.size(); ++i) {
    if (order_[i] >= mechanism_.num_coordinate_couplings()) continue;
    names += (names.empty() ? "\"" : ", \"") +
             mechanism_.couplings()[static_cast<std::size_t>(order_[i])].name + '"';
  }
  return names.empty() ? "" : "coupling " + names + " depends on the other constraints";
}

#define LOOPBENCH_INSTANTIATE(Space, S) template class CoupledSolver<Space, S>;
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
