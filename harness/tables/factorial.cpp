#include "harness/tables/factorial.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>

#include "harness/config/formulations.h"
#include "harness/tables/columns.h"
#include "harness/text/config_error.h"

namespace loopbench::harness {
namespace {

// What tells two runs apart, once tolerance and horizon are fixed. "geometry" is "square",
// "general" or, for a scene without counterpart, empty; "family" is then the scene's own name.
using Key = std::map<std::string, std::string>;

struct Run {
  Key key;
  Record record;
};

void SetScene(const std::string& mechanism, const FactorialOptions& options, Key* key) {
  (*key)["family"] = mechanism;
  (*key)["geometry"] = "";
  for (const auto& [square, general] : options.square_and_general) {
    if (mechanism != square && mechanism != general) continue;
    (*key)["family"] = square + " | " + general;
    (*key)["geometry"] = mechanism == square ? "square" : "general";
  }
}

// A table of one effect per factor has no place for two runs that differ in anything else.
void RequireSameCase(const Record& one, const Record& other) {
  if (one.Text("case_id") == other.Text("case_id")) return;
  for (const char* key : {"experiment", "jacobian", "atol", "content", "case_id"}) {
    if (one.Text(key) == other.Text(key)) continue;
    throw ConfigError(fmt::format(
        "factorial table: found {} {} with {} {} and {}, expected one of them: choose "
        "with --where {}=...",
        one.Text("mechanism"), one.Text("formulation"), key, one.Text(key), other.Text(key), key));
  }
}

std::vector<Run> Collect(std::span<const Record> records, const FactorialOptions& options) {
  const std::vector<TableColumn> parameters = WithParameters({}, records);
  std::map<Key, Record> last;
  for (const Record& record : records) {
    if (record.Number("rtol") != options.rtol) continue;
    if (record.Number("horizon") != options.horizon) continue;
    // Timing has no drift; a run that failed before its first step has none either, but an outcome.
    const std::string outcome = record.Text("outcome");
    const bool failed = !outcome.empty() && outcome != "finished";
    if (record.Find("drift_position_max") == nullptr && !failed) continue;
    Key key;
    for (const char* name : {"formulation", "enforcement", "coordinates", "solver", "integrator"}) {
      key[name] = record.Text(name);
    }
    for (const TableColumn& parameter : parameters) {
      // mechanisms differ in content, and are compared all the same
      if (parameter.key == "content" || parameter.key == "set") continue;
      key["parameter " + parameter.key] = record.Text(parameter.key);
    }
    SetScene(record.Text("mechanism"), options, &key);
    const auto [known, is_new] = last.try_emplace(key, record);
    if (!is_new) RequireSameCase(known->second, record);
    known->second = record;
  }
  std::vector<Run> runs;
  for (const auto& [key, record] : last) runs.push_back({key, record});
  return runs;
}

double Drift(const Record& record) {
  const std::string outcome = record.Text("outcome");
  if (!outcome.empty() && outcome != "finished") return std::numeric_limits<double>::quiet_NaN();
  return std::max(record.Number("drift_position_max"), std::numeric_limits<double>::epsilon());
}

// Sums over the pairs of one row.
struct Row {
  int pairs = 0;
  int left_out = 0;
  double log_sum = 0.0;
  double ratio_min = std::numeric_limits<double>::infinity();
  double ratio_max = 0.0;
  int exponents = 0;
  double exponent_sum = 0.0;

  void Add(const Record& from, const Record& to) {
    const double ratio = Drift(to) / Drift(from);
    if (!std::isfinite(ratio)) {
      ++left_out;
      return;
    }
    ++pairs;
    log_sum += std::log(ratio);
    ratio_min = std::min(ratio_min, ratio);
    ratio_max = std::max(ratio_max, ratio);
    const double difference = to.Number("growth_exponent") - from.Number("growth_exponent");
    if (std::isfinite(difference)) {
      ++exponents;
      exponent_sum += difference;
    }
  }
};

// One change of one factor, and the factor whose settings split it into rows.
struct Change {
  std::string factor;
  std::string key;
  std::string from;
  std::string to;
  std::string split_by;
};

// Every formulation with every later one, then the other factors.
std::vector<Change> Changes() {
  std::vector<Change> changes;
  const std::vector<std::string> formulations = FormulationNames();
  for (std::size_t i = 0; i < formulations.size(); ++i) {
    for (std::size_t j = i + 1; j < formulations.size(); ++j) {
      changes.push_back(
          {"formulation", "formulation", formulations[i], formulations[j], "geometry"});
    }
  }
  changes.push_back({"coordinates", "coordinates", "joint", "absolute", "geometry"});
  changes.push_back({"level", "enforcement", "velocity", "acceleration", "geometry"});
  changes.push_back({"geometry", "geometry", "square", "general", "coordinates"});
  return changes;
}

// Rows of one change by setting of the splitting factor; "all" holds every pair.
std::map<std::string, Row> Compare(const Change& change, const std::vector<Run>& runs) {
  std::map<std::string, Row> rows;
  for (const Run& from : runs) {
    if (from.key.at(change.key) != change.from) continue;
    Key wanted = from.key;
    wanted[change.key] = change.to;
    const auto to = std::ranges::find(runs, wanted, &Run::key);
    if (to == runs.end()) continue;
    rows["all"].Add(from.record, to->record);
    const std::string& setting = from.key.at(change.split_by);
    if (!setting.empty()) rows[setting].Add(from.record, to->record);
  }
  return rows;
}

Record ToRecord(const Change& change, const std::string& within, const Row& row) {
  Record record;
  record.Set("factor", change.factor);
  record.Set("from", change.from);
  record.Set("to", change.to);
  record.Set("within", within);
  record.Set("pairs", std::int64_t{row.pairs});
  if (row.pairs > 0) {
    record.Set("ratio_mean", std::exp(row.log_sum / row.pairs));
    record.Set("ratio_min", row.ratio_min);
    record.Set("ratio_max", row.ratio_max);
  }
  if (row.exponents > 0) record.Set("exponent_difference", row.exponent_sum / row.exponents);
  record.Set("left_out", std::int64_t{row.left_out});
  return record;
}

}  // namespace

Table FactorialTable(std::span<const Record> records, const FactorialOptions& options) {
  Table table;
  table.title = fmt::format("Drift by factor, rtol {}, {} s", options.rtol, options.horizon);
  table.columns = {
      {"factor", "factor", Format::kText, {}},
      {"from", "from", Format::kText, {}},
      {"to", "to", Format::kText, {}},
      {"within", "within", Format::kText, {}},
      {"pairs", "pairs", Format::kInteger, {}},
      {"ratio_mean", "drift ratio", Format::kScientific, {}},
      {"ratio_min", "least", Format::kScientific, {}},
      {"ratio_max", "largest", Format::kScientific, {}},
      {"exponent_difference", "exponent diff.", Format::kExponent, {}},
      {"left_out", "left out", Format::kInteger, {}},
  };
  const std::vector<Run> runs = Collect(records, options);
  for (const Change& change : Changes()) {
    for (const auto& [within, row] : Compare(change, runs)) {
      table.rows.push_back(ToRecord(change, within, row));
    }
  }
  return table;
}

}  // namespace loopbench::harness
