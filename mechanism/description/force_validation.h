// Which forces of a description make sense.
#pragma once

#include <string>

#include "mechanism/description/description.h"

namespace loopbench {

/// "" or what makes a force unusable: joints with several coordinates, points of bodies that do not
/// exist or of Ground, negative stiffness, damping or length, parts out of the plane, non-finite
/// numbers.
std::string ValidateForce(const MechanismDescription& description, const ForceDescription& force);

}  // namespace loopbench
