#include "harness/judge/measures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace loopbench::harness {

namespace {

/// Records begin with what names their case (CaseKeys); one of these ends it.
bool EndsCase(std::string_view key) {
  return key == "case_id" || key == "id" || key == "version" || key == "outcome";
}

bool IsTime(double time) { return std::isfinite(time) && time >= 0.0; }

bool IsNumber(const Value& value) {
  return std::holds_alternative<double>(value) || std::holds_alternative<std::int64_t>(value);
}

}  // namespace

std::string_view GroupOf(Rule rule) {
  switch (rule) {
    case Rule::kOutcome:
    case Rule::kDoubts:
      return "outcomes";
    case Rule::kEqual:
    case Rule::kCount:
      return "counts";
    case Rule::kHash:
      return "hashes";
    case Rule::kError:
      return "errors";
    case Rule::kInstructions:
      return "instructions";
    case Rule::kTime:
      return "times";
  }
  return "";
}

const std::vector<std::string>& GroupNames() {
  static const std::vector<std::string> names = {"outcomes", "counts",       "hashes",
                                                 "errors",   "instructions", "times"};
  return names;
}

const std::vector<Measure>& Measures() {
  // Accelerations' drift stays out: at the level of round-off it moves with every change of code.
  static const std::vector<Measure> measures = {
      {"outcome", Rule::kOutcome, "", false},
      {"bodies", Rule::kEqual, "", false},
      {"joints", Rule::kEqual, "", false},
      {"loops", Rule::kEqual, "", false},
      {"dof", Rule::kEqual, "", false},
      {"ensemble", Rule::kEqual, "", false},
      {"ensemble_branch_kept", Rule::kEqual, "", false},
      {"ensemble_failed", Rule::kEqual, "", false},
      {"doubts", Rule::kDoubts, "", false},
      {"evaluations", Rule::kEqual, "", false},
      {"rank", Rule::kEqual, "", false},
      {"rank_min", Rule::kEqual, "", false},
      {"start_hash", Rule::kHash, "", false},
      {"rhs_operations", Rule::kCount, "", false},
      {"plan_depth", Rule::kCount, "", false},
      {"plan_largest_join", Rule::kCount, "", false},
      {"allocations", Rule::kCount, "", true},
      {"bytes", Rule::kCount, "B", true},
      {"steps", Rule::kCount, "", true},
      {"rejected", Rule::kCount, "", true},
      {"rhs_evaluations", Rule::kCount, "", true},
      {"restarts", Rule::kCount, "", true},
      {"newton_iterations", Rule::kCount, "", true},
      {"newton_failures", Rule::kCount, "", true},
      {"newton_rhs_evaluations", Rule::kCount, "", true},
      {"newton_dual_evaluations", Rule::kCount, "", true},
      {"state_hash", Rule::kHash, "", true},
      {"derivative_hash", Rule::kHash, "", true},
      {"drift_position_max", Rule::kError, "m", false},
      {"drift_rotation_max", Rule::kError, "rad", false},
      {"drift_velocity_max", Rule::kError, "", false},
      {"loop_closure_max", Rule::kError, "m", false},
      {"energy_error_max", Rule::kError, "J", false},
      {"error_final", Rule::kError, "", false},
      {"branch_error_max", Rule::kError, "rad", false},
      {"closed_form_error_max", Rule::kError, "rad", false},
      {"instructions", Rule::kInstructions, "", true},
      {"series.rhs_ns", Rule::kTime, "ns", false},
      {"series.wall_s", Rule::kTime, "s", false},
      {"series.cpu_ns", Rule::kTime, "ns", false},
  };
  return measures;
}

Held HeldBy(const Record& record, const Measure& measure) {
  const Value* value = record.Find(measure.key);
  if (value == nullptr) return Held::kNothing;
  const auto* series = std::get_if<std::vector<double>>(value);
  const double number = IsNumber(*value) ? record.Number(measure.key) : std::nan("");
  bool fits = false;
  switch (measure.rule) {
    case Rule::kDoubts:
      fits = std::holds_alternative<std::string>(*value);
      break;
    case Rule::kOutcome:
    case Rule::kHash:
      fits = !record.Text(measure.key).empty() && std::holds_alternative<std::string>(*value);
      break;
    case Rule::kEqual:
      fits = std::isfinite(number);
      break;
    case Rule::kCount:
    case Rule::kError:
      fits = std::isfinite(number) && number >= 0.0;
      break;
    case Rule::kInstructions:
      fits = std::isfinite(number) && number > 0.0;
      break;
    case Rule::kTime:
      fits = series != nullptr && !series->empty() && std::ranges::all_of(*series, IsTime);
  }
  return fits ? Held::kFit : Held::kUnfit;
}

std::string_view Expected(Rule rule) {
  switch (rule) {
    case Rule::kOutcome:
    case Rule::kDoubts:
    case Rule::kHash:
      return "a text";
    case Rule::kEqual:
      return "a finite number";
    case Rule::kCount:
    case Rule::kError:
      return "a finite number >= 0";
    case Rule::kInstructions:
      return "a finite number > 0";
    case Rule::kTime:
      return "finite times >= 0";
  }
  return "";
}

std::string Shown(const Record& record, const std::string& key) {
  const Value* value = record.Find(key);
  if (value == nullptr) return "";
  if (std::holds_alternative<std::monostate>(*value)) return "null";
  if (std::holds_alternative<std::string>(*value)) return '"' + record.Text(key) + '"';
  const auto* series = std::get_if<std::vector<double>>(value);
  if (series == nullptr) return record.Text(key);
  const auto unfit = std::ranges::count_if(*series, [](double time) { return !IsTime(time); });
  return fmt::format("{} values{}", series->size(),
                     unfit > 0 ? fmt::format(" ({} null or negative)", unfit) : "");
}

std::string CaseText(const Record& record) {
  std::string text;
  for (const auto& [key, value] : record.items()) {
    if (EndsCase(key)) break;
    const std::string shown = record.Text(key);
    if (shown.empty()) continue;
    // names speak for themselves, numbers do not
    const bool is_name = std::holds_alternative<std::string>(value);
    text += (text.empty() ? "" : " ") + (is_name ? shown : key + " " + shown);
  }
  return text;
}

}  // namespace loopbench::harness
