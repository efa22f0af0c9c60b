// The kinds of joints, a row each: what files and users call it and its coordinates, and what is
// to know of it besides how it moves. That stands in mechanism/model/joint.h, and a test holds the
// two together.
#pragma once

#include <array>
#include <string_view>
#include <vector>

namespace loopbench {

enum class SpaceKind { kPlanar, kSpatial };
std::string_view ToString(SpaceKind space);

/// What a joint leaves free.
enum class JointType {
  kRevolute,
  kPrismatic,
  kWeld,
  kFree,
  kPinInSlot,
  kRod,
  kCylindrical,
  kSpherical,
  kPlanar,
  kUniversal,
  kHelical,
};

/// Words "from" and "to": of frame F and of frame M.
struct SideWords {
  std::string_view from = "", to = "";
};

/// A number that a kind has beside its frames (JointDescription::parameter).
struct JointParameter {
  std::string_view key = "";  ///< in files; empty for kinds without one
  std::string_view meaning = "", unit = "";
  bool positive = false;
};

/// What is left of a joint in a plane across z or x of its frames, as `turns` and `slides` ask.
struct InPlaneOf {
  bool possible = false;
  bool turns = false;    ///< about z of its frames, which must be normal to the plane
  bool slides = false;   ///< along x of F, which must lie in the plane
  bool is_free = false;  ///< nothing holds it there
};

struct JointTraits {
  std::string_view name;
  bool in_plane = false;  ///< planar scenes may have it
  /// The axis of its own frames that JointDescription::axis names: 'x' (slides along it), 'z'
  /// (turns about it, or is normal to its plane), or '-' for kinds without one.
  char own_axis = '-';
  /// Coordinates and speeds that users give (none of a rod, which is never followed), in the order
  /// of files. Units follow from the words (ValueWords()). Empty speeds: as the coordinates.
  std::string_view planar = "", coordinates = "", speeds = "";
  /// The axes that it moves along or about, as letters of its frames.
  SideWords planar_axes = {}, axes = {};
  /// A moment and a force of the joint that act along no axis of F.
  std::string_view moment = "", force = "";
  InPlaneOf flat = {};
  bool cut_last = false;  ///< among joints that could close a loop
  JointParameter parameter = {};
};

/// In the order of JointType.
inline constexpr std::array kJointTraits = {
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
    JointTraits{
        .name = "cylindrical", .own_axis = 'z', .coordinates = "angle, shift", .axes = {"z", "z"}},
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
};
inline constexpr int kNumJointTypes = static_cast<int>(kJointTraits.size());

constexpr const JointTraits& TraitsOf(JointType type) {
  return kJointTraits.at(static_cast<std::size_t>(type));
}
constexpr std::string_view ToString(JointType type) { return TraitsOf(type).name; }

/// A coordinate or speed of a joint.
struct ValueWord {
  std::string_view
      name;  ///< angle, shift, x, y, z; qw to qz of a quaternion; wx to wz of its rates
  std::string_view unit;  ///< rad, m or nothing; of speeds rad/s or m/s

  bool is_length() const { return unit.starts_with('m'); }
};

std::vector<ValueWord> ValueWords(JointType type, SpaceKind space, bool speeds);
int NumValues(JointType type, SpaceKind space, bool speeds);

}  // namespace loopbench
