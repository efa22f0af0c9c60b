// Steps of level projection: Newton's method on positions, then a step on speeds.
#pragma once

#include "mechanism/formulation/factored_state.h"

namespace loopbench {

/// Steps from the state's positions and speeds, evaluated by the library.
template <class Space, class S>
class LibrarySteps {
 public:
  explicit LibrarySteps(const Mechanism<Space, S>& mechanism)
      : violation_(VectorX<S>::Zero(mechanism.num_equations())),
        change_(VectorX<S>::Zero(mechanism.num_u())),
        q_(VectorX<S>::Zero(mechanism.num_q())),
        moved_(q_),
        step_(q_),
        u_(change_) {}
  bool has_constraints() const { return violation_.size() > 0 && change_.size() > 0; }

  /// The largest violations of positions.
  Outcome Measure(FactoredState<Space, S>& state, Correction<S>& now) {
    PositionViolation(state.kinematics(), violation_, now);
    return Outcome::kFinished;
  }
  /// A Newton step, after Measure().
  Outcome Step(FactoredState<Space, S>& state) {
    if (const Outcome outcome = state.Correct(violation_, change_); outcome != Outcome::kFinished) {
      return outcome;
    }
    q_ = state.q();
    state.mechanism().Rates(q_, change_, step_);
    moved_ = q_ + step_;
    state.mechanism().Normalise(moved_);
    state.SetPositions(moved_);
    return Outcome::kFinished;
  }
  void Undo(FactoredState<Space, S>& state) { state.SetPositions(q_); }
  Outcome CorrectSpeeds(FactoredState<Space, S>& state) {
    state.SetSpeeds(state.u());
    SpeedViolation(state.kinematics(), violation_);
    if (const Outcome outcome = state.Correct(violation_, change_); outcome != Outcome::kFinished) {
      return outcome;
    }
    u_ = state.u() + change_;
    state.SetSpeeds(u_);
    return Outcome::kFinished;
  }

 private:
  VectorX<S> violation_, change_, q_, moved_, step_, u_;
};

}  // namespace loopbench
