#include "lagrange/lagrange.h"

#include <limits>

#include "mechanism/algebra/instantiate.h"

namespace loopbench::lagrange {

namespace {

template <class Space, class S>
std::vector<int> RowsOfConstraints(const Mechanism<Space, S>& mechanism) {
  std::vector<int> rows;
  for (int index : mechanism.constraints()) {
    rows.push_back(mechanism.joints()[index].num_constraints());
  }
  return rows;
}

}  // namespace

template <class Space, class S>
Lagrange<Space, S>::Lagrange(const Mechanism<Space, S>& mechanism, FormulationOptions options)
    : Base(mechanism, options),
      dynamics_(mechanism),
      M_(MatrixX<S>::Zero(mechanism.num_u(), mechanism.num_u())),
      J_(MatrixX<S>::Zero(mechanism.num_rows(), mechanism.num_u())),
      h_(VectorX<S>::Zero(mechanism.num_u())),
      gamma_(VectorX<S>::Zero(mechanism.num_rows())),
      lambda_(gamma_),
      force_(h_),
      target_(gamma_),
      bias_(gamma_),
      change_(h_),
      loop_(RowsOfConstraints(mechanism)) {
  const int n = mechanism.num_u(), m = mechanism.num_rows();
  if (options.solver == SolverKind::kAsPublished) {
    augmented_.setZero(n + m, n + m);
    rhs_.setZero(n + m);
    solution_.setZero(n + m);
    lu_ = Eigen::PartialPivLU<MatrixX<S>>(n + m);
  } else {
    W_.setZero(n, m);
    response_.setZero(m, m);
    mass_factor_.compute(MatrixX<S>::Identity(n, n));
  }
}

template <class Space, class S>
Outcome Lagrange<Space, S>::FactorOnce() {
  if (factored_version_ == kinematics_.position_version()) return Outcome::kFinished;
  dynamics_.Jacobian(kinematics_, J_);
  const bool plain = Base::options_.solver == SolverKind::kAsPublished;
  const Outcome outcome = plain ? FactorAugmented() : FactorResponse();
  factored_version_ = outcome == Outcome::kFinished ? kinematics_.position_version() : -1;
  return outcome;
}

template <class Space, class S>
Outcome Lagrange<Space, S>::FactorAugmented() {
  const int n = mechanism_.num_u(), m = mechanism_.num_rows();
  dynamics_.MassMatrix(kinematics_, Masses::kPhysical, M_);
  augmented_.topLeftCorner(n, n) = M_;
  augmented_.topRightCorner(n, m) = J_.transpose();
  augmented_.bottomLeftCorner(m, n) = J_;
  augmented_.bottomRightCorner(m, m).setZero();
  lu_.compute(augmented_);
  const auto pivots = lu_.matrixLU().diagonal().cwiseAbs();
  const S rcond = pivots.minCoeff() / pivots.maxCoeff();
  diagnostics_.rank = Base::LoopRank(0);
  diagnostics_.rcond = static_cast<double>(rcond);
  // a pivot below a few eps of the largest is round-off of the elimination
  return rcond > S(16) * std::numeric_limits<S>::epsilon() ? Outcome::kFinished
                                                           : Outcome::kSingular;
}

template <class Space, class S>
void Lagrange<Space, S>::FormResponse(Masses masses) {
  dynamics_.MassMatrix(kinematics_, masses, M_);
  mass_factor_.compute(M_);
  if (loop_.size() == 0) return;  // a tree: nothing is constrained
  W_ = J_.transpose();
  mass_factor_.matrixL().solveInPlace(W_);
  response_.noalias() = W_.transpose() * W_;
}

template <class Space, class S>
void Lagrange<Space, S>::SetScales(Masses masses) {
  for (int j = 0; j < static_cast<int>(mechanism_.constraints().size()); ++j) {
    loop_.SetScale(j, FreeResponse(kinematics_, masses, mechanism_.constraints()[j]));
  }
}

template <class Space, class S>
Outcome Lagrange<Space, S>::FactorResponse() {
  diagnostics_.rank = Base::LoopRank(0);
  diagnostics_.smallest_weight = 1.0;
  FormResponse(Masses::kPhysical);
  if (mass_factor_.info() != Eigen::Success) return Outcome::kNonFinite;
  if (loop_.size() == 0) return Outcome::kFinished;
  SetScales(Masses::kPhysical);
  if (!loop_.FactorScaled(response_)) {
    SetScales(Masses::kGeometric);
    FormResponse(Masses::kGeometric);
    if (!response_.allFinite()) return Outcome::kNonFinite;
    loop_.FactorGeometric(response_);
    diagnostics_.rank = Base::LoopRank(loop_.size() - loop_.rank());
    diagnostics_.smallest_weight = static_cast<double>(loop_.smallest_weight());
    FormResponse(Masses::kPhysical);
    if (!loop_.FactorSoftened(response_)) return Outcome::kSingular;
  }
  diagnostics_.rcond = static_cast<double>(loop_.rcond());
  return Outcome::kFinished;
}

template <class Space, class S>
void Lagrange<Space, S>::SolveConstrained(const VectorX<S>& force, const VectorX<S>& target,
                                          VectorX<S>& x, VectorX<S>& lambda) {
  const int n = mechanism_.num_u(), m = mechanism_.num_rows();
  if (Base::options_.solver == SolverKind::kAsPublished) {
    rhs_.head(n) = force;
    rhs_.tail(m) = target;
    solution_ = lu_.solve(rhs_);
    x = solution_.head(n);
    lambda = -solution_.tail(m);
    return;
  }
  // x = M^-1 (force + J^T lambda) with S lambda = target - J M^-1 force
  x = force;
  mass_factor_.matrixL().solveInPlace(x);
  if (m > 0) {
    lambda = target;
    lambda.noalias() -= W_.transpose() * x;
    loop_.Apply(lambda);
    loop_.ApplyTransposed(lambda);
    x.noalias() += W_ * lambda;
  }
  mass_factor_.matrixU().solveInPlace(x);
}

template <class Space, class S>
Outcome Lagrange<Space, S>::CompleteSpeeds() {
  if (const Outcome outcome = FactorOnce(); outcome != Outcome::kFinished) return outcome;
  force_.setZero();
  SpeedBias(kinematics_, force_, bias_);
  target_ = -bias_;
  target_.noalias() -= J_ * u_;
  SolveConstrained(force_, target_, change_, lambda_);
  u_ += change_;
  return u_.allFinite() ? Outcome::kFinished : Outcome::kNonFinite;
}

template <class Space, class S>
Outcome Lagrange<Space, S>::Correct(const VectorX<S>& violation, VectorX<S>& change) {
  if (const Outcome outcome = FactorOnce(); outcome != Outcome::kFinished) return outcome;
  force_.setZero();
  target_ = -violation;
  SolveConstrained(force_, target_, change, lambda_);
  return change.allFinite() ? Outcome::kFinished : Outcome::kNonFinite;
}

template <class Space, class S>
Outcome Lagrange<Space, S>::Accelerations() {
  if (const Outcome outcome = FactorOnce(); outcome != Outcome::kFinished) return outcome;
  dynamics_.Bias(kinematics_, h_);
  dynamics_.JacobianBias(kinematics_, gamma_);
  if (Base::feedback().size() > 0) gamma_ -= Base::feedback();
  force_ = -h_;
  SolveConstrained(force_, gamma_, udot_, lambda_);
  return udot_.allFinite() ? Outcome::kFinished : Outcome::kNonFinite;
}

#define LOOPBENCH_INSTANTIATE(Space, S) template class Lagrange<Space, S>;
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench::lagrange
