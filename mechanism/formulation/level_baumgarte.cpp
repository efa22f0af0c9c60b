// Level baumgarte: violations of positions and speeds return as constraint accelerations.
#include <algorithm>

#include "mechanism/algebra/instantiate.h"
#include "mechanism/formulation/level.h"

namespace loopbench {

namespace {

/// Automatic gain of Baumgarte stabilisation times the step. Stages violate the constraints more
/// than steps do, and 1/h times that is an error of low order, which grows with this factor. With
/// this value a violation decays within about twenty steps.
constexpr double kGainTimesStep = 0.05;

template <class Space, class S>
class BaumgarteLevel final : public Level<Space, S> {
 public:
  BaumgarteLevel(const Mechanism<Space, S>& mechanism, std::optional<BaumgarteGains> gains)
      : chooses_gains_(!gains), feedback_(VectorX<S>::Zero(mechanism.num_equations())) {
    Level<Space, S>::gains_ = gains.value_or(BaumgarteGains());
  }

  const VectorX<S>& Feedback(const Kinematics<Space, S>& kinematics) override {
    feedback_.setZero();
    AddFeedback(kinematics, Level<Space, S>::gains_, feedback_);
    return feedback_;
  }

  /// Gains from the length of steps, where users gave none (options.h).
  Accepted Accept(FactoredState<Space, S>&, S h) override {
    if (feedback_.size() == 0 || !chooses_gains_) return Accepted::kAsItWas;
    BaumgarteGains& gains = Level<Space, S>::gains_;
    const bool still_growing = h > S(2) * longest_step_;
    longest_step_ = std::max(longest_step_, h);
    const bool fits =
        gains.alpha > 0.0 ? S(gains.alpha) * longest_step_ < S(2 * kGainTimesStep) : still_growing;
    if (fits || !(longest_step_ > S(0))) return Accepted::kAsItWas;
    gains.alpha = gains.beta = static_cast<double>(S(kGainTimesStep) / longest_step_);
    return Accepted::kModeChanged;
  }

 private:
  bool chooses_gains_;
  VectorX<S> feedback_;
  S longest_step_ = S(0);  ///< of accepted steps
};

}  // namespace

template <class Space, class S>
std::unique_ptr<Level<Space, S>> MakeBaumgarteLevel(const Mechanism<Space, S>& mechanism,
                                                    const FormulationOptions& options) {
  return std::make_unique<BaumgarteLevel<Space, S>>(mechanism, options.gains);
}

#define LOOPBENCH_INSTANTIATE(Space, S)                                                    \
  template std::unique_ptr<Level<Space, S>> MakeBaumgarteLevel(const Mechanism<Space, S>&, \
                                                               const FormulationOptions&);
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
