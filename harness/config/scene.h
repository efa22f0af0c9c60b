// What a mechanism file says beyond the mechanism itself: exact facts that observers compare with.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mechanism/description/description.h"

namespace loopbench::harness {

/// A linear combination of absolute body angles, as (body name, coefficient) pairs. On the branch
/// the scene starts on it keeps its initial value; a run that changes it has left the branch.
using AngleCombination = std::vector<std::pair<std::string, double>>;

/// The exact motion of one body is that of a plain pendulum,
///   theta'' = -frequency_squared sin(theta),   theta = absolute angle of the body - down_angle.
struct PendulumForm {
  std::string body;
  double down_angle = 0.0;         ///< absolute angle of the body where theta = 0 [rad]
  double frequency_squared = 0.0;  ///< [1/s^2], > 0
};

/// JSON "observe". Empty where a scene has no such facts.
struct SceneObservation {
  std::vector<AngleCombination> branch_invariants;  ///< JSON "branch"
  std::optional<PendulumForm> closed_form;
  double length = 1.0;  ///< characteristic bar length, the scale of "saturated" drift [m]
};

/// All that one mechanism file says.
struct MechanismFile {
  MechanismDescription description;
  SceneObservation observe;
  std::string canonical;  ///< the document without spaces: equal texts are equal mechanisms
};

}  // namespace loopbench::harness
