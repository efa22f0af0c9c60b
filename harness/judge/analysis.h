// Analysis of runs and models: growth, warnings, findings on structures.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "harness/base/record.h"
#include "harness/config/mechanism_reader.h"
#include "mechanism/description/description.h"
#include "mechanism/formulation/options.h"
#include "mechanism/simplify/structure.h"

namespace loopbench::harness {

// Growth of drift with time and of time with size: fits and their tests.

/// One run's drift: times since release in s, increasing, and drift in the unit of a length (signs
/// are dropped). Samples belong to accepted steps. A value that is not finite ends the run.
struct DriftSeries {
  std::vector<double> t;
  std::vector<double> value;
};

/// Best-fitting law of growth.
struct Hypothesis {
  std::string name = "none";  ///< "t^0.5", "t^1", "t^1.5", "t^2", "exponential" or "none"
  bool refutes_rivals = false;
  /// Root-mean-square residual of log drift: best rival over winner (geometric means over the
  /// members). 1 is a tie, 3 is clear. NaN without data.
  double ratio = NAN;
  /// Mean k of e^(k t) over the members [1/s], for any winner. NaN without data.
  double rate = NAN;
};

/// Compares the laws t^(1/2), t, t^(3/2), t^2 and e^(k t) on running maxima read at times spaced
/// evenly in log t, one series per member of the ensemble, all over the same window.
///
/// Fit: least squares of log(drift). The score of a hypothesis in one member is ln(mean square
/// residual) + m ln(n) / n with m free numbers (one for powers, two for e^(k t)) and n independent
/// readings: the Bayesian information criterion per reading. The winner has the least mean score
/// over the members. It is "none" if a power law wins whose exponent is further than 0.15 from the
/// mean of the fitted ones. It is also "none" if e^(k t) wins, but does not grow by a factor e or
/// does not beat a power law of free exponent.
///
/// The standard error of score differences over the members decides whether a rival is refuted:
/// members are independent, readings of one run are not (Vuong's model comparison, paired by run).
///
/// @param exponent  mean of the fitted exponents over the members, same window.
Hypothesis CompareHypotheses(std::span<const DriftSeries> readings, double exponent);

/// Result of the analysis. Exponents and spreads are NaN if not available.
struct Growth {
  double exponent = NAN;       ///< mean over the members, window [0.1 T, T]
  double spread = NAN;         ///< sample standard deviation over the members; NaN for one member
  double exponent_late = NAN;  ///< the same for the window [0.5 T, T]
  double spread_late = NAN;
  bool resolved = false;             ///< see AnalyseGrowth()
  std::string regime = "too-short";  ///< or "truncation", "round-off", "saturated"
  int members = 0;                   ///< number of runs
  double t_from = NAN;    ///< start of the first window, s; later than 0.1 T if the floor clips it
  double t_to = NAN;      ///< T, end of both windows, s; before the runs' end if drift saturates
  Hypothesis hypothesis;  ///< which law fits best in the first window
  bool hypothesis_resolved = false;  ///< see AnalyseGrowth()
};

/// A final drift below this many round-offs of the length is called "round-off". Rounding leaves a
/// thousand after 1e4 steps, truncation at the tightest tolerance in use (1e-12) more than 1e4.
inline constexpr double kRoundOffDrift = 1e3;

/// Returns the exponent p in "drift grows like t^p": the least-squares slope of log(running
/// maximum) against log t, per run and window; mean and spread over the ensemble.
///
/// The spread comes from 16 to 32 runs with perturbed starts: the residual scatter of one fit
/// underestimates its error, because residuals are periodic and correlated.
///
/// All members use the same windows: T is the earliest of t_end, a run's end and saturation (a
/// tenth of the length), and the first window starts no earlier than the last member leaves the
/// floor of ten round-offs.
///
/// *Resolved* means all of:
///  1. at least 8 members and windows that are not too short;
///  2. |exponent - exponent_late| <= max(s, 0.05) with s^2 the mean of the squares of the two
///     spreads: one power law holds on both windows within the scatter of runs;
///  3. s / sqrt(m) <= 0.125 for either spread and m members, because with a large spread the second
///     condition would hold for any numbers.
///
/// *Regime*: "round-off" if the geometric mean of the final running maxima is below `round_off`;
/// else "too-short" if a window is; else "saturated" if some member passes saturation before t_end
/// (the exponent then describes the time before); else "truncation".
///
/// *Hypothesis*: see CompareHypotheses(). It is resolved when it refutes its rivals and, for a
/// power law, the exponent is resolved too.
///
/// @param length  characteristic length of the mechanism (a link), in the unit of the drift.
/// @param round_off  in round-offs of the length
/// @throws std::invalid_argument if t and value differ in size or length is not positive.
Growth AnalyseGrowth(std::span<const DriftSeries> runs, double t_end, double length,
                     double round_off = kRoundOffDrift);

/// Returns the running maximum of |value| at `points` times spaced evenly in log t, from the first
/// positive time to the last. Empty if there is no interval or points < 2.
DriftSeries Envelope(const DriftSeries& series, int points);

/// Fit of the exponent p of cost = c size^p. Costs of real programs are not powers (fixed costs at
/// small sizes, caches at large ones), so the fit comes with two spreads: the standard error from
/// the residuals, and the range of slopes between neighbouring sizes.
struct PowerFit {
  int sizes = 0;                         ///< points used; below 2 everything else is NaN
  double smallest = 0.0, largest = 0.0;  ///< sizes at the ends
  double exponent = 0.0;
  double standard_error = 0.0;  ///< of the exponent; NaN with two points, which fit any line
  double coefficient = 0.0;     ///< cost at size 1 of the fitted line
  double slope_min = 0.0, slope_max = 0.0;  ///< between neighbouring sizes
};

/// Least squares of log(cost) against log(size). Points with a size or cost that is not positive
/// and finite are left out; of equal sizes the geometric mean of their costs counts as one point.
PowerFit FitPower(std::span<const double> sizes, std::span<const double> costs);

// Warnings about unusual models: sentences that name the parts.

/// Returns the length that lengths of one mechanism are compared with: the longest extent [m] of
/// the joints of one moving body (their distance for two joints) or of a rod. If no body has two
/// joints: the longest distance of a joint from a centre of mass, or else 1. Depends on geometry
/// alone, not on the position in space.
double LinkLength(const MechanismDescription& description);

/// Ratio of singular values (Structure::conditioning) below which a start is near singular. Loop
/// forces are then about a hundred times their causes. The paper's problems stay above 0.1 except
/// at their singular configurations.
inline constexpr double kNearSingularRatio = 1e-2;

/// Returns warnings from the numbers alone, without assembly. Angles above one turn in initial
/// coordinates, frames and spring rest angles give one combined warning: they may have been meant
/// in degrees.
std::vector<std::string> FindUnitWarnings(const MechanismDescription& description);

/// Returns a warning for each guess that a start q in joint coordinates misses.
std::vector<std::string> FindGuessWarnings(const MechanismDescription& description,
                                           const VectorX<double>& q);

/// Returns a warning for each spring or damper whose points coincide at a start q in joint
/// coordinates.
std::vector<std::string> FindForceWarnings(const MechanismDescription& description,
                                           const VectorX<double>& q);

/// Returns all warnings: on units and guesses, and on starts that are inconsistent, singular or
/// nearly singular. Others are on locked mechanisms, redundancy within the accuracy of the input,
/// parts that no joint connects to ground, and masses or centres of mass that lose digits.
std::vector<std::string> FindWarnings(const MechanismDescription& description,
                                      const Structure& structure);

// Findings of `explain` on a structure: idle degrees of freedom, hints on parts that may be
// mistakes, the degrees of freedom that a file expects, and the range of a driven coordinate.

/// A spin of bodies about a line that moves no other body: of a rod between two spherical joints
/// about the line of their centres. It is a finite motion. No coordinate of its own describes it.
struct IdleFreedom {
  std::vector<int> bodies;  ///< that turn together
  std::vector<int> joints;  ///< whose points lie on the line
};

/// Returns the idle freedoms of a spatial mechanism at its start, none of a planar one.
///
/// Bodies are grouped by the joints with one speed or less. A group with joints to two or more
/// other bodies may turn about the line of these joints' points, or of a cylindrical one's axis.
/// The spin is idle if all points lie on the line and no constraint forbids it: D^T V = 0 at each
/// of these joints. This needs neither rank nor matrices of the whole.
std::vector<IdleFreedom> FindIdleFreedoms(const MechanismDescription& description,
                                          const Structure& structure);

/// Returns a sentence for each of the freedoms: "spin of rod about the line of its joints A, B".
std::vector<std::string> NamesOf(const MechanismDescription& description,
                                 const std::vector<IdleFreedom>& idle);

/// Returns sentences on unusual parts: bodies that hang by one joint beside loops, and radii of
/// gyration out of proportion with the distances of joints and centres of mass.
std::vector<std::string> FindHints(const MechanismDescription& description,
                                   const Structure& structure);

/// Returns the error message of a mechanism that does not have the expected degrees of freedom,
/// with redundant constraints and idle freedoms; "" if it has them, if nothing is expected, or if
/// the start cannot be assembled, which is an error of its own.
std::string FreedomFault(const MechanismDescription& description, const ObservedQuantities& observe,
                         const Structure& structure);

/// End of the range of a driven coordinate, beyond which loops do not close.
struct RangeEnd {
  double value = 0.0;       ///< [rad] or [m]
  bool binds = false;       ///< else the search ended: a turn, or ten lengths from the start
  MechanismDescription at;  ///< with this position as its start
  /// Pairs of bodies that are in line there, and their joint: "rod and rocker at B".
  std::vector<std::string> in_line;
};

struct CoordinateRange {
  std::string why;  ///< why there is none; else empty
  double start = 0.0;
  RangeEnd low, high;
};

/// Finds the limits of a coordinate. It is held and moved in small steps. A step that does not
/// close, or that ends on another branch, is halved until it is negligible. Limits are accurate to
/// a few times the accepted gap, 1e-11 of the mechanism's size.
///
/// `joint` has one coordinate; a motion of the file is ignored. All other motions, except idle
/// ones, must follow from it and from "fixed" joints; these do not count if they leave no motion.
CoordinateRange FindRange(MechanismDescription description, int joint);

// Reasons not to rely on a finished run: warnings from its own record and from other runs of its
// problem. Drift and energy do not reveal a wrong branch; a comparison of final poses does.

/// Final poses are alike that differ by at most so many tolerances: over links and in rad.
inline constexpr double kMaxTolerances = 1000.0;

/// Final poses nearer than this, over links and in rad, are alike for rounding's sake: below 1e-11
/// comparisons hold all errors for round-off (harness/judge/judge.h).
inline constexpr double kRoundOffShare = 1e-11;

/// Returns the largest of the relative and the absolute tolerances of a run; NaN without.
double ToleranceOf(const Record& record);

bool IsFinishedRun(const Record& record);

/// Returns true for agreement with the reference to the end of the run. Published data are sparse,
/// so agreement with them does not prove the branch.
bool IsCertified(const Record& record);

struct Agreement {
  /// Runs of the same problem, horizon and tolerance with equal numbers have equal final poses. The
  /// largest such set is 1. 0 if there is no other run to compare with.
  std::int64_t cluster = 0;
  bool flagged = false;
  /// Agrees with a trusted run whose level restores the branch at every step.
  bool is_backed = false;
};

/// Returns one entry per record, in order. Compares finished accuracy runs of one problem
/// (`problem_id`: its full content) and horizon. Fixed-step runs are excluded because they give no
/// scale for a small difference.
///
/// If final poses differ at one tolerance, all these runs get a warning. The majority may be wrong:
/// formulations at one level make equal mistakes. A finer tolerance decides if all its runs agree
/// and cover several levels or coordinate sets. Then only the coarser runs that differ from it are
/// flagged. Integrators have different errors at one tolerance: if exactly one integrator's runs
/// all agree, they decide for that tolerance. Engines with compliant constraints
/// (FormulationRow::is_soft) are compared but not used as evidence.
///
/// Only trusted runs decide, one flag for each record (none: all are trusted): runs with own
/// warnings are only compared. If no run is trusted, all decide.
std::vector<Agreement> CompareFinalPoses(std::span<const Record> records,
                                         std::vector<bool> testifies = {});

/// Returns true if an external engine made the run.
bool IsPeer(const Record& record);

/// Largest difference of final poses, and its body: lengths over the link length, angles in rad,
/// axes unscaled. Infinite if a number is missing or not finite.
struct PoseDifference {
  double largest = 0.0;
  std::string body;
};
/// Returns the largest difference between any two of `runs` of one problem, in any order, over the
/// bodies that both have.
PoseDifference LargestDifference(std::span<const Record> runs);
PoseDifference DifferenceOf(const Record& a, const Record& b);

/// The codes of `warnings` (docs/reference/outcomes-and-warnings.md); programs may rely on them.
inline constexpr const char* kEnergyWarning = "energy";
inline constexpr const char* kSingularWarning = "singular-crossing";
inline constexpr const char* kRegularizedWarning = "regularized";
inline constexpr const char* kDriftWarning = "drift";
inline constexpr const char* kErrorWarning = "error";
inline constexpr const char* kRefinementWarning = "refinement";
inline constexpr const char* kDriveWarning = "drive";
inline constexpr const char* kSpringWarning = "spring";
inline constexpr const char* kStepsWarning = "steps";
inline constexpr const char* kMembersWarning = "ensemble-failures";
inline constexpr const char* kExponentWarning = "exponent";
inline constexpr const char* kDisagreementWarning = "disagreement";

/// A warning that one record can raise.
struct WarningRow {
  const char* code;
  const char* sentence;                         ///< its meaning
  bool (*is_raised)(const Record& record);      ///< by a finished accuracy run
  std::string (*number)(const Record& record);  ///< the run's number, and the expected one
};
/// Returns all warnings, except of disagreement with other runs, in the order of codes.
std::span<const WarningRow> WarningRows();

/// Returns the expected drift growth at the record's level; empty for unknown levels.
std::optional<DriftGrowth> GrowthAt(const Record& record);

/// Returns the warning codes from an accuracy record alone; none if the run did not finish.
std::vector<std::string> OwnCodes(const Record& record);
/// Returns them separated by spaces.
std::string OwnWarnings(const Record& record);

/// Sets `warnings` of every finished accuracy record, including warnings from comparisons of runs.
/// Sets `agreement`: the runs of equal problem, horizon and tolerance with equal final poses.
void SetWarnings(std::vector<Record>* records);

/// Returns the words of the record's warnings, in their order.
std::vector<std::string> WarningsOf(const Record& record);

/// Returns true if the record has warning `code`, or any warning if `code` is "".
bool HasWarning(const Record& record, const std::string& code = "");

}  // namespace loopbench::harness
