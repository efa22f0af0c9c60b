#include <algorithm>
#include <cmath>

#include "harness/observers/observer.h"

namespace loopbench::harness {

double FastestDrive(const MechanismDescription& description) {
  double fastest = 0.0;
  const auto look = [&](const TimeFunctionDescription& value) {
    const auto* harmonic = std::get_if<Harmonic>(&value);
    if (harmonic == nullptr || harmonic->amplitude == 0.0) return;
    fastest = std::max(fastest, std::abs(harmonic->omega));
  };
  for (const JointDescription& joint : description.joints) {
    for (const PrescribedMotion& motion : joint.motions) look(motion.value);
  }
  for (ForceDescription force : description.forces) {
    if (const TimeFunctionDescription* value = PartsOf(force).value) look(*value);
  }
  return fastest;
}

template <class Space>
StepLengthObserver<Space>::StepLengthObserver(const Watched<Space>& run)
    : stops_(run.stops.begin(), run.stops.end()), fastest_(FastestDrive(run.description)) {}

template <class Space>
void StepLengthObserver<Space>::Observe(const Sample<Space>& sample) {
  if (last_ > 0.0 && !std::ranges::binary_search(stops_, t_) &&
      (shortest_ == 0.0 || last_ < shortest_)) {
    shortest_ = last_;
    shortest_t_ = t_;
  }
  last_ = sample.t - t_;
  t_ = sample.t;
  longest_ = std::max(longest_, last_);
}

template <class Space>
void StepLengthObserver<Space>::Write(Record& record) const {
  if (longest_ == 0.0) return;
  record.Set("step_longest", longest_);
  if (shortest_ > 0.0) {
    record.Set("step_shortest", shortest_);
    record.Set("step_shortest_t", shortest_t_);
  }
  if (fastest_ > 0.0) record.Set("drive_frequency", fastest_);
}

template class StepLengthObserver<Planar>;
template class StepLengthObserver<Spatial>;

}  // namespace loopbench::harness
