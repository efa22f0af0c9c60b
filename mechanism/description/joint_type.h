// The kinds of joints: names of the kind and its coordinates for files and users, and properties
// other than its motion. The motion is in mechanism/model/joint.h; a test compares the two.
#pragma once

#include <deque>
#include <string_view>
#include <vector>

namespace loopbench {

enum class SpaceKind { kPlanar, kSpatial };
std::string_view ToString(SpaceKind space);

/// Kinds of joints, by free motions. User-defined kinds have the numbers after these.
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
  kTranslation,
  kSchoenflies,
  kPointOnLine,
  kPointInPlane,
};

/// Words "from" and "to": of frame F and of frame M.
struct SideWords {
  std::string_view from = "", to = "";
};

/// A number of a kind besides its frames (JointDescription::parameter).
struct JointParameter {
  std::string_view key = "";  ///< in files; empty for kinds without one
  std::string_view meaning = "", unit = "";
  bool positive = false;
};

/// Remainder of a joint in a plane across z or x of its frames, as `turns` and `slides` require.
struct InPlaneOf {
  bool possible = false;
  bool turns = false;    ///< about z of its frames, which must be normal to the plane
  bool slides = false;   ///< along x of F, which must lie in the plane
  bool is_free = false;  ///< nothing holds it there
};

struct JointTraits {
  std::string_view name;
  bool in_plane = false;  ///< planar problems may have it
  /// The axis of its own frames given by JointDescription::axis: 'x' (slides along it), 'z' (turns
  /// about it, or is normal to its plane), or '-' for kinds without one.
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

/// Returns all kinds in the order of JointType: the built-in ones, then user-defined ones
/// (mechanism/model/registry.h). References stay valid.
const std::deque<JointTraits>& AllJointTraits();
/// Adds an entry, whose texts must live as long as the program, and returns its number. Programs
/// call RegisterJoint() instead: a kind needs functions too.
JointType AddJointTraits(const JointTraits& traits);

/// Returns true for built-in kinds, which exist in all scalars.
bool IsBuiltIn(JointType type);

const JointTraits& TraitsOf(JointType type);
std::string_view ToString(JointType type);

/// A coordinate or speed of a joint.
struct ValueWord {
  std::string_view
      name;  ///< angle, shift, x, y, z; qw to qz of a quaternion; wx to wz of its rates
  std::string_view unit;  ///< rad, m or nothing; of speeds rad/s or m/s

  bool is_length() const { return unit.starts_with('m'); }
};

std::vector<ValueWord> ValueWords(const JointTraits& traits, SpaceKind space, bool speeds);
std::vector<ValueWord> ValueWords(JointType type, SpaceKind space, bool speeds);
int NumValues(JointType type, SpaceKind space, bool speeds);

}  // namespace loopbench
