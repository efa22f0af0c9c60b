#include "mechanism/formulation/level.h"

#include "mechanism/algebra/instantiate.h"
#include "mechanism/description/registration.h"

namespace loopbench {

// Levels with a file of their own.
template <class Space, class S>
std::unique_ptr<Level<Space, S>> MakeVelocityLevel(const Mechanism<Space, S>& mechanism,
                                                   const FormulationOptions&);
template <class Space, class S>
std::unique_ptr<Level<Space, S>> MakePositionLevel(const Mechanism<Space, S>& mechanism,
                                                   const FormulationOptions&);
template <class Space, class S>
std::unique_ptr<Level<Space, S>> MakeBaumgarteLevel(const Mechanism<Space, S>& mechanism,
                                                    const FormulationOptions& options);

namespace {

template <class Space, class S>
class AccelerationLevel final : public Level<Space, S> {
 public:
  AccelerationLevel() {
    this->right_hand_side_ = SpeedsUsed::kGiven;
    this->takes_steps_as_they_are_ = true;
  }
};

}  // namespace

template <class Space, class S>
Outcome Level<Space, S>::SetSpeeds(FactoredState<Space, S>& state,
                                   const Eigen::Ref<const VectorX<S>>& carried) {
  state.SetSpeeds(carried);
  return Outcome::kFinished;
}

template <class Space, class S>
std::deque<LevelFactory<Space, S>>& LevelFactories() {
  const auto acceleration = [](const Mechanism<Space, S>&, const FormulationOptions&) {
    return std::make_unique<AccelerationLevel<Space, S>>();
  };
  static std::deque<LevelFactory<Space, S>> factories = {acceleration, MakeVelocityLevel<Space, S>,
                                                         MakePositionLevel<Space, S>,
                                                         MakeBaumgarteLevel<Space, S>};
  return factories;
}

template <class Space, class S>
std::unique_ptr<Level<Space, S>> MakeLevel(const Mechanism<Space, S>& mechanism,
                                           const FormulationOptions& options) {
  const auto& factories = LevelFactories<Space, S>();
  const auto index = static_cast<std::size_t>(options.enforcement);
  if (index >= factories.size()) {
    RefuseRow("level", ToString(options.enforcement), "a scalar other than double",
              "double, which levels of other programs are made in");
  }
  return factories[index](mechanism, options);
}

#define LOOPBENCH_INSTANTIATE(Space, S)                                           \
  template class Level<Space, S>;                                                 \
  template std::deque<LevelFactory<Space, S>>& LevelFactories<Space, S>();        \
  template std::unique_ptr<Level<Space, S>> MakeLevel(const Mechanism<Space, S>&, \
                                                      const FormulationOptions&);
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
