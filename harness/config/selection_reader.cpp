#include "harness/config/selection_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

namespace loopbench::harness {
namespace {

// Returns a scalar as the text of a Condition: 1e-6 becomes "1e-06", true becomes "true".
std::string ConditionValue(const JsonNode& node) {
  const Json& value = node.value();
  if (value.is_string()) return node.Text();
  if (value.is_boolean()) return value.get<bool>() ? "true" : "false";
  if (value.is_number_integer()) return value.dump();
  if (value.is_number()) return fmt::format("{}", value.get<double>());
  node.Fail("a string, a number, a bool or a list of them");
  return "";
}

}  // namespace

Selection ReadSelection(const JsonNode& node, std::size_t least) {
  Selection selection;
  for (const auto& [key, member] : node.Members()) {
    Condition condition{key, {}};
    for (const JsonNode& value : member.OneOrMore("values")) {
      condition.values.push_back(ConditionValue(value));
    }
    selection.push_back(std::move(condition));
  }
  if (selection.size() < least && node.value().is_object()) node.Fail("at least one key");
  return selection;
}

Json SelectionSchema(std::size_t least) {
  const Json other = {{"type", {"number", "boolean"}}, {"words", "a number, `true`, `false`"}};
  const Json value = Named("value", EitherSchema({TextSchema(), other}));
  return Named(least > 0 ? "someSelection" : "selection", MapSchema(OneOrMoreSchema(value), least));
}

void ReportRepeated(const JsonNode& owner, const std::string& key, const std::string& name,
                    std::vector<std::string>* taken) {
  const std::optional<JsonNode> member = owner.Optional(key);
  if (member && std::ranges::find(*taken, name) != taken->end()) member->Fail("each name once");
  taken->push_back(name);
}

}  // namespace loopbench::harness
