#include "harness/tables/columns.h"

#include <fmt/format.h>

#include <algorithm>
#include <initializer_list>
#include <utility>

#include "mechanism/formulation/options.h"

namespace loopbench::harness {
namespace {

using std::string_view;

TableColumn Of(const Measure& measure, string_view key) {
  const auto& [words, unit, format] = measure.heading;
  const string_view shown = words == "*" ? key.substr(measure.key.size() - 1) : words;
  const std::string brackets = unit.empty() ? "" : fmt::format(" [{}]", unit);
  return {std::string(key), std::string(shown) + brackets, format, {}};
}

std::vector<TableColumn> Columns(std::initializer_list<string_view> keys) {
  std::vector<TableColumn> columns;
  for (const string_view key : keys) columns.push_back(Of(*FindMeasure(key), key));
  return columns;
}

// What a table was made for stays longer than some of what tells its rows apart.
constexpr int kAnswer = 2;

// The column of a narrow table: another heading, and shorter words for values.
TableColumn Short(string_view key, const char* header,
                  std::vector<std::pair<std::string, std::string>> abbreviations = {},
                  int importance = 0) {
  return {std::string(key), header, FindMeasure(key)->heading.format, std::move(abbreviations),
          importance};
}

std::vector<std::pair<std::string, std::string>> AbbreviatedLevels() {
  std::vector<std::pair<std::string, std::string>> pairs;
  for (const LevelTraits& level : Levels()) pairs.emplace_back(level.name, level.abbreviation);
  return pairs;
}

// Of measures that a program has added and that have words.
std::vector<TableColumn> AddedColumns() {
  std::vector<TableColumn> columns;
  for (const Measure* measure : AddedMeasures()) {
    const bool single = measure->type != ValueType::kNumbers && !measure->key.ends_with('*');
    if (single && !measure->heading.words.empty()) columns.push_back(Of(*measure, measure->key));
  }
  return columns;
}

std::vector<TableColumn> Join(std::vector<TableColumn> head, const std::vector<TableColumn>& tail) {
  head.insert(head.end(), tail.begin(), tail.end());
  return head;
}

// What was run and how it ended: the keys that drift.csv and timing.csv share.
std::vector<TableColumn> CaseColumns() {
  return Columns({"experiment", "mechanism", "formulation", "enforcement", "coordinates", "solver",
                  "integrator", "rtol", "atol", "horizon", "outcome", "t_reached"});
}

}  // namespace

std::optional<TableColumn> KnownColumn(string_view key) {
  const Measure* measure = FindMeasure(key);
  if (measure == nullptr || measure->heading.words.empty()) return std::nullopt;
  return Of(*measure, key);
}

const std::vector<TableColumn>& CompactCaseColumns() {
  static const std::vector<TableColumn> kColumns = {
      Short("mechanism", "mechanism"),
      Short("formulation", "formul."),
      Short("enforcement", "level", AbbreviatedLevels()),
      Short("coordinates", "coord", {{"absolute", "abs"}}),
      Short("solver", "solv", {{"as-published", "publ"}, {"rank-revealing", "rank"}}),
      Short("rtol", "rtol"),
      Short("horizon", "T/s"),
      Short("outcome", "outcome",
            {{"finished", "ok"},
             {"step-too-small", "small step"},
             {"inconsistent-start", "bad start"},
             {"inconsistent-motion", "bad motion"},
             {"newton-failure", "newton"},
             {"integrator-error", "integrator"}}),
  };
  return kColumns;
}

const std::vector<TableColumn>& DriftColumns() {
  static const std::vector<TableColumn> kColumns =
      Join(Join(CaseColumns(), Columns({"doubts",
                                        "agreement",
                                        "drift_position_max",
                                        "drift_rotation_max",
                                        "drift_velocity_max",
                                        "drift_acceleration_max",
                                        "loop_closure_max",
                                        "correction_max",
                                        "worst_loop",
                                        "energy_error_max",
                                        "growth_exponent",
                                        "growth_spread",
                                        "growth_regime",
                                        "growth_resolved",
                                        "growth_hypothesis",
                                        "growth_hypothesis_resolved",
                                        "ensemble",
                                        "steps",
                                        "rejected",
                                        "rhs_evaluations",
                                        "rank_min",
                                        "rcond_min",
                                        "state_hash",
                                        "restarts",
                                        "branch_error_max",
                                        "closed_form_error_max",
                                        "message"})),
           AddedColumns());
  return kColumns;
}

const std::vector<TableColumn>& TimingColumns() {
  static const std::vector<TableColumn> kMachine =
      Columns({"aa_spread", "aa_spread_wall", "yardstick_ns", "yardstick_wall_ns",
               "disturbed_rounds", "load1", "processors", "governor", "noise"});
  static const std::vector<TableColumn> kTimes =
      Columns({"bodies", "joints", "loops", "dof", "rhs_ns_median", "rhs_ns_p10", "rhs_ns_p90",
               "ns_per_body", "step_us_median", "wall_s_median", "realtime_factor", "repeats",
               "rhs_ns_min", "wall_s_min", "wall_s_p10", "wall_s_p90"});
  static const std::vector<TableColumn> kColumns = Join(CaseColumns(), Join(kTimes, kMachine));
  return kColumns;
}

const std::vector<TableColumn>& PrecisionColumns() {
  static const std::vector<TableColumn> kColumns =
      Columns({"experiment",     "mechanism",   "formulation",    "enforcement",
               "coordinates",    "solver",      "integrator",     "scalar",
               "rtol",           "atol",        "horizon",        "outcome",
               "t_reached",      "error_final", "error_ruled_by", "drift_position_max",
               "drift_ruled_by", "steps",       "rejected",       "restarts",
               "rhs_evaluations"});
  return kColumns;
}

const std::vector<TableColumn>& CompactPrecisionColumns() {
  static const std::vector<TableColumn> kColumns = [] {
    std::vector<TableColumn> columns = CompactCaseColumns();
    std::erase_if(columns, [](const TableColumn& column) {
      return column.key == "solver" || column.key == "horizon";
    });
    const auto rtol = std::ranges::find(columns, "rtol", &TableColumn::key);
    columns.insert(rtol, Short("scalar", "scalar"));
    const std::vector<std::pair<std::string, std::string>> parts = {{"truncation", "trunc"},
                                                                    {"round-off", "round"}};
    return Join(std::move(columns),
                {Short("error_final", "error/m", {}, kAnswer), Short("error_ruled_by", "by", parts),
                 Short("drift_position_max", "drift/m"), Short("drift_ruled_by", "by", parts),
                 Short("steps", "steps")});
  }();
  return kColumns;
}

const std::vector<TableColumn>& ModelColumns() {
  static const std::vector<TableColumn> kColumns = Columns({"mechanism",
                                                            "model",
                                                            "formulation",
                                                            "enforcement",
                                                            "coordinates",
                                                            "integrator",
                                                            "rtol",
                                                            "horizon",
                                                            "outcome",
                                                            "model_motion",
                                                            "bodies",
                                                            "joints",
                                                            "model_error",
                                                            "model_error_at",
                                                            "reference_error",
                                                            "trust_horizon",
                                                            "model_accepts",
                                                            "model_verdict",
                                                            "error_position_max",
                                                            "rhs_evaluations",
                                                            "model_rhs_ratio",
                                                            "wall_s",
                                                            "model_wall_ratio",
                                                            "noise"});
  return kColumns;
}

const std::vector<TableColumn>& CompactModelColumns() {
  static const std::vector<TableColumn> kColumns = {
      Short("mechanism", "mechanism"),  Short("model", "model"),
      Short("bodies", "bodies"),        Short("model_error", "causes/m"),
      Short("rhs_evaluations", "rhs"),  Short("model_rhs_ratio", "of full"),
      Short("wall_s", "wall/s"),        Short("model_wall_ratio", "of full"),
      Short("model_verdict", "verdict")};
  return kColumns;
}

const std::vector<TableColumn>& ReferenceColumns() {
  static const std::vector<TableColumn> kColumns =
      Columns({"experiment", "mechanism", "horizon", "outcome", "reference", "trust_horizon",
               "reference_error", "reference_witnesses", "cpu_s", "rhs_evaluations", "message"});
  return kColumns;
}

const std::vector<TableColumn>& CompactReferenceColumns() {
  static const std::vector<TableColumn> kColumns = {
      Short("mechanism", "mechanism"),
      Short("horizon", "T/s"),
      Short("outcome", "outcome"),
      Short("reference", "reference"),
      Short("trust_horizon", "certified until/s", {}, kAnswer),
      Short("reference_error", "to/m", {}, kAnswer),
      Short("cpu_s", "CPU/s"),
      Short("message", "why no further")};
  return kColumns;
}

const std::vector<TableColumn>& CompactDriftColumns() {
  static const std::vector<TableColumn> kColumns =
      Join(CompactCaseColumns(),
           {Short("drift_position_max", "drift [m]", {}, kAnswer),
            Short("energy_error_max", "dE [J]"), Short("growth_exponent", "slope")});
  return kColumns;
}

const std::vector<TableColumn>& CompactTimingColumns() {
  static const std::vector<TableColumn> kColumns =
      Join(CompactCaseColumns(),
           {Short("bodies", "bodies", {}, -1), Short("rhs_ns_median", "rhs [ns]", {}, kAnswer),
            Short("wall_s_median", "wall [s]")});
  return kColumns;
}

}  // namespace loopbench::harness
