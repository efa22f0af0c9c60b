#include "harness/compare/measures.h"

namespace loopbench::harness {

namespace {

/// Records begin with what names their case (CaseKeys); one of these ends it.
bool EndsCase(std::string_view key) {
  return key == "case_id" || key == "id" || key == "version" || key == "outcome";
}

}  // namespace

std::string_view GroupOf(Rule rule) {
  switch (rule) {
    case Rule::kOutcome:
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
      {"branch_error_max", Rule::kError, "rad", false},
      {"closed_form_error_max", Rule::kError, "rad", false},
      {"instructions", Rule::kInstructions, "", true},
      {"series.rhs_ns", Rule::kTime, "ns", false},
      {"series.wall_s", Rule::kTime, "s", false},
      {"series.cpu_ns", Rule::kTime, "ns", false},
  };
  return measures;
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
