// What a simplification makes of a description: the rungs of a ladder of models of one scene.
//
// compile.h simplifies before a run what changes nothing of the motion. Here each idea gives a
// description of its own, which a mechanism file can say, and some ideas change the motion: then
// the error that one causes, and the time that it saves, can be measured against the whole model.
//
//   exact        welds, immovable, planar, islands (compile.h); redundancy (no file can say it)
//   approximate  constant-parts   bodies that hardly move against each other become one
//                stiff-springs    springs much faster than the motion become rods, or hold a joint
//                light-links      links of small mass become massless rods
//                nearly-planar    what nearly moves in parallel planes becomes planar
// Each approximate one has a limit, and says of every candidate the number that is held against it.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "mechanism/description/joint_frames.h"

namespace loopbench {

/// How far the two bodies of a joint have moved against each other in a short run, at most.
struct Travel {
  double turn = 0.0;   ///< [rad]
  double shift = 0.0;  ///< of the joint's point on `to`, seen from `from` [m]
};

/// What a short run of the whole model showed. Joints by name: models of the ladder differ in
/// numbers.
struct ShortRun {
  std::map<std::string, Travel> travels;
  double rate = 0.0;      ///< largest angular speed, or speed over length [rad/s]
  double duration = 0.0;  ///< [s]; 0: there was none
  std::string message;    ///< why it ended before it should have
};

/// Where the mass of a link that becomes a massless rod goes.
enum class Lumping {
  kCentreOfMass,  ///< to both ends, so that its centre of mass stays where it is
  kHalf,          ///< half to each end
  kNone,          ///< nowhere: the mechanism is lighter
};

struct SimplifyOptions {
  /// Share in the kinetic energy, at most, of a link that becomes a rod. What changes is the
  /// inertia of the link's own rotation, a part of that share: angles go wrong by some 1e-2 of the
  /// way that they travel.
  double light_links = 0.01;
  /// Least frequency of a stiff spring over the rate of the motion. What it gives way is about the
  /// square of the inverse, 1e-3 of the way that the motion goes.
  double stiff_springs = 30.0;
  /// Travel of a joint that stands still, at most [rad, or of the mechanism's length].
  double constant_parts = 1e-3;
  /// Tilt of an axis, or of a spring, that still counts as none, at most (sine). Lengths seen from
  /// the normal are shorter by half its square.
  double nearly_planar = 0.05;
  Lumping lumping = Lumping::kCentreOfMass;
};

/// Something that an idea could take away, and the number that decides.
struct Candidate {
  std::string what;   ///< in words: "link \"rod\" between \"crank\" and \"slider\""
  double number = 0;  ///< NaN where there is none
  bool taken = false;
  std::string why;  ///< in words, besides the number: what was done, or what prevents it
};

struct Idea;

struct Simplified {
  /// One; several where a model falls into parts that have nothing to do with each other.
  std::vector<MechanismDescription> parts;
  Eigen::Matrix3d R_WC = Eigen::Matrix3d::Identity();  ///< their ground axes in the given ones
  std::vector<Candidate> candidates;
  std::vector<std::string> done;     ///< sentences
  std::vector<std::string> dropped;  ///< what is no longer there
  std::vector<const Idea*> ideas;    ///< that apply, where several are combined
  std::string why_not;               ///< why nothing applies; empty where something does

  bool applies() const { return why_not.empty(); }
};

/// Why an idea does not apply that found nothing to look at.
inline constexpr std::string_view kNothingOfTheKind = "there is nothing of the kind";

/// A simplification: a row.
struct Idea {
  std::string_view name;  ///< on the command line, and of files
  bool is_exact = false;
  std::string_view sentence = "";    ///< what it does
  std::string_view assumption = "";  ///< when that is right
  std::string_view number = "";      ///< what the candidates' numbers are; empty without a limit
  double SimplifyOptions::*limit = nullptr;
  bool is_least = false;  ///< candidates are taken from the limit on, not up to it
  Simplified (*apply)(const MechanismDescription&, const ShortRun&,
                      const SimplifyOptions&) = nullptr;
};

/// All ideas in the order in which they are combined.
const std::vector<Idea>& Ideas();

/// One idea after the other, each on what those before left. Parts that have nothing to do with
/// each other stay in one description.
///
/// @throws std::invalid_argument for a description that Validate() refuses.
Simplified Combine(const MechanismDescription& description, const std::vector<const Idea*>& ideas,
                   const ShortRun& run, const SimplifyOptions& options);

/// A named point of a body, found by name in a simplified model: on that body if it is there, else
/// under "<body>.<point>" on the body that took its place.
struct FoundPoint {
  int body = -1;  ///< -1: gone
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
};
FoundPoint FindPoint(const MechanismDescription& simplified, const std::string& body,
                     const std::string& point);

}  // namespace loopbench
