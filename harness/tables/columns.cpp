#include "harness/tables/columns.h"

#include <algorithm>
#include <array>

namespace loopbench::harness {
namespace {

using enum Format;

TableColumn Make(const char* key, const char* header, Format format = kText) {
  return {.key = key, .header = header, .format = format, .abbreviations = {}};
}

// What was run and how it ended: the keys that drift.csv and timing.csv share.
std::vector<TableColumn> CaseColumns() {
  return {
      Make("experiment", "experiment"),   Make("mechanism", "mechanism"),
      Make("formulation", "formulation"), Make("enforcement", "enforcement"),
      Make("coordinates", "coordinates"), Make("solver", "solver"),
      Make("integrator", "integrator"),   Make("rtol", "rtol", kShortest),
      Make("atol", "atol", kShortest),    Make("horizon", "horizon [s]", kShortest),
      Make("outcome", "outcome"),         Make("t_reached", "t reached [s]", kSeconds),
  };
}

std::vector<TableColumn> Join(std::vector<TableColumn> head, const std::vector<TableColumn>& tail) {
  head.insert(head.end(), tail.begin(), tail.end());
  return head;
}

// What records hold besides the columns of the tables.
std::vector<TableColumn> OtherColumns() {
  return {
      Make("kind", "kind"),
      Make("id", "id"),
      Make("case_id", "case"),
      Make("version", "version"),
      Make("growth_exponent_late", "growth exponent, late", kExponent),
      Make("growth_spread_late", "growth spread, late", kSeconds),
      Make("growth_hypothesis_ratio", "residual ratio", kExponent),
      Make("growth_rate", "growth rate [1/s]", kSeconds),
      Make("growth_from", "window from [s]", kSeconds),
      Make("growth_to", "window to [s]", kSeconds),
      Make("ensemble_size", "ensemble size", kInteger),
      Make("ensemble_failed", "ensemble failed", kInteger),
      Make("energy_error_relative", "energy error / kinetic", kScientific),
      Make("energy_scale", "energy that moves [J]", kScientific),
      Make("link_length", "link [m]", kShortest),
      Make("position_goal", "projection's goal [m]", kScientific),
      Make("scene_id", "scene"),
      Make("ensemble_first_failed", "first failed member"),
      Make("ensemble_first_left", "first member off branch"),
      Make("ensemble_branch_kept", "branch kept", kInteger),
      Make("ensemble_started_off", "started off branch", kInteger),
      Make("ensemble_branch_bound", "branch bound [rad]", kShortest),
      Make("ensemble_branch_error_max", "ensemble branch error [rad]", kScientific),
      Make("ensemble_closed_form_error_max", "ensemble closed form error [rad]", kScientific),
      Make("ensemble_energy_error_max", "ensemble energy error [J]", kScientific),
      Make("ensemble_drift_position_max", "ensemble drift [m]", kScientific),
      Make("energy_supplied", "work supplied [J]", kScientific),
      Make("energy_dissipated", "work dissipated [J]", kScientific),
      Make("projection_iterations", "projections' Newton steps", kInteger),
      Make("rhs_equivalents", "rhs equivalents", kInteger),
      Make("correction_growth_exponent", "correction's growth exponent", kExponent),
      Make("energy_growth_exponent", "energy error's growth exponent", kExponent),
      Make("rcond_min_t", "at time [s]", kSeconds),
      Make("softened_steps", "softened steps", kInteger),
      Make("softened_evaluations", "softened evaluations", kInteger),
      Make("mode_changes", "changes of mode", kInteger),
      Make("singularity_distance_min", "singularity distance", kScientific),
      Make("singularity_distance_min_t", "at time [s]", kSeconds),
      Make("singularity_passages", "singular passages", kInteger),
      Make("wall_s", "wall [s]", kSeconds),
      Make("cpu_s", "CPU [s]", kSeconds),
      Make("newton_iterations", "newton iterations", kInteger),
      Make("newton_failures", "newton failures", kInteger),
      Make("newton_jacobians", "jacobians", kInteger),
      Make("newton_rhs_evaluations", "rhs for jacobians", kInteger),
      Make("newton_dual_evaluations", "dual evaluations", kInteger),
      Make("jacobian", "jacobian"),
      Make("plan_depth", "plan depth", kInteger),
      Make("plan_largest_join", "largest join", kInteger),
      Make("rhs_operations", "rhs operations", kInteger),
      Make("series.drift", "drift, running maximum [m]", kScientific),
      Make("series.drift_t", "time [s]", kSeconds),
      Make("series.energy_error", "energy error [J]", kScientific),
      Make("series.energy_t", "time [s]", kSeconds),
      Make("series.t", "time [s]", kSeconds),
      Make("series.branch", "branch error [rad]", kScientific),
      Make("series.branch_t", "time [s]", kSeconds),
  };
}

}  // namespace

const TableColumn* KnownColumn(const std::string& key) {
  static const std::vector<TableColumn> kOther = OtherColumns();
  for (const auto* list : {&DriftColumns(), &TimingColumns(), &PrecisionColumns(), &kOther}) {
    const auto it = std::ranges::find(*list, key, &TableColumn::key);
    if (it != list->end()) return &*it;
  }
  return nullptr;
}

const std::vector<TableColumn>& CompactCaseColumns() {
  static const std::vector<TableColumn> kColumns = {
      Make("mechanism", "mechanism"),
      Make("formulation", "formul."),
      {"enforcement",
       "level",
       kText,
       {{"acceleration", "accel"}, {"velocity", "veloc"}, {"position", "posit"}}},
      {"coordinates", "coord", kText, {{"absolute", "abs"}}},
      {"solver", "solv", kText, {{"as-published", "publ"}, {"rank-revealing", "rank"}}},
      Make("rtol", "rtol", kShortest),
      Make("horizon", "T/s", kShortest),
      {"outcome",
       "outcome",
       kText,
       {{"finished", "ok"},
        {"step-too-small", "small step"},
        {"inconsistent-start", "bad start"},
        {"inconsistent-motion", "bad motion"},
        {"newton-failure", "newton"},
        {"integrator-error", "integrator"}}},
  };
  return kColumns;
}

const std::vector<TableColumn>& DriftColumns() {
  static const std::vector<TableColumn> kColumns =
      Join(CaseColumns(), {
                              Make("doubts", "doubts"),
                              Make("agreement", "ends alike", kInteger),
                              Make("drift_position_max", "drift, position [m]", kScientific),
                              Make("drift_rotation_max", "drift, rotation [rad]", kScientific),
                              Make("drift_velocity_max", "drift, velocity [m/s]", kScientific),
                              Make("drift_acceleration_max", "drift, accel. [m/s2]", kScientific),
                              Make("loop_closure_max", "loop closure [m]", kScientific),
                              Make("correction_max", "correction [m]", kScientific),
                              Make("worst_loop", "worst loop"),
                              Make("energy_error_max", "energy error [J]", kScientific),
                              Make("growth_exponent", "growth exponent", kExponent),
                              Make("growth_spread", "growth spread", kSeconds),
                              Make("growth_regime", "growth regime"),
                              Make("growth_resolved", "growth resolved"),
                              Make("growth_hypothesis", "growth hypothesis"),
                              Make("growth_hypothesis_resolved", "hypothesis resolved"),
                              Make("ensemble", "ensemble", kInteger),
                              Make("steps", "steps", kInteger),
                              Make("rejected", "rejected", kInteger),
                              Make("rhs_evaluations", "rhs evaluations", kInteger),
                              Make("rank_min", "rank min", kInteger),
                              Make("rcond_min", "rcond min", kScientific),
                              Make("state_hash", "state hash"),
                              Make("restarts", "restarts", kInteger),
                              Make("branch_error_max", "branch error [rad]", kScientific),
                              Make("closed_form_error_max", "closed-form error [rad]", kScientific),
                              Make("message", "message"),
                          });
  return kColumns;
}

const std::vector<TableColumn>& TimingColumns() {
  static const std::vector<TableColumn> kColumns =
      Join(CaseColumns(), {
                              Make("bodies", "bodies", kInteger),
                              Make("joints", "joints", kInteger),
                              Make("loops", "loops", kInteger),
                              Make("dof", "dof", kInteger),
                              Make("rhs_ns_median", "rhs median [ns]", kFixed),
                              Make("rhs_ns_p10", "rhs p10 [ns]", kFixed),
                              Make("rhs_ns_p90", "rhs p90 [ns]", kFixed),
                              Make("ns_per_body", "per body [ns]", kFixed),
                              Make("step_us_median", "step median [us]", kSeconds),
                              Make("wall_s_median", "wall median [s]", kSeconds),
                              Make("realtime_factor", "real-time factor", kSeconds),
                              Make("repeats", "repeats", kInteger),
                              Make("rhs_ns_min", "rhs min [ns]", kFixed),
                              Make("wall_s_min", "wall min [s]", kSeconds),
                              Make("wall_s_p10", "wall p10 [s]", kSeconds),
                              Make("wall_s_p90", "wall p90 [s]", kSeconds),
                              Make("aa_spread", "A/A spread, rhs", kSeconds),
                              Make("aa_spread_wall", "A/A spread, wall", kSeconds),
                              Make("load1", "load", kSeconds),
                              Make("processors", "processors", kInteger),
                              Make("governor", "governor"),
                              Make("noise", "noise"),
                          });
  return kColumns;
}

const std::vector<TableColumn>& PrecisionColumns() {
  static const std::vector<TableColumn> kColumns = [] {
    std::vector<TableColumn> columns = CaseColumns();
    const auto rtol = std::ranges::find(columns, "rtol", &TableColumn::key);
    columns.insert(rtol, Make("scalar", "scalar"));
    return Join(std::move(columns),
                {
                    Make("error_final", "error at the end [m]", kScientific),
                    Make("error_ruled_by", "error ruled by"),
                    Make("drift_position_max", "drift, position [m]", kScientific),
                    Make("drift_ruled_by", "drift ruled by"),
                    Make("steps", "steps", kInteger),
                    Make("rejected", "rejected", kInteger),
                    Make("restarts", "restarts", kInteger),
                    Make("rhs_evaluations", "rhs evaluations", kInteger),
                });
  }();
  return kColumns;
}

const std::vector<TableColumn>& CompactPrecisionColumns() {
  static const std::vector<TableColumn> kColumns = [] {
    std::vector<TableColumn> columns = CompactCaseColumns();
    std::erase_if(columns, [](const TableColumn& column) {
      return column.key == "solver" || column.key == "horizon";
    });
    const auto rtol = std::ranges::find(columns, "rtol", &TableColumn::key);
    columns.insert(rtol, Make("scalar", "scalar"));
    const std::vector<std::pair<std::string, std::string>> parts = {{"truncation", "trunc"},
                                                                    {"round-off", "round"}};
    return Join(std::move(columns), {
                                        Make("error_final", "error/m", kScientific),
                                        {"error_ruled_by", "by", kText, parts},
                                        Make("drift_position_max", "drift/m", kScientific),
                                        {"drift_ruled_by", "by", kText, parts},
                                        Make("steps", "steps", kInteger),
                                    });
  }();
  return kColumns;
}

const std::vector<TableColumn>& CompactDriftColumns() {
  static const std::vector<TableColumn> kColumns =
      Join(CompactCaseColumns(), {
                                     Make("drift_position_max", "drift [m]", kScientific),
                                     Make("energy_error_max", "dE [J]", kScientific),
                                     Make("growth_exponent", "slope", kExponent),
                                 });
  return kColumns;
}

const std::vector<TableColumn>& CompactTimingColumns() {
  static const std::vector<TableColumn> kColumns =
      Join(CompactCaseColumns(), {
                                     Make("bodies", "bodies", kInteger),
                                     Make("rhs_ns_median", "rhs [ns]", kFixed),
                                     Make("wall_s_median", "wall [s]", kSeconds),
                                 });
  return kColumns;
}

}  // namespace loopbench::harness
