// The coordinates and speeds of each kind of joint in words and units, in the order of files.
#pragma once

#include <string_view>
#include <vector>

#include "mechanism/description/description.h"

namespace loopbench::harness {

struct CoordinateWord {
  std::string_view
      name;  ///< angle, shift, x, y, z; qw to qz of a quaternion; wx to wz of its rates
  std::string_view unit;  ///< rad, m or nothing; of speeds rad/s or m/s
};

/// As many as NumValues() counts: none of a weld and of a rod.
std::vector<CoordinateWord> CoordinateWords(JointType type, SpaceKind space);
std::vector<CoordinateWord> SpeedWords(JointType type, SpaceKind space);

/// The axes that a joint moves along or about, as letters of its frame: those of F on `from`, or of
/// M on `to`; "" where it has none of its own.
std::string_view AxesOfSide(JointType type, SpaceKind space, bool from);

}  // namespace loopbench::harness
