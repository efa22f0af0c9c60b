#include "mechanism/formulation/level.h"

#include "mechanism/algebra/instantiate.h"

namespace loopbench {

// Levels with a file of their own.
template <class Space, class S>
std::unique_ptr<Level<Space, S>> MakeVelocityLevel(const Mechanism<Space, S>& mechanism);
template <class Space, class S>
std::unique_ptr<Level<Space, S>> MakePositionLevel(const Mechanism<Space, S>& mechanism);
template <class Space, class S>
std::unique_ptr<Level<Space, S>> MakeBaumgarteLevel(const Mechanism<Space, S>& mechanism,
                                                    std::optional<BaumgarteGains> gains);

template <class Space, class S>
Outcome Level<Space, S>::SetSpeeds(FactoredState<Space, S>& state,
                                   const Eigen::Ref<const VectorX<S>>& carried) {
  state.SetSpeeds(carried);
  return Outcome::kFinished;
}

template <class Space, class S>
std::unique_ptr<Level<Space, S>> MakeLevel(const Mechanism<Space, S>& mechanism,
                                           const FormulationOptions& options) {
  switch (options.enforcement) {
    case Enforcement::kAcceleration:
      break;
    case Enforcement::kVelocity:
      return MakeVelocityLevel(mechanism);
    case Enforcement::kPosition:
      return MakePositionLevel(mechanism);
    case Enforcement::kBaumgarte:
      return MakeBaumgarteLevel(mechanism, options.gains);
  }
  return std::make_unique<Level<Space, S>>();
}

#define LOOPBENCH_INSTANTIATE(Space, S)                                           \
  template class Level<Space, S>;                                                 \
  template std::unique_ptr<Level<Space, S>> MakeLevel(const Mechanism<Space, S>&, \
                                                      const FormulationOptions&);
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
