// Simplified models of one problem: results of the simplification rules.
//
// compile.h makes exact simplifications before a run. Here each rule gives a separate description,
// which a mechanism file can hold. Some rules change the motion: their error and time saving can
// then be measured against the full model.
//
//   exact        welds, immovable, planar, islands (compile.h); redundancy (not in files)
//   approximate  constant-parts   bodies that hardly move against each other become one
//                stiff-springs    springs much faster than the motion become rods, or hold a joint
//                light-links      links of small mass become massless rods
//                nearly-planar    nearly planar motion in parallel planes becomes planar
// Each approximate one has a limit and reports the compared number of every candidate.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "mechanism/description/joint_frames.h"

namespace loopbench {

/// Largest relative motion of the two bodies of a joint in a short run.
struct Travel {
  double turn = 0.0;   ///< [rad]
  double shift = 0.0;  ///< of the joint's point on `to`, seen from `from` [m]
};

/// Results of a short run of the full model. Joints by name: models differ in joint numbers.
struct ShortRun {
  std::map<std::string, Travel> travels;
  double rate = 0.0;      ///< largest angular speed, or speed over length [rad/s]
  double duration = 0.0;  ///< [s]; 0: no run
  std::string message;    ///< why it ended before it should have
};

/// Destination of the mass of a link that becomes a massless rod.
enum class Lumping {
  kCentreOfMass,  ///< to both ends, keeping its centre of mass
  kHalf,          ///< half to each end
  kNone,          ///< nowhere: the mechanism is lighter
};

struct SimplifyOptions {
  /// Maximum share in the kinetic energy of a link that becomes a rod. The change is the inertia of
  /// the link's own rotation, a part of that share: angles change by about 1e-2 of their travel.
  double light_links = 0.01;
  /// Minimum ratio of natural frequency to motion rate; relative deflection about 1/ratio^2 = 1e-3.
  double stiff_springs = 30.0;
  /// Maximum travel of a joint that counts as fixed [rad, or of the mechanism's length].
  double constant_parts = 1e-3;
  /// Maximum tilt (sine) of an axis or a spring that counts as planar. Projected lengths are
  /// shorter by half its square.
  double nearly_planar = 0.05;
  Lumping lumping = Lumping::kCentreOfMass;
};

/// An object that a rule could remove, and the deciding number.
struct Candidate {
  std::string what;   ///< in words: "link \"rod\" between \"crank\" and \"slider\""
  double number = 0;  ///< NaN if there is none
  bool taken = false;
  std::string why;  ///< text besides the number: the change made, or the obstacle
};

struct SimplificationRule;

struct Simplified {
  /// One description; several if a model consists of unconnected parts.
  std::vector<MechanismDescription> parts;
  Eigen::Matrix3d R_WC = Eigen::Matrix3d::Identity();  ///< their ground axes in the given ones
  std::vector<Candidate> candidates;
  std::vector<std::string> done;                 ///< sentences
  std::vector<std::string> dropped;              ///< removed objects
  std::vector<const SimplificationRule*> ideas;  ///< rules that apply, if several are combined
  std::string why_not;  ///< why nothing applies; empty where something does

  bool applies() const { return why_not.empty(); }
};

/// Reason why a rule without candidates does not apply.
inline constexpr std::string_view kNothingOfTheKind = "there is nothing of the kind";

/// A simplification: a row.
struct SimplificationRule {
  std::string_view name;  ///< on the command line, and of files
  bool is_exact = false;
  std::string_view sentence = "";    ///< description
  std::string_view assumption = "";  ///< condition of validity
  std::string_view number = "";      ///< meaning of the candidates' numbers; empty without a limit
  double SimplifyOptions::*limit = nullptr;
  bool is_least = false;  ///< candidates are taken from the limit on, not up to it
  Simplified (*apply)(const MechanismDescription&, const ShortRun&,
                      const SimplifyOptions&) = nullptr;
};

/// Returns all rules in the order in which they are combined.
const std::vector<SimplificationRule>& SimplificationRules();

/// Applies the rules in order, each to the result of the previous ones. Unconnected parts stay in
/// one description.
///
/// @throws std::invalid_argument for a description that Validate() rejects.
Simplified Combine(const MechanismDescription& description,
                   const std::vector<const SimplificationRule*>& ideas, const ShortRun& run,
                   const SimplifyOptions& options);

/// A named point of a body, found by name in a simplified model: on that body if it is there, else
/// under "<body>.<point>" on the body that took its place.
struct FoundPoint {
  int body = -1;  ///< -1: removed
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
};
FoundPoint FindPoint(const MechanismDescription& simplified, const std::string& body,
                     const std::string& point);

// The approximate simplification rules (rules.cpp, plane.cpp).

/// Merges bodies whose joints have hardly moved in the short run, in their initial poses, also with
/// Ground. Joints with prescribed motions are excluded.
Simplified FreezeConstantParts(const MechanismDescription& description, const ShortRun& run,
                               const SimplifyOptions& options);

/// Replaces a stiff spring between two points by a rod of its free length. A stiff joint spring
/// fixes its joint, and the two bodies become one. Its damper is removed. The frequency is its
/// natural frequency alone (restart.h). The rate of the motion is taken from the start or the short
/// run, or is the highest frequency of the springs that are not stiff.
Simplified HoldStiffSprings(const MechanismDescription& description, const ShortRun& run,
                            const SimplifyOptions& options);

/// Replaces bodies by rods of their names, the lightest first. A planar body must have two pins and
/// nothing else, a spatial body two spherical joints or one and a universal joint. Named points
/// at the pins stay as points "<body>.<point>" of the bodies there. If nothing else carries the two
/// bodies of the rod, they float on free joints.
Simplified LightenLinks(const MechanismDescription& description, const ShortRun& run,
                        const SimplifyOptions& options);

/// Makes a nearly planar spatial description planar at its start (exactly planar ones: plane.h).
/// Axes nearly normal (or parallel) to the plane are taken as exact, spherical and universal joints
/// turn about its normal, heights keep their initial values.
Simplified FlattenNearly(const MechanismDescription& description, const ShortRun& run,
                         const SimplifyOptions& options);

}  // namespace loopbench
