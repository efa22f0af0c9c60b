// The length that lengths of one mechanism are compared with.
#pragma once

#include "mechanism/description/description.h"

namespace loopbench::harness {

/// The longest extent [m] of the joints of one moving body, which for two joints is their distance,
/// or of a rod; where no body has two joints, the longest way from a joint to a centre of mass. 1
/// where there is none either. Geometry alone: where the scene stands does not matter.
double LinkLength(const MechanismDescription& description);

}  // namespace loopbench::harness
