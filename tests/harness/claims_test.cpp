// Planted data turn each verdict, and the committed rules are readable and answer to planted data.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "harness/base/text.h"
#include "harness/judge/judge.h"
#include "tests/harness/records.h"

namespace loopbench::harness {
namespace claims_test {

const std::filesystem::path kClaimsFile =
    std::filesystem::path(LOOPBENCH_SOURCE_DIR) / "configs/experiments/paper/claims.json";

Record RunOf(const std::string& mechanism, const std::string& measure, double value,
             const std::string& outcome = "finished") {
  return RecordOf("mechanism", mechanism, "outcome", outcome, measure, value);
}

Check DriftCheck(const std::string& mechanism) {
  Check check;
  check.label = mechanism + " problem";
  check.select = {{"mechanism", {mechanism}}};
  check.demand = {.measure = "drift", .relation = Relation::kAtMost, .number = 1e-12};
  return check;
}

ClaimRule TwoProblems() {
  ClaimRule rule;
  rule.id = "two";
  rule.claim = "Drift is small.";
  rule.where = "section 4.1";
  rule.checks = {DriftCheck("square"), DriftCheck("general")};
  rule.wording.reproduced = "Everywhere.";
  return rule;
}

TEST(Claims, TheVerdictTurnsWithTheData) {
  const ClaimRule rule = TwoProblems();
  const auto verdict = [&](double square, double general) {
    return Evaluate(rule, std::vector<Record>{RunOf("square", "drift", square),
                                              RunOf("general", "drift", general)})
        .text;
  };
  EXPECT_EQ(verdict(1e-14, 1e-13), "reproduced. Everywhere.");
  EXPECT_EQ(verdict(1e-6, 1e-7), "not reproduced");
  EXPECT_EQ(verdict(1e-14, 1e-7),
            "partially reproduced: square problem. Not under: general problem");
  EXPECT_EQ(Evaluate(rule, {}).text, "not measured");
}

TEST(Claims, AMissingConditionIsNeverSilentlyTrue) {
  const ClaimRule rule = TwoProblems();
  const ClaimResult half = Evaluate(rule, std::vector<Record>{RunOf("square", "drift", 1e-14)});
  EXPECT_EQ(half.verdict, Verdict::kOnlyUnder);
  EXPECT_EQ(half.text, "partially reproduced: square problem. Not measured: general problem");
  ExpectWords(half.checks[1].reason, {"no record of mechanism=general"});
  const ClaimResult bad = Evaluate(rule, std::vector<Record>{RunOf("square", "drift", 1.0)});
  EXPECT_EQ(bad.text, "not reproduced. Not measured: general problem");
}

TEST(Claims, AFailedRunFailsTheCheckAndAMissingValueLeavesItUndecided) {
  const Check check = DriftCheck("square");
  std::vector<Record> records = {RunOf("square", "drift", 1e-14), RunOf("square", "drift", 1e-14)};
  EXPECT_EQ(Evaluate(check, records).state, CheckState::kHolds);
  records[1].Set("outcome", std::string("step-too-small"));
  CheckResult result = Evaluate(check, records);
  EXPECT_EQ(result.state, CheckState::kFails);
  EXPECT_EQ(result.reason, "1 of 2 runs did not finish");
  Record without = RecordOf("mechanism", "square", "outcome", "finished");
  Record null = Changed(without, "drift", Value());
  for (const Record& other :
       {RunOf("square", "drift", std::numeric_limits<double>::quiet_NaN()),
        RunOf("square", "drift", std::numeric_limits<double>::infinity()), null, without}) {
    records[1] = other;
    for (const Statistic statistic : {Statistic::kMax, Statistic::kAll, Statistic::kAny}) {
      Check one = check;
      one.statistic = statistic;
      result = Evaluate(one, records);
      EXPECT_EQ(result.state, CheckState::kNotMeasured);
      EXPECT_EQ(result.reason, "1 of 2 values missing or not finite");
    }
    // of either side of a ratio
    records[1].Set("mechanism", std::string("base"));
    Check ratio = check;
    ratio.relative_to = {{"mechanism", {"base"}}};
    records.push_back(RunOf("base", "drift", 1e-14));
    EXPECT_EQ(Evaluate(ratio, records).reason, "1 of 2 values missing or not finite");
    records.pop_back();
  }
  // words may be missing too
  Check word = check;
  word.statistic = Statistic::kAll;
  word.demand = {.measure = "growth_regime", .relation = Relation::kIsNot, .word = "truncation"};
  records = {RunOf("square", "drift", 1.0), RunOf("square", "drift", 1.0)};
  records[0].Set("growth_regime", std::string("round-off"));
  EXPECT_EQ(Evaluate(word, records).state, CheckState::kNotMeasured);
}

TEST(Claims, ARunThatFailedBeforeItsFirstMeasureStillFailsTheCheck) {
  const Record crashed = RecordOf("mechanism", "square", "outcome", "inconsistent-start");
  EXPECT_EQ(Evaluate(DriftCheck("square"), std::vector{crashed}).state, CheckState::kFails);
}

TEST(Claims, RecordsOfAnotherKindDoNotCount) {
  EXPECT_EQ(
      Evaluate(DriftCheck("square"), std::vector{RunOf("square", "rhs_ns_median", 100.0)}).state,
      CheckState::kNotMeasured);
}

TEST(Claims, OutcomesAreExaminedWhereTheCheckAsksForThem) {
  Check check = DriftCheck("square");
  check.statistic = Statistic::kAll;
  check.demand = {.measure = "outcome", .relation = Relation::kIsNot, .word = "singular"};
  std::vector<Record> records = {RunOf("square", "drift", 1.0),
                                 RunOf("square", "drift", 1.0, "time-limit")};
  CheckResult result = Evaluate(check, records);
  EXPECT_EQ(result.state, CheckState::kHolds);
  EXPECT_EQ(result.measured, "finished (1), time-limit (1)");
  records[0].Set("outcome", std::string("singular"));
  EXPECT_EQ(Evaluate(check, records).state, CheckState::kFails);
  check.statistic = Statistic::kAny;
  EXPECT_EQ(Evaluate(check, records).state, CheckState::kHolds);
}

TEST(Claims, AnExpectedFailureHoldsForFailedRunsAndForBadNumbers) {
  Check check = DriftCheck("square");
  check.statistic = Statistic::kAll;
  check.demand = {.measure = "drift", .relation = Relation::kAtLeast, .number = 0.1};
  check.failed_runs_hold = true;
  std::vector<Record> records = {RunOf("square", "drift", 0.0, "singular")};
  EXPECT_EQ(Evaluate(check, records).state, CheckState::kHolds);
  records.push_back(RunOf("square", "drift", 0.7));
  EXPECT_EQ(Evaluate(check, records).state, CheckState::kHolds);
  EXPECT_EQ(Evaluate(check, records).measured, "0.7 .. 0.7, 1 of 2 did not finish");
  records.push_back(RunOf("square", "drift", 1e-9));
  EXPECT_EQ(Evaluate(check, records).state, CheckState::kFails);
}

TEST(Claims, AMeanWithinItsToleranceMustAlsoBeResolved) {
  Check check = DriftCheck("square");
  check.statistic = Statistic::kMean;
  check.demand = {
      .measure = "drift", .relation = Relation::kWithin, .number = 2.0, .tolerance = 0.15};
  check.require = {{"growth_resolved", {"true"}}};
  std::vector<Record> records = {RunOf("square", "drift", 1.8), RunOf("square", "drift", 2.1)};
  for (Record& record : records) record.Set("growth_resolved", true);
  CheckResult result = Evaluate(check, records);
  EXPECT_EQ(result.state, CheckState::kHolds);
  EXPECT_EQ(result.measured, "1.95 (1.8 .. 2.1)");
  EXPECT_EQ(result.expected, "mean drift = 2 +- 0.15");
  EXPECT_EQ(result.rows, 2u);
  records[0].Set("growth_resolved", false);
  result = Evaluate(check, records);
  EXPECT_EQ(result.state, CheckState::kFails);
  EXPECT_EQ(result.reason, "1 of 2 rows without growth_resolved=true");
}

TEST(Claims, ARatioComparesTwoSelections) {
  Check check = DriftCheck("chain-1000");
  check.relative_to = {{"mechanism", {"chain-100"}}};
  check.demand.number = 12.0;
  std::vector<Record> records = {RunOf("chain-100", "drift", 3000.0),
                                 RunOf("chain-1000", "drift", 33000.0)};
  CheckResult result = Evaluate(check, records);
  EXPECT_EQ(result.state, CheckState::kHolds);
  EXPECT_EQ(result.measured, "11 (3.3e+04 / 3e+03)");
  EXPECT_EQ(result.rows, 2u);
  records[1] = RunOf("chain-1000", "drift", 3e5);
  EXPECT_EQ(Evaluate(check, records).state, CheckState::kFails);
  records[0] = RunOf("chain-100", "drift", 0.0);
  EXPECT_EQ(Evaluate(check, records).state, CheckState::kFails);
  EXPECT_EQ(Evaluate(check, records).remark, "the ratio 3e+05 / 0 is infinite");
  check.demand.relation = Relation::kAtLeast;
  EXPECT_EQ(Evaluate(check, records).state, CheckState::kHolds);
  records[1] = RunOf("chain-1000", "drift", 0.0);
  result = Evaluate(check, records);
  EXPECT_EQ(result.state, CheckState::kNotMeasured);
  EXPECT_EQ(result.reason, "the ratio 0 / 0 has no value");
  records.erase(records.begin());
  EXPECT_EQ(Evaluate(check, records).state, CheckState::kNotMeasured);
}

TEST(Claims, FlaggedRunsAndUnknownRequiredKeysAreNamed) {
  Check check = DriftCheck("square");
  std::vector<Record> records = {RunOf("square", "drift", 1e-14), RunOf("square", "drift", 1e-13)};
  EXPECT_EQ(Evaluate(check, records).remark, "");
  records[1].Set("warnings", std::string("energy drift"));
  const CheckResult result = Evaluate(check, records);
  EXPECT_EQ(result.state, CheckState::kHolds);
  EXPECT_EQ(result.remark, "1 of 2 runs have warnings: drift, energy");
  check.require = {{"outcom", {"finished"}}};
  EXPECT_EQ(Evaluate(check, records).state, CheckState::kNotMeasured);
  EXPECT_EQ(Evaluate(check, records).reason, "no record of mechanism=square has outcom");
}

TEST(Claims, AMachineOfTwoSpeedsDecidesNoRatioOfTimes) {
  Check check = DriftCheck("ladder-1000");
  check.relative_to = {{"mechanism", {"ladder-100"}}};
  check.demand = {.measure = "rhs_ns_median", .number = 12.0};
  const auto state = [&](double slower, double ratio, double calibration) {
    std::vector<Record> records = {RunOf("ladder-100", "rhs_ns_median", 1e5 * slower),
                                   RunOf("ladder-1000", "rhs_ns_median", 1e5 * ratio)};
    records[0].Set("calibration_ns", 7000.0 * calibration);
    records[1].Set("calibration_ns", 7000.0);
    const CheckResult result = Evaluate(check, records);
    EXPECT_EQ(result.state == CheckState::kNotMeasured,
              result.reason.find("calibration_ns") != std::string::npos);
    return result.state;
  };
  EXPECT_EQ(state(1.0, 11.0, 1.0), CheckState::kHolds);
  EXPECT_EQ(state(1.0, 13.0, 1.02), CheckState::kFails)
      << "equal speeds but for the calibration's own spread";
  EXPECT_EQ(state(1.5, 13.0, 1.5), CheckState::kNotMeasured) << "of one machine it is 13";
  EXPECT_EQ(state(1.5, 11.0, 1.5), CheckState::kHolds) << "at any of the two speeds";
  EXPECT_EQ(state(1.5, 30.0, 1.5), CheckState::kFails);
  EXPECT_EQ(state(1.0, 11.0, std::numeric_limits<double>::quiet_NaN()), CheckState::kHolds);
  check.demand = {
      .measure = "rhs_ns_median", .relation = Relation::kWithin, .number = 10.0, .tolerance = 1.0};
  EXPECT_EQ(state(1.0, 10.0, 1.0), CheckState::kHolds);
  EXPECT_EQ(state(1.2, 12.0, 1.2), CheckState::kNotMeasured) << "what holds between both ends";
}

TEST(ClaimsReport, EveryCheckShowsNumbersThresholdAndRows) {
  const std::vector<ClaimResult> results = {
      Evaluate(TwoProblems(), std::vector<Record>{RunOf("square", "drift", 1e-14)})};
  const std::string markdown = ClaimsMarkdown(results, {"command: loopbench run"});
  ExpectWords(markdown,
              {"| two | section 4.1 | Drift is small. | partially reproduced |",
               "| square problem | holds | 1e-14 (1e-14 .. 1e-14) | max drift <= 1e-12 "
               "| 1 |  |",
               "| general problem | not measured |  | max drift <= 1e-12 | 0 | ",
               "\n\ncommand: loopbench run\n",
               "**Verdict: partially reproduced: square problem. Not measured: general problem"});
}

TEST(ClaimsReader, NoClaimsAreAMistake) {
  EXPECT_THROW(ParseClaims(R"({"claims": []})", "rules.json"), ConfigError);
}

TEST(ClaimsReader, MistakesAreReportedTogetherWithTheirPlaces) {
  const std::string text = R"({"claims": [{"id": "a", "claim": "c", "where": "w", "checks": [
    {"label": "x", "select": {"rtol": [1e-6, {}]}, "measure": "m", "statistic": "maximum",
     "compare": "<=", "threshold": "small", "tolerance": 1},
    {"label": "x", "select": {}, "measure": "m", "statistic": "max", "compare": "is",
     "word": "finished", "treshold": 1}]}]})";
  ExpectWords(MessageOf([&] { ParseClaims(text, "rules.json"); }),
              {"/claims/0/checks/0/select/rtol/1: found", "/checks/0/statistic: found \"maximum\"",
               "/checks/0/threshold: found \"small\", expected a number",
               "/checks/0/tolerance: found 1, expected no \"tolerance\"",
               "/checks/1/treshold: found unknown key",
               "/checks/1/statistic: found \"max\", expected \"all\" or \"any\"",
               "/checks/1/label: found \"x\", expected each name once"});
}

TEST(ClaimsReader, TheSelectionOfARuleJoinsThatOfEveryCheck) {
  const std::vector<ClaimRule> rules = ParseClaims(
      R"({"claims": [{"id": "a", "claim": "c", "where": "w", "select": {"horizon": 10},
          "checks": [{"label": "x", "select": {"rtol": [1e-6, 1e-8]}, "measure": "m",
                      "statistic": "mean", "compare": "within", "threshold": 2, "tolerance": 0.1,
                      "require": {"growth_resolved": true}}]}]})",
      "rules.json");
  ASSERT_EQ(rules.size(), 1u);
  const Check& check = rules[0].checks[0];
  EXPECT_EQ(check.select, (Selection{{"horizon", {"10"}}, {"rtol", {"1e-06", "1e-08"}}}));
  EXPECT_EQ(check.require, (Selection{{"growth_resolved", {"true"}}}));
  EXPECT_EQ(check.demand.relation, Relation::kWithin);
}

// A record that the check selects, with the same value everywhere.
Record Planted(const Selection& selection, const Check& check, double value) {
  Record record = RecordOf("outcome", "finished", "growth_resolved", true);
  for (const auto& [key, values, op] : selection) record.Set(key, values.front());
  if (check.demand.measure != "outcome") record.Set(check.demand.measure, value);
  return record;
}

TEST(PaperClaims, EachTurnsFromReproducedToNotReproducedWithPlantedData) {
  const std::vector<ClaimRule> rules = ReadClaims(kClaimsFile);
  EXPECT_GE(rules.size(), 9u);
  for (const ClaimRule& rule : rules) {
    EXPECT_EQ(Evaluate(rule, {}).verdict, Verdict::kNotMeasured) << rule.id;
    for (const Check& check : rule.checks) {
      const bool word = check.demand.IsText();
      const bool at_most = check.demand.relation == Relation::kAtMost;
      const double good = check.demand.number;
      const double bad = at_most ? good * 2.0 : good * 0.5;
      std::vector<Record> records;
      if (!check.relative_to.empty()) records.push_back(Planted(check.relative_to, check, 1.0));
      records.push_back(Planted(check.select, check, good));
      EXPECT_EQ(Evaluate(check, records).state, CheckState::kHolds) << rule.id << check.label;
      records.back() = Planted(check.select, check, bad);
      if (word) records.back().Set("outcome", std::string("singular"));
      EXPECT_EQ(Evaluate(check, records).state, CheckState::kFails) << rule.id << check.label;
    }
  }
}

}  // namespace claims_test
}  // namespace loopbench::harness
