// What is unusual in a model, measured by the length of its links.
#pragma once

#include <string>
#include <vector>

#include "mechanism/description/description.h"
#include "mechanism/simplify/structure.h"

namespace loopbench::harness {

// The length that lengths of one mechanism are compared with.

/// The longest extent [m] of the joints of one moving body, which for two joints is their distance,
/// or of a rod; where no body has two joints, the longest way from a joint to a centre of mass. 1
/// where there is none either. Geometry alone: where the scene stands does not matter.
double LinkLength(const MechanismDescription& description);

// What looks wrong about a mechanism before anything is run.

enum class WarningKind {
  kInconsistentStart,  ///< the start cannot be assembled
  kLocked,             ///< nothing can move
  kSingularStart,      ///< the start is a singular position
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
/// Ratio of singular values (Structure::conditioning) below which a start is near singular. Forces
/// in the loops are then some hundred times those that cause them. The scenes of the paper stay
/// above 0.1 but at their singular positions.
inline constexpr double kNearSingularRatio = 1e-2;

/// Distance of a centre of mass from the middle of its joints over the mechanism's length: poses go
/// through centres of mass, so that joints know their places to eps times as much; beyond this a
/// tolerance of 1e-12 cannot be met.
inline constexpr double kFarthestCentre = 1e3;

/// What can be said of the numbers alone, without an assembly: angles of more than a turn among
/// initial coordinates, frames and rests of springs. All in one warning, as sure as a guess can be:
/// such an angle may be meant.
std::vector<Warning> FindUnitWarnings(const MechanismDescription& description);

/// A warning for each guess that a start q in joint coordinates misses.
std::vector<Warning> FindGuessWarnings(const MechanismDescription& description,
                                       const VectorX<double>& q);

/// All of them.
std::vector<Warning> FindWarnings(const MechanismDescription& description,
                                  const Structure& structure);

}  // namespace loopbench::harness
