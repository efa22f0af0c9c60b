#include "mechanism/formulation/passage.h"

#include <algorithm>
#include <cmath>

#include "mechanism/algebra/instantiate.h"

namespace loopbench {

namespace {

/// Positions that show a passage at a distance are this far away [rad, or mechanism lengths, of the
/// fastest body], ten widths of regularization.
constexpr double kBeside = 2e-3;
/// Distance of the nearest positions with forces, in these units: smooth forces err by 1e-9. Other
/// forces use kBeside at least, and up to kFar if nearer positions are regularized.
constexpr double kNear = 8e-3, kFar = 4e-2;
/// Share of the force, or of applied forces if more, by which interpolations with all and with
/// fewer pairs differ at most if it is smooth.
constexpr double kRough = 1e-6;
/// Weights of regular positions: regularization changes forces by a millionth at most.
constexpr double kRegularWeight = 1.0 - 1e-6;
/// Change of the direction of motion within 2 kBeside. On a smooth branch it is of the size of
/// kBeside^2; beyond the turning point of a hyperbola it is of the size of one.
constexpr double kTurned = 0.02;
/// Least eigenvalue of regular positions, as a share of kRegularization. The parabola through three
/// positions at a distance of kBeside has an error of some kBeside^3, 8e-9.
constexpr double kPassed = 0.25;
/// Eigenvalues up to six times this have weights below 1.
constexpr double kProbe = 1e-4;

/// Inverse of the weight in direction_weights.h.
double EigenvalueOf(double weight, double share) {
  return share * std::sqrt(-std::log1p(-std::min(weight, 1.0 - 1e-16)));
}

}  // namespace

template <class Space, class S>
Passage<Space, S>::Passage(const Mechanism<Space, S>& mechanism, ConstraintSolver<Space, S>& solver)
    : solver_(solver),
      state_(mechanism, solver),
      projection_(MakeLevel(mechanism, FormulationOptions{.enforcement = Enforcement::kPosition})),
      dynamics_(mechanism),
      rates_(VectorX<S>::Zero(mechanism.num_q())),
      curve_(rates_),
      there_(rates_),
      moved_(rates_),
      udot_(VectorX<S>::Zero(mechanism.num_u())),
      force_(VectorX<S>::Zero(solver.TakesWrenches() ? Space::kDim * mechanism.num_bodies()
                                                     : mechanism.num_u())),
      change_(force_),
      rows_(VectorX<S>::Zero(mechanism.num_equations())),
      nothing_(rows_) {
  means_.fill(force_);
}

template <class Space, class S>
bool Passage<Space, S>::Move(const Kinematics<Space, S>& at, S step) {
  there_ = at.q() + step * (rates_ + step * curve_);
  at.mechanism().Normalise(there_);
  state_.kinematics().SetTime(at.time() + step);
  state_.kinematics().CountTurnsLike(at);
  state_.SetPositions(there_);
  state_.SetSpeeds(at.u());
  return projection_->Accept(state_, S(0)) != Accepted::kFailed &&
         state_.Factor() == Outcome::kFinished;
}

template <class Space, class S>
S Passage<Space, S>::LeastEigenvalue() {
  state_.kinematics().SetRegularization(kProbe);
  state_.ForgetFactors();
  const bool known = state_.Factor() == Outcome::kFinished;
  state_.kinematics().SetRegularization(kRegularization);
  state_.ForgetFactors();
  return known ? S(EigenvalueOf(solver_.conditioning().smallest_weight, kProbe)) : S(0);
}

template <class Space, class S>
Nearby Passage<Space, S>::Judge(const Kinematics<Space, S>& at, S least, S step) {
  curve_.setZero();
  const bool may_pass = least > S(kPassed * kRegularization);
  if (!Move(at, -step)) return Nearby::kUnknown;
  moved_ = state_.q() - there_;
  const S before = may_pass ? LeastEigenvalue() : S(0);
  if (!Move(at, step)) return Nearby::kUnknown;
  curve_ = state_.q() - there_;
  if ((curve_ - moved_).norm() > S(2 * kTurned) * step * rates_.norm()) return Nearby::kRegular;
  curve_ = (curve_ + moved_) / (S(2) * step * step);
  if (!may_pass) return Nearby::kOneBranch;
  const S after = LeastEigenvalue();
  // the lowest value of the parabola through the three
  const S bend = (before + after) / S(2) - least, slope = (after - before) / S(2);
  const S lowest = bend > S(0) ? least - slope * slope / (S(4) * bend) : least;
  return lowest > S(kPassed * kRegularization) ? Nearby::kRegular : Nearby::kOneBranch;
}

/// M udot + h of the accelerations there, or body by body.
template <class Space, class S>
bool Passage<Space, S>::FindForce(VectorX<S>& force) {
  if (solver_.conditioning().smallest_weight < kRegularWeight) return false;
  if (!solver_.Accelerate(state_.kinematics(), VectorX<S>(), udot_, nullptr)) {
    dynamics_.Bias(state_.kinematics(), force);
    dynamics_.JacobianBias(state_.kinematics(), rows_);
    force = -force;
    solver_.Solve(force, rows_, udot_, nullptr);
  }
  if (solver_.TakesWrenches()) {
    const auto wrenches = dynamics_.WrenchesLeft(state_.kinematics(), udot_, nothing_);
    for (std::size_t body = 1; body < wrenches.size(); ++body) {
      const auto first = static_cast<Eigen::Index>(body) * Space::kDim;
      for (int d = 0; d < Space::kDim; ++d) force[first + d] = wrenches[body][d];
    }
  } else {
    dynamics_.Residual(state_.kinematics(), udot_, nothing_, force, rows_);
  }
  return force.allFinite();
}

template <class Space, class S>
bool Passage<Space, S>::Interpolate(const Kinematics<Space, S>& at, S step) {
  constexpr double kParts[kPairs][kPairs] = {{1.0}, {4.0 / 3.0, -1.0 / 3.0}, {1.5, -0.6, 0.1}};
  int pairs = 0;
  for (; pairs < kPairs; ++pairs) {
    const S far = S(pairs + 1) * step;
    VectorX<S>& mean = means_[static_cast<std::size_t>(pairs)];
    if (!Move(at, -far) || !FindForce(mean) || !Move(at, far) || !FindForce(change_)) break;
    mean = (mean + change_) / S(2);
  }
  if (pairs == 0) return false;
  const auto sum = [&](int count, VectorX<S>& force) {
    force.setZero();
    for (int k = 0; k < count; ++k) {
      force += S(kParts[count - 1][k]) * means_[static_cast<std::size_t>(k)];
    }
  };
  sum(pairs, force_);
  sum(kPairs - 1, change_);
  const S difference = (change_ - force_).norm();
  dynamics_.Bias(state_.kinematics(), udot_);
  is_smooth_ = pairs == kPairs && difference < S(kRough) * std::max(force_.norm(), udot_.norm());
  return true;
}

template <class Space, class S>
Nearby Passage<Space, S>::Look(const Kinematics<Space, S>& at) {
  const Mechanism<Space, S>& mechanism = at.mechanism();
  const S least = S(EigenvalueOf(solver_.conditioning().smallest_weight, at.regularization()));
  S speed = S(0);
  for (const Velocity<Space, S>& V : at.motions()) {
    speed = std::max({speed, S(V.angular.norm()), S(V.linear.norm() / mechanism.length())});
  }
  if (!(speed > S(0))) return Nearby::kUnknown;
  mechanism.Rates(at.q(), at.u(), rates_);
  state_.Follow(at);  // measured angles continue from the same step
  state_.kinematics().SetRegularization(kRegularization);
  state_.ForgetFactors();
  const Nearby beside = Judge(at, least, S(kBeside) / speed);
  if (beside != Nearby::kOneBranch) return beside;
  bool is_known = false;
  for (double side = kNear; side >= kBeside; side /= 2.0) {
    is_known = Interpolate(at, S(side) / speed) || is_known;
    if (!is_known || !is_smooth_) continue;
    is_smooth_ = side == kNear;
    return beside;
  }
  for (double side = 2.0 * kNear; !is_known && side < kFar; side *= 2.0) {
    is_known = Interpolate(at, S(side) / speed);
  }
  is_smooth_ = false;
  return is_known ? beside : Nearby::kUnknown;
}

#define LOOPBENCH_INSTANTIATE(Space, S) template class Passage<Space, S>;
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
