#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
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
  bool is_selected = false;  // records match, with the measure or without
};

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
  Sample sample{.selection = selection, .is_selected = !selected.empty()};
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
  return sample;
}

// Returns "no record of formulation=odca has drift".
std::string NoneHas(const Sample& sample, const std::string& key) {
  return fmt::format("no record of {} has {}", ToText(sample.selection), key);
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

// Returns "no record of formulation=odca has colour" for a required key that no row has, or "".
std::string KeyMissing(const Check& check, const Sample& sample) {
  for (const Condition& one : check.require) {
    const bool is_there = std::ranges::any_of(
        sample.rows, [&one](const Record& row) { return row.Find(one.key) != nullptr; });
    if (sample.unmet > 0 && sample.failed == 0 && !is_there) return NoneHas(sample, one.key);
  }
  return "";
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
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  if (statistic == Statistic::kMax) return std::ranges::max(values);
  if (statistic == Statistic::kMin) return std::ranges::min(values);
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

// Returns true if all values, or any value, meet the demand.
template <typename Value>
bool Quantify(const Check& check, const std::vector<Value>& values) {
  const auto meets = [&check](const Value& value) { return Meets(check.demand, value); };
  return check.statistic == Statistic::kAny ? std::ranges::any_of(values, meets)
                                            : std::ranges::all_of(values, meets);
}

// HoldsOf...(): return true if the demand is met, with the numbers in `measured`.
bool HoldsOfTexts(const Check& check, const Sample& sample, std::string* measured) {
  const std::vector<std::string> words = Mapped<std::string>(
      sample.rows, [&](const Record& row) { return row.Text(check.demand.measure); });
  *measured = CountWords(words, "{} ({})");
  return Quantify(check, words);
}

bool HoldsOfNumbers(const Check& check, const Sample& sample, std::string* measured) {
  // if all runs failed in a check that expects failure, it holds without a number
  bool holds = true;
  *measured = "no number";
  if (!sample.values.empty()) {
    const auto [low, high] = std::ranges::minmax(sample.values);
    const double value = Apply(check.statistic, sample.values);
    const bool quantified = IsQuantified(check);
    *measured = quantified ? fmt::format("{:.3g} .. {:.3g}", low, high)
                           : fmt::format("{:.3g} ({:.3g} .. {:.3g})", value, low, high);
    holds = quantified ? Quantify(check, sample.values) : Meets(check.demand, value);
  }
  if (sample.failed > 0) {
    *measured += fmt::format(", {} of {} did not finish", sample.failed, sample.rows.size());
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
  for (const Sample& sample : samples) {
    if (!sample.rows.empty()) continue;
    result.reason = sample.is_selected ? NoneHas(sample, check.demand.measure)
                                       : "no record of " + ToText(sample.selection);
    return result;
  }
  for (const Sample& sample : samples) {
    result.reason = KeyMissing(check, sample);
    if (!result.reason.empty()) return result;
  }
  std::string uncertain;
  const bool holds = is_ratio ? HoldsOfRatio(check, samples, &result, &uncertain)
                     : check.demand.IsText()
                         ? HoldsOfTexts(check, samples.front(), &result.measured)
                         : HoldsOfNumbers(check, samples.front(), &result.measured);
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

std::string_view ToString(Verdict verdict) {
  constexpr std::string_view kWords[] = {"reproduced", "not reproduced", "partially reproduced",
                                         "not measured"};
  return kWords[static_cast<std::size_t>(verdict)];
}

std::string_view ToString(CheckState state) {
  constexpr std::string_view kWords[] = {"holds", "fails", "not measured"};
  return kWords[static_cast<std::size_t>(state)];
}

}  // namespace loopbench::harness
