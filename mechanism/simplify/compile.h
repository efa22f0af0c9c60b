// Models only what a scene requires (docs/decisions/009): a description, simplified before it is
// compiled into a Mechanism, and the way back to the user's bodies and joints.
//
// Savings, in this order, each with its switch:
//   welds      bodies joined by welds become one (welds.h);
//   immovable  bodies that certainly cannot move become part of Ground (immovable.h);
//   islands    parts connected through Ground at most become descriptions of their own (islands.h);
//   planar     a spatial part that moves in parallel planes becomes planar (plane.h);
//   redundancy constraints that say at every position what others say are released (redundancy.h).
// The motion is the same but for rounding. What a saving does not know, a new kind of joint or
// force, keeps it from being made.
#pragma once

#include <string>
#include <vector>

#include "mechanism/model/kinematics.h"
#include "mechanism/simplify/attach.h"

namespace loopbench {

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

/// Where a user's body is.
struct BodyImage {
  int part = -1;       ///< -1: fixed to Ground, at X in the user's ground axes
  int body = kGround;  ///< of that part's description
  Frame X;             ///< the user's body axes and origin in those of `body`
  double turn = 0.0;   ///< plane: their angle, a number
};

/// Where a user's joint is.
struct JointImage {
  int part = -1;  ///< -1: gone, both its bodies move as one
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
  CompileOptions done;              ///< which savings found something to save
  std::vector<std::string> report;  ///< sentences: what was done, what was dropped, why not
};

/// Throws std::invalid_argument for a description that Validate() refuses.
Compiled Compile(const MechanismDescription& description, const CompileOptions& options = {});

/// Pose of a user's body, at its origin in the user's ground axes, when its part moves as
/// `kinematics` says. Bodies fixed to Ground take no kinematics: nullptr.
template <class Space>
Frame UserPose(const Compiled& compiled, int body, const Kinematics<Space, double>* kinematics);

}  // namespace loopbench
