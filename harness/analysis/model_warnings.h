// Warnings about unusual models, with lengths relative to the links.
#pragma once

#include <string>
#include <vector>

#include "mechanism/description/description.h"
#include "mechanism/simplify/structure.h"

namespace loopbench::harness {

// The length that lengths of one mechanism are compared with.

/// Returns the longest extent [m] of the joints of one moving body (their distance for two joints)
/// or of a rod. If no body has two joints: the longest distance of a joint from a centre of mass,
/// or else 1. Depends on geometry alone, not on the position in space.
double LinkLength(const MechanismDescription& description);

// Warnings about a mechanism before any run.

enum class WarningKind {
  kInconsistentStart,  ///< the start cannot be assembled
  kLocked,             ///< nothing can move
  kSingularStart,      ///< the start is a singular configuration
  kNearSingular,       ///< the loops are almost dependent at the start: bodies nearly in line
  kFloating,           ///< a part that no joint connects to ground
  kMassRatio,          ///< masses further apart than their equations can resolve well
  kFarCentre,          ///< a centre of mass so far from its joints that poses lose digits
  kNotAnalysed,        ///< too large for an analysis of rank
  kRounded,            ///< constraints are redundant within the accuracy of the input only
  kMissedGuess,        ///< a joint starts far from its guess
  kDegrees,            ///< angles of more than a turn, which may have been meant in degrees
};

struct Warning {
  WarningKind kind = WarningKind::kLocked;
  std::string text;  ///< a sentence that names the parts
};

/// The heaviest body over the lightest: beyond it half the digits of a double are the light body's.
inline constexpr double kLargestMassRatio = 1e8;
/// Ratio of singular values (Structure::conditioning) below which a start is near singular. Loop
/// forces are then about a hundred times their causes. The paper's problems stay above 0.1 except
/// at their singular configurations.
inline constexpr double kNearSingularRatio = 1e-2;

/// Distance of a centre of mass from the middle of its joints over the mechanism's length. Poses
/// refer to centres of mass, so joint positions have rounding errors eps times as large. Beyond
/// this limit a tolerance of 1e-12 cannot be met.
inline constexpr double kFarthestCentre = 1e3;

/// Returns warnings from the numbers alone, without assembly. Angles above one turn in initial
/// coordinates, frames and spring rest angles give one combined warning. It is a guess: such an
/// angle may be intended.
std::vector<Warning> FindUnitWarnings(const MechanismDescription& description);

/// A warning for each guess that a start q in joint coordinates misses.
std::vector<Warning> FindGuessWarnings(const MechanismDescription& description,
                                       const VectorX<double>& q);

/// Returns all warnings.
std::vector<Warning> FindWarnings(const MechanismDescription& description,
                                  const Structure& structure);

}  // namespace loopbench::harness
