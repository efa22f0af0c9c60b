// An observer that Loopbench does not have: the largest speed of any coordinate, and when.
#pragma once

#include "harness/observers/registry.h"

namespace own {

using namespace loopbench;

template <class Space>
class LargestSpeed final : public harness::Observer<Space> {
 public:
  explicit LargestSpeed(const harness::Watched<Space>&) {}

  void Observe(const harness::Sample<Space>& sample) override {
    const double speed = sample.formulation.u().cwiseAbs().maxCoeff();
    if (speed <= largest_) return;
    largest_ = speed;
    when_ = sample.t;
  }
  /// Of a run that saw no state, and of one at rest, nothing is known.
  void Write(harness::Record& record) const override {
    if (largest_ < 0.0) return;
    record.Set("speed_max", largest_);
    record.Set("speed_max_t", when_);
  }

 private:
  double largest_ = -1.0, when_ = 0.0;
};

inline harness::ObserverRow LargestSpeedRow() {
  using namespace harness;
  return ObserverRowOf<LargestSpeed>("largest-speed",
                                     "the largest speed of a coordinate, and when.",
                                     {{"speed_max",
                                       ValueType::kNumber,
                                       {"largest speed", "rad/s", Format::kScientific},
                                       {Merge::kLargest},
                                       Rule::kError},
                                      {"speed_max_t",
                                       ValueType::kNumber,
                                       {"at time", "s", Format::kSeconds},
                                       {Merge::kWith, "speed_max"}}});
}

}  // namespace own
