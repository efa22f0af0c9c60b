// "exclude" of an experiment file, and the names that an axis of a sweep may not take.
#include <fmt/format.h>

#include <array>

#include "harness/config/experiment_sweep.h"
#include "harness/record/record_types.h"

namespace loopbench::harness {
namespace {

// Keys that records may come to have, besides those whose type is known (record_types.h): a run
// would write over a parameter of that name. A test holds all against the records of actual runs.
constexpr std::array<std::string_view, 9> kRecordKeys = {"document",  "seed",          "perturb",
                                                         "memory_mb", "series_points", "libraries",
                                                         "command",   "date",          "real_ns"};

// Measured values come in groups, and more of each kind may be added.
constexpr std::array<std::string_view, 18> kRecordPrefixes = {
    "drift_",       "loop_",       "energy_", "growth_", "rank_",     "rcond_",
    "rhs_",         "step_",       "wall_",   "cpu_",    "plan_",     "branch_",
    "closed_form_", "correction_", "aa_",     "newton_", "ensemble_", "error_"};

}  // namespace

bool IsRecordKey(const std::string& name) {
  if (TypeOf(name) != ValueType::kAny) return true;
  for (const std::string_view key : kRecordKeys) {
    if (name == key) return true;
  }
  for (const std::string_view prefix : kRecordPrefixes) {
    if (name.starts_with(prefix)) return true;
  }
  return false;
}

std::vector<Selection> ReadExclusions(const JsonNode& root, const Record& keys) {
  std::vector<Selection> exclusions;
  const auto node = root.Optional("exclude");
  if (!node) return exclusions;
  const std::vector<JsonNode> elements = node->Elements("rules");
  if (elements.size() > kMaxRules) {
    node->Fail(fmt::format("at most {} rules", kMaxRules));
    return exclusions;
  }
  NameList known;
  for (const auto& [name, value] : keys.items()) {
    if (name != "kind" && name != "experiment") known.Add(name);
  }
  for (const JsonNode& element : elements) {
    Selection& rule = exclusions.emplace_back();
    if (!element.ExpectObject(known)) continue;
    if (element.value().empty()) element.Fail("at least one condition");
    for (const auto& [key, values] : element.Members()) {
      Condition& condition = rule.emplace_back();
      condition.key = key;
      if (values.value().is_object()) {
        for (const double number : values.Spaced()) {
          condition.values.push_back(fmt::format("{}", number));
        }
        continue;
      }
      for (const JsonNode& value : values.OneOrMore("values")) {
        const Json& one = value.value();
        if (one.is_structured() || one.is_null()) {
          value.Fail("a string, a number, true or false");
        } else {
          condition.values.push_back(one.is_string()   ? one.get<std::string>()
                                     : one.is_number() ? fmt::format("{}", one.get<double>())
                                                       : one.dump());
        }
      }
    }
  }
  return exclusions;
}

}  // namespace loopbench::harness
