// Functions of time in a mechanism file.
#include <fmt/format.h>

#include "harness/config/mechanism_sections.h"

namespace loopbench::harness {
namespace {

/// Numbers of an array with at least `least`.
std::vector<double> ReadNumbers(const JsonNode& owner, const std::string& key, std::size_t least,
                                std::string_view expected) {
  const auto node = owner.Required(key, expected);
  if (!node) return {};
  if (!node->value().is_array() || node->value().size() < least) {
    node->Fail(expected);
    return {};
  }
  std::vector<double> numbers;
  for (const JsonNode& element : node->Elements("numbers")) numbers.push_back(element.Number());
  return numbers;
}

Polynomial ReadPolynomial(const JsonNode& node) {
  if (!node.ExpectObject({"type", "coefficients"})) return {{0.0}};
  return {ReadNumbers(node, "coefficients", 1, "an array of one or more numbers, constant first")};
}

Harmonic ReadHarmonic(const JsonNode& node) {
  Harmonic harmonic;
  if (!node.ExpectObject({"type", "mean", "amplitude", "omega", "phase"})) return harmonic;
  harmonic.mean = ReadOptionalNumber(node, "mean");
  harmonic.amplitude = ReadRequiredNumber(node, "amplitude");
  harmonic.omega = ReadRequiredNumber(node, "omega");
  harmonic.phase = ReadOptionalNumber(node, "phase");
  return harmonic;
}

TimeTable ReadTable(const JsonNode& node) {
  TimeTable table;
  if (!node.ExpectObject({"type", "times", "values", "interpolation"})) return table;
  table.times = ReadNumbers(node, "times", 2, "an array of two or more numbers that ascend [s]");
  table.values = ReadNumbers(node, "values", 2, "an array of two or more numbers");
  if (const auto interpolation = node.Optional("interpolation")) {
    table.cubic = interpolation->Choice({"cubic", "linear"}, "an interpolation").value_or(0) == 0;
  }
  if (table.times.empty() || table.values.empty()) return table;
  const std::vector<JsonNode> times = node.Optional("times")->Elements("times");
  for (std::size_t i = 1; i < times.size(); ++i) {
    const bool numbers = times[i - 1].value().is_number() && times[i].value().is_number();
    if (!numbers || table.times[i] > table.times[i - 1]) continue;
    times[i].Fail(fmt::format("more than the time before it, {}", table.times[i - 1]));
  }
  if (table.values.size() != table.times.size()) {
    node.Optional("values")->FailAs(fmt::format("{} values", table.values.size()),
                                    fmt::format("{}, one per time", table.times.size()));
  }
  return table;
}

}  // namespace

TimeFunctionDescription ReadTimeFunction(const JsonNode& node) {
  if (node.value().is_number()) return Polynomial{{node.Number()}};
  if (!node.value().is_object()) {
    node.Fail("a number, or an object that describes a function of time");
    return Polynomial{{0.0}};
  }
  const auto name = node.Required("type", "a function of time");
  if (!name) return Polynomial{{0.0}};
  const auto type = name->Choice({"polynomial", "harmonic", "table"}, "a function of time");
  if (type == 0) return ReadPolynomial(node);
  if (type == 1) return ReadHarmonic(node);
  if (type == 2) return ReadTable(node);
  return Polynomial{{0.0}};
}

}  // namespace loopbench::harness
