#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "harness/judge/judge.h"

namespace loopbench::harness {

namespace {

/// Returns true for keys that end the case keys (CaseKeys) at the start of a record.
bool EndsCase(std::string_view key) {
  return key == "case_id" || key == "id" || key == "version" || key == "outcome";
}

bool IsTime(double time) { return std::isfinite(time) && time >= 0.0; }

/// Group of a rule (`--only`, summary), and its valid values.
struct FieldSet {
  std::string_view group, expected;
};

FieldSet FieldSetOf(Rule rule) {
  switch (rule) {
    case Rule::kOutcome:
    case Rule::kWarnings:
      return {"outcomes", "a text"};
    case Rule::kEqual:
      return {"counts", "a finite number"};
    case Rule::kCount:
      return {"counts", "a finite number >= 0"};
    case Rule::kHash:
      return {"hashes", "a text"};
    case Rule::kError:
      return {"errors", "a finite number >= 0"};
    case Rule::kInstructions:
      return {"instructions", "a finite number > 0"};
    case Rule::kTime:
      return {"times", "finite times >= 0"};
    case Rule::kNone:
      break;
  }
  return {};
}

void AppendKey(const Record& record, const std::string& key, std::string* text) {
  const std::string shown = record.Text(key);
  if (shown.empty()) return;
  // names are clear without a key, numbers are not
  const bool is_name = std::holds_alternative<std::string>(*record.Find(key));
  *text += (text->empty() ? "" : " ") + (is_name ? shown : key + " " + shown);
}

bool IsNumber(const Value& value) {
  return std::holds_alternative<double>(value) || std::holds_alternative<std::int64_t>(value);
}

}  // namespace

std::string_view GroupOf(Rule rule) { return FieldSetOf(rule).group; }

std::string_view Expected(Rule rule) { return FieldSetOf(rule).expected; }

const std::vector<std::string>& GroupNames() {
  static const std::vector<std::string> names = {"outcomes", "counts",       "hashes",
                                                 "errors",   "instructions", "times"};
  return names;
}

Presence PresenceOf(const Record& record, const Measure& measure) {
  const Value* value = record.Find(measure.key);
  if (value == nullptr) return Presence::kNothing;
  const Rule rule = measure.rule;
  bool fits = false;
  if (const auto* text = std::get_if<std::string>(value)) {
    const bool is_text = rule == Rule::kOutcome || rule == Rule::kWarnings || rule == Rule::kHash;
    fits = is_text && (!text->empty() || rule == Rule::kWarnings);
  } else if (const auto* series = std::get_if<std::vector<double>>(value)) {
    fits = rule == Rule::kTime && !series->empty() && std::ranges::all_of(*series, IsTime);
  } else if (IsNumber(*value)) {
    const double number = record.Number(measure.key);
    fits = std::isfinite(number) &&
           (rule == Rule::kEqual || (rule == Rule::kInstructions && number > 0.0) ||
            ((rule == Rule::kCount || rule == Rule::kError) && number >= 0.0));
  }
  return fits ? Presence::kFit : Presence::kUnfit;
}

std::string Shown(const Record& record, std::string_view key) {
  const Value* value = record.Find(key);
  if (value == nullptr) return "";
  if (std::holds_alternative<std::monostate>(*value)) return "null";
  if (std::holds_alternative<std::string>(*value)) return '"' + record.Text(key) + '"';
  const auto* series = std::get_if<std::vector<double>>(value);
  if (series == nullptr) return record.Text(key);
  const auto unfit = std::ranges::count_if(*series, [](double time) { return !IsTime(time); });
  return fmt::format("{}{}", WithCount(series->size(), "value"),
                     unfit > 0 ? fmt::format(" ({} null or negative)", unfit) : "");
}

double CalibrationOf(const Record& record, std::string_view key) {
  const auto is_any = [key](const auto&... parts) {
    return ((key.find(parts) != std::string_view::npos) || ...);
  };
  if (is_any("wall_s", "step_us", "realtime_factor")) return record.Number("calibration_wall_ns");
  if (is_any("rhs_ns", "cpu_ns", "ns_per_body")) return record.Number("calibration_ns");
  return std::numeric_limits<double>::quiet_NaN();
}

std::string CaseText(const Record& record) {
  std::string text;
  for (const auto& [key, value] : record.items()) {
    if (EndsCase(key)) break;
    AppendKey(record, key, &text);
  }
  return text;
}

std::string CaseText(const Record& record, const std::vector<std::string>& keys) {
  std::string text;
  AppendKey(record, "kind", &text);
  for (const std::string& key : keys) {
    if (key != "kind") AppendKey(record, key, &text);
  }
  return text;
}

std::string OtherSettings(const Record& base, const Record& fresh) {
  std::vector<std::string> keys;
  for (const Record* record : {&base, &fresh}) {
    for (const auto& [key, value] : record->items()) {
      if (EndsCase(key)) break;
      if (std::ranges::count(keys, key) == 0) keys.push_back(key);
    }
  }
  if (std::ranges::count(keys, "config_hash") == 0) keys.emplace_back("config_hash");
  const auto shown = [](const std::string& text) { return text.empty() ? "none" : text; };
  std::string text;
  for (const std::string& key : keys) {
    const std::string before = base.Text(key), now = fresh.Text(key);
    if (before == now) continue;
    text += fmt::format("{}{} {} before, {} now", text.empty() ? "" : ", ", key, shown(before),
                        shown(now));
  }
  return text;
}
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Returns the value relative to its limit.
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
