// An experiment: which mechanisms, columns, tolerances and horizons are run, and how each case is
// called. Plain data; experiment_reader.h fills it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "harness/config/mechanism_reader.h"
#include "harness/config/published_series.h"
#include "harness/record/record.h"
#include "harness/record/select.h"
#include "mechanism/description/topology.h"
#include "mechanism/formulation/options.h"
#include "mechanism/simplify/compile.h"

namespace loopbench::harness {

/// Where the Newton iteration of an implicit profile has its Jacobians from.
enum class JacobianKind { kForward, kFiniteDifference };

/// Who evaluates right-hand sides: the library, or code generated from its text
/// (harness/generate/), without or with fused multiply-add.
enum class Execution { kLibrary, kGenerated, kGeneratedFma };

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
inline constexpr std::array<std::string_view, 3> kNames<Execution> = {"library", "generated",
                                                                      "generated-fma"};

/// What a run computes in, narrowest first (harness/precision/).
enum class Scalar { kFloat, kDouble, kLongDouble, kFloat128 };
template <>
inline constexpr std::array<std::string_view, 4> kNames<Scalar> = {"float", "double", "long-double",
                                                                   "float128"};
/// The other enums have theirs beside them, in mechanism/.
inline std::string_view ToString(Scalar value) {
  return kNames<Scalar>[static_cast<std::size_t>(value)];
}
inline std::string_view ToString(Execution value) {
  return kNames<Execution>[static_cast<std::size_t>(value)];
}

/// The value with this name, or nothing.
template <class Enum>
std::optional<Enum> Parse(std::string_view name) {
  for (std::size_t i = 0; i < kNames<Enum>.size(); ++i) {
    if (kNames<Enum>[i] == name) return static_cast<Enum>(i);
  }
  return std::nullopt;
}
/// Levels are a table that grows.
template <>
inline std::optional<Enforcement> Parse<Enforcement>(std::string_view name) {
  return FindLevel(name);
}

/// One way of imposing the loops: a column of the tables. For reduction the solver as published is
/// the mechanism's fixed independent set, the rank-revealing one the automatic partition.
struct Column {
  std::string formulation = "odca";  ///< a registered name (formulations.h)
  Enforcement enforcement = Enforcement::kAcceleration;
  Coordinates coordinates = Coordinates::kJoint;
  SolverKind solver = SolverKind::kRankRevealing;
  /// Of "baumgarte", when the file gives them.
  std::optional<BaumgarteGains> gains = std::nullopt;
  int threads = 1;  ///< that may work on one right-hand side
  Execution execution = Execution::kLibrary;

  friend bool operator==(const Column&, const Column&) = default;
};

/// The most threads that files may ask for: more than processors have.
inline constexpr int kMostThreads = 256;

/// "odca/acceleration/joint/plain", "odca/baumgarte(5, 5)/joint/rank-revealing",
/// "odca/velocity/joint/rank-revealing/2-threads".
std::string ToString(const Column& column);

/// A mechanism and how long it runs.
struct ExperimentScene {
  std::string name;  ///< the mechanism's name unless overridden; unique
  /// The mechanism file, resolved against the experiment's folder; empty for one that stands in the
  /// experiment itself or is a member of a family.
  std::filesystem::path path;
  MechanismFile mechanism;
  std::vector<double> horizons;   ///< [s], different
  std::vector<std::string> tags;  ///< for filters and tables
  /// What accuracy runs are held against in place of a certified reference.
  std::optional<PublishedSeries> series = std::nullopt;
};

/// A held coordinate drawn uniformly between two bounds [rad or m].
struct DrawnCoordinate {
  std::string joint;
  double from = 0.0, to = 0.0;
};

/// Perturbed repetitions for every case that matches all given lists; an empty list matches all.
struct EnsembleRule {
  int size = 16;                         ///< runs per case, at least 2
  std::uint64_t seed = 1;                ///< of the generator of perturbations
  double perturb = 0.02;                 ///< amplitude on the held coordinates [rad or m]; or else
  std::vector<DrawnCoordinate> between;  ///< held coordinates drawn anew, the others as they are
  double branch_bound = 1e-6;            ///< a run further from its branch has left it [rad]
  std::vector<std::string> scenes;
  std::vector<double> horizons;
  std::vector<double> tolerances;
  std::vector<std::string> formulations;
  std::vector<Enforcement> enforcements;
  std::vector<Coordinates> coordinates;
  std::vector<SolverKind> solvers;
};

/// When a case is given up. Its row then says so.
struct Limits {
  double cpu_s = 10.0;             ///< CPU time [s]: keeps a whole suite within minutes
  std::int64_t steps = 1'000'000;  ///< accepted steps: far more than any case that ends needs
  double memory_mb = 2048.0;       ///< address space of the case's process [MiB]
};

/// A family of mechanisms of growing size (mechanism/description/library.h), timed per right-hand
/// side only.
struct TimingFamily {
  std::string family;      ///< a SizedFamily (harness/config/benchmarks.h)
  std::vector<int> sizes;  ///< of its members
  std::vector<Column> columns;
};

/// Timing runs, separate from those that measure accuracy.
struct Timing {
  int repeats = 5;              ///< 0 switches timing off; 5 make a median with a spread
  double tolerance = 1e-8;      ///< rtol = atol
  double horizon = 0.0;         ///< [s]; 0: the shortest of each scene
  std::vector<Column> columns;  ///< those of the experiment unless given
  /// Instead of one tolerance and horizon for all: every accuracy case with its own integrator,
  /// tolerance or step, and horizon, so that each accuracy row has a timing row of the same keys.
  bool cases = false;
  std::vector<TimingFamily> families;
};

/// Runs in several scalars (harness/precision/ladder.h), separate from the others.
struct Precision {
  std::vector<Scalar> scalars;     ///< different; empty: none
  std::vector<double> tolerances;  ///< those of the experiment unless given
  double horizon = 0.0;            ///< [s]; 0: the shortest of each scene
  double reference = 1e-25;        ///< tolerance of the reference: double's reach squared
};

/// Certified references that accuracy runs are held against (harness/precision/make_reference.h).
struct ReferenceOptions {
  /// "long-double", "float128" (of planar mechanisms), or the first that certifies to the end.
  std::string scalar = "as-needed";
  int points = 101;     ///< times, evenly from the start to the end
  double cpu_s = 20.0;  ///< of one witness [s]; it certifies as far as it gets
};

/// What rows of a trajectory hold, in the order of their columns (harness/trajectory/columns.h).
enum class OutputPart { kJoints, kBodies, kPoints, kReactions, kForces, kEnergy };
template <>
inline constexpr std::array<std::string_view, 6> kNames<OutputPart> = {
    "joints", "bodies", "points", "reactions", "forces", "energy"};
/// Axes of reactions: the ground's, or frame F of each joint, which is fixed on its first body.
enum class OutputAxes { kGround, kJoint };
template <>
inline constexpr std::array<std::string_view, 2> kNames<OutputAxes> = {"ground", "joint"};

/// A trajectory of each accuracy case. Times are said in one of four ways.
struct OutputOptions {
  double step = 0.0;            ///< [s] from row to row, 0: said otherwise
  int number = 0;               ///< of rows, evenly from the start to the end; 0: likewise
  std::vector<double> times;    ///< [s], rising; those beyond a horizon are left out
  bool accepted_steps = false;  ///< the ends of the integrator's own steps
  /// The integrator's steps end at the times; else they lie on dense output and the run is the same
  /// as without.
  bool exact = false;
  std::vector<OutputPart> quantities = {OutputPart::kJoints, OutputPart::kBodies,
                                        OutputPart::kPoints, OutputPart::kReactions,
                                        OutputPart::kForces, OutputPart::kEnergy};
  OutputAxes axes = OutputAxes::kGround;

  bool Has(OutputPart part) const;
};

/// The times of rows of a run until `horizon`; none for accepted steps.
std::vector<double> OutputTimes(const OutputOptions& output, double horizon);
/// All that it says, for the identity of cases.
std::string ToString(const OutputOptions& output);

struct Experiment {
  std::string name;
  std::string comment;
  std::filesystem::path path;
  std::vector<ExperimentScene> scenes;
  std::vector<Column> columns;
  std::vector<double> tolerances;   ///< rtol = atol; may be empty where there are
  std::vector<double> fixed_steps;  ///< [s]; each makes cases without error test besides those
  std::vector<std::string> integrators = {"ode45"};  ///< profiles, crossed with all of them
  JacobianKind jacobian = JacobianKind::kForward;    ///< of no consequence to explicit profiles
  std::vector<EnsembleRule> ensembles;               ///< the first that matches a case counts
  Limits limits;
  CompileOptions compile;   ///< what is simplified before a run
  bool refine = false;      ///< accuracy cases run again at a tenth of their tolerance
  int series_points = 200;  ///< points kept of a time series for figures
  Timing timing;
  Precision precision;
  std::optional<ReferenceOptions> reference;
  std::optional<OutputOptions> output;
  /// Of a sweep: this combination's value on each axis, by the axis's name. The values are in every
  /// record, so that filters and tables can use them. Empty without a sweep.
  Record parameters;
  std::vector<Selection> exclusions;  ///< cases that match one of them are left out
};

/// One row of a table: everything that decides a run, except the mechanism itself.
struct Case {
  std::size_t scene = 0;  ///< index into Experiment::scenes
  std::string mechanism;  ///< the scene's name
  Column column;
  std::string integrator;
  JacobianKind jacobian = JacobianKind::kForward;
  double rtol = 0.0;       ///< 0 where the step is fixed
  double atol = 0.0;       ///< likewise
  double horizon = 0.0;    ///< [s]
  double step = 0.0;       ///< [s]; of all steps, without error test; 0: the tolerance chooses them
  int ensemble = 1;        ///< runs; 1: the scene as it is, no perturbation
  std::uint64_t seed = 0;  ///< of the ensemble
  double perturb = 0.0;    ///< amplitude of the ensemble [rad or m], or else
  std::vector<DrawnCoordinate> between = {};  ///< as in the rule
  double branch_bound = 1e-6;                 ///< [rad]
  Limits limits = {};
  /// CaseKeys(), made with the case; where it is run also "case_id" and "content"
  /// (harness/run/case_identity.h). What runs a case writes them, whatever they say.
  Record keys = {};
};

/// Whether the rule applies to the case (its ensemble fields do not matter).
bool Matches(const EnsembleRule& rule, const Case& one);

/// The keys that name a case, as they stand in every table row: docs/reference/records.md,
/// then the experiment's parameters. With a fixed step rtol and atol are empty and "step" is a key.
Record CaseKeys(const Experiment& experiment, const Case& one);

/// "1e-08", or "step 0.001": what decides how long the case's steps are.
std::string SettingOf(const Case& one);

/// In proportion to the steps that a run over `horizon` takes: the horizon over the fixed step, or
/// times rtol^(-1/5), as with a pair of order 5. Only cases of one kind compare.
double ExpectedSteps(const Case& one);

/// All columns but peers with so many threads; those that differed in nothing else become one.
void UseThreads(int threads, Experiment& experiment);

/// All cases for accuracy, in the order scene, horizon, column, integrator, tolerance, fixed step,
/// without excluded ones. A peer, which has its own integrator, is there once for each tolerance.
std::vector<Case> Expand(const Experiment& experiment);

/// One case for each precision ladder, in the order scene, column, without excluded ones; empty
/// without scalars. Tolerances are those of the ladder.
std::vector<Case> ExpandLadders(const Experiment& experiment);

/// All cases for timing, in the order scene, column, integrator, without excluded ones, or with
/// `timing.cases` those for accuracy, each of which is one run; empty when timing is off.
std::vector<Case> ExpandTiming(const Experiment& experiment);

// Limits as keys and values: what the content of a case says of them.

/// Each limit under its key in files.
Record RecordOf(const Limits& limits);

}  // namespace loopbench::harness
