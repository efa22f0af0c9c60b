// Level velocity: speeds of the state are projected inside the right-hand side, or completed where
// the state carries independent ones only. A state that carries all speeds gets the projected ones
// after each accepted step: the difference of the two would grow exponentially.
#include "mechanism/algebra/instantiate.h"
#include "mechanism/formulation/level.h"

namespace loopbench {

namespace {

template <class Space, class S>
class VelocityLevel final : public Level<Space, S> {
 public:
  explicit VelocityLevel(const Mechanism<Space, S>& mechanism)
      : u_(VectorX<S>::Zero(mechanism.num_u())),
        change_(u_),
        violation_(VectorX<S>::Zero(mechanism.num_equations())) {
    this->changes_speeds_ = true;
    this->right_hand_side_ = SpeedsUsed::kCompleted;
  }

  Outcome SetSpeeds(FactoredState<Space, S>& state,
                    const Eigen::Ref<const VectorX<S>>& carried) override {
    if (const std::vector<int>* speeds = state.solver().CarriedSpeeds()) {
      for (Eigen::Index i = 0; i < carried.size(); ++i) u_[(*speeds)[i]] = carried[i];
    } else {
      u_ = carried;
    }
    const Outcome outcome = u_.size() > 0 ? Complete(state) : Outcome::kFinished;
    state.SetSpeeds(u_);
    return outcome;
  }

  Accepted Accept(FactoredState<Space, S>& state, S) override {
    const bool carries_all = state.solver().CarriedSpeeds() == nullptr;
    return carries_all && violation_.size() > 0 ? Accepted::kProjected : Accepted::kAsItWas;
  }

 private:
  Outcome Complete(FactoredState<Space, S>& state) {
    if (const Outcome outcome = state.Factor(); outcome != Outcome::kFinished) return outcome;
    if (!state.solver().CompleteSpeeds(state.kinematics(), u_)) {
      state.SetSpeeds(u_);
      SpeedViolation(state.kinematics(), violation_);
      if (const Outcome outcome = state.Correct(violation_, change_);
          outcome != Outcome::kFinished) {
        return outcome;
      }
      u_ += change_;
    }
    state.ShareSpeeds(u_);
    return u_.allFinite() ? Outcome::kFinished : Outcome::kNonFinite;
  }

  VectorX<S> u_, change_, violation_;
};

}  // namespace

template <class Space, class S>
std::unique_ptr<Level<Space, S>> MakeVelocityLevel(const Mechanism<Space, S>& mechanism,
                                                   const FormulationOptions&) {
  return std::make_unique<VelocityLevel<Space, S>>(mechanism);
}

#define LOOPBENCH_INSTANTIATE(Space, S)                                                   \
  template std::unique_ptr<Level<Space, S>> MakeVelocityLevel(const Mechanism<Space, S>&, \
                                                              const FormulationOptions&);
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
