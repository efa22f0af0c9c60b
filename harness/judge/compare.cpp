#include "harness/judge/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <set>
#include <sstream>

#include "harness/analysis/doubts.h"
#include "harness/judge/statistics.h"
#include "harness/record/origin.h"

namespace loopbench::harness {

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Two records of one case.
struct Pair {
  const Record& base;
  const Record& fresh;
  bool same_arithmetic, same_machine;
};

void Set(Finding& finding, Judgement judgement, std::string why = "") {
  finding.judgement = judgement;
  finding.why = std::move(why);
}

void JudgeOutcome(Finding& finding) {
  if (finding.base == finding.fresh) return;
  if (finding.fresh == "finished") return Set(finding, Judgement::kBetter, "failed before");
  Set(finding, Judgement::kWorse, "ends otherwise");
}

/// Worse with a reason for doubt that BASE did not have, better without one.
void JudgeDoubts(Finding& finding) {
  const auto codes = [](const std::string& text) {
    std::istringstream words(text);
    return std::set<std::string>(std::istream_iterator<std::string>(words), {});
  };
  const std::set<std::string> base = codes(finding.base), fresh = codes(finding.fresh);
  if (base == fresh) return;
  const bool no_new = std::ranges::includes(base, fresh);
  Set(finding, no_new ? Judgement::kBetter : Judgement::kWorse,
      no_new ? "fewer doubts" : "new doubts");
}

void JudgeCount(Finding& finding, double base, double fresh) {
  if (base == fresh) return;
  if (finding.measure.rule == Rule::kEqual) return Set(finding, Judgement::kWorse, "must be equal");
  Set(finding, fresh > base ? Judgement::kWorse : Judgement::kBetter, "exact count");
}

/// Worse above the ratio, better below its inverse.
void JudgeRatio(Finding& finding, double ratio, double allowed) {
  const std::string rule = fmt::format("ratio {:.4g}, allowed {:.4g}", ratio, allowed);
  if (ratio > allowed) Set(finding, Judgement::kWorse, rule);
  if (ratio < 1.0 / allowed) Set(finding, Judgement::kBetter, rule);
}

void JudgeNumbers(Finding& finding, const Pair& pair, const CompareOptions& options) {
  const double base = pair.base.Number(finding.measure.key);
  const double fresh = pair.fresh.Number(finding.measure.key);
  finding.ratio = fresh / base;
  switch (finding.measure.rule) {
    case Rule::kError: {
      // round-off has no size worth comparing
      const double floor = options.error_floor;
      finding.ratio = std::max(std::abs(fresh), floor) / std::max(std::abs(base), floor);
      return JudgeRatio(finding, finding.ratio,
                        pair.same_arithmetic ? options.error_ratio : options.error_ratio_other);
    }
    case Rule::kInstructions:
      return JudgeRatio(finding, finding.ratio, options.instruction_ratio);
    default:
      return JudgeCount(finding, base, fresh);
  }
}

/// Leaves the unadjusted p of "different by more than the ratio" in the finding; Holm decides.
void TestTimes(Finding& finding, const Pair& pair, const CompareOptions& options) {
  const std::vector<double>& base = pair.base.Numbers(finding.measure.key);
  const std::vector<double>& fresh = pair.fresh.Numbers(finding.measure.key);
  const double base_median = Median(base), fresh_median = Median(fresh);
  finding.base = fmt::format("{:.4g}", base_median);
  finding.fresh = fmt::format("{:.4g}", fresh_median);
  finding.ratio = fresh_median / base_median;
  std::vector<double> lifted_base = base, lifted_fresh = fresh;
  for (double& time : lifted_base) time *= options.time_ratio;
  for (double& time : lifted_fresh) time *= options.time_ratio;
  const double slower = MannWhitney(fresh, lifted_base).p_greater;
  const double faster = MannWhitney(base, lifted_fresh).p_greater;
  finding.p = std::min(1.0, 2.0 * std::min(slower, faster));
}

bool EndedBadly(const Record& record) {
  const std::string outcome = record.Text("outcome");
  return !outcome.empty() && outcome != "finished";
}

/// Judges a pair of which a side lacks the measure, or holds what it is not made of; false when
/// both have it.
bool JudgeWhatIsMissing(Finding& finding, const Pair& pair) {
  const Measure& measure = finding.measure;
  const Held base = HeldBy(pair.base, measure), fresh = HeldBy(pair.fresh, measure);
  if (base == Held::kFit && fresh == Held::kFit) return false;
  finding.base = Shown(pair.base, measure.key);
  finding.fresh = Shown(pair.fresh, measure.key);
  if (base == Held::kNothing && fresh == Held::kFit && EndedBadly(pair.base) &&
      !EndedBadly(pair.fresh)) {
    Set(finding, Judgement::kNotMeasured, "BASE did not finish");
    return true;
  }
  if (base != Held::kUnfit && fresh != Held::kUnfit) {
    const bool lost = fresh == Held::kNothing;
    Set(finding, lost ? Judgement::kWorse : Judgement::kDifferent,
        lost ? "not in NEW" : "not in BASE");
    return true;
  }
  const char* side = base != Held::kUnfit ? "NEW" : fresh != Held::kUnfit ? "BASE" : "BASE and NEW";
  const std::string why = fmt::format("in {}: expected {}", side, Expected(measure.rule));
  // a run that failed on both sides in one way may well end in NaN on both
  const bool failed_alike = finding.base == "null" && finding.fresh == "null" &&
                            EndedBadly(pair.base) && EndedBadly(pair.fresh);
  Set(finding,
      failed_alike         ? Judgement::kNotMeasured
      : base == Held::kFit ? Judgement::kWorse
                           : Judgement::kDifferent,
      why);
  return true;
}

/// Why values that both sides have cannot be compared; "" when they can.
std::string Obstacle(const Measure& measure, const Pair& pair) {
  if (measure.rule == Rule::kTime && !pair.same_machine) {
    return OriginOf(pair.base).machine.empty() || OriginOf(pair.fresh).machine.empty()
               ? "machine not known"
               : "another machine";
  }
  if (measure.needs_same_arithmetic && !pair.same_arithmetic) {
    return "another compiler, flags or mathematical library";
  }
  if (measure.rule == Rule::kTime &&
      pair.base.Text("start_hash") != pair.fresh.Text("start_hash")) {
    return "measured at another state";
  }
  return "";
}

Finding Judge(const std::string& one, const Measure& measure, const Pair& pair,
              const CompareOptions& options) {
  Finding finding;
  finding.one = one;
  finding.measure = measure;
  finding.base = pair.base.Text(measure.key);
  finding.fresh = pair.fresh.Text(measure.key);
  finding.ratio = finding.p = kNaN;
  if (JudgeWhatIsMissing(finding, pair)) return finding;
  if (const std::string obstacle = Obstacle(measure, pair); !obstacle.empty()) {
    Set(finding, Judgement::kNotMeasured, obstacle);
    return finding;
  }
  switch (measure.rule) {
    case Rule::kOutcome:
      JudgeOutcome(finding);
      break;
    case Rule::kDoubts:
      JudgeDoubts(finding);
      break;
    case Rule::kHash:
      if (finding.base != finding.fresh) Set(finding, Judgement::kWorse, "other bits");
      break;
    case Rule::kTime:
      TestTimes(finding, pair, options);
      break;
    default:
      JudgeNumbers(finding, pair, options);
  }
  return finding;
}

/// Adjusts the p-values of all times together and judges them. `smallest` holds the least
/// p that each sample could have given.
void DecideTimes(std::vector<Finding*>& times, const std::vector<double>& smallest,
                 const CompareOptions& options) {
  std::vector<double> p;
  for (const Finding* finding : times) p.push_back(finding->p);
  const std::vector<double> adjusted = HolmAdjusted(p);
  const double tests = static_cast<double>(times.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    Finding& finding = *times[i];
    finding.p = adjusted[i];
    // medians that are both zero have no ratio, and no difference
    if (finding.p <= options.alpha && !std::isnan(finding.ratio)) {
      Set(finding, finding.ratio > 1.0 ? Judgement::kWorse : Judgement::kBetter,
          fmt::format("ratio {:.3f}, p {:.2g}", finding.ratio, finding.p));
    } else if (smallest[i] * tests > options.alpha) {
      Set(finding, Judgement::kNotMeasured,
          fmt::format("too few repetitions to decide among {} times", times.size()));
    }
  }
}

/// Doubts of accuracy runs that each record has by itself: what runs beside it say depends on the
/// store.
std::vector<Record> WithOwnDoubts(std::vector<Record> records) {
  for (Record& record : records) {
    if (record.Text("kind") == "accuracy") record.Set("doubts", OwnDoubts(record));
  }
  return records;
}

/// Records by case; cases that occur twice go to `ambiguous`.
std::map<std::string, const Record*> ByCase(const std::vector<Record>& records,
                                            std::vector<std::string>& ambiguous) {
  std::map<std::string, const Record*> cases;
  for (const Record& record : records) {
    const std::string one = CaseText(record);
    if (!cases.emplace(one, &record).second && std::ranges::count(ambiguous, one) == 0) {
      ambiguous.push_back(one);
    }
  }
  return cases;
}

}  // namespace

std::string_view ToString(Judgement judgement) {
  constexpr std::string_view kJudgements[] = {"same", "better", "worse", "different",
                                              "not measured"};
  return kJudgements[static_cast<int>(judgement)];
}

int ComparisonReport::Count(Judgement judgement, std::string_view group) const {
  return static_cast<int>(std::ranges::count_if(findings, [&](const Finding& finding) {
    return finding.judgement == judgement &&
           (group.empty() || GroupOf(finding.measure.rule) == group);
  }));
}

int ComparisonReport::ExitCode(const CompareOptions& options) const {
  if (Count(Judgement::kWorse) + Count(Judgement::kDifferent) > 0) return 1;
  const int compared = Count(Judgement::kSame) + Count(Judgement::kBetter);
  const bool missing = !options.subset && !only_base.empty();
  return compared == 0 || missing || !ambiguous.empty() || !other_content.empty() ? 2 : 0;
}

ComparisonReport Compare(const std::vector<Record>& given_base,
                         const std::vector<Record>& given_fresh, const CompareOptions& options) {
  ComparisonReport comparison;
  const std::vector<Record> base = WithOwnDoubts(given_base), fresh = WithOwnDoubts(given_fresh);
  const auto in_base = ByCase(base, comparison.ambiguous);
  const auto in_fresh = ByCase(fresh, comparison.ambiguous);
  std::vector<double> smallest;
  for (const Record& record : base) {
    const std::string one = CaseText(record);
    if (in_base.at(one) != &record || std::ranges::count(comparison.ambiguous, one) > 0) continue;
    const auto other = in_fresh.find(one);
    if (other == in_fresh.end()) {
      comparison.only_base.push_back(one);
      continue;
    }
    if (record.Text("case_id") != other->second->Text("case_id")) {
      comparison.other_content.push_back(one);
      continue;
    }
    const Origin base_origin = OriginOf(record), fresh_origin = OriginOf(*other->second);
    const Pair pair{record, *other->second, base_origin.SameArithmetic(fresh_origin),
                    base_origin.SameMachine(fresh_origin)};
    for (const Measure& measure : Measures()) {
      const bool chosen =
          measure.rule != Rule::kNone &&
          (options.only.empty() || std::ranges::count(options.only, GroupOf(measure.rule)) > 0);
      const bool anywhere = HeldBy(pair.base, measure) != Held::kNothing ||
                            HeldBy(pair.fresh, measure) != Held::kNothing;
      if (!chosen || !anywhere) continue;
      comparison.findings.push_back(Judge(one, measure, pair, options));
      if (measure.rule == Rule::kTime) {
        smallest.push_back(2.0 * SmallestP(pair.base.Numbers(measure.key).size(),
                                           pair.fresh.Numbers(measure.key).size()));
      }
    }
  }
  for (const Record& record : fresh) {
    const std::string one = CaseText(record);
    if (!in_base.contains(one)) comparison.only_fresh.push_back(one);
  }
  std::vector<Finding*> times;
  std::vector<double> least;
  std::size_t next = 0;
  for (Finding& finding : comparison.findings) {
    if (finding.measure.rule != Rule::kTime) continue;
    const double p = smallest[next++];
    if (std::isnan(finding.p)) continue;  // not tested
    times.push_back(&finding);
    least.push_back(p);
  }
  DecideTimes(times, least, options);
  return comparison;
}

}  // namespace loopbench::harness
