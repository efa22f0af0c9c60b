#include "harness/record/measures.h"

namespace loopbench::harness {
namespace {

using enum ValueType;
using enum Merge;
using enum Rule;
using Format::kExponent, Format::kFixed, Format::kInteger, Format::kScientific, Format::kSeconds,
    Format::kShortest;

constexpr bool kSameBits = true;  // needs_same_arithmetic

// Accelerations' drift is not compared: at the level of round-off it moves with every change of
// code. Two units stand in the words, so that reports of comparisons go on without them.
constexpr Measure kMeasures[] = {
    // what names a case
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
    {"step", kNumber, {"step", "s", kShortest}},
    {"horizon", kNumber, {"horizon", "s", kShortest}},
    {"threads", kNumber},
    {"alpha", kNumber},
    {"beta", kNumber},
    {"case_id", kText, {"case"}},
    {"content", kText},
    {"set", kText},
    {"id", kText, {"id"}},
    {"version", kText, {"version"}},
    {"experiment_index", kNumber},
    {"checksum", kText},

    // how it ended
    {"outcome", kText, {"outcome"}, {kOfEnding}, kOutcome},
    {"message", kText, {"message"}, {kOfEnding}},
    {"t_reached", kNumber, {"t reached", "s", kSeconds}, {kSmallest}},

    // what was run
    {"scene_id", kText, {"scene"}},
    {"compiled", kText},
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

    // what speaks against a run
    {"doubts", kText, {"doubts"}, {}, kDoubts},
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
    {"singularity_passages", kNumber, {"singular passages", "", kInteger}, {kSum}},
    {"softened_steps", kNumber, {"softened steps", "", kInteger}, {kSum}},
    {"softened_evaluations", kNumber, {"softened evaluations", "", kInteger}, {kSum}},
    {"mode_changes", kNumber, {"changes of mode", "", kInteger}, {kSum}},

    // work
    {"start_hash", kText, {}, {}, kHash},
    {"rhs_operations", kNumber, {"rhs operations", "", kInteger}, {}, kCount},
    {"plan_depth", kNumber, {"plan depth", "", kInteger}, {}, kCount},
    {"plan_largest_join", kNumber, {"largest join", "", kInteger}, {}, kCount},
    {"plan_*", kNumber},
    {"allocations", kNumber, {}, {}, kCount, kSameBits},
    {"bytes", kNumber, {"", "B"}, {}, kCount, kSameBits},
    {"steps", kNumber, {"steps", "", kInteger}, {kSum}, kCount, kSameBits},
    {"rejected", kNumber, {"rejected", "", kInteger}, {kSum}, kCount, kSameBits},
    {"rhs_evaluations", kNumber, {"rhs evaluations", "", kInteger}, {kSum}, kCount, kSameBits},
    {"rhs_equivalents", kNumber, {"rhs equivalents", "", kInteger}, {kSum}},
    {"projection_iterations", kNumber, {"projections' Newton steps", "", kInteger}, {kSum}},
    {"restarts", kNumber, {"restarts", "", kInteger}, {kSum}, kCount, kSameBits},
    {"newton_iterations", kNumber, {"newton iterations", "", kInteger}, {kSum}, kCount, kSameBits},
    {"newton_failures", kNumber, {"newton failures", "", kInteger}, {kSum}, kCount, kSameBits},
    {"newton_jacobians", kNumber, {"jacobians", "", kInteger}, {kSum}},
    {"newton_rhs_evaluations",
     kNumber,
     {"rhs for jacobians", "", kInteger},
     {kSum},
     kCount,
     kSameBits},
    {"newton_dual_evaluations",
     kNumber,
     {"dual evaluations", "", kInteger},
     {kSum},
     kCount,
     kSameBits},
    {"newton_*", kNumber},
    {"state_hash", kText, {"state hash"}, {kHashOfAll}, kHash, kSameBits},
    {"derivative_hash", kText, {}, {}, kHash, kSameBits},

    // drift
    {"drift_position_max", kNumber, {"drift, position", "m", kScientific}, {kLargest}, kError},
    {"drift_rotation_max", kNumber, {"drift, rotation", "rad", kScientific}, {kLargest}, kError},
    {"drift_velocity_max", kNumber, {"drift, velocity [m/s]", "", kScientific}, {kLargest}, kError},
    {"drift_acceleration_max", kNumber, {"drift, accel.", "m/s2", kScientific}, {kLargest}},
    {"drift_ruled_by", kText, {"drift ruled by"}},
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
    {"energy_supplied", kNumber, {"work supplied", "J", kScientific}, {kSum}},
    {"energy_dissipated", kNumber, {"work dissipated", "J", kScientific}, {kSum}},
    {"energy_growth_exponent", kNumber, {"energy error's growth exponent", "", kExponent}},
    {"energy_*", kNumber},

    // distance from what is known
    {"error_final", kNumber, {"error at the end [m]", "", kScientific}, {}, kError},
    {"error_ruled_by", kText, {"error ruled by"}},
    {"error_*", kNumber},
    {"branch_error_max", kNumber, {"branch error", "rad", kScientific}, {}, kError},
    {"branch_*", kNumber},
    {"closed_form_error_max", kNumber, {"closed-form error", "rad", kScientific}, {}, kError},
    {"closed_form_*", kNumber},

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
    {"series.rhs_ns", kNumbers, {"", "ns"}, {}, kTime},
    {"series.wall_s", kNumbers, {"", "s"}, {}, kTime},
    {"series.cpu_ns", kNumbers, {"", "ns"}, {}, kTime},
    {"repeats", kNumber, {"repeats", "", kInteger}},
    {"rhs_ns_median", kNumber, {"rhs median", "ns", kFixed}},
    {"rhs_ns_p10", kNumber, {"rhs p10", "ns", kFixed}},
    {"rhs_ns_p90", kNumber, {"rhs p90", "ns", kFixed}},
    {"rhs_ns_min", kNumber, {"rhs min", "ns", kFixed}},
    {"rhs_*", kNumber},
    {"ns_per_body", kNumber, {"per body", "ns", kFixed}},
    {"step_us_median", kNumber, {"step median", "us", kSeconds}},
    {"step_*", kNumber},
    {"wall_s", kNumber, {"wall", "s", kSeconds}, {kSum}},
    {"wall_s_median", kNumber, {"wall median", "s", kSeconds}},
    {"wall_s_min", kNumber, {"wall min", "s", kSeconds}},
    {"wall_s_p10", kNumber, {"wall p10", "s", kSeconds}},
    {"wall_s_p90", kNumber, {"wall p90", "s", kSeconds}},
    {"wall_*", kNumber},
    {"cpu_s", kNumber, {"CPU", "s", kSeconds}, {kSum}},
    {"cpu_*", kNumber},
    {"realtime_factor", kNumber, {"real-time factor", "", kSeconds}},
    {"aa_spread", kNumber, {"A/A spread, rhs", "", kSeconds}},
    {"aa_spread_wall", kNumber, {"A/A spread, wall", "", kSeconds}},
    {"aa_*", kNumber},
    {"load1", kNumber, {"load", "", kSeconds}},
    {"load_average", kNumber},
    {"processors", kNumber, {"processors", "", kInteger}},
    {"governor", kText, {"governor"}},
    {"noise", kText, {"noise"}},

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

    // where it comes from
    {"machine", kText},
    {"compiler", kText},
    {"flags", kText},
    {"libm", kText},
    {"commit", kText},

    // what decides a run or stands beside records, and may come to stand in them
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

}  // namespace

std::span<const Measure> BuiltInMeasures() { return kMeasures; }

}  // namespace loopbench::harness
