// "exclude" of an experiment file.
#include <fmt/format.h>

#include "harness/config/experiment_sweep.h"

namespace loopbench::harness {

Json ExclusionsSchema() {
  const Json scalar = {{"type", {"string", "number", "boolean"}}, {"words", "a value"}};
  const Json condition = OneOrMoreSchema(scalar, false, SpacedSchema(NumberSchema(), false));
  return ArraySchema(MapSchema(Named("condition", condition), 1), 0, kMaxRules);
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
  known.Add("step");  // of those cases only whose steps are fixed
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
