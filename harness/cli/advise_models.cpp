#include "harness/cli/advise_models.h"

#include <algorithm>

namespace loopbench::harness {

CausedError ErrorOfModel(const MechanismDescription& whole, const Reference& whole_reference,
                         const SceneModel& model, const Reference& reference,
                         const std::vector<std::string>& names) {
  CausedError error;
  const std::size_t count = std::min(whole_reference.NumTrusted(), reference.NumTrusted());
  if (count > 0) error.until = whole_reference.times[count - 1];
  for (std::size_t body = 1; body < whole.bodies.size(); ++body) {
    for (const auto& [point, at] : whole.bodies[body].points) {
      const std::string name = whole.bodies[body].name + "." + point;
      if (!names.empty() && std::ranges::find(names, name) == names.end()) continue;
      const FoundPoint found = FindPoint(model.description, whole.bodies[body].name, point);
      if (found.body < 0) continue;
      ++error.points;
      for (std::size_t k = 0; k < count; ++k) {
        const Frame& X = whole_reference.snapshots[k].bodies[body].pose;
        const Frame& Y = reference.snapshots[k].bodies[static_cast<std::size_t>(found.body)].pose;
        const double off = (X.p + X.R * at - model.R_WC * (Y.p + Y.R * found.at)).norm();
        if (off <= error.largest) continue;
        error.largest = off;
        error.point = name;
      }
    }
  }
  return error;
}

}  // namespace loopbench::harness
