#include <algorithm>
#include <iterator>
#include <map>

#include "harness/base/record.h"
#include "mechanism/description/registration.h"

namespace loopbench::harness {
namespace {

using enum ValueType;
using enum Merge;
using enum Rule;
using Format::kExponent, Format::kFixed, Format::kInteger, Format::kScientific, Format::kSeconds,
    Format::kShortest;

constexpr Repeats kSameBits = Repeats::kUnderOneArithmetic, kVaries = Repeats::kNever;

/// Returns the row of a count of work; parts of a mechanism are added.
constexpr Measure Work(std::string_view key, std::string_view words) {
  return {key, kNumber, {words, "", kInteger}, {kSum}, kCount, kSameBits};
}
/// Returns the row of an error that `compare` does not judge; the largest of all parts counts.
constexpr Measure Error(std::string_view key, std::string_view words, std::string_view unit) {
  return {key, kNumber, {words, unit, kScientific}, {kLargest}};
}

// Drift of accelerations is not compared: at round-off level it varies with every code change. Two
// units are part of the words, so that comparison reports omit them.
constexpr Measure kMeasures[] = {
    // identification of a case
    {"kind", kText, {"kind"}},
    {"experiment", kText, {"experiment"}},
    {"benchmark", kText},
    {"mechanism", kText, {"mechanism"}},
    {"formulation", kText, {"formulation"}},
    {"enforcement", kText, {"enforcement"}},
    {"coordinates", kText, {"coordinates"}},
    {"solver", kText, {"solver"}},
    {"integrator", kText, {"integrator"}},
    {"jacobian", kText, {"jacobian"}},
    {"scalar", kText, {"scalar"}},
    {"rtol", kNumber, {"rtol", "", kShortest}},
    {"atol", kNumber, {"atol", "", kShortest}},
    {"atol_*", kNumber},
    {"step", kNumber, {"step", "s", kShortest}},
    {"max_step", kNumber},
    {"initial_step", kNumber},
    {"max_newton_iterations", kNumber},
    {"newton_coefficient", kNumber},
    {"horizon", kNumber, {"horizon", "s", kShortest}},
    {"threads", kNumber},
    {"execution", kText, {"execution"}},
    {"alpha", kNumber},
    {"beta", kNumber},
    {"case_id", kText, {"case"}},
    {"config_hash", kText},
    {"set", kText, {}, {}, kNone, kVaries},
    {"id", kText, {"id"}},
    {"version", kText, {"version"}},
    {"experiment_index", kNumber, {}, {}, kNone, kVaries},
    {"checksum", kText},
    {"format", kNumber},

    // outcome
    {"outcome", kText, {"outcome"}, {kOfEnding}, kOutcome},
    {"message", kText, {"message"}, {kOfEnding}},
    {"t_reached", kNumber, {"t reached", "s", kSeconds}, {kSmallest}},

    // configuration of the run
    {"problem_id", kText, {"problem"}},
    {"preprocessed", kText},
    {"link_length", kNumber, {"link", "m", kShortest}},
    {"position_goal", kNumber, {"projection's goal", "m", kScientific}},
    {"bodies", kNumber, {"bodies", "", kInteger}, {}, kEqual},
    {"joints", kNumber, {"joints", "", kInteger}, {}, kEqual},
    {"loops", kNumber, {"loops", "", kInteger}, {}, kEqual},
    {"dof", kNumber, {"dof", "", kInteger}, {}, kEqual},

    // ensembles
    {"ensemble", kNumber, {"ensemble", "", kInteger}, {}, kEqual},
    {"ensemble_size", kNumber, {"ensemble size", "", kInteger}},
    {"ensemble_branch_kept", kNumber, {"branch kept", "", kInteger}, {}, kEqual},
    {"ensemble_failed", kNumber, {"ensemble failed", "", kInteger}, {}, kEqual},
    {"ensemble_first_failed", kText, {"first failed member"}},
    {"ensemble_first_left", kText, {"first member off branch"}},
    {"ensemble_started_off", kNumber, {"started off branch", "", kInteger}},
    {"ensemble_branch_bound", kNumber, {"branch bound", "rad", kShortest}},
    {"ensemble_branch_error_max", kNumber, {"ensemble branch error", "rad", kScientific}},
    {"ensemble_closed_form_error_max", kNumber, {"ensemble closed form error", "rad", kScientific}},
    {"ensemble_energy_error_max", kNumber, {"ensemble energy error", "J", kScientific}},
    {"ensemble_drift_position_max", kNumber, {"ensemble drift", "m", kScientific}},
    {"ensemble_*", kNumber},

    // warnings
    {"warnings", kText, {"warnings"}, {}, kWarnings},
    {"agreement", kNumber, {"ends alike", "", kInteger}},

    // rank and conditioning
    {"evaluations", kNumber, {}, {}, kEqual},
    {"rank", kNumber, {}, {}, kEqual},
    {"rank_min", kNumber, {"rank min", "", kInteger}, {kSumOfAll}, kEqual},
    {"rank_constraints_min", kNumber, {}, {kSumOfAll}},
    {"rank_*", kNumber},
    {"rcond_min", kNumber, {"rcond min", "", kScientific}, {kSmallest}},
    {"rcond_min_t", kNumber, {"at time", "s", kSeconds}, {kWith, "rcond_min"}},
    {"rcond_*", kNumber},
    {"singularity_distance_min", kNumber, {"singularity distance", "", kScientific}, {kSmallest}},
    {"singularity_distance_min_t",
     kNumber,
     {"at time", "s", kSeconds},
     {kWith, "singularity_distance_min"}},
    {"singularity_crossings", kNumber, {"singular crossings", "", kInteger}, {kSum}},
    {"regularized_steps", kNumber, {"regularized steps", "", kInteger}, {kSum}},
    {"regularized_evaluations", kNumber, {"regularized evaluations", "", kInteger}, {kSum}},
    {"library_evaluations", kNumber, {"evaluations in the library", "", kInteger}, {kSum}},
    {"mode_changes", kNumber, {"changes of mode", "", kInteger}, {kSum}},

    // work
    {"start_hash", kText, {}, {}, kHash},
    {"rhs_operations", kNumber, {"rhs operations", "", kInteger}, {}, kCount},
    {"flops", kNumber, {"weighted operations", "", kInteger}, {kSum}, kCount},
    {"additions", kNumber, {"+ -", "", kInteger}, {kSum}},
    {"multiplications", kNumber, {"*", "", kInteger}, {kSum}},
    {"divisions", kNumber, {"/", "", kInteger}, {kSum}},
    {"roots", kNumber, {"sqrt", "", kInteger}, {kSum}},
    {"sines", kNumber, {"sin cos", "", kInteger}, {kSum}},
    {"other", kNumber, {"other functions", "", kInteger}, {kSum}},
    {"depth", kNumber, {"depth", "", kInteger}, {kLargest}, kCount},
    {"flops_per_body", kNumber, {"weighted operations per body", "", kFixed}, {}, kNone},
    {"plan_depth", kNumber, {"plan depth", "", kInteger}, {}, kCount},
    {"plan_largest_join", kNumber, {"largest join", "", kInteger}, {}, kCount},
    {"plan_*", kNumber},
    {"allocations", kNumber, {}, {}, kCount, kSameBits},
    {"bytes", kNumber, {"", "B"}, {}, kCount, kSameBits},
    Work("steps", "steps"),
    Work("rejected", "rejected"),
    Work("rhs_evaluations", "rhs evaluations"),
    {"rhs_equivalents", kNumber, {"rhs equivalents", "", kInteger}, {kSum}},
    {"projection_iterations", kNumber, {"projections' Newton steps", "", kInteger}, {kSum}},
    Work("restarts", "restarts"),
    Work("newton_iterations", "newton iterations"),
    Work("newton_failures", "newton failures"),
    {"newton_jacobians", kNumber, {"jacobians", "", kInteger}, {kSum}},
    Work("newton_rhs_evaluations", "rhs for jacobians"),
    Work("newton_dual_evaluations", "dual evaluations"),
    {"newton_*", kNumber},
    {"state_hash", kText, {"state hash"}, {kHashOfAll}, kHash, kSameBits},
    {"derivative_hash", kText, {}, {}, kHash, kSameBits},

    // drift
    {"drift_position_max", kNumber, {"drift, position", "m", kScientific}, {kLargest}, kError},
    {"drift_rotation_max", kNumber, {"drift, rotation", "rad", kScientific}, {kLargest}, kError},
    {"drift_velocity_max", kNumber, {"drift, velocity [m/s]", "", kScientific}, {kLargest}, kError},
    {"drift_acceleration_max", kNumber, {"drift, accel.", "m/s2", kScientific}, {kLargest}},
    {"drift_dominated_by", kText, {"drift dominated by"}},
    {"drift_*", kNumber},
    {"drift.loop.*", kNumber, {"*", "m", kScientific}, {kOfEachPart}},
    {"worst_loop", kText, {"worst loop"}, {kWith, "drift_position_max"}},
    {"loop_closure_max", kNumber, {"loop closure", "m", kScientific}, {kLargest}, kError},
    {"loop_*", kNumber},
    {"correction_max", kNumber, {"correction", "m", kScientific}, {kLargest}},
    {"correction_growth_exponent", kNumber, {"correction's growth exponent", "", kExponent}},
    {"correction_*", kNumber},

    // energy
    {"energy_error_max", kNumber, {"energy error", "J", kScientific}, {kSumOfAll}, kError},
    {"energy_error_relative", kNumber, {"energy error / kinetic", "", kScientific}},
    {"energy_scale", kNumber, {"energy that moves", "J", kScientific}, {kSum}},
    {"energy_sensitivity", kNumber, {"energy per unit of error", "J", kScientific}, {kSum}},
    {"energy_supplied", kNumber, {"work supplied", "J", kScientific}, {kSum}},
    {"energy_dissipated", kNumber, {"work dissipated", "J", kScientific}, {kSum}},
    {"energy_growth_exponent", kNumber, {"energy error's growth exponent", "", kExponent}},
    {"energy_*", kNumber},

    // distance from known results
    {"refinement_difference", kNumber, {"distance from the finer run", "", kScientific}},
    {"reference", kText, {"reference"}},
    {"reference_file", kText},
    {"reference_error", kNumber, {"reference's error", "m", kScientific}},
    {"reference_runs", kText, {"reference runs"}},
    {"reference_error_*", kNumber, {"reference's error, *", "", kScientific}},
    {"reference_valid_until", kNumber, {"reference valid until", "s", kSeconds}},
    {"error_final", kNumber, {"error at the end [m]", "", kScientific}, {}, kError},
    {"error_dominated_by", kText, {"error dominated by"}},
    {"error_position_end", kNumber, {"error at the end", "m", kScientific}, {kLargest}, kError},
    {"error_position_max", kNumber, {"error", "m", kScientific}, {kLargest}, kError},
    {"error_position_rms", kNumber, {"error, rms", "m", kScientific}, {kLargest}, kError},
    {"error_rotation_max", kNumber, {"error, rotation", "rad", kScientific}, {kLargest}, kError},
    {"error_velocity_max", kNumber, {"error, velocity [m/s]", "", kScientific}, {kLargest}, kError},
    Error("error_angular_velocity_max", "error, angular velocity [rad/s]", ""),
    Error("error_angle_max", "error, joint angles", "rad"),
    Error("error_displacement_max", "error, joint displacements", "m"),
    Error("error_angle_rate_max", "error, joint speeds [rad/s]", ""),
    Error("error_displacement_rate_max", "error, joint speeds [m/s]", ""),
    Error("error_over_uncertainty", "error / published uncertainty", ""),
    Error("error_energy_max", "error of the energy", "J"),
    Error("error_phase_max", "phase error", "s"),
    Error("error_path_max", "path error", "m"),
    Error("error_interpolation_max", "interpolation", "m"),
    {"error_points", kNumber, {"times compared", "", kInteger}, {kSmallest}},
    {"error_*", kNumber},
    {"trajectory", kText, {"trajectory"}},
    {"trajectory_hash", kText, {"hash of its file"}},
    {"trajectory_output", kText, {"rows at"}},
    {"trajectory_rows", kNumber, {"rows", "", kInteger}},
    {"trajectory_open", kNumber, {"numbers not unique", "", kInteger}},
    {"trajectory_interpolation_max", kNumber, {"interpolation of rows", "m", kScientific}},
    {"branch_error_max", kNumber, {"branch error", "rad", kScientific}, {}, kError},
    {"branch_*", kNumber},
    {"closed_form_error_max", kNumber, {"closed-form error", "rad", kScientific}, {}, kError},
    {"closed_form_*", kNumber},

    // simpler models (harness/cli/commands.h)
    {"model", kText, {"model"}},
    {"model_motion", kText, {"motion"}},
    {"model_error", kNumber, {"model error", "m", kScientific}, {}, kError},
    {"model_error_at", kText, {"of point"}},
    {"model_points", kNumber, {"points compared", "", kInteger}, {}, kEqual},
    {"model_accepts", kNumber, {"accepted up to", "m", kShortest}},
    {"model_verdict", kText, {"verdict"}},
    {"model_rhs_ratio", kNumber, {"right-hand sides / whole", "", kSeconds}},
    {"model_wall_ratio", kNumber, {"wall / whole", "", kSeconds}},
    {"model_*", kAny},

    // growth
    {"growth_exponent", kNumber, {"growth exponent", "", kExponent}},
    {"growth_spread", kNumber, {"growth spread", "", kSeconds}},
    {"growth_exponent_late", kNumber, {"growth exponent, late", "", kExponent}},
    {"growth_spread_late", kNumber, {"growth spread, late", "", kSeconds}},
    {"growth_regime", kText, {"growth regime"}},
    {"growth_resolved", kFlag, {"growth resolved"}},
    {"growth_hypothesis", kText, {"growth hypothesis"}},
    {"growth_hypothesis_resolved", kFlag, {"hypothesis resolved"}},
    {"growth_hypothesis_ratio", kNumber, {"residual ratio", "", kExponent}},
    {"growth_rate", kNumber, {"growth rate", "1/s", kSeconds}},
    {"growth_from", kNumber, {"window from", "s", kSeconds}},
    {"growth_to", kNumber, {"window to", "s", kSeconds}},
    {"growth_*", kNumber},

    // times
    {"instructions", kNumber, {}, {}, kInstructions, kSameBits},
    {"series.rhs_ns", kNumbers, {"", "ns"}, {}, kTime, kVaries},
    {"series.wall_s", kNumbers, {"", "s"}, {}, kTime, kVaries},
    {"series.cpu_ns", kNumbers, {"", "ns"}, {}, kTime},
    {"repeats", kNumber, {"repeats", "", kInteger}},
    {"rhs_ns_median", kNumber, {"rhs median", "ns", kFixed}, {}, kNone, kVaries},
    {"rhs_ns_p10", kNumber, {"rhs p10", "ns", kFixed}, {}, kNone, kVaries},
    {"rhs_ns_p90", kNumber, {"rhs p90", "ns", kFixed}, {}, kNone, kVaries},
    {"rhs_ns_min", kNumber, {"rhs min", "ns", kFixed}, {}, kNone, kVaries},
    {"rhs_*", kNumber},
    {"ns_per_body", kNumber, {"per body", "ns", kFixed}, {}, kNone, kVaries},
    {"step_us_median", kNumber, {"step median", "us", kSeconds}, {}, kNone, kVaries},
    {"step_longest", kNumber, {"longest step", "s", kSeconds}, {kLargest}},
    {"step_shortest", kNumber, {"shortest step", "s", kSeconds}, {kSmallest}},
    {"step_shortest_t", kNumber, {"at time", "s", kSeconds}, {kWith, "step_shortest"}},
    {"drive_frequency", kNumber, {"fastest drive", "rad/s", kShortest}, {kLargest}},
    {"step_*", kNumber},
    {"spring_reversals", kNumber, {"spring reversals", "", kInteger}, {kSum}},
    {"spring_reversal", kText, {"spring"}, {kWith, "spring_reversal_t"}},
    {"spring_reversal_t", kNumber, {"at time", "s", kSeconds}, {kSmallest}},
    {"wall_s", kNumber, {"wall", "s", kSeconds}, {kSum}, kNone, kVaries},
    {"wall_s_median", kNumber, {"wall median", "s", kSeconds}, {}, kNone, kVaries},
    {"wall_s_min", kNumber, {"wall min", "s", kSeconds}, {}, kNone, kVaries},
    {"wall_s_p10", kNumber, {"wall p10", "s", kSeconds}, {}, kNone, kVaries},
    {"wall_s_p90", kNumber, {"wall p90", "s", kSeconds}, {}, kNone, kVaries},
    {"wall_*", kNumber},
    {"compile_s", kNumber, {"compile", "s", kSeconds}, {kSum}, kNone, kVaries},
    {"cpu_s", kNumber, {"CPU", "s", kSeconds}, {kSum}, kNone, kVaries},
    {"cpu_*", kNumber},
    {"realtime_factor", kNumber, {"real-time factor", "", kSeconds}, {}, kNone, kVaries},
    {"aa_spread", kNumber, {"A/A spread, rhs", "", kSeconds}, {}, kNone, kVaries},
    {"aa_spread_wall", kNumber, {"A/A spread, wall", "", kSeconds}, {}, kNone, kVaries},
    {"aa_*", kNumber},
    {"calibration_ns", kNumber, {"calibration, rhs", "ns", kFixed}, {}, kNone, kVaries},
    {"calibration_wall_ns", kNumber, {"calibration, wall", "ns", kFixed}, {}, kNone, kVaries},
    {"discarded_repetitions", kNumber, {"discarded repetitions", "", kInteger}, {}, kNone, kVaries},
    {"load1", kNumber, {"load", "", kSeconds}, {}, kNone, kVaries},
    {"load_average", kNumber},
    {"processors", kNumber, {"processors", "", kInteger}, {}, kNone, kVaries},
    {"governor", kText, {"governor"}, {}, kNone, kVaries},
    {"noise", kText, {"noise"}, {}, kNone, kVaries},

    // series
    {"series.drift", kNumbers, {"drift, running maximum", "m", kScientific}},
    {"series.drift_t", kNumbers, {"time", "s", kSeconds}},
    {"series.energy_error", kNumbers, {"energy error", "J", kScientific}},
    {"series.energy_t", kNumbers, {"time", "s", kSeconds}},
    {"series.branch", kNumbers, {"branch error", "rad", kScientific}},
    {"series.branch_t", kNumbers, {"time", "s", kSeconds}},
    {"series.t", kNumbers, {"time", "s", kSeconds}},
    {"series.angle.*", kNumbers, {"angle", "rad", kSeconds}},
    {"series.displacement.*", kNumbers, {"displacement", "m", kSeconds}},
    {"series.opening_*", kNumbers, {"time", "s", kSeconds}},
    {"series.opening.angle.*", kNumbers, {"angle", "rad", kSeconds}},
    {"series.opening.displacement.*", kNumbers, {"displacement", "m", kSeconds}},
    {"series.final.*", kNumbers, {}, {kOfEachPart}},
    {"series.*", kNumbers},

    // origin
    {"machine", kText, {}, {}, kNone, kVaries},
    {"compiler", kText},
    {"flags", kText},
    {"libm", kText, {}, {}, kNone, kVaries},
    {"commit", kText},

    // reserved: configuration and metadata keys that may become record keys
    {"document"},
    {"seed"},
    {"perturb"},
    {"memory_mb"},
    {"series_points"},
    {"libraries"},
    {"command"},
    {"date"},
    {"real_ns"},
};

// Table of measures: the built-in rows (measures.cpp), and rows that programs add.

using enum ValueType;

bool IsFamily(const Measure& measure) { return measure.key.ends_with('*'); }

std::string_view BeginningOf(const Measure& family) {
  return family.key.substr(0, family.key.size() - 1);
}

struct MeasureTable {
  MeasureTable() {
    for (const Measure& measure : BuiltInMeasures()) Add(measure);
  }
  void Add(const Measure& measure) {
    const Measure& row = rows.emplace_back(measure);
    if (!IsFamily(row)) by_key.emplace(row.key, &row);
  }

  std::deque<Measure> rows;
  std::map<std::string_view, const Measure*> by_key;
  std::deque<std::string> words;  ///< words of added rows
};

MeasureTable& AllMeasures() {
  static MeasureTable table;
  return table;
}

bool IsKey(std::string_view key) {
  if (key.ends_with('*')) key.remove_suffix(1);
  constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyz0123456789_.";
  return !key.empty() && key.find_first_not_of(kLetters) == std::string_view::npos;
}

/// Returns true if both are one key, or the new one is a family that includes a known one.
bool Takes(const Measure& fresh, const Measure& known) {
  return fresh.key == known.key || (IsFamily(fresh) && known.key.starts_with(BeginningOf(fresh)));
}

/// Throws std::invalid_argument for `fresh[index]` unless it can join the table.
void RequireMeasure(std::span<const Measure> fresh, std::size_t index) {
  const Measure& measure = fresh[index];
  const auto refuse = [&](std::string_view found, std::string_view expected) {
    RefuseRow("measure", measure.key, found, expected);
  };
  if (!IsKey(measure.key)) refuse("no key", "a-z, 0-9, '_' and '.', perhaps '*' at the end");
  const auto known = [&](const Measure& other) { return Takes(measure, other); };
  if (std::ranges::any_of(Measures(), known) || std::ranges::any_of(fresh.first(index), known)) {
    refuse("a key that there is", "each key once");
  }
  if (measure.type == kAny) refuse("no type", "one");
  if (measure.merging.how != Merge::kWith) return;
  const auto other = std::ranges::find(fresh, measure.merging.with, &Measure::key);
  const Measure* with = other != fresh.end() ? &*other : FindMeasure(measure.merging.with);
  if (with == nullptr ||
      (with->merging.how != Merge::kLargest && with->merging.how != Merge::kSmallest)) {
    refuse("merged with no such key", "another whose largest or smallest value is taken");
  }
}

}  // namespace

std::span<const Measure> BuiltInMeasures() { return kMeasures; }

const std::deque<Measure>& Measures() { return AllMeasures().rows; }

void AddMeasures(std::span<const Measure> fresh) {
  for (std::size_t i = 0; i < fresh.size(); ++i) RequireMeasure(fresh, i);
  const auto keep = [](std::string_view& text) { text = AllMeasures().words.emplace_back(text); };
  for (Measure measure : fresh) {
    keep(measure.key);
    keep(measure.heading.words);
    keep(measure.heading.unit);
    keep(measure.merging.with);
    AllMeasures().Add(measure);
  }
}

std::vector<const Measure*> AddedMeasures() {
  std::vector<const Measure*> added;
  for (std::size_t i = BuiltInMeasures().size(); i < Measures().size(); ++i) {
    added.push_back(&Measures()[i]);
  }
  return added;
}

const Measure* FindMeasure(std::string_view key) {
  if (const auto own = AllMeasures().by_key.find(key); own != AllMeasures().by_key.end())
    return own->second;
  const Measure* longest = nullptr;
  for (const Measure& measure : Measures()) {
    if (!IsFamily(measure) || !key.starts_with(BeginningOf(measure))) continue;
    if (longest == nullptr || measure.key.size() > longest->key.size()) longest = &measure;
  }
  return longest;
}

ValueType TypeOf(std::string_view key) {
  const Measure* measure = FindMeasure(key);
  return measure == nullptr ? kAny : measure->type;
}

bool IsReserved(std::string_view name) {
  // columns that work-precision and JSON tables add
  constexpr std::string_view kOfTables[] = {"cost",    "error",      "front",
                                            "problem", "provenance", "reason"};
  return FindMeasure(name) != nullptr || std::ranges::find(kOfTables, name) != std::end(kOfTables);
}

std::string_view Describe(ValueType type) {
  switch (type) {
    case kAny:
      break;
    case kNumber:
      return "a number or null";
    case kText:
      return "a string or null";
    case kFlag:
      return "true, false or null";
    case kNumbers:
      return "an array of numbers";
  }
  return "null, a bool, a number, a string or an array of numbers";
}

}  // namespace loopbench::harness
