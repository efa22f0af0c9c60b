// A level of enforcement that Loopbench does not have: between acceleration and velocity.
#pragma once

#include "mechanism/formulation/level.h"

namespace own {

using namespace loopbench;

/// Half of the violation of the speeds is removed in every evaluation.
template <class Space, class S>
class HalfVelocity final : public Level<Space, S> {
 public:
  HalfVelocity(const Mechanism<Space, S>& mechanism, const FormulationOptions&)
      : violation_(VectorX<S>::Zero(mechanism.num_rows())),
        change_(VectorX<S>::Zero(mechanism.num_u())),
        u_(change_) {}

  Outcome SetSpeeds(FactoredState<Space, S>& state,
                    const Eigen::Ref<const VectorX<S>>& carried) override {
    state.SetSpeeds(carried);
    SpeedViolation(state.kinematics(), violation_);
    const Outcome outcome = state.Correct(violation_, change_);
    if (outcome != Outcome::kFinished) return outcome;
    u_ = carried + S(0.5) * change_;
    state.SetSpeeds(u_);
    return Outcome::kFinished;
  }

 private:
  VectorX<S> violation_, change_, u_;
};

inline LevelRow HalfVelocityRow() {
  return LevelRowOf<HalfVelocity>({.name = "half-velocity",
                                   .sentence = "half of the violation of the speeds is removed.",
                                   .growth = DriftGrowth::kSquare,
                                   .abbreviation = "half"});
}

}  // namespace own
