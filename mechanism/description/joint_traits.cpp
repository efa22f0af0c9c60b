#include "mechanism/description/joint_traits.h"

#include <array>

namespace loopbench {

namespace {

// in the order of JointType
constexpr std::array<JointTraits, kNumJointTypes> kTraits = {{
    {"revolute", true, 'z', {1, 0}, {1, 0}, {1, 0}},
    {"prismatic", true, 'x', {0, 1}, {0, 1}, {0, 1}},
    {"weld", true, '-', {0, 0}, {0, 0}, {0, 0}},
    {"free", true, '-', {1, 2}, {4, 3}, {3, 3}},
    {"pin-in-slot", true, 'x', {1, 1}, {1, 1}, {1, 1}},
    {"rod", true, '-', {0, 0}, {0, 0}, {0, 0}},
    {"cylindrical", false, 'z', {}, {1, 1}, {1, 1}},
    {"spherical", false, '-', {}, {4, 0}, {3, 0}},
    {"planar", false, 'z', {}, {1, 2}, {1, 2}},
    {"universal", false, '-', {}, {2, 0}, {2, 0}},
    {"helical", false, 'z', {}, {1, 0}, {1, 0}},
}};

}  // namespace

const JointTraits& TraitsOf(JointType type) { return kTraits.at(static_cast<std::size_t>(type)); }

ValueCount CountValues(JointType type, SpaceKind space, bool speeds) {
  const JointTraits& traits = TraitsOf(type);
  if (space == SpaceKind::kPlanar && traits.in_plane) return traits.planar;
  return speeds ? traits.speeds : traits.coordinates;
}

std::string_view ToString(JointType type) { return TraitsOf(type).name; }

bool ExistsInPlane(JointType type) { return TraitsOf(type).in_plane; }

char OwnAxis(JointType type) { return TraitsOf(type).own_axis; }

int NumValues(JointType type, SpaceKind space, bool speeds) {
  return CountValues(type, space, speeds).all();
}

}  // namespace loopbench
