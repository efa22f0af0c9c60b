// Error against cost: joins of runs and timings, fronts against domination by definition, the
// cheapest methods, what is left out and why.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "harness/base/text.h"
#include "harness/judge/judge.h"
#include "tests/harness/cli_fixture.h"
#include "tests/harness/work_precision_records.h"

namespace loopbench::harness {
namespace work_precision_test {

using namespace work_precision_records;

std::vector<WorkPrecisionRow> OnlyRows(const WorkPrecision& work_precision) {
  EXPECT_EQ(work_precision.problems.size(), 1u);
  return work_precision.problems.front().rows;
}

/// By definition: nobody is as good in both and better in one.
bool IsBeaten(const WorkPrecisionRow& row, const std::vector<WorkPrecisionRow>& rows) {
  return std::ranges::any_of(rows, [&](const WorkPrecisionRow& other) {
    return other.reason.empty() && other.error <= row.error && other.cost <= row.cost &&
           (other.error < row.error || other.cost < row.cost);
  });
}

TEST(WorkPrecision, TheFrontIsWhatNobodyBeats) {
  std::mt19937 generator(7);
  std::uniform_int_distribution<int> any(1, 12);  // few values: many ties
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<double> errors, walls;
    for (int i = 0; i < 20; ++i) {
      errors.push_back(std::pow(10.0, -any(generator)));
      walls.push_back(0.001 * any(generator));
    }
    std::vector<Record> records = Store(errors, walls);
    records[2].Set("warnings", std::string("energy"));
    records[4].Set("outcome", std::string("singular"));
    int front = 0;
    for (const WorkPrecisionRow& row : OnlyRows(MakeWorkPrecision(records, {}))) {
      if (!row.reason.empty()) {
        EXPECT_FALSE(row.on_front) << row.reason;
        continue;
      }
      EXPECT_EQ(row.on_front, !IsBeaten(row, OnlyRows(MakeWorkPrecision(records, {}))));
      front += row.on_front ? 1 : 0;
    }
    EXPECT_GE(front, 1);
  }
}

TEST(WorkPrecision, TheCostIsThatOfTheSameCase) {
  std::vector<Record> records = Store({1e-3, 1e-6, 1e-9}, {0.1, 0.2, 0.4});
  records.push_back(TimingOf("odca", 0.5, 1e-7));  // of a case that was not run
  records.push_back(TimingOf("odca", 1e-3, 7.0));
  records.back().Set("horizon", 20.0);
  for (const WorkPrecisionRow& row : OnlyRows(MakeWorkPrecision(records, {}))) {
    EXPECT_EQ(row.reason, "");
    const double expected = row.error == 1e-3 ? 0.1 : row.error == 1e-6 ? 0.2 : 0.4;
    EXPECT_EQ(row.cost, expected);
    EXPECT_EQ(row.timing.Number("rtol"), row.record.Number("rtol"));
  }
}

TEST(WorkPrecision, FixedStepsAreCasesOfTheirOwn) {
  std::vector<Record> records;
  for (const double step : {0.1, 0.01}) {
    for (Record record : {RunOf("odca", 1e-3, step), TimingOf("odca", 1e-3, 1.0 / step)}) {
      record.Set("rtol", Value());
      Record keyed;  // the step stands among the keys
      for (const auto& [key, value] : record.items()) {
        if (key == "case_id") keyed.Set("step", step);
        keyed.Set(key, value);
      }
      records.push_back(keyed);
    }
  }
  const auto rows = OnlyRows(MakeWorkPrecision(records, {}));
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].cost, 10.0);
  EXPECT_EQ(rows[0].error, 0.1);
  EXPECT_EQ(rows[1].cost, 100.0);
}

TEST(WorkPrecision, RowsThatAreNotComparedSayWhy) {
  std::vector<Record> records = Store({1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8}, {1, 1, 1, 1, 1, 1});
  records[0].Set("outcome", std::string("singular"));
  records[0].Set("t_reached", 0.312);
  records[2].Set("warnings", std::string("energy drift"));
  records[4].Set("error_position_max", Value());
  records[7].Set("outcome", std::string("time-limit"));
  records[7].Set("wall_s_median", Value());
  records.erase(records.begin() + 9);  // the timing of the fifth
  std::vector<std::string> reasons;
  for (const WorkPrecisionRow& row : OnlyRows(MakeWorkPrecision(records, {})))
    reasons.push_back(row.reason);
  std::ranges::sort(reasons);
  EXPECT_EQ(reasons, (std::vector<std::string>{"", "no error_position_max", "not timed",
                                               "singular at 0.312 s", "timing: time-limit",
                                               "warnings: energy drift"}));
}

/// What the reference cannot tell apart is not what a row may win by.
TEST(WorkPrecision, NoErrorIsBelievedBelowWhatTheReferenceIsCertifiedTo) {
  std::vector<Record> records = Store({1e-12, 3e-12}, {2.0, 1.0});
  for (Record& record : records) record.Set("reference_error", 2e-12);
  const auto rows = OnlyRows(MakeWorkPrecision(records, {}));
  EXPECT_EQ(rows[0].error, 3e-12);
  EXPECT_FALSE(rows[0].is_bound);
  EXPECT_TRUE(rows[0].on_front);
  EXPECT_EQ(rows[1].error, 1e-12 + 2e-12);
  EXPECT_TRUE(rows[1].is_bound);
  EXPECT_FALSE(rows[1].on_front) << "as good as the other as far as anybody knows, and dearer";
}

TEST(WorkPrecision, FallsBackAndSaysSo) {
  std::vector<Record> records = Store({1e-3, 1e-6}, {1.0, 2.0});
  EXPECT_TRUE(MakeWorkPrecision(records, {}).remarks.empty());
  for (Record& record : records) {
    record.Set("error_position_max", Value());
    record.Set("closed_form_error_max", 0.5);
    record.Set("drift_position_max", 0.25);
  }
  WorkPrecision work_precision = MakeWorkPrecision(records, {});
  EXPECT_EQ(work_precision.error, "closed_form_error_max");
  ASSERT_EQ(work_precision.remarks.size(), 1u);
  EXPECT_NE(work_precision.remarks[0].find("no record has error_position_max"), std::string::npos);
  for (Record& record : records) record.Set("closed_form_error_max", Value());
  std::erase_if(records, [](const Record& record) { return record.Text("kind") == "timing"; });
  work_precision = MakeWorkPrecision(records, {});
  EXPECT_EQ(work_precision.error, "drift_position_max");
  EXPECT_EQ(work_precision.cost, "rhs_equivalents");
  ASSERT_EQ(work_precision.remarks.size(), 2u);
  EXPECT_NE(work_precision.remarks[0].find("no distance from the right motion"), std::string::npos);
  EXPECT_NE(work_precision.remarks[1].find("no accuracy case was timed"), std::string::npos);
}

/// The usual timings of an experiment are at one tolerance for all: of no accuracy case.
TEST(WorkPrecision, TimingsOfOtherCasesAreNoCost) {
  std::vector<Record> records = Store({1e-3, 1e-6}, {1.0, 2.0});
  for (Record& record : records) {
    if (record.Text("kind") == "timing") record.Set("horizon", 1.0);
  }
  EXPECT_EQ(MakeWorkPrecision(records, {}).cost, "rhs_equivalents");
  for (const WorkPrecisionRow& row : OnlyRows(MakeWorkPrecision(records, {.cost = "wall_s"}))) {
    EXPECT_EQ(row.reason, "not timed");
  }
}

TEST(WorkPrecision, RefusesWhatNoRecordHas) {
  const std::vector<Record> records = Store({1e-3}, {1.0});
  EXPECT_THROW(MakeWorkPrecision(records, {.error = "error_positoin_max"}), ConfigError);
  EXPECT_THROW(MakeWorkPrecision(records, {.error = "closed_form_error_max"}), ConfigError);
  EXPECT_THROW(MakeWorkPrecision(records, {.error = "mechanism"}), ConfigError);
  EXPECT_THROW(MakeWorkPrecision(records, {.cost = "walls"}), ConfigError);
  EXPECT_THROW(MakeWorkPrecision(records, {.per = {"mechanisms"}}), ConfigError);
  EXPECT_THROW(MakeWorkPrecision(records, {.where = {ParseCondition("rtol<1e-9")}}), ConfigError);
  std::vector<Record> empty = records;
  empty[0].Set("error_position_max", Value());
  EXPECT_THROW(MakeWorkPrecision(empty, {}), ConfigError);
}

TEST(WorkPrecision, ConditionsSeeTheTimingToo) {
  const std::vector<Record> records = Store({1e-3, 1e-6, 1e-9}, {0.1, 0.2, 0.4});
  const WorkPrecision fast =
      MakeWorkPrecision(records, {.where = {ParseCondition("wall_s_median<0.3")}});
  EXPECT_EQ(OnlyRows(fast).size(), 2u);
}

TEST(WorkPrecision, ProblemsAreComparedEachByItself) {
  std::vector<Record> records = Store({1e-3, 1e-6}, {0.1, 0.2});
  for (Record record : Store({1e-2, 1e-5}, {10.0, 20.0})) {
    record.Set("mechanism", std::string("slow"));
    record.Set("case_id", "slow" + record.Text("case_id"));
    records.push_back(record);
  }
  const WorkPrecision work_precision = MakeWorkPrecision(records, {});
  ASSERT_EQ(work_precision.problems.size(), 2u);
  EXPECT_EQ(work_precision.problems[0].name, "four-bar, horizon 10");
  for (const WorkPrecisionProblem& problem : work_precision.problems) {
    for (const WorkPrecisionRow& row : problem.rows) EXPECT_TRUE(row.on_front);
  }
  const WorkPrecision one = MakeWorkPrecision(records, {.per = {"horizon"}});
  EXPECT_EQ(one.problems.size(), 1u);
}

TEST(WorkPrecision, TheCheapestOfEachFormulationReachesTheError) {
  // odca 1e-4 at 0.1 and 1e-10 at 0.9, lagrange 1e-7 at 0.3
  const std::vector<Record> records = Store({1e-4, 1e-7, 1e-10}, {0.1, 0.3, 0.9});
  const WorkPrecisionProblem problem = MakeWorkPrecision(records, {}).problems.front();
  std::vector<std::string> found;
  for (const Cheapest& one : problem.cheapest) {
    const std::string cost =
        one.row < 0 ? "none"
                    : fmt::format("{} x{:.3g}",
                                  problem.rows[static_cast<std::size_t>(one.row)].cost, one.ratio);
    found.push_back(fmt::format("{} {} {}", one.error_class, one.formulation, cost));
  }
  EXPECT_EQ(found, (std::vector<std::string>{"0.001 lagrange 0.3 x3", "0.001 odca 0.1 x1",
                                             "1e-06 lagrange 0.3 x1", "1e-06 odca 0.9 x3",
                                             "1e-09 lagrange none", "1e-09 odca 0.9 x1"}));
}

class WorkPrecisionProgram : public CommandLineTest {};

TEST_F(WorkPrecisionProgram, PrintsAndWritesWhatAccuracyCosts) {
  Write("pendulum.json", ReadFile(kConfigs / "mechanisms/pendulum.json"));
  Write("e.json", R"({"name": "e", "tolerances": [1e-4, 1e-6, 1e-8], "fixed_steps": [0.02],
    "integrator": ["ode45", "verner"], "problems": [{"mechanism": "pendulum.json", "horizon": 0.5}],
    "methods": [{"formulation": ["odca", "lagrange"], "enforcement": "projection"}],
    "timing": {"repeats": 2, "cases": true}})");
  ExpectEnding(Call("run e.json --out out"), 0, {"ran 32 cases"});
  ExpectEnding(Call("work-precision out --figures"), 0,
               {"closed_form_error_max against wall_s_median", "problem = pendulum, horizon 0.5",
                "no record has error_position_max", "equal in all compared rows",
                "work-precision-overview.csv", "wrote 5 figures to out/figures"});
  for (const char* file : {"work-precision.csv", "work-precision.md", "work-precision-overview.csv",
                           "figures/work-precision-pendulum-horizon-0.5.svg",
                           "figures/integrators-pendulum-horizon-0.5-lagrange.svg",
                           "figures/tolerance-pendulum-horizon-0.5-verner.svg"}) {
    EXPECT_TRUE(fs::exists(folder_ / "out" / file)) << file;
  }
  const std::string csv = ReadFile(folder_ / "out/work-precision.csv");
  EXPECT_EQ(std::ranges::count(csv.substr(0, csv.find("\n#")), '\n'), 16) << csv;
  ExpectEnding(Call("work-precision out --cost-key steps --error-levels 1e-2 --where "
                    "integrator=verner --out t"),
               0, {"against steps", "wrote t/work-precision.csv"});
  ExpectEnding(Call("work-precision out --error-key nothing"), 2,
               {"--error-key: found \"nothing\""});
  ExpectEnding(Call("work-precision out --error-levels nan"), 2, {"expected a number from 0"});
  ExpectEnding(Call("work-precision out --format csv --where 'rtol<1e-7'"), 0,
               {"problem,formulation"});
}

}  // namespace work_precision_test
}  // namespace loopbench::harness
