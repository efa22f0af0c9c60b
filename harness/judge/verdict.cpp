// The verdict on a claim, from the states of its checks.
#include <string>
#include <string_view>

#include "harness/judge/claims.h"

namespace loopbench::harness {
namespace {

std::string Labels(const std::vector<CheckResult>& checks, CheckState state) {
  std::string labels;
  for (const CheckResult& check : checks) {
    if (check.state == state) labels += (labels.empty() ? "" : "; ") + check.label;
  }
  return labels;
}

const std::string& WordingOf(const Wording& wording, Verdict verdict) {
  switch (verdict) {
    case Verdict::kReproduced:
      return wording.reproduced;
    case Verdict::kNotReproduced:
      return wording.not_reproduced;
    case Verdict::kOnlyUnder:
      return wording.only_under;
    case Verdict::kNotMeasured:
      break;
  }
  return wording.not_measured;
}

}  // namespace

ClaimResult Evaluate(const ClaimRule& rule, std::span<const Record> records) {
  ClaimResult result;
  result.rule = rule;
  for (const Check& check : rule.checks) result.checks.push_back(Evaluate(check, records));
  const std::string holds = Labels(result.checks, CheckState::kHolds);
  const std::string fails = Labels(result.checks, CheckState::kFails);
  const std::string missing = Labels(result.checks, CheckState::kNotMeasured);

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
  const std::string& sentence = WordingOf(rule.wording, result.verdict);
  if (!sentence.empty()) result.text += ". " + sentence;
  return result;
}

std::string_view ToString(Verdict verdict) {
  switch (verdict) {
    case Verdict::kReproduced:
      return "reproduced";
    case Verdict::kNotReproduced:
      return "not reproduced";
    case Verdict::kOnlyUnder:
      return "only under";
    case Verdict::kNotMeasured:
      break;
  }
  return "not measured";
}

std::string_view ToString(CheckState state) {
  switch (state) {
    case CheckState::kHolds:
      return "holds";
    case CheckState::kFails:
      return "fails";
    case CheckState::kNotMeasured:
      break;
  }
  return "not measured";
}

}  // namespace loopbench::harness
