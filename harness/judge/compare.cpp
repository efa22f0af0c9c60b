#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <sstream>

#include "harness/base/record.h"
#include "harness/base/text.h"
#include "harness/judge/analysis.h"
#include "harness/judge/judge.h"
#include "harness/judge/tables.h"

namespace loopbench::harness {

namespace {

struct Pair {
  const Record& base;
  const Record& fresh;
  bool same_arithmetic, same_machine;
  bool same_settings;  ///< otherwise equal bits are not expected
};

struct Ruling {
  Judgement judgement = Judgement::kSame;
  std::string why = {};
};

Ruling CompareTexts(Rule rule, const std::string& base, const std::string& fresh) {
  if (base == fresh) return {};
  if (rule == Rule::kHash) return {Judgement::kWorse, "other bits"};
  if (rule == Rule::kOutcome) {
    return fresh == "finished" ? Ruling{Judgement::kBetter, "failed before"}
                               : Ruling{Judgement::kWorse, "ends otherwise"};
  }
  // worse with a warning that BASE does not have, better without a warning of BASE
  const auto codes = [](const std::string& text) {
    std::istringstream words(text);
    return std::set<std::string>(std::istream_iterator<std::string>(words), {});
  };
  const std::set<std::string> before = codes(base), now = codes(fresh);
  if (before == now) return {};
  return std::ranges::includes(before, now) ? Ruling{Judgement::kBetter, "fewer warnings"}
                                            : Ruling{Judgement::kWorse, "new warnings"};
}

Ruling Between(double value, double lower, double upper, const std::string& why) {
  if (!std::isfinite(value) || value > upper) return {Judgement::kWorse, why};
  return value >= lower ? Ruling{} : Ruling{Judgement::kBetter, why};
}

Ruling CompareRatio(double ratio, double allowed) {
  return Between(ratio, 1.0 / allowed, allowed,
                 fmt::format("ratio {:.4g}, allowed {:.4g}", ratio, allowed));
}

Ruling CompareValues(const Pair& pair, const CompareOptions& options, Finding* finding) {
  const double base = pair.base.Number(finding->measure.key);
  const double fresh = pair.fresh.Number(finding->measure.key);
  finding->ratio = fresh / base;
  switch (finding->measure.rule) {
    case Rule::kError: {
      const double floor = options.error_floor;
      finding->ratio = std::max(std::abs(fresh), floor) / std::max(std::abs(base), floor);
      return CompareRatio(finding->ratio,
                          pair.same_arithmetic ? options.error_ratio : options.error_ratio_other);
    }
    case Rule::kInstructions:
      return CompareRatio(finding->ratio, options.instruction_ratio);
    case Rule::kCount:
      return Between(fresh, base, base, "exact count");
    default:
      break;
  }
  return base == fresh ? Ruling{} : Ruling{Judgement::kWorse, "must be equal"};
}

constexpr double kGap = 1.5;  ///< ratio that exceeds the usual noise of one machine

/// Returns true if samples are separated by the factor kGap `margin`. Rank tests of few repetitions
/// cannot decide among many times. One or two times may both contain an interruption.
bool AreApart(const std::vector<double>& base, const std::vector<double>& fresh, double margin) {
  constexpr std::size_t kFewest = 3;
  constexpr double kGapOfFew = 4.0;
  const bool is_few = std::min(base.size(), fresh.size()) < kFewest;
  const double gap = (is_few ? kGapOfFew : kGap) * margin;
  const auto [base_least, base_most] = std::ranges::minmax(base);
  const auto [fresh_least, fresh_most] = std::ranges::minmax(fresh);
  return fresh_least > gap * base_most || base_least > gap * fresh_most;
}

/// Returns the time of the calibration workload in NEW as a multiple of its time in BASE; 1 if it
/// is unknown, within noise, or was compiled differently.
double SpeedRatio(const Pair& pair, const Measure& measure) {
  const double ratio =
      CalibrationOf(pair.fresh, measure.key) / CalibrationOf(pair.base, measure.key);
  const bool is_equal_work = OriginOf(pair.base).compiler == OriginOf(pair.fresh).compiler;
  return is_equal_work && (ratio > kOtherSpeed || ratio < 1.0 / kOtherSpeed) ? ratio : 1.0;
}

/// Stores the unadjusted p of "different by more than the ratio" in the finding, for Holm's method.
/// If the machine changed its speed, the ratio is multiplied by the square of the change, because
/// other work may slow down more than the calibration workload.
void TestTimes(const Pair& pair, const CompareOptions& options, Finding* finding) {
  const std::vector<double>& base = pair.base.Numbers(finding->measure.key);
  const std::vector<double>& fresh = pair.fresh.Numbers(finding->measure.key);
  const double base_median = Median(base), fresh_median = Median(fresh);
  finding->base = fmt::format("{:.4g}", base_median);
  finding->fresh = fmt::format("{:.4g}", fresh_median);
  finding->ratio = fresh_median / base_median;
  const double speed = SpeedRatio(pair, finding->measure);
  const double margin = std::max(speed * speed, 1.0 / (speed * speed));
  if (speed != 1.0) {
    finding->why = fmt::format("the machine took {:.3g} of the time for equal work", speed);
  }
  const auto lifted = [factor = options.time_ratio * margin](const std::vector<double>& times) {
    return Mapped<double>(times, [factor](double time) { return time * factor; });
  };
  const double slower = MannWhitney(fresh, lifted(base)).p_greater;
  const double faster = MannWhitney(base, lifted(fresh)).p_greater;
  finding->p = std::min(1.0, 2.0 * std::min(slower, faster));
  finding->least_p = 2.0 * SmallestP(base.size(), fresh.size());
  finding->is_apart = AreApart(base, fresh, margin);
}

/// Returns the ruling for a missing or invalid measure; nothing if both sides have it.
std::optional<Ruling> ClassifyMissing(const Pair& pair, const Measure& measure) {
  const Presence base = PresenceOf(pair.base, measure), fresh = PresenceOf(pair.fresh, measure);
  if (base == Presence::kFit && fresh == Presence::kFit) return std::nullopt;
  const bool base_failed = HasFailed(pair.base), fresh_failed = HasFailed(pair.fresh);
  if (base == Presence::kNothing && fresh == Presence::kFit && base_failed && !fresh_failed) {
    return Ruling{Judgement::kNotMeasured, "BASE did not finish"};
  }
  if (base != Presence::kUnfit && fresh != Presence::kUnfit) {
    return fresh == Presence::kNothing ? Ruling{Judgement::kWorse, "not in NEW"}
                                       : Ruling{Judgement::kDifferent, "not in BASE"};
  }
  const char* side = base != Presence::kUnfit    ? "NEW"
                     : fresh != Presence::kUnfit ? "BASE"
                                                 : "BASE and NEW";
  // a run that failed equally on both sides may give NaN on both
  const bool failed_alike = base_failed && fresh_failed &&
                            Shown(pair.base, measure.key) == "null" &&
                            Shown(pair.fresh, measure.key) == "null";
  return Ruling{failed_alike             ? Judgement::kNotMeasured
                : base == Presence::kFit ? Judgement::kWorse
                                         : Judgement::kDifferent,
                fmt::format("in {}: expected {}", side, Expected(measure.rule))};
}

/// Returns the reason why values cannot be compared, or "".
std::string ObstacleOf(const Measure& measure, const Pair& pair) {
  if (measure.rule == Rule::kTime && !pair.same_machine) {
    return OriginOf(pair.base).machine.empty() || OriginOf(pair.fresh).machine.empty()
               ? "machine not known"
               : "another machine";
  }
  if (measure.repeats == Repeats::kUnderOneArithmetic && !pair.same_arithmetic) {
    return "another compiler, flags or mathematical library";
  }
  if (measure.rule == Rule::kHash && !pair.same_settings) return "ran with other settings";
  if (measure.rule == Rule::kTime &&
      pair.base.Text("start_hash") != pair.fresh.Text("start_hash")) {
    return "measured at another state";
  }
  return "";
}

Finding Compared(const std::string& one, const Measure& measure, const Pair& pair,
                 const CompareOptions& options) {
  Finding finding{.one = one, .measure = measure};
  Ruling ruling;
  if (const auto missing = ClassifyMissing(pair, measure)) {
    finding.base = Shown(pair.base, measure.key);
    finding.fresh = Shown(pair.fresh, measure.key);
    finding.on_both = false;
    ruling = *missing;
  } else {
    finding.base = pair.base.Text(measure.key);
    finding.fresh = pair.fresh.Text(measure.key);
    if (const std::string obstacle = ObstacleOf(measure, pair); !obstacle.empty()) {
      ruling = {Judgement::kNotMeasured, obstacle};
    } else if (measure.rule == Rule::kTime) {
      TestTimes(pair, options, &finding);
      return finding;  // DecideTimes judges all times together
    } else if (TypeOf(measure.key) == ValueType::kText) {
      ruling = CompareTexts(measure.rule, finding.base, finding.fresh);
    } else {
      ruling = CompareValues(pair, options, &finding);
    }
  }
  finding.judgement = ruling.judgement;
  finding.why = ruling.why;
  return finding;
}

/// Adjusts the p-values of all times together and judges them.
void DecideTimes(const CompareOptions& options, std::vector<Finding>* findings) {
  std::vector<double> p = Mapped<double>(*findings, &Finding::p);
  std::erase_if(p, [](double one) { return std::isnan(one); });  // not a time, or not tested
  const std::vector<double> adjusted = HolmAdjusted(p);
  const double tests = static_cast<double>(p.size());
  std::size_t time = 0;
  for (Finding& finding : *findings) {
    if (std::isnan(finding.p)) continue;
    finding.p = adjusted[time++];
    const bool is_sure = finding.p <= options.alpha;
    if (std::isnan(finding.ratio)) {
      finding.judgement = Judgement::kNotMeasured;
      finding.why = "times of 0";
    } else if (finding.ratio == 0.0 || std::isinf(finding.ratio)) {
      finding.judgement = Judgement::kDifferent;
      finding.why = "a time of 0 on one side";
    } else if (is_sure || finding.is_apart) {
      finding.judgement = finding.ratio > 1.0 ? Judgement::kWorse : Judgement::kBetter;
      finding.why = is_sure ? fmt::format("ratio {:.3f}, p {:.2g}", finding.ratio, finding.p)
                            : fmt::format("ratio {:.3f}, samples far apart", finding.ratio);
    } else if (!finding.why.empty()) {  // within the change of the machine's speed
      finding.judgement = Judgement::kNotMeasured;
    } else if (finding.least_p * tests > options.alpha) {
      finding.judgement = Judgement::kNotMeasured;
      finding.why = "too few repetitions to decide among " + WithCount(p.size(), "time");
    } else if (finding.ratio > kGap || finding.ratio < 1.0 / kGap) {
      finding.judgement = Judgement::kNotMeasured;
      finding.why = fmt::format("ratio {:.3g} of medians, but samples overlap", finding.ratio);
    }
  }
}

/// Restricts warnings of accuracy runs to warnings from the record alone: comparisons with other
/// runs depend on the store.
std::vector<Record> WithOwnWarnings(std::vector<Record> records) {
  for (Record& record : records) {
    if (record.Text("kind") == "accuracy") record.Set("warnings", OwnWarnings(record));
  }
  return records;
}

/// Returns the records by case. Adds cases that occur twice to `repeated`, and to `in_order` if
/// they are new there.
std::map<std::string, const Record*> ByCase(const std::vector<Record>& records,
                                            const CompareOptions& options,
                                            std::set<std::string>* repeated,
                                            std::vector<std::string>* in_order) {
  std::map<std::string, const Record*> cases;
  for (const Record& record : records) {
    const std::string one = CaseText(record, options.match);
    const bool is_new = cases.emplace(one, &record).second;
    if (!is_new && repeated->insert(one).second) in_order->push_back(one);
  }
  return cases;
}

}  // namespace

int ComparisonReport::Count(Judgement judgement, std::string_view group) const {
  return static_cast<int>(std::ranges::count_if(findings, [&](const Finding& finding) {
    return finding.judgement == judgement &&
           (group.empty() || GroupOf(finding.measure.rule) == group);
  }));
}

std::string ComparisonReport::Obstacle(const CompareOptions& options) const {
  std::vector<std::string> reasons;
  const auto count = [&reasons](const std::vector<std::string>& cases, const char* what) {
    if (!cases.empty()) reasons.push_back(WithCount(cases.size(), "case") + " " + what);
  };
  if (!options.subset) count(only_base, "only in BASE");
  if (!options.added) count(only_fresh, "only in NEW");
  count(ambiguous, "there more than once");
  count(other_content, "of other content");
  std::vector<Finding> times = findings;
  std::erase_if(times, [](const Finding& finding) {
    return finding.measure.rule != Rule::kTime || !finding.on_both;
  });
  const auto is_measured = [](const Finding& finding) {
    return finding.judgement != Judgement::kNotMeasured;
  };
  if (!times.empty() && std::ranges::none_of(times, is_measured)) {
    reasons.push_back(WithCount(times.size(), "time") + " not comparable: " + times.front().why);
  }
  if (reasons.empty() && std::ranges::none_of(findings, is_measured)) {
    reasons.emplace_back("too little in common");
  }
  return Joined(reasons, "; ");
}

int ComparisonReport::ExitCode(const CompareOptions& options) const {
  if (Count(Judgement::kWorse) + Count(Judgement::kDifferent) > 0) return 1;
  return Obstacle(options).empty() ? 0 : 2;
}

ComparisonReport Compare(const std::vector<Record>& given_base,
                         const std::vector<Record>& given_fresh, const CompareOptions& options) {
  ComparisonReport comparison;
  const std::vector<Record> base = WithOwnWarnings(given_base),
                            fresh = WithOwnWarnings(given_fresh);
  std::set<std::string> repeated;
  const auto in_base = ByCase(base, options, &repeated, &comparison.ambiguous);
  const auto in_fresh = ByCase(fresh, options, &repeated, &comparison.ambiguous);
  for (const Record& record : base) {
    const std::string one = CaseText(record, options.match);
    if (in_base.at(one) != &record || repeated.contains(one)) continue;
    const auto other = in_fresh.find(one);
    if (other == in_fresh.end()) {
      comparison.only_base.push_back(one);
      continue;
    }
    const bool same_settings = record.Text("case_id") == other->second->Text("case_id");
    if (!same_settings && options.match.empty()) {
      comparison.other_content.push_back(one);
      continue;
    }
    if (!same_settings) {
      comparison.other_settings.push_back(
          fmt::format("{}: {}", one, OtherSettings(record, *other->second)));
    }
    const Origin base_origin = OriginOf(record), fresh_origin = OriginOf(*other->second);
    const Pair pair{record, *other->second, base_origin.SameArithmetic(fresh_origin),
                    base_origin.SameMachine(fresh_origin), same_settings};
    for (const Measure& measure : Measures()) {
      const bool chosen = measure.rule != Rule::kNone &&
                          (options.only.empty() || Contains(options.only, GroupOf(measure.rule)));
      const bool anywhere =
          pair.base.Find(measure.key) != nullptr || pair.fresh.Find(measure.key) != nullptr;
      if (chosen && anywhere) comparison.findings.push_back(Compared(one, measure, pair, options));
    }
  }
  for (const Record& record : fresh) {
    const std::string one = CaseText(record, options.match);
    if (!in_base.contains(one)) comparison.only_fresh.push_back(one);
  }
  DecideTimes(options, &comparison.findings);
  return comparison;
}

}  // namespace loopbench::harness
