// Experiment: mechanisms, methods, tolerances and horizons, as plain data (experiment_reader.h).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "harness/base/record.h"
#include "harness/config/mechanism_reader.h"
#include "harness/config/options.h"
#include "harness/config/published_series.h"
#include "mechanism/description/topology.h"
#include "mechanism/formulation/options.h"
#include "mechanism/simplify/compile.h"

namespace loopbench::harness {

/// Source of Jacobians for the Newton iteration of implicit profiles.
enum class JacobianKind { kForward, kFiniteDifference };

/// Evaluation of right-hand sides: by the library, with or without its fast paths, or by code
/// generated from it (harness/generate/), without or with fused multiply-add. Without fast paths
/// and without fused multiply-add bits are equal.
enum class Execution { kLibrary, kGeneral, kGenerated, kGeneratedFma };

inline bool IsGenerated(Execution execution) { return execution >= Execution::kGenerated; }

/// Names in files and tables, by value of the enum.
template <class Enum>
inline constexpr std::array<std::string_view, 0> kNames = {};
template <>
inline constexpr std::array<std::string_view, 2> kNames<Coordinates> = {"joint", "absolute"};
template <>
inline constexpr std::array<std::string_view, 2> kNames<SolverKind> = {"plain", "rank-revealing"};
template <>
inline constexpr std::array<std::string_view, 2> kNames<JacobianKind> = {"forward",
                                                                         "finite-difference"};

template <>
inline constexpr std::array<std::string_view, 4> kNames<Execution> = {"library", "general",
                                                                      "generated", "generated-fma"};

/// Floating-point type of a run, narrowest first (harness/precision/).
enum class Scalar { kFloat, kDouble, kLongDouble, kFloat128 };
template <>
inline constexpr std::array<std::string_view, 4> kNames<Scalar> = {"float", "double", "long-double",
                                                                   "float128"};
/// ToString of the other enums is in mechanism/.
inline std::string_view ToString(Scalar value) {
  return kNames<Scalar>[static_cast<std::size_t>(value)];
}
inline std::string_view ToString(Execution value) {
  return kNames<Execution>[static_cast<std::size_t>(value)];
}

/// Returns the value with this name, or nothing.
template <class Enum>
std::optional<Enum> Parse(std::string_view name) {
  for (std::size_t i = 0; i < kNames<Enum>.size(); ++i) {
    if (kNames<Enum>[i] == name) return static_cast<Enum>(i);
  }
  return std::nullopt;
}
/// Looks up a level in the table of registered levels.
template <>
inline std::optional<Enforcement> Parse<Enforcement>(std::string_view name) {
  return FindLevel(name);
}

/// Method that imposes the loop constraints. For reduction, the plain solver uses the mechanism's
/// fixed independent set, the rank-revealing solver the automatic partition.
struct Method {
  std::string formulation = "odca";  ///< registered name (formulations.h)
  Enforcement enforcement = Enforcement::kAcceleration;
  Coordinates coordinates = Coordinates::kJoint;
  SolverKind solver = SolverKind::kRankRevealing;
  /// Gains of "baumgarte", if given in the file.
  std::optional<BaumgarteGains> gains = std::nullopt;
  int threads = 1;  ///< threads for one right-hand side
  Execution execution = Execution::kLibrary;

  friend bool operator==(const Method&, const Method&) = default;
};

/// Returns true for a program with its own integrator.
bool IsPeer(const Method& method);

/// Maximum number of threads in files; more than processors have.
inline constexpr int kMaxThreads = 256;

/// "odca/acceleration/joint/plain", "odca/baumgarte(5, 5)/joint/rank-revealing",
/// "odca/velocity/joint/rank-revealing/2-threads".
std::string ToString(const Method& method);

/// Problem: a mechanism and its simulated times.
struct ExperimentProblem {
  std::string name;  ///< the mechanism's name unless overridden; unique
  /// Mechanism file, with the experiment's folder; empty for an included mechanism or a family.
  std::filesystem::path path;
  MechanismFile mechanism;
  std::vector<double> horizons;   ///< [s], different
  std::vector<std::string> tags;  ///< for filters and tables
  /// Published data, used instead of a certified reference.
  std::optional<PublishedSeries> series = std::nullopt;
};

/// Fixed coordinate, drawn uniformly between two bounds [rad or m].
struct DrawnCoordinate {
  std::string joint;
  double from = 0.0, to = 0.0;
};

/// Perturbed repetitions for every case that matches all given lists; an empty list matches all.
struct EnsembleRule {
  int size = 16;                         ///< runs per case, at least 2
  std::uint64_t seed = 1;                ///< seed of the random perturbations
  double perturb = 0.02;                 ///< amplitude on the fixed coordinates [rad or m]; or
  std::vector<DrawnCoordinate> between;  ///< drawn coordinates; others are unchanged
  double branch_bound = 1e-6;            ///< branch error beyond which a run has left it [rad]
  std::vector<std::string> problems;
  std::vector<double> horizons;
  std::vector<double> tolerances;
  std::vector<std::string> formulations;
  std::vector<Enforcement> enforcements;
  std::vector<Coordinates> coordinates;
  std::vector<SolverKind> solvers;
};

/// Limits at which a case is stopped; its row contains the reason.
struct Limits {
  double cpu_s = 10.0;             ///< CPU time [s]: keeps a whole suite within minutes
  std::int64_t steps = 1'000'000;  ///< accepted steps; far more than completed cases need
  double memory_mb = 2048.0;       ///< address space of the case's process [MiB]
};

/// A family of mechanisms of several sizes (library.h), timed per right-hand side only.
struct TimingFamily {
  std::string family;      ///< a SizedFamily (harness/config/benchmarks.h)
  std::vector<int> sizes;  ///< sizes of its members
  std::vector<Method> methods;
};

/// Timing runs, separate from accuracy runs.
struct Timing {
  int repeats = 5;              ///< 0: no timing; 5 give a median with a spread
  double tolerance = 1e-8;      ///< rtol = atol
  double horizon = 0.0;         ///< [s]; 0: the shortest of each problem
  std::vector<Method> methods;  ///< default: as in the experiment
  /// If true, every accuracy case is timed with its own integrator, tolerance or step, and horizon,
  /// so that each accuracy row has a timing row with the same keys.
  bool cases = false;
  std::vector<TimingFamily> families;
};

/// Runs in several scalars (harness/precision/ladder.h), separate from the others.
struct Precision {
  std::vector<Scalar> scalars;     ///< different; empty: none
  std::vector<double> tolerances;  ///< default: as in the experiment
  double horizon = 0.0;            ///< [s]; 0: the shortest of each problem
  double reference = 1e-25;        ///< tolerance of the reference: double's reach squared
};

/// Certified references for accuracy runs (harness/precision/make_reference.h).
struct ReferenceOptions {
  /// "long-double", "float128" (planar only), or "as-needed": the first that certifies to the end.
  std::string scalar = "as-needed";
  int points = 101;     ///< number of times, evenly from start to end
  double cpu_s = 20.0;  ///< CPU time of one integration [s]; it certifies the completed part
};

/// Quantities in rows of a trajectory, in the order of columns (harness/observers/trajectory.h).
enum class OutputPart { kJoints, kBodies, kPoints, kReactions, kForces, kEnergy };
template <>
inline constexpr std::array<std::string_view, 6> kNames<OutputPart> = {
    "joints", "bodies", "points", "reactions", "forces", "energy"};
/// Axes of reactions: ground axes, or frame F of each joint, which is fixed to its first body.
enum class OutputAxes { kGround, kJoint };
template <>
inline constexpr std::array<std::string_view, 2> kNames<OutputAxes> = {"ground", "joint"};

/// Trajectory of each accuracy case. Times are given in one of four ways.
struct OutputOptions {
  double step = 0.0;            ///< [s] between rows; 0: not used
  int number = 0;               ///< number of rows, evenly from start to end; 0: not used
  std::vector<double> times;    ///< [s], ascending; times beyond a horizon are left out
  bool accepted_steps = false;  ///< the ends of the integrator's own steps
  /// True: steps end at the times. False: rows are of dense output, and the run is unchanged.
  bool exact = false;
  std::vector<OutputPart> quantities = {OutputPart::kJoints, OutputPart::kBodies,
                                        OutputPart::kPoints, OutputPart::kReactions,
                                        OutputPart::kForces, OutputPart::kEnergy};
  OutputAxes axes = OutputAxes::kGround;

  bool Has(OutputPart part) const;
};

/// Returns the times of rows of a run until `horizon`; none for accepted steps.
std::vector<double> OutputTimes(const OutputOptions& output, double horizon);
/// Returns all options as text, for the identity of cases.
std::string ToString(const OutputOptions& output);

/// Absolute tolerances by quantity. In files and experiments 0 stands for the relative tolerance.
struct AbsoluteTolerances {
  double length = 0.0, angle = 0.0;         ///< [m], [rad]; coordinates of quaternions are angles
  double speed = 0.0, angular_speed = 0.0;  ///< [m/s], [rad/s]

  std::array<double*, 4> All() { return {&length, &angle, &speed, &angular_speed}; }
};

struct Experiment {
  std::string name;
  std::string comment;
  std::filesystem::path path;
  std::vector<ExperimentProblem> problems;
  std::vector<Method> methods;
  std::vector<double> tolerances;  ///< rtol, and atol; may be empty if there are fixed_steps
  double atol = 0.0;               ///< 0: as rtol
  std::optional<AbsoluteTolerances> atols = std::nullopt;  ///< instead of atol
  Integration integration;
  std::vector<double> fixed_steps;                   ///< [s]; additional cases without error test
  std::vector<std::string> integrators = {"ode45"};  ///< profiles, crossed with all steps
  JacobianKind jacobian = JacobianKind::kForward;    ///< unused by explicit profiles
  std::vector<EnsembleRule> ensembles;               ///< the first match of a case applies
  Limits limits;
  CompileOptions compile;   ///< simplifications before a run
  bool refine = false;      ///< accuracy cases run again at a tenth of their tolerance
  int series_points = 200;  ///< points kept of a time series for figures
  Timing timing;
  Precision precision;
  std::optional<ReferenceOptions> reference;
  std::optional<OutputOptions> output;
  /// Values of this combination of a sweep, by axis name, as in every record.
  Record parameters;
  std::vector<Selection> exclusions;  ///< matching cases are left out
};

/// Case: all settings that determine a run, except the mechanism.
struct Case {
  std::size_t problem = 0;  ///< index in Experiment::problems
  std::string mechanism;    ///< the problem's name
  Method method;
  std::string integrator;
  JacobianKind jacobian = JacobianKind::kForward;
  double rtol = 0.0;                             ///< 0 if the step is fixed
  double atol = 0.0;                             ///< 0 if the step is fixed
  std::optional<AbsoluteTolerances> atols = {};  ///< instead of atol; all positive
  Integration integration = {};
  double horizon = 0.0;    ///< [s]
  double step = 0.0;       ///< fixed step [s], without error test; 0: set by the tolerance
  int ensemble = 1;        ///< number of runs; 1: no perturbation
  std::uint64_t seed = 0;  ///< seed of the ensemble
  double perturb = 0.0;    ///< amplitude of the ensemble [rad or m], or
  std::vector<DrawnCoordinate> between = {};  ///< as in the rule
  double branch_bound = 1e-6;                 ///< [rad]
  Limits limits = {};
  /// CaseKeys() of the case, for the record; for runs also "case_id" and "content" (run.h).
  Record keys = {};
};

/// Returns true if the rule applies to the case, whose ensemble fields are ignored.
bool Matches(const EnsembleRule& rule, const Case& one);

/// Returns the keys of a case in every record (docs/reference/records.md), then the experiment's
/// parameters. With a fixed step, rtol and atol are empty and "step" is a key. Other options of the
/// integrator are keys if they are not defaults and affect the case.
Record CaseKeys(const Experiment& experiment, const Case& one);

/// "1e-08", or "step 0.001": the setting that determines step lengths.
std::string SettingOf(const Case& one);

/// Returns a number proportional to the expected steps of a run: horizon / step, or horizon
/// rtol^(-1/5) as for a pair of order 5. Comparable only between cases of one kind.
double ExpectedSteps(const Case& one);

/// Sets the threads of all methods except peers, and merges methods that become equal.
void UseThreads(int threads, Experiment& experiment);

/// Returns all cases for accuracy that are not excluded, in the order problem, horizon, method,
/// integrator, tolerance, fixed step. Peers, which have own integrators, have one per tolerance.
std::vector<Case> Expand(const Experiment& experiment);

/// Returns one case per precision ladder, except excluded ones, in the order problem, method.
std::vector<Case> ExpandLadders(const Experiment& experiment);

/// Returns all timing cases except excluded cases, in the order problem, method, integrator. With
/// `timing.cases`, returns the accuracy cases, each as one run; else integrators without embedding
/// have none. Empty if timing is off.
std::vector<Case> ExpandTiming(const Experiment& experiment);

/// Returns each limit under its key in files, for the content of a case.
Record RecordOf(const Limits& limits);

}  // namespace loopbench::harness
