// Demands, and claims that make them on statistics of records.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <string_view>

#include "harness/base/record.h"
#include "harness/base/text.h"
#include "harness/judge/analysis.h"
#include "harness/judge/judge.h"
#include "harness/judge/tables.h"

namespace loopbench::harness {

// Demands on measures, and cases.

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

// in the order of Rule
constexpr FieldSet kFieldSets[] = {{"", ""},
                                   {"outcomes", "a text"},
                                   {"outcomes", "a text"},
                                   {"counts", "a finite number"},
                                   {"counts", "a finite number >= 0"},
                                   {"hashes", "a text"},
                                   {"errors", "a finite number >= 0"},
                                   {"instructions", "a finite number > 0"},
                                   {"times", "finite times >= 0"}};

bool IsNumber(const Value& value) {
  return std::holds_alternative<double>(value) || std::holds_alternative<std::int64_t>(value);
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();

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
  std::vector<std::string> named = keys.empty() ? CaseKeys(record) : keys;
  if (!keys.empty()) {
    std::erase(named, "kind");
    named.insert(named.begin(), "kind");
  }
  std::erase_if(named, [&](const std::string& key) { return record.Text(key).empty(); });
  return NameBy(record, named, " ");
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
    if (std::string one = CaseText(record); !once.insert(one).second) repeated.insert(one);
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

// Claims.

namespace {

constexpr std::string_view kStatistics[] = {"max", "min", "mean", "every", "any"};

bool IsQuantified(const Check& check) {
  return check.statistic == Statistic::kAll || check.statistic == Statistic::kAny;
}

// Rows of one selection, counted by usability.
struct Sample {
  const Selection& selection;
  std::vector<Record> rows = {};
  std::vector<double> values = {};  // finite measures of usable runs
  std::size_t failed = 0, unmet = 0, missing = 0;
  std::string reason = {};  // why the check cannot be measured
};

// Returns "no record of formulation=odca has drift".
std::string NoneHas(const Selection& selection, const std::string& key) {
  return fmt::format("no record of {} has {}", ToText(selection), key);
}

Sample Take(const Check& check, const Selection& selection, std::span<const Record> records) {
  const std::string& measure = check.demand.measure;
  // if the outcome is checked, a failed run is a valid observation
  const bool examines_outcome =
      measure == "outcome" || Contains(check.select, "outcome", &Condition::key);
  const std::vector<Record> selected = Filter(records, selection);
  std::set<std::string> kinds;  // kinds of records with the measure
  for (const Record& record : selected) {
    if (record.Find(measure) != nullptr) kinds.insert(record.Text("kind"));
  }
  Sample sample{.selection = selection};
  for (const Record& record : selected) {
    const bool failed = HasFailed(record) && !examines_outcome;
    if (!kinds.contains(record.Text("kind")) && !failed) continue;
    sample.rows.push_back(record);
    const double value = record.Number(measure);
    if (failed) {
      ++sample.failed;
    } else if (!Matches(record, check.require)) {
      ++sample.unmet;
    } else if (check.demand.IsText() ? record.Text(measure).empty() : !std::isfinite(value)) {
      ++sample.missing;
    }
    if (!failed && std::isfinite(value)) sample.values.push_back(value);
  }
  if (sample.rows.empty()) {
    sample.reason =
        selected.empty() ? "no record of " + ToText(selection) : NoneHas(selection, measure);
  }
  for (const Condition& one : check.require) {
    const bool is_there = std::ranges::any_of(
        sample.rows, [&one](const Record& row) { return row.Find(one.key) != nullptr; });
    if (sample.unmet == 0 || sample.failed > 0 || is_there || !sample.reason.empty()) continue;
    sample.reason = NoneHas(selection, one.key);
  }
  return sample;
}

// Returns "2 of 3 runs failed", or "" if all rows of the sample are usable.
std::string Defect(const Check& check, const Sample& sample) {
  const std::size_t rows = sample.rows.size();
  if (sample.failed > 0 && !check.failed_runs_hold) {
    return fmt::format("{} of {} runs did not finish", sample.failed, rows);
  }
  if (sample.unmet == 0) return "";
  return fmt::format("{} of {} rows without {}", sample.unmet, rows, ToText(check.require));
}

// Returns "12 of 24 runs have warnings: energy, drift", or "".
std::string Flagged(const std::vector<Sample>& samples) {
  std::set<std::string> words;
  std::size_t rows = 0, flagged = 0;
  for (const Sample& sample : samples) {
    for (const Record& row : sample.rows) {
      const std::vector<std::string> codes = WarningsOf(row);
      words.insert(codes.begin(), codes.end());
      if (HasWarning(row)) ++flagged;
    }
    rows += sample.rows.size();
  }
  if (flagged == 0) return "";
  return fmt::format("{} of {} runs have warnings: {}", flagged, rows, fmt::join(words, ", "));
}

double Apply(Statistic statistic, const std::vector<double>& values) {
  if (values.empty()) return kNoNumber;
  if (statistic == Statistic::kMax) return std::ranges::max(values);
  if (statistic == Statistic::kMin) return std::ranges::min(values);
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

template <typename Value>
bool Quantify(const Check& check, const std::vector<Value>& values) {
  const auto meets = [&check](const Value& value) { return Meets(check.demand, value); };
  return check.statistic == Statistic::kAny ? std::ranges::any_of(values, meets)
                                            : std::ranges::all_of(values, meets);
}

// HoldsOf...(): return true if the demand is met, with the numbers in `result`.
bool HoldsOfTexts(const Check& check, const Sample& sample, CheckResult* result) {
  const std::vector<std::string> words = Mapped<std::string>(
      sample.rows, [&](const Record& row) { return row.Text(check.demand.measure); });
  result->measured = CountWords(words, "{} ({})");
  return Quantify(check, words);
}

bool HoldsOfNumbers(const Check& check, const Sample& sample, CheckResult* result) {
  // if all runs failed in a check that expects failure, it holds without a number
  bool holds = true;
  result->measured = "no number";
  if (!sample.values.empty()) {
    const auto [low, high] = std::ranges::minmax(sample.values);
    const double value = Apply(check.statistic, sample.values);
    const bool quantified = IsQuantified(check);
    result->measured = quantified ? fmt::format("{:.3g} .. {:.3g}", low, high)
                                  : fmt::format("{:.3g} ({:.3g} .. {:.3g})", value, low, high);
    holds = quantified ? Quantify(check, sample.values) : Meets(check.demand, value);
  }
  if (sample.failed > 0) {
    result->measured += fmt::format(", {} of {} did not finish", sample.failed, sample.rows.size());
  }
  return holds;
}

/// Returns the ratio of machine speeds between these rows; 1 if the measure is not a time.
double OtherSpeed(const Check& check, const std::vector<Sample>& samples) {
  double least = std::numeric_limits<double>::infinity(), most = 0.0;
  for (const Sample& sample : samples) {
    for (const Record& row : sample.rows) {
      const double calibration = CalibrationOf(row, check.demand.measure);
      if (!(calibration > 0.0)) continue;
      least = std::min(least, calibration);
      most = std::max(most, calibration);
    }
  }
  return most > kOtherSpeed * least ? most / least : 1.0;
}

/// An infinite ratio counts as the largest number, at any speed of the machine.
bool HoldsOfRatio(const Check& check, const std::vector<Sample>& samples, CheckResult* result,
                  std::string* uncertain) {
  const double numerator = Apply(check.statistic, samples.front().values);
  const double denominator = Apply(check.statistic, samples.back().values);
  constexpr double kMost = std::numeric_limits<double>::max();
  const double quotient = numerator / denominator, ratio = std::clamp(quotient, -kMost, kMost);
  const std::string parts = fmt::format("{:.3g} / {:.3g}", numerator, denominator);
  if (std::isnan(quotient)) {
    *uncertain = fmt::format("the ratio {} has no value", parts);
    result->measured = "no number";
    return false;
  }
  result->measured = fmt::format("{:.3g} ({})", quotient, parts);
  if (std::isinf(quotient)) result->remark = fmt::format("the ratio {} is infinite", parts);
  const double speed = std::isinf(quotient) ? 1.0 : OtherSpeed(check, samples);
  const bool holds = Meets(check.demand, ratio);
  if (Meets(check.demand, ratio * speed) != holds || Meets(check.demand, ratio / speed) != holds) {
    *uncertain = fmt::format(
        "the machine's speed changed by a factor of {:.3g} in between (calibration_ns): time again "
        "with run --timing-only --rerun all",
        speed);
  }
  return holds;
}

std::string VerdictColour(const Record& row, const TableColumn& column) {
  if (column.key != "verdict") return "";
  const std::string verdict = row.Text("verdict");
  if (verdict == ToString(Verdict::kReproduced)) return "32";
  return verdict == ToString(Verdict::kNotReproduced) ? "31" : "33";
}

}  // namespace

CheckResult Evaluate(const Check& check, std::span<const Record> records) {
  const bool is_ratio = !check.relative_to.empty();
  std::vector<Sample> samples = {Take(check, check.select, records)};
  if (is_ratio) samples.push_back(Take(check, check.relative_to, records));
  CheckResult result;
  result.label = check.label;
  for (const Sample& sample : samples) result.rows += sample.rows.size();
  const auto statistic = kStatistics[static_cast<std::size_t>(check.statistic)];
  result.expected = ToText(
      check.demand,
      fmt::format("{}{} {}", is_ratio ? "ratio of " : "", statistic, check.demand.measure), true);
  // samples without rows before samples without a required key
  for (const bool with_rows : {false, true}) {
    for (const Sample& sample : samples) {
      if (sample.reason.empty() || sample.rows.empty() == with_rows) continue;
      result.reason = sample.reason;
      return result;
    }
  }
  std::string uncertain;
  const bool holds = is_ratio                ? HoldsOfRatio(check, samples, &result, &uncertain)
                     : check.demand.IsText() ? HoldsOfTexts(check, samples.front(), &result)
                                             : HoldsOfNumbers(check, samples.front(), &result);
  for (const Sample& sample : samples) {
    if (result.reason.empty()) result.reason = Defect(check, sample);
    if (sample.missing == 0) continue;  // incomplete samples decide nothing
    uncertain =
        fmt::format("{} of {} values missing or not finite", sample.missing, sample.rows.size());
  }
  result.state = holds && result.reason.empty() ? CheckState::kHolds : CheckState::kFails;
  if (result.reason.empty() && !uncertain.empty()) {
    result.reason = uncertain;
    result.state = CheckState::kNotMeasured;
  }
  const std::string flagged = Flagged(samples);
  if (!flagged.empty()) result.remark += (result.remark.empty() ? "" : "; ") + flagged;
  return result;
}

Table VerdictTable(std::span<const ClaimResult> results) {
  Table table;
  table.colour = &VerdictColour;
  table.columns = Columns("id, where=paper, claim, verdict");
  for (const auto& [rule, checks, verdict, text] : results) {
    AddRow({rule.id, rule.where, rule.claim, verdict}, &table);
  }
  return table;
}

Table CheckTable(const ClaimResult& result) {
  Table table;
  table.columns = Columns("condition, result, measured, expected, rows:integer, reason=remark");
  for (const auto& [label, state, rows, measured, expected, reason, remark] : result.checks) {
    const char* between = reason.empty() || remark.empty() ? "" : "; ";
    AddRow({label, state, measured, expected, rows, reason + between + remark}, &table);
  }
  return table;
}

std::string ClaimsMarkdown(std::span<const ClaimResult> results,
                           const std::vector<std::string>& notes) {
  std::string out = fmt::format("# Verdicts\n\n{}", ToMarkdown(VerdictTable(results)));
  for (const ClaimResult& result : results) {
    out += fmt::format("\n## {}\n\n{} (paper, {})\n\n**Verdict: {}**\n",
                       EscapeMarkdown(result.rule.id), EscapeMarkdownParagraph(result.rule.claim),
                       EscapeMarkdown(result.rule.where), EscapeMarkdown(result.text));
    if (!result.rule.note.empty()) {
      out += fmt::format("\n{}\n", EscapeMarkdownParagraph(result.rule.note));
    }
    out += fmt::format("\n{}", ToMarkdown(CheckTable(result)));
  }
  for (const std::string& note : notes) out += "\n\n" + EscapeMarkdownParagraph(note);
  return out + (notes.empty() ? "" : "\n");
}

ClaimResult Evaluate(const ClaimRule& rule, std::span<const Record> records) {
  ClaimResult result;
  result.rule = rule;
  for (const Check& check : rule.checks) result.checks.push_back(Evaluate(check, records));
  const auto labels = [&result](CheckState state) {
    std::vector<CheckResult> checks = result.checks;
    std::erase_if(checks, [=](const CheckResult& check) { return check.state != state; });
    return Joined(checks, "; ", &CheckResult::label);
  };
  const std::string holds = labels(CheckState::kHolds), fails = labels(CheckState::kFails),
                    missing = labels(CheckState::kNotMeasured);
  if (holds.empty()) {
    result.verdict = fails.empty() ? Verdict::kNotMeasured : Verdict::kNotReproduced;
  } else {
    result.verdict = fails.empty() && missing.empty() ? Verdict::kReproduced : Verdict::kOnlyUnder;
  }
  result.text = ToString(result.verdict);
  if (result.verdict == Verdict::kOnlyUnder) {
    result.text += ": " + holds;
    if (!fails.empty()) result.text += ". Not under: " + fails;
  }
  if (result.verdict != Verdict::kNotMeasured && !missing.empty()) {
    result.text += ". Not measured: " + missing;
  }
  const auto& [reproduced, not_reproduced, only_under, not_measured] = rule.wording;
  const std::string* const sentences[] = {&reproduced, &not_reproduced, &only_under, &not_measured};
  const std::string& sentence = *sentences[static_cast<std::size_t>(result.verdict)];
  if (!sentence.empty()) result.text += ". " + sentence;
  return result;
}

}  // namespace loopbench::harness
