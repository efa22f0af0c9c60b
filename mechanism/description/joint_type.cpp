#include "mechanism/description/joint_type.h"

namespace loopbench {

std::string_view ToString(SpaceKind space) {
  return space == SpaceKind::kPlanar ? "planar" : "spatial";
}

namespace {

/// In the order of JointType.
std::deque<JointTraits> BuiltIn() {
  return {
      JointTraits{.name = "revolute",
                  .in_plane = true,
                  .own_axis = 'z',
                  .planar = "angle",
                  .coordinates = "angle",
                  .axes = {"z", "z"},
                  .flat = {.possible = true, .turns = true}},
      JointTraits{.name = "prismatic",
                  .in_plane = true,
                  .own_axis = 'x',
                  .planar = "shift",
                  .coordinates = "shift",
                  .planar_axes = {"x", "x"},
                  .axes = {"x", "x"},
                  .flat = {.possible = true, .slides = true}},
      JointTraits{.name = "weld", .in_plane = true, .flat = {.possible = true}},
      JointTraits{.name = "free",
                  .in_plane = true,
                  .planar = "angle, x, y",
                  .coordinates = "qw, qx, qy, qz, x, y, z",
                  .speeds = "wx, wy, wz, x, y, z"},
      JointTraits{.name = "pin-in-slot",
                  .in_plane = true,
                  .own_axis = 'x',
                  .planar = "angle, shift",
                  .coordinates = "angle, shift",
                  .planar_axes = {"x", ""},
                  .axes = {"zx", "z"},
                  .flat = {.possible = true, .turns = true, .slides = true}},
      JointTraits{.name = "rod",
                  .in_plane = true,
                  .force = "the force along the rod",
                  .parameter = {"length", "the distance of the two points [m]", "m", true}},
      JointTraits{.name = "cylindrical",
                  .own_axis = 'z',
                  .coordinates = "angle, shift",
                  .axes = {"z", "z"}},
      JointTraits{.name = "spherical", .coordinates = "qw, qx, qy, qz", .speeds = "wx, wy, wz"},
      JointTraits{.name = "planar",
                  .own_axis = 'z',
                  .coordinates = "angle, x, y",
                  .axes = {"z", "z"},
                  .flat = {.possible = true, .turns = true, .is_free = true}},
      JointTraits{.name = "universal",
                  .coordinates = "angle about x, angle about y",
                  .axes = {"x", "y"},
                  .moment = "the moment about the normal of its two axes"},
      JointTraits{.name = "helical",
                  .own_axis = 'z',
                  .coordinates = "angle",
                  .axes = {"z", "z"},
                  .cut_last = true,
                  .parameter = {"pitch", "the advance along the axis per angle [m/rad]", "m/rad"}},
      JointTraits{.name = "translation", .coordinates = "x, y, z", .axes = {"xyz", "xyz"}},
      JointTraits{.name = "schoenflies",
                  .own_axis = 'z',
                  .coordinates = "angle, x, y, z",
                  .axes = {"z", "z"}},
      JointTraits{.name = "point-on-line",
                  .own_axis = 'x',
                  .coordinates = "qw, qx, qy, qz, x",
                  .speeds = "wx, wy, wz, x",
                  .axes = {"x", ""}},
      JointTraits{.name = "point-in-plane",
                  .own_axis = 'z',
                  .coordinates = "qw, qx, qy, qz, x, y",
                  .speeds = "wx, wy, wz, x, y",
                  .axes = {"z", ""}},
  };
}

std::deque<JointTraits>& Rows() {
  static std::deque<JointTraits> rows = BuiltIn();
  return rows;
}

/// Returns the unit: "angle" and "wx" are rotations, "qw" has no unit, all others are lengths.
std::string_view UnitOf(std::string_view word, bool speed) {
  if (word.front() == 'q') return "";
  const bool turns = word.front() == 'a' || word.front() == 'w';
  return turns ? (speed ? "rad/s" : "rad") : (speed ? "m/s" : "m");
}

}  // namespace

const std::deque<JointTraits>& AllJointTraits() { return Rows(); }

JointType AddJointTraits(const JointTraits& traits) {
  Rows().push_back(traits);
  return static_cast<JointType>(Rows().size() - 1);
}

bool IsBuiltIn(JointType type) {
  static const std::size_t count = BuiltIn().size();
  return static_cast<std::size_t>(type) < count;
}

const JointTraits& TraitsOf(JointType type) { return Rows().at(static_cast<std::size_t>(type)); }
std::string_view ToString(JointType type) { return TraitsOf(type).name; }

std::vector<ValueWord> ValueWords(const JointTraits& traits, SpaceKind space, bool speeds) {
  std::string_view list = traits.coordinates;
  if (space == SpaceKind::kPlanar && traits.in_plane) {
    list = traits.planar;
  } else if (speeds && !traits.speeds.empty()) {
    list = traits.speeds;
  }
  constexpr std::string_view kBetween = ", ";
  std::vector<ValueWord> words;
  while (!list.empty()) {
    const std::string_view word = list.substr(0, list.find(kBetween));
    words.push_back({word, UnitOf(word, speeds)});
    list.remove_prefix(std::min(list.size(), word.size() + kBetween.size()));
  }
  return words;
}

std::vector<ValueWord> ValueWords(JointType type, SpaceKind space, bool speeds) {
  return ValueWords(TraitsOf(type), space, speeds);
}

int NumValues(JointType type, SpaceKind space, bool speeds) {
  return static_cast<int>(ValueWords(type, space, speeds).size());
}

}  // namespace loopbench
