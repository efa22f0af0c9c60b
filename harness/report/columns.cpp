#include "harness/report/columns.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "harness/config/config_error.h"
#include "harness/config/spelling.h"

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

// The same for a terminal: words that differ in their first letters can be short.
std::vector<TableColumn> CompactCaseColumns() {
  return {
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
      Make("wall_s", "wall [s]", kSeconds),
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

const TableColumn* FindKnown(const std::string& key) {
  static const std::vector<TableColumn> kOther = OtherColumns();
  for (const auto* list : {&DriftColumns(), &TimingColumns(), &PrecisionColumns(), &kOther}) {
    const auto it = std::ranges::find(*list, key, &TableColumn::key);
    if (it != list->end()) return &*it;
  }
  return nullptr;
}

// Keys of per-loop and per-body values, which are no parameters.
bool IsFamily(const std::string& key) {
  return key.starts_with("series.") || key.starts_with("drift.loop.");
}

// How a value without a column of its own is printed: by its type.
Format FormatOf(const std::string& key, std::span<const Record> rows) {
  for (const Record& row : rows) {
    const Value* value = row.Find(key);
    if (value == nullptr || std::holds_alternative<std::monostate>(*value)) continue;
    if (std::holds_alternative<std::int64_t>(*value)) return kInteger;
    if (std::holds_alternative<double>(*value)) return kShortest;
    return kText;
  }
  return kText;
}

}  // namespace

TableColumn ColumnOf(const std::string& key, std::span<const Record> rows) {
  if (const TableColumn* known = FindKnown(key)) return *known;
  if (key.starts_with("series.angle.")) return Make(key.c_str(), "angle [rad]", kSeconds);
  if (key.starts_with("drift.loop.")) {
    return Make(key.c_str(), (key.substr(11) + " [m]").c_str(), kScientific);
  }
  return Make(key.c_str(), key.c_str(), FormatOf(key, rows));
}

std::string UnitOf(const TableColumn& column) {
  const std::size_t open = column.header.rfind('[');
  if (open == std::string::npos || column.header.back() != ']') return "";
  return column.header.substr(open + 1, column.header.size() - open - 2);
}

std::vector<std::string> KeysOf(std::span<const Record> rows) {
  std::vector<std::string> keys;
  for (const Record& row : rows) {
    for (const auto& [key, value] : row.items()) {
      if (std::ranges::find(keys, key) == keys.end()) keys.push_back(key);
    }
  }
  return keys;
}

void RequireKey(const std::string& option, const std::string& key, std::span<const Record> rows) {
  const std::vector<std::string> keys = KeysOf(rows);
  // a column of the tables may be empty in every record
  if (std::ranges::find(keys, key) != keys.end() || FindKnown(key) != nullptr) return;
  std::vector<std::string> scalars;
  std::ranges::copy_if(keys, std::back_inserter(scalars),
                       [](const std::string& known) { return !IsFamily(known); });
  const std::string nearest = NearestSpelling(key, keys);
  const std::string cure = nearest.empty() ? "" : fmt::format(" (did you mean \"{}\"?)", nearest);
  throw ConfigError(fmt::format("{}: found \"{}\", which no record has{}; expected one of {}",
                                option, key, cure, fmt::join(scalars, ", ")));
}

std::vector<TableColumn> WithParameters(std::vector<TableColumn> columns,
                                        std::span<const Record> rows) {
  std::vector<std::string> keys;
  for (const Record& row : rows) {
    // the keys of a case end at its id; what follows is its result
    for (const auto& [key, value] : row.items()) {
      if (key == "case_id" || key == "outcome") break;
      if (std::ranges::find(keys, key) == keys.end()) keys.push_back(key);
    }
  }
  std::vector<TableColumn> parameters;
  for (const std::string& key : keys) {
    if (FindKnown(key) == nullptr) parameters.push_back(ColumnOf(key, rows));
  }
  const auto outcome = std::ranges::find(columns, "outcome", &TableColumn::key);
  columns.insert(outcome, parameters.begin(), parameters.end());
  return columns;
}

const std::vector<TableColumn>& DriftColumns() {
  static const std::vector<TableColumn> kColumns =
      Join(CaseColumns(), {
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
      return column.key == "coordinates" || column.key == "solver" || column.key == "horizon";
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
