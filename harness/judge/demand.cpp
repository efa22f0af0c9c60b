#include "harness/judge/demand.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

namespace loopbench::harness {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// How far beyond its limit a value is.
double Ratio(const Demand& demand, double value, double limit) {
  switch (demand.relation) {
    case Relation::kAtMost:
      return value / limit;
    case Relation::kAtLeast:
      return value > 0.0 ? limit / value : kInfinity;
    default:
      return value == limit ? 0.0 : kInfinity;
  }
}

std::string InBrackets(const std::string& unit) { return unit.empty() ? "" : " [" + unit + "]"; }

}  // namespace

bool Meets(const Demand& demand, double value) {
  if (!std::isfinite(value)) return false;
  switch (demand.relation) {
    case Relation::kAtMost:
      return value <= demand.number;
    case Relation::kAtLeast:
      return value >= demand.number;
    case Relation::kEqual:
      return value == demand.number;
    case Relation::kWithin:
      return std::abs(value - demand.number) <= demand.tolerance;
    case Relation::kIs:
    case Relation::kIsNot:
      break;
  }
  return false;
}

bool Meets(const Demand& demand, const std::string& text) {
  return (text == demand.word) == (demand.relation == Relation::kIs);
}

Judged Judge(const Demand& demand, const Record& record) {
  Judged judged{.measure = demand.measure, .name = demand.name, .unit = demand.unit};
  const double unit = demand.of.empty() ? 1.0 : record.Number(demand.of);
  const bool has_measure = record.Find(demand.measure) != nullptr;
  judged.measured = has_measure && std::isfinite(unit);
  if (!judged.measured) {
    judged.reason = "the record has no " + (has_measure ? "finite " + demand.of : demand.measure);
    return judged;
  }
  Demand own = demand;
  own.number *= unit;
  judged.value = record.Number(demand.measure);
  judged.limit = own.number;
  judged.met = Meets(own, judged.value);
  const bool finite = std::isfinite(judged.value);
  judged.ratio = finite ? Ratio(demand, judged.value, judged.limit) : kInfinity;
  if (!demand.of.empty() && demand.relation != Relation::kAtMost) {
    judged.total = judged.limit / demand.number;
  }
  constexpr std::array kLimits = {"limit", "at least", "expected", "expected"};
  judged.reason = fmt::format("{} = {}{}, {} {:.3g}", demand.measure,
                              finite ? fmt::format("{:.3g}", judged.value) : "not finite",
                              InBrackets(demand.unit),
                              kLimits.at(static_cast<std::size_t>(demand.relation)), judged.limit);
  return judged;
}

std::string ToText(const Demand& demand, const std::string& subject, bool rounded) {
  constexpr std::array kSigns = {"<=", ">=", "=", "=", "is", "is not"};
  const std::string sign = kSigns.at(static_cast<std::size_t>(demand.relation));
  if (demand.IsText()) return fmt::format("{} {} {}", subject, sign, demand.word);
  const auto digits = [rounded](double x) {
    return rounded ? fmt::format("{:.3g}", x) : fmt::format("{}", x);
  };
  const bool always = demand.when == std::vector<std::string>{"finished"};
  return fmt::format("{} {} {}{}{}{}{}", subject, sign, digits(demand.number),
                     demand.relation == Relation::kWithin ? " +- " + digits(demand.tolerance) : "",
                     demand.of.empty() ? "" : " " + demand.of, InBrackets(demand.unit),
                     always ? "" : fmt::format(" when {}", fmt::join(demand.when, " or ")));
}

}  // namespace loopbench::harness
