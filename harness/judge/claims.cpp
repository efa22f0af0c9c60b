#include "harness/judge/claims.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <string_view>

namespace loopbench::harness {
namespace {

constexpr const char* kFinished = "finished";

bool IsText(const Check& check) {
  return check.compare == Comparison::kIs || check.compare == Comparison::kIsNot;
}

bool RunFailed(const Record& record) {
  const std::string outcome = record.Text("outcome");
  return !outcome.empty() && outcome != kFinished;
}

// The outcome itself is examined, so a run that failed is an observation and no defect.
bool ExaminesOutcome(const Check& check) {
  return check.measure == "outcome" ||
         std::ranges::find(check.select, "outcome", &Condition::key) != check.select.end();
}

// Rows of one selection, sorted by what they are good for.
struct Sample {
  std::vector<Record> rows;
  std::vector<double> values;  // finite measures of the runs that count
  std::size_t failed = 0;
  std::size_t unmet = 0;
  std::size_t not_finite = 0;
};

Sample Take(const Check& check, const Selection& selection, std::span<const Record> records) {
  Sample sample;
  for (const Record& record : records) {
    const bool failed = RunFailed(record) && !ExaminesOutcome(check);
    if (!Matches(record, selection)) continue;
    if (record.Find(check.measure) == nullptr && !failed) continue;
    sample.rows.push_back(record);
    if (failed) {
      ++sample.failed;
    } else if (!Matches(record, check.require)) {
      ++sample.unmet;
    } else if (!IsText(check) && !std::isfinite(record.Number(check.measure))) {
      ++sample.not_finite;
    }
    const double value = record.Number(check.measure);
    if (!failed && std::isfinite(value)) sample.values.push_back(value);
  }
  return sample;
}

// "2 of 3 runs failed", or "" when every row of the sample can be used.
std::string Defect(const Check& check, const Sample& sample) {
  const std::size_t rows = sample.rows.size();
  if (sample.failed > 0 && !check.failed_runs_hold) {
    return fmt::format("{} of {} runs did not finish", sample.failed, rows);
  }
  if (sample.unmet > 0) {
    return fmt::format("{} of {} rows without {}", sample.unmet, rows, ToText(check.require));
  }
  if (sample.not_finite > 0) {
    return fmt::format("{} of {} values missing or not finite", sample.not_finite, rows);
  }
  return "";
}

double Apply(Statistic statistic, const std::vector<double>& values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  switch (statistic) {
    case Statistic::kMax:
      return std::ranges::max(values);
    case Statistic::kMin:
      return std::ranges::min(values);
    default:
      break;
  }
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

bool Satisfies(const Check& check, double value) {
  switch (check.compare) {
    case Comparison::kAtMost:
      return value <= check.threshold;
    case Comparison::kAtLeast:
      return value >= check.threshold;
    default:
      return std::abs(value - check.threshold) <= check.tolerance;
  }
}

template <typename Values, typename Predicate>
bool Quantify(Statistic statistic, const Values& values, const Predicate& holds) {
  return statistic == Statistic::kAny ? std::ranges::any_of(values, holds)
                                      : std::ranges::all_of(values, holds);
}

std::string_view ToString(Statistic statistic) {
  switch (statistic) {
    case Statistic::kMax:
      return "max";
    case Statistic::kMin:
      return "min";
    case Statistic::kMean:
      return "mean";
    case Statistic::kAll:
      return "every";
    case Statistic::kAny:
      return "any";
  }
  return "";
}

std::string Expected(const Check& check) {
  const std::string subject = fmt::format("{}{} {}", check.relative_to.empty() ? "" : "ratio of ",
                                          ToString(check.statistic), check.measure);
  switch (check.compare) {
    case Comparison::kAtMost:
      return fmt::format("{} <= {:.3g}", subject, check.threshold);
    case Comparison::kAtLeast:
      return fmt::format("{} >= {:.3g}", subject, check.threshold);
    case Comparison::kWithin:
      return fmt::format("{} = {:.3g} +- {:.3g}", subject, check.threshold, check.tolerance);
    case Comparison::kIs:
      return fmt::format("{} is {}", subject, check.word);
    case Comparison::kIsNot:
      return fmt::format("{} is not {}", subject, check.word);
  }
  return subject;
}

void CompareText(const Check& check, const Sample& sample, CheckResult* result) {
  std::map<std::string, int> counts;
  for (const Record& row : sample.rows) ++counts[row.Text(check.measure)];
  for (const auto& [word, count] : counts) {
    result->measured += fmt::format("{}{} ({})", result->measured.empty() ? "" : ", ", word, count);
  }
  const bool holds = Quantify(check.statistic, sample.rows, [&](const Record& row) {
    return (row.Text(check.measure) == check.word) == (check.compare == Comparison::kIs);
  });
  result->state = holds ? CheckState::kHolds : CheckState::kFails;
}

void CompareNumbers(const Check& check, const Sample& sample, CheckResult* result) {
  // All runs failed in a check that expects failure: there is no number, and it holds.
  bool holds = sample.values.empty();
  if (holds) {
    result->measured = "no number";
  } else {
    const auto [low, high] = std::ranges::minmax(sample.values);
    const bool quantified =
        check.statistic == Statistic::kAll || check.statistic == Statistic::kAny;
    const double value = Apply(check.statistic, sample.values);
    result->measured = quantified ? fmt::format("{:.3g} .. {:.3g}", low, high)
                                  : fmt::format("{:.3g} ({:.3g} .. {:.3g})", value, low, high);
    holds = quantified ? Quantify(check.statistic, sample.values,
                                  [&](double x) { return Satisfies(check, x); })
                       : Satisfies(check, value);
  }
  if (sample.failed > 0) {
    result->measured += fmt::format(", {} of {} did not finish", sample.failed, sample.rows.size());
  }
  result->state = holds ? CheckState::kHolds : CheckState::kFails;
}

void CompareRatio(const Check& check, const Sample& above, const Sample& below,
                  CheckResult* result) {
  const double numerator = Apply(check.statistic, above.values);
  const double denominator = Apply(check.statistic, below.values);
  const double ratio = numerator / denominator;
  result->measured = fmt::format("{:.3g} ({:.3g} / {:.3g})", ratio, numerator, denominator);
  const bool holds = std::isfinite(ratio) && Satisfies(check, ratio);
  result->state = holds ? CheckState::kHolds : CheckState::kFails;
}

}  // namespace

CheckResult Evaluate(const Check& check, std::span<const Record> records) {
  const bool is_ratio = !check.relative_to.empty();
  const Sample sample = Take(check, check.select, records);
  const Sample base = is_ratio ? Take(check, check.relative_to, records) : Sample{};
  CheckResult result;
  result.label = check.label;
  result.rows = sample.rows.size() + base.rows.size();
  result.expected = Expected(check);
  if (sample.rows.empty() || (is_ratio && base.rows.empty())) {
    result.reason =
        "no record of " + ToText(sample.rows.empty() ? check.select : check.relative_to);
    return result;
  }
  if (is_ratio) {
    CompareRatio(check, sample, base, &result);
  } else if (IsText(check)) {
    CompareText(check, sample, &result);
  } else {
    CompareNumbers(check, sample, &result);
  }
  const std::string defect = Defect(check, sample);
  result.reason = defect.empty() ? Defect(check, base) : defect;
  if (!result.reason.empty()) result.state = CheckState::kFails;
  return result;
}

}  // namespace loopbench::harness
