// Planted records turn each cell of a robustness map into each of its classes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "harness/judge/judge.h"
#include "tests/harness/robustness_map_runs.h"

namespace loopbench::harness {
namespace robustness_map_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

testing::AssertionResult Contains(const std::string& text, const std::string& part) {
  return testing::IsSubstring("part", "text", part, text);
}

/// Branch within 1e-6 rad, energy within 500 rtol.
MapRow Row() {
  MapRow row;
  row.label = "parallelogram";
  row.select = {{"mechanism", {"parallelogram"}}};
  row.decides = {
      {.measure = "branch_error_max", .name = "branch", .unit = "rad", .number = 1e-6, .of = ""},
      {.measure = "energy_error_max",
       .name = "energy",
       .unit = "J",
       .number = 500.0,
       .of = "rtol"}};
  row.must_hold = {false};
  return row;
}

const MapMethod kOdca{"O-DCA", {{"formulation", {"odca"}}}};

MapCell CellOf(const std::vector<Record>& records, const MapRow& row = Row()) {
  return JudgeCell(row, 0, kOdca, records);
}

TEST(MapCell, HoldsWithTheNumberClosestToItsLimit) {
  const MapCell cell = CellOf({RunOf("odca", 1e-8, 2e-7, 5e-7)});
  EXPECT_EQ(cell.state, CellState::kHolds);
  EXPECT_EQ(cell.word, "holds");
  EXPECT_EQ(cell.decided.measure, "branch_error_max");  // a fifth of its limit, energy a tenth
  EXPECT_NEAR(cell.decided.ratio, 0.2, 1e-12);
  EXPECT_EQ(DecidingNumber(cell), "branch 2e-07 rad");
  const MapCell other = CellOf({RunOf("odca", 1e-8, 2e-7, 4e-6)});
  EXPECT_EQ(DecidingNumber(other), "energy 4e-06 J");
  EXPECT_DOUBLE_EQ(other.decided.limit, 500 * 1e-8);
}

TEST(MapCell, IsInaccurateBeyondALimitAndNamesAllThatAre) {
  const MapCell cell = CellOf({RunOf("odca", 1e-8, 0.71, 1e-3)});
  EXPECT_EQ(cell.state, CellState::kInaccurate);
  EXPECT_EQ(cell.word, "inaccurate");
  EXPECT_EQ(DecidingNumber(cell), "branch 0.71 rad");  // 7e5 limits against 200
  EXPECT_TRUE(Contains(cell.reason, "branch_error_max = 0.71 [rad], limit 1e-06"));
  EXPECT_TRUE(Contains(cell.reason, "energy_error_max = 0.001 [J], limit 5e-06"));
  EXPECT_EQ(cell.holding, 0u);
}

TEST(MapCell, TheLimitItselfHolds) {
  EXPECT_EQ(CellOf({RunOf("odca", 1e-8, 1e-6, 0.0)}).state, CellState::kHolds);
  EXPECT_EQ(CellOf({RunOf("odca", 1e-8, std::nextafter(1e-6, 1.0), 0.0)}).state,
            CellState::kInaccurate);
}

TEST(MapCell, WhatIsNotFiniteIsInaccurate) {
  const MapCell cell = CellOf({RunOf("odca", 1e-8, kNan, 1e-7)});
  EXPECT_EQ(cell.state, CellState::kInaccurate);
  EXPECT_EQ(DecidingNumber(cell), "branch not finite");
  Record null = RunOf("odca", 1e-8, 0.0, 1e-7);
  null.Set("branch_error_max", std::monostate());  // as stored
  EXPECT_EQ(CellOf({null}).state, CellState::kInaccurate);
}

TEST(MapCell, NamesEveryOtherEndingOfARun) {
  std::size_t stopped = 0, limits = 0, broken = 0;
  for (const RunEnding& ending : kRunEndings) {
    if (ending.word == "finished") continue;
    const MapCell cell = CellOf({RunOf("odca", 1e-8, 0.0, 0.0, std::string(ending.word))});
    EXPECT_EQ(cell.word, ending.word);
    EXPECT_EQ(cell.state, ending.state);
    EXPECT_EQ(DecidingNumber(cell), "at 0.312 s");
    stopped += ending.state == CellState::kStopped ? 1 : 0;
    limits += ending.state == CellState::kLimit ? 1 : 0;
    broken += ending.state == CellState::kBroken ? 1 : 0;
  }
  EXPECT_EQ(stopped, 8u);
  EXPECT_EQ(limits, 4u);
  EXPECT_EQ(broken, 3u);
  EXPECT_EQ(CellOf({RunOf("odca", 1e-8, 0.0, 0.0, "a new word")}).state, CellState::kBroken);
}

TEST(MapCell, WithoutRecordIsNotMeasuredAndNeverHolds) {
  const MapCell cell = CellOf({RunOf("lagrange", 1e-8, 0.0, 0.0)});
  EXPECT_EQ(cell.state, CellState::kNotMeasured);
  EXPECT_EQ(cell.reason, "no record matches");
  Record timing = RunOf("odca", 1e-8, 0.0, 0.0);
  timing.Set("kind", std::string("timing"));
  EXPECT_EQ(CellOf({timing}).state, CellState::kNotMeasured);
}

TEST(MapCell, WithoutAMeasureThatDecidesIsNotMeasured) {
  MapRow row = Row();
  row.decides[0].measure = "closed_form_error_max";
  const MapCell cell = CellOf({RunOf("odca", 1e-8, 0.0, 0.0)}, row);
  EXPECT_EQ(cell.state, CellState::kNotMeasured);
  EXPECT_EQ(cell.reason, "the record has no closed_form_error_max");
  EXPECT_EQ(cell.holding, 0u);
  // what is wrong all the same is not excused by what is missing
  EXPECT_EQ(CellOf({RunOf("odca", 1e-8, 0.0, 1.0)}, row).state, CellState::kInaccurate);
  row = Row();
  row.decides[1].of = "tolerance";
  EXPECT_EQ(CellOf({RunOf("odca", 1e-8, 0.0, 0.0)}, row).reason,
            "the record has no finite tolerance");
}

TEST(MapCell, FewerRecordsThanCasesAreNotMeasured) {
  MapRow row = Row();
  row.cases = 3;
  std::vector<Record> records = {RunOf("odca", 1e-6, 0.0, 0.0), RunOf("odca", 1e-8, 0.0, 0.0)};
  MapCell cell = CellOf(records, row);
  EXPECT_EQ(cell.state, CellState::kNotMeasured);
  EXPECT_EQ(cell.reason, "2 of 3 cases have a record");
  EXPECT_EQ(HoldingCount(cell), "2/3");
  records[1].Set("outcome", std::string("crashed"));  // bad enough already
  EXPECT_EQ(CellOf(records, row).word, "crashed");
  records[1].Set("outcome", std::string("finished"));
  records.push_back(RunOf("odca", 1e-10, 0.0, 0.0));
  cell = CellOf(records, row);
  EXPECT_EQ(cell.state, CellState::kHolds);
  EXPECT_EQ(HoldingCount(cell), "3/3");
}

TEST(MapCell, TheWorstOfSeveralRecordsDecides) {
  // from good to bad; each, put among all better ones, is what the cell shows
  const std::vector<Record> records = {
      RunOf("odca", 1e-4, 1e-9, 0.0),           RunOf("odca", 1e-5, 1e-7, 0.0),
      RunOf("odca", 1e-6, 0.0, 0.0, "locked"),  RunOf("odca", 1e-7, 0.0, 0.0, "step-limit"),
      RunOf("odca", 1e-8, 1e-5, 0.0),           RunOf("odca", 1e-9, 1e-4, 0.0),
      RunOf("odca", 1e-10, 0.0, 0.0, "crashed")};
  std::vector<Record> some;
  for (const Record& record : records) {
    some.insert(some.begin(), record);
    const MapCell cell = CellOf(some);
    EXPECT_EQ(cell.case_id, record.Text("case_id"));
    EXPECT_EQ(cell.records, some.size());
    EXPECT_EQ(cell.holding, std::min<std::size_t>(some.size(), 2));
  }
}

TEST(MapCell, AnotherEndingMayBeRight) {
  MapRow row = Row();
  row.right = {"locked", "step-too-small"};
  row.decides = {{.measure = "t_reached",
                  .name = "",
                  .unit = "s",
                  .relation = Relation::kAtMost,
                  .number = 0.32,
                  .of = "",
                  .when = {"locked"}}};
  Record record = RunOf("odca", 1e-8, 0.0, 0.0, "locked");
  MapCell cell = CellOf({record}, row);
  EXPECT_EQ(cell.state, CellState::kHolds);
  EXPECT_EQ(ClassText(cell), "holds: locked");
  EXPECT_EQ(DecidingNumber(cell), "0.31 s");
  record.Set("t_reached", 5.0);
  EXPECT_EQ(CellOf({record}, row).state, CellState::kInaccurate);
  record.Set("outcome", std::string("step-too-small"));  // right at any time
  cell = CellOf({record}, row);
  EXPECT_EQ(ClassText(cell) + " " + DecidingNumber(cell), "holds: step-too-small at 5 s");
  record.Set("outcome", std::string("singular"));
  cell = CellOf({record}, row);
  EXPECT_EQ(cell.word, "singular");
  EXPECT_EQ(cell.reason, "ended as singular, right is locked or step-too-small");
  // to go on as if all were well is wrong then, however small the errors
  cell = CellOf({RunOf("odca", 1e-8, 0.0, 0.0)}, row);
  EXPECT_EQ(cell.word, "inaccurate");
  EXPECT_EQ(DecidingNumber(cell), "finished");
}

const Demand kAllKept{.measure = "kept",
                      .name = "kept",
                      .unit = "",
                      .relation = Relation::kAtLeast,
                      .number = 1.0,
                      .of = "size"};

TEST(MapCell, ANumberIsShownOutOfItsOwnTotalOnly) {
  MapRow row = Row();
  row.decides = {kAllKept,
                 {.measure = "slip", .name = "slip", .unit = "m", .number = 1e-6, .of = ""}};
  Record record = RunOf("odca", 1e-8, 0.0, 0.0);
  record.Set("size", std::int64_t{400});
  record.Set("kept", std::int64_t{400});
  record.Set("slip", 0.016);
  EXPECT_EQ(DecidingNumber(CellOf({record}, row)), "slip 0.016 m");
}

TEST(MapCell, CountsAreDemandedAtLeastAndEqual) {
  MapRow row = Row();
  row.decides = {kAllKept};
  Record record = RunOf("odca", 1e-8, 0.0, 0.0);
  record.Set("size", std::int64_t{400});
  record.Set("kept", std::int64_t{400});
  EXPECT_EQ(CellOf({record}, row).state, CellState::kHolds);
  record.Set("kept", std::int64_t{397});
  EXPECT_EQ(CellOf({record}, row).state, CellState::kInaccurate);
  EXPECT_EQ(DecidingNumber(CellOf({record}, row)), "kept 397 of 400");
  record.Set("kept", std::int64_t{0});
  EXPECT_TRUE(std::isinf(CellOf({record}, row).decided.ratio));
  row.decides[0] = {.measure = "rank",
                    .name = "",
                    .unit = "",
                    .relation = Relation::kEqual,
                    .number = 3.0,
                    .of = ""};
  record.Set("rank", std::int64_t{3});
  EXPECT_EQ(CellOf({record}, row).state, CellState::kHolds);
  record.Set("rank", std::int64_t{2});
  EXPECT_EQ(CellOf({record}, row).state, CellState::kInaccurate);
}

TEST(MapCell, NotApplicableExcusesAMissingRecordOnly) {
  MapRow row = Row();
  row.not_applicable = {{"O-DCA", "there is nothing to feed back"}};
  MapCell cell = CellOf({}, row);
  EXPECT_EQ(cell.state, CellState::kNotApplicable);
  EXPECT_EQ(cell.reason, "there is nothing to feed back");
  cell = CellOf({RunOf("odca", 1e-8, 1.0, 0.0)}, row);
  EXPECT_EQ(cell.state, CellState::kInaccurate);
}

TEST(MapCell, OneReasonExcusesAllColumnsThatNeedNotHold) {
  MapRow row = Row();
  row.others_not_applicable = "not run";
  row.must_hold = {false};
  MapCell cell = CellOf({}, row);
  EXPECT_EQ(cell.state, CellState::kNotApplicable);
  EXPECT_EQ(cell.reason, "not run");
  row.must_hold = {true};
  EXPECT_EQ(CellOf({}, row).state, CellState::kNotMeasured);
}

}  // namespace robustness_map_test
}  // namespace loopbench::harness
