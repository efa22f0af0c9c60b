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
  const auto& [reproduced, not_reproduced, only_under, not_measured] = rule.wording;
  const std::string* const sentences[] = {&reproduced, &not_reproduced, &only_under, &not_measured};
  const std::string& sentence = *sentences[static_cast<std::size_t>(result.verdict)];
  if (!sentence.empty()) result.text += ". " + sentence;
  return result;
}

std::string_view ToString(Verdict verdict) {
  constexpr std::string_view kWords[] = {"reproduced", "not reproduced", "only under",
                                         "not measured"};
  return kWords[static_cast<std::size_t>(verdict)];
}

std::string_view ToString(CheckState state) {
  constexpr std::string_view kWords[] = {"holds", "fails", "not measured"};
  return kWords[static_cast<std::size_t>(state)];
}

}  // namespace loopbench::harness
