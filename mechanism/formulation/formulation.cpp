#include "mechanism/formulation/formulation.h"

#include <algorithm>
#include <limits>

#include "mechanism/algebra/instantiate.h"

namespace loopbench {

namespace {

/// Newton converges in two or three steps from what one accepted step leaves.
constexpr int kMostProjections = 10;

/// Automatic gain of Baumgarte's stabilisation times the step. Stages are off the constraints by
/// more than steps are, and 1/h times that is an error of low order: the smaller the factor, the
/// less of it. With this one a mismatch decays within some twenty steps.
constexpr double kGainTimesStep = 0.05;

}  // namespace

template <class Space, class S>
Formulation<Space, S>::Formulation(const Mechanism<Space, S>& mechanism, FormulationOptions options)
    : mechanism_(mechanism),
      options_(options),
      kinematics_(mechanism),
      q_(VectorX<S>::Zero(mechanism.num_q())),
      u_(VectorX<S>::Zero(mechanism.num_u())),
      udot_(VectorX<S>::Zero(mechanism.num_u())) {
  if (options.enforcement == Enforcement::kPosition) {
    violation_.setZero(mechanism.num_rows());
    change_of_state_.setZero(mechanism.num_u());
    moved_.setZero(mechanism.num_q());
    step_.setZero(mechanism.num_q());
  }
  if (options.enforcement == Enforcement::kBaumgarte) {
    gains_ = options.gains.value_or(BaumgarteGains());
    violation_.setZero(mechanism.num_rows());
    feedback_ = violation_;
  }
  if (mechanism.drives().empty()) return;
  drives_ = std::make_unique<Drives<Space, S>>(mechanism);
  lambda_of_drives_.setZero(mechanism.num_rows());
}

template <class Space, class S>
Outcome Formulation<Space, S>::Start(S t, const VectorX<S>& q, const VectorX<S>& u) {
  kinematics_.SetTime(t);
  q_ = q;
  u_ = u;
  kinematics_.UpdatePosition(q_);
  kinematics_.UpdateVelocity(u_);
  kinematics_.AcceptStep();
  accepted_t_ = t;
  return Outcome::kFinished;
}

template <class Space, class S>
void Formulation<Space, S>::ToState(const VectorX<S>& q, const VectorX<S>& u,
                                    std::span<S> y) const {
  const int num_q = mechanism_.num_q();
  for (int i = 0; i < num_q; ++i) y[i] = q[i];
  for (int i = 0; i < num_state_speeds(); ++i) y[num_q + i] = u[state_speed(i)];
}

template <class Space, class S>
Outcome Formulation<Space, S>::FromState(S t, std::span<const S> y) {
  const int num_q = mechanism_.num_q();
  const bool known = at_step_end_ && kinematics_.position_version() > 0 &&
                     t == kinematics_.time() && std::equal(q_.begin(), q_.end(), y.begin());
  at_step_end_ = false;
  kinematics_.SetTime(t);
  for (int i = 0; i < num_q; ++i) q_[i] = y[i];
  for (int i = 0; i < num_state_speeds(); ++i) u_[state_speed(i)] = y[num_q + i];
  if (!known) kinematics_.UpdatePosition(q_);
  Outcome outcome = Outcome::kFinished;
  if (options_.enforcement == Enforcement::kVelocity && mechanism_.num_u() > 0) {
    outcome = CompleteSpeeds();
  }
  kinematics_.UpdateVelocity(u_);
  return outcome;
}

template <class Space, class S>
Outcome Formulation<Space, S>::Solve() {
  UpdateFeedback();
  if (mechanism_.num_u() > 0) {
    if (const Outcome outcome = Accelerations(); outcome != Outcome::kFinished) return outcome;
    if (diagnostics_.smallest_weight < 1.0) ++diagnostics_.softened_evaluations;
  }
  if (drives_ == nullptr || drives_->Followed(kinematics_, udot_, feedback_))
    return Outcome::kFinished;
  return Outcome::kInconsistentMotion;
}

template <class Space, class S>
S Formulation<Space, S>::DrivePower() {
  if (drives_ == nullptr) return S(0);
  if (mechanism_.num_u() > 0) Multipliers(lambda_of_drives_);
  return drives_->Power(kinematics_, udot_, lambda_of_drives_);
}

template <class Space, class S>
Outcome Formulation<Space, S>::Derivative(S t, std::span<const S> y, std::span<S> ydot) {
  Outcome outcome = FromState(t, y);
  if (outcome == Outcome::kFinished) outcome = Solve();
  diagnostics_.outcome = outcome;
  if (outcome != Outcome::kFinished) return outcome;
  const int num_q = mechanism_.num_q();
  mechanism_.Rates(q_, u_, Eigen::Map<VectorX<S>>(ydot.data(), num_q));
  for (int i = 0; i < num_state_speeds(); ++i) ydot[num_q + i] = udot_[state_speed(i)];
  return outcome;
}

template <class Space, class S>
Outcome Formulation<Space, S>::Evaluate(S t, const VectorX<S>& q, const VectorX<S>& u,
                                        VectorX<S>& udot) {
  at_step_end_ = false;
  kinematics_.SetTime(t);
  q_ = q;
  u_ = u;
  kinematics_.UpdatePosition(q_);
  kinematics_.UpdateVelocity(u_);
  diagnostics_.outcome = Solve();
  udot = udot_;
  return diagnostics_.outcome;
}

template <class Space, class S>
bool Formulation<Space, S>::BeginStep(S t, std::span<S> y) {
  at_step_end_ = true;
  if (FromState(t, y) != Outcome::kFinished) return false;  // the next evaluation will say why
  const bool projects = options_.enforcement == Enforcement::kPosition &&
                        mechanism_.num_rows() > 0 && mechanism_.num_u() > 0;
  if (projects && Project() != Outcome::kFinished) return false;  // likewise
  kinematics_.AcceptStep();
  const S h = t - accepted_t_;
  accepted_t_ = t;
  const bool changed_released = ChangeReleased(h), changed_gains = ChangeGains(h);
  const bool changed = ChangeMode() || changed_released || changed_gains;
  if (changed) ++diagnostics_.mode_changes;
  at_step_end_ = true;
  if (!projects && !changed) return false;
  ToState(q_, u_, y);
  return true;
}

template <class Space, class S>
void Formulation<Space, S>::PositionViolation(Correction<S>& largest) {
  largest.shift = largest.rotation = S(0);
  for (int index : mechanism_.constraints()) {
    const Joint<Space, S>& joint = mechanism_.joints()[index];
    const auto D = kinematics_.joints()[index].D();
    const Motion<Space, S> all = kinematics_.ConstraintMismatch(index);
    Motion<Space, S> constrained = Motion<Space, S>::Zero();
    for (int r = 0; r < joint.num_constraints(); ++r) {
      violation_[joint.row + r] = D.col(r).dot(all);
      constrained += D.col(r) * violation_[joint.row + r];
    }
    largest.rotation = std::max(largest.rotation, constrained.template head<Space::kRot>().norm());
    largest.shift = std::max(largest.shift, constrained.template tail<Space::kLin>().norm());
  }
}

template <class Space, class S>
void Formulation<Space, S>::SpeedViolation(VectorX<S>& violation) const {
  for (int index : mechanism_.constraints()) {
    const Joint<Space, S>& joint = mechanism_.joints()[index];
    violation.segment(joint.row, joint.num_constraints()) =
        kinematics_.ConstraintSpeed(index).head(joint.num_constraints());
  }
}

template <class Space, class S>
void Formulation<Space, S>::UpdateFeedback() {
  if (feedback_.size() == 0) return;
  Correction<S> largest;
  PositionViolation(largest);
  SpeedViolation(feedback_);
  feedback_ = S(2 * gains_.alpha) * feedback_ + S(gains_.beta * gains_.beta) * violation_;
}

template <class Space, class S>
bool Formulation<Space, S>::ChangeGains(S step) {
  if (feedback_.size() == 0 || options_.gains) return false;
  const bool still_growing = step > S(2) * longest_step_;
  longest_step_ = std::max(longest_step_, step);
  const bool fits =
      gains_.alpha > 0.0 ? S(gains_.alpha) * longest_step_ < S(2 * kGainTimesStep) : still_growing;
  if (fits || !(longest_step_ > S(0))) return false;
  gains_.alpha = gains_.beta = static_cast<double>(S(kGainTimesStep) / longest_step_);
  return true;
}

template <class Space, class S>
bool Formulation<Space, S>::ChangeReleased(S h) {
  if (kinematics_.released().empty()) return false;
  const std::vector<Released>* better = review_.Review(kinematics_, h);
  if (better == nullptr) return false;
  kinematics_.Release(*better);
  kinematics_.UpdatePosition(q_);
  kinematics_.UpdateVelocity(u_);
  return true;
}

template <class Space, class S>
Outcome Formulation<Space, S>::Project() {
  // what rounding leaves of poses that went through all bodies
  const S goal = S(4) * std::numeric_limits<S>::epsilon() * S(mechanism_.num_bodies());
  const auto size = [&](const Correction<S>& c) {
    return std::max(c.rotation, c.shift / mechanism_.length());
  };
  Correction<S> now;
  PositionViolation(now);
  correction_ = now;
  for (int i = 0; i < kMostProjections && size(now) > goal; ++i) {
    if (const Outcome outcome = Correct(violation_, change_of_state_);
        outcome != Outcome::kFinished) {
      return outcome;
    }
    const S before = size(now);
    moved_ = q_;
    mechanism_.Rates(q_, change_of_state_, step_);
    q_ += step_;
    mechanism_.Normalise(q_);
    kinematics_.UpdatePosition(q_);
    PositionViolation(now);
    ++correction_.iterations;
    if (!(size(now) < before)) {  // round-off, or a direction that is softened: as it was
      q_ = moved_;
      kinematics_.UpdatePosition(q_);
      break;
    }
  }
  kinematics_.UpdateVelocity(u_);
  SpeedViolation(violation_);
  if (const Outcome outcome = Correct(violation_, change_of_state_);
      outcome != Outcome::kFinished) {
    return outcome;
  }
  u_ += change_of_state_;
  kinematics_.UpdateVelocity(u_);
  return q_.allFinite() && u_.allFinite() ? Outcome::kFinished : Outcome::kNonFinite;
}

template <class Space, class S>
int Formulation<Space, S>::LoopRank(int dependent_rows) const {
  int user_tree_rows = 0;
  if (mechanism_.coordinates() == Coordinates::kAbsolute) {
    // every user joint is a constraint here; those of a spanning forest never depend on each other,
    // and they are what turns the speeds of free bodies into joint speeds
    user_tree_rows = mechanism_.num_u() - mechanism_.num_joint_speeds();
  }
  return mechanism_.num_rows() - user_tree_rows - dependent_rows;
}

#define LOOPBENCH_INSTANTIATE(Space, S) template class Formulation<Space, S>;
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
