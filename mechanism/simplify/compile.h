// Exact preprocessing of a problem (docs/decisions/009): simplifies a description before it is
// compiled into a Mechanism, and maps results back to the user's bodies and joints.
//
// Simplifications, in this order, each with a switch:
//   welds       Bodies joined by welds become one (attach.h).
//   immovable   Bodies that certainly cannot move become part of Ground (attach.h).
//   islands     Parts connected only through Ground become separate descriptions (topology.h).
//   planar      A spatial part that moves in parallel planes becomes planar (plane.h).
//   redundancy  Constraints that are redundant at every position are released (redundancy.h).
// The motion is the same except for rounding. An unknown kind of joint or force prevents a
// simplification.
#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "mechanism/model/kinematics.h"
#include "mechanism/simplify/attach.h"

namespace loopbench {

/// Returns the number with so many significant digits, as "%.*g" prints it.
inline std::string NumberText(double value, int digits) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*g", digits, value);
  return text;
}

struct CompileOptions {
  bool planar = true;
  bool welds = true;
  bool immovable = true;
  /// Off: an adaptive integrator gives each part its own steps, so a run is another one.
  bool islands = false;
  bool redundancy = true;

  static CompileOptions All() { return {.islands = true}; }
  static CompileOptions None() {
    return {
        .planar = false, .welds = false, .immovable = false, .islands = false, .redundancy = false};
  }
  friend bool operator==(const CompileOptions&, const CompileOptions&) = default;
};

/// Image of a user's body.
struct BodyImage {
  int part = -1;       ///< -1: fixed to Ground, at X in the user's ground axes
  int body = kGround;  ///< of that part's description
  Frame X;             ///< the user's body axes and origin in those of `body`
  double turn = 0.0;   ///< plane: their angle, which counts turns
};

/// Image of a user's joint.
struct JointImage {
  int part = -1;  ///< -1: removed, both its bodies move as one
  int joint = -1;
  bool mirrored = false;  ///< angle, and y of a planar joint, have the opposite sign
};

struct CompiledPart {
  MechanismDescription description;
  Eigen::Matrix3d R_WC = Eigen::Matrix3d::Identity();  ///< its ground axes in the user's
};

struct Compiled {
  std::vector<CompiledPart> parts;  ///< at least one
  std::vector<BodyImage> bodies;    ///< by the user's body
  std::vector<JointImage> joints;   ///< by the user's joint
  CompileOptions done;              ///< simplifications that changed something
  std::vector<std::string> report;  ///< sentences: changes, dropped data, obstacles
};

/// Throws std::invalid_argument for a description that Validate() rejects.
Compiled Compile(const MechanismDescription& description, const CompileOptions& options = {});

/// Returns the pose of a user's body, at its origin in the user's ground axes, for the part's
/// `kinematics`. Bodies fixed to Ground take no kinematics: nullptr.
template <class Space>
Frame UserPose(const Compiled& compiled, int body, const Kinematics<Space, double>* kinematics);

}  // namespace loopbench
