#include <algorithm>
#include <random>

#include "mechanism/start/assembly.h"

namespace loopbench {

MechanismDescription Perturb(MechanismDescription description, double amplitude, std::uint64_t seed,
                             int member) {
  std::seed_seq sequence{seed, static_cast<std::uint64_t>(member)};
  std::mt19937_64 generator(sequence);
  for (JointValues& values : description.initial.coordinates) {
    const std::vector<int>& held = description.initial.held;
    if (std::ranges::find(held, values.joint) == held.end()) continue;
    for (double& value : values.values) {
      // 53 random bits: the same number with every standard library
      const double unit = static_cast<double>(generator() >> 11) * 0x1p-53;
      value += amplitude * (2.0 * unit - 1.0);
    }
  }
  return description;
}

}  // namespace loopbench
