// Lists of numbers in a file: one, several, or a range.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>

#include "harness/json/json_reader.h"

namespace loopbench::harness {
namespace {

/// The number a person would have written, where round-off alone is in its way: 1e-08 for the
/// 1.0000000000000002e-08 that a power gives.
double Clean(double value) {
  const std::string text = fmt::format("{:.13g}", value);
  double rounded = value;
  std::from_chars(text.data(), text.data() + text.size(), rounded);
  constexpr double kRoundOff = 1e-15;  // some ulps: of lerp, log10 and pow
  return std::abs(rounded - value) <= kRoundOff * std::abs(value) ? rounded : value;
}

std::vector<double> Spread(double from, double to, int count, bool logarithmic) {
  std::vector<double> numbers(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    const double t = static_cast<double>(i) / (count - 1);
    numbers[static_cast<std::size_t>(i)] =
        logarithmic ? std::copysign(std::pow(10.0, std::lerp(std::log10(std::abs(from)),
                                                             std::log10(std::abs(to)), t)),
                                    from)
                    : std::lerp(from, to, t);
  }
  for (double& number : numbers) number = Clean(number);
  numbers.front() = from;
  numbers.back() = to;
  return numbers;
}

}  // namespace

std::vector<double> JsonNode::Spaced(const Range& range) const {
  if (!ExpectObject({"lin", "log"})) return {};
  const auto lin = Optional("lin"), log = Optional("log");
  if (lin.has_value() == log.has_value()) {
    if (lin || value_->empty()) {
      FailAs(lin ? "both \"lin\" and \"log\"" : "an empty object",
             "{\"lin\": [from, to, count]} or {\"log\": [from, to, count]}");
    }
    return {};
  }
  const JsonNode& ends = lin ? *lin : *log;
  if (!ends.value().is_array() || ends.value().size() != 3) {
    ends.Fail("an array of three numbers: from, to, count");
    return {};
  }
  const std::vector<JsonNode> three = ends.Elements("numbers");
  const double from = three[0].Number(range), to = three[1].Number(range);
  const auto count = static_cast<int>(three[2].Integer(2, kMostInRange));
  if (!range.Contains(from) || !range.Contains(to)) return {};
  if (from == to) {
    ends.FailAs("a range that ends where it begins", "two different ends");
    return {};
  }
  if (log && !(from < 0.0 && to < 0.0) && !(from > 0.0 && to > 0.0)) {
    ends.FailAs(fmt::format("logarithms from {} to {}", from, to),
                "two ends of the same sign, neither of them 0");
    return {};
  }
  return Spread(from, to, count, log.has_value());
}

std::vector<double> JsonNode::NumberList(const Range& range) const {
  if (value_->is_object()) return Spaced(range);
  if (!value_->is_array() && !value_->is_number()) {
    Fail(
        fmt::format("a number{}, a list of such numbers, or a range: {{\"lin\" or \"log\": [from, "
                    "to, count]}}",
                    range.Text()));
    return {};
  }
  std::vector<double> numbers;
  std::set<double> known;
  for (const JsonNode& element : OneOrMore("numbers")) {
    const double number = element.Number(range);
    const bool again = !known.insert(number).second;
    if (again && range.Contains(number)) element.Fail("each value once");
    numbers.push_back(number);
  }
  return numbers;
}

std::vector<std::int64_t> JsonNode::IntegerList(std::int64_t min, std::int64_t max) const {
  std::vector<std::int64_t> integers;
  std::set<std::int64_t> known;
  if (value_->is_object()) {
    const Range range = {.min = static_cast<double>(min), .max = static_cast<double>(max)};
    for (const double number : Spaced(range)) {
      const std::int64_t integer = std::llround(number);
      if (!known.insert(integer).second) {
        FailAs(fmt::format("{} twice after rounding", integer), "a smaller count");
        break;
      }
      integers.push_back(integer);
    }
    return integers;
  }
  if (!value_->is_array() && !value_->is_number()) {
    Fail(
        fmt::format("an integer from {} to {}, a list of them, or a range: {{\"lin\" or \"log\": "
                    "[from, to, count]}}",
                    min, max));
    return {};
  }
  for (const JsonNode& element : OneOrMore("integers")) {
    const std::int64_t integer = element.Integer(min, max);
    const bool sound = element.value().is_number() &&
                       element.value().get<double>() == static_cast<double>(integer);
    if (known.insert(integer).second) {
      integers.push_back(integer);
    } else if (sound) {
      element.Fail("each value once");
    }
  }
  return integers;
}

}  // namespace loopbench::harness
