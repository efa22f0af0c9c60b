#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "harness/base/text.h"
#include "harness/judge/judge.h"

namespace loopbench::harness {

namespace {

/// Returns the keys of the case, at the start of the record.
std::vector<std::string> CaseKeys(const Record& record) {
  constexpr std::string_view kEnds[] = {"case_id", "id", "version", "outcome"};
  std::vector<std::string> keys;
  for (const auto& [key, value] : record.items()) {
    if (Contains(kEnds, key)) break;
    keys.push_back(key);
  }
  return keys;
}

bool IsTime(double time) { return std::isfinite(time) && time >= 0.0; }

/// Group of a rule (`--only`, summary), and its valid values.
struct FieldSet {
  std::string_view group, expected;
};

/// By Rule.
constexpr FieldSet kFieldSets[] = {{"", ""},
                                   {"outcomes", "a text"},
                                   {"outcomes", "a text"},
                                   {"counts", "a finite number"},
                                   {"counts", "a finite number >= 0"},
                                   {"hashes", "a text"},
                                   {"errors", "a finite number >= 0"},
                                   {"instructions", "a finite number > 0"},
                                   {"times", "finite times >= 0"}};

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

std::string_view GroupOf(Rule rule) { return kFieldSets[static_cast<std::size_t>(rule)].group; }

std::string_view Expected(Rule rule) { return kFieldSets[static_cast<std::size_t>(rule)].expected; }

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

std::string CaseText(const Record& record, const std::vector<std::string>& keys) {
  std::string text;
  if (!keys.empty()) AppendKey(record, "kind", &text);
  for (const std::string& key : keys.empty() ? CaseKeys(record) : keys) {
    if (keys.empty() || key != "kind") AppendKey(record, key, &text);
  }
  return text;
}

std::string CountWords(const std::vector<std::string>& words, std::string_view format) {
  std::map<std::string, int> counts;
  for (const std::string& word : words) ++counts[word];
  return Joined(counts, ", ", [format](const auto& one) {
    return fmt::format(fmt::runtime(format), one.first, one.second);
  });
}

std::set<std::string> RepeatedCases(std::span<const Record> records) {
  std::set<std::string> once, repeated;
  for (const Record& record : records) {
    const std::string one = CaseText(record);
    if (!once.insert(one).second) repeated.insert(one);
  }
  return repeated;
}

std::string OtherSettings(const Record& base, const Record& fresh) {
  std::vector<std::string> keys = CaseKeys(base);
  for (const std::string& key : CaseKeys(fresh)) AddOnce(keys, key);
  AddOnce(keys, "config_hash");
  std::erase_if(keys, [&](const std::string& key) { return base.Text(key) == fresh.Text(key); });
  const auto shown = [](const std::string& text) { return text.empty() ? "none" : text; };
  return Joined(keys, ", ", [&](const std::string& key) {
    return fmt::format("{} {} before, {} now", key, shown(base.Text(key)), shown(fresh.Text(key)));
  });
}

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
    default:
      return false;
  }
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
