#include "harness/config/selection_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

namespace loopbench::harness {
namespace {

// A scalar as the text that a Condition compares with: 1e-6 becomes "1e-06", true becomes "true".
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

std::string RequiredText(const JsonNode& owner, const std::string& key) {
  const std::optional<JsonNode> node = owner.Required(key, kAnyText);
  return node ? node->Text() : "";
}

std::string OptionalText(const JsonNode& owner, const std::string& key) {
  const std::optional<JsonNode> node = owner.Optional(key);
  return node ? node->Text() : "";
}

Selection ReadSelection(const JsonNode& node) {
  Selection selection;
  for (const auto& [key, member] : node.Members()) {
    Condition condition{key, {}};
    for (const JsonNode& value : member.OneOrMore("values")) {
      condition.values.push_back(ConditionValue(value));
    }
    selection.push_back(std::move(condition));
  }
  return selection;
}

Selection OptionalSelection(const JsonNode& owner, const std::string& key) {
  const std::optional<JsonNode> node = owner.Optional(key);
  if (!node) return {};
  Selection selection = ReadSelection(*node);
  if (selection.empty() && node->value().is_object()) node->Fail("at least one key");
  return selection;
}

void ReportRepeated(const JsonNode& owner, const std::string& key, const std::string& name,
                    std::vector<std::string>* taken) {
  const std::optional<JsonNode> member = owner.Optional(key);
  if (member && std::ranges::find(*taken, name) != taken->end()) member->Fail("each name once");
  taken->push_back(name);
}

}  // namespace loopbench::harness
