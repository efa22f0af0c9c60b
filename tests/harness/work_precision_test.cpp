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
#include "harness/figures/figures.h"
#include "harness/judge/judge.h"
#include "tests/harness/cli_fixture.h"
#include "tests/harness/records.h"
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

/// Differences below the accuracy of the reference decide nothing.
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
    record = Changed(record, "error_position_max", Value(), "closed_form_error_max", 0.5,
                     "drift_position_max", 0.25);
  }
  WorkPrecision work_precision = MakeWorkPrecision(records, {});
  EXPECT_EQ(work_precision.error, "closed_form_error_max");
  ASSERT_EQ(work_precision.remarks.size(), 1u);
  ExpectWords(work_precision.remarks[0], {"no record has error_position_max"});
  for (Record& record : records) record.Set("closed_form_error_max", Value());
  std::erase_if(records, [](const Record& record) { return record.Text("kind") == "timing"; });
  work_precision = MakeWorkPrecision(records, {});
  EXPECT_EQ(work_precision.error, "drift_position_max");
  EXPECT_EQ(work_precision.cost, "rhs_equivalents");
  ASSERT_EQ(work_precision.remarks.size(), 2u);
  ExpectWords(work_precision.remarks[0], {"no distance from the right motion"});
  ExpectWords(work_precision.remarks[1], {"no accuracy case was timed"});
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

TEST(WorkPrecisionReport, SaysNoneReachedIt) {
  const std::vector<Record> records = Store({1e-4, 1e-7}, {0.1, 0.3});
  const WorkPrecision work_precision = MakeWorkPrecision(records, {});
  const std::string overview = ToText(OverviewTable(work_precision));
  ExpectWords(overview, {"none", "0.3 (3.00)"});
  ExpectWords(ToCsv(CheapestTable(work_precision)), {"none"});
}

TEST(WorkPrecisionReport, ListsFrontAndReasonsAndHidesOnlyTheBeaten) {
  std::vector<Record> records = Store({1e-3, 1e-2, 1e-6}, {0.1, 0.2, 0.3});
  records[4].Set("warnings", std::string("energy"));
  const WorkPrecision work_precision = MakeWorkPrecision(records, {});
  const Table brief = WorkPrecisionTable(work_precision, {});
  ASSERT_EQ(brief.rows.size(), 2u);
  EXPECT_EQ(brief.rows[0].Text("front"), "*");
  EXPECT_EQ(brief.rows[1].Text("reason"), "warnings: energy");
  ExpectWords(ToText(brief), {"not shown: 1 dominated rows"});
  EXPECT_EQ(WorkPrecisionTable(work_precision, {.compact = true, .all = true}).rows.size(), 3u);
  const std::string csv =
      ToCsv(WorkPrecisionTable(work_precision, {.compact = false, .all = true}));
  ExpectWords(csv, {"problem,formulation,enforcement,coordinates,solver,integrator,rtol,error,"});
  const std::string page = WorkPrecisionMarkdown(work_precision, {"command: x"});
  ExpectWords(
      page, {"cheapest method for an error", "equal in all compared rows", "energy", "command: x"});
}

std::string Statement(const std::vector<Record>& records) {
  return Joined(FairnessStatement(MakeWorkPrecision(records, {})), "\n");
}

TEST(Fairness, SaysWhatWasEqualAndWhatWasNot) {
  std::vector<Record> records = Store({1e-3, 1e-6, 1e-9}, {0.1, 0.2, 0.4});
  const std::string alike = Statement(records);
  ExpectWords(
      alike,
      {"error: error_position_max", "cost: wall_s_median [s]", "integrator ode45", "machine m",
       "threads 1", "simplifications none", "mechanism and start problem", "not recorded: compiler",
       "formulation (odca 2, lagrange 1)", "tolerance (0.001 1, 0.0001 1, 1e-05 1)"});
  ExpectNone(alike, {"warning", "not compared"});
  for (const int i : {2, 3})
    records[static_cast<std::size_t>(i)].Set("integrator", std::string("verner"));
  records[4].Set("warnings", std::string("energy"));
  const std::string mixed = Statement(records);
  ExpectWords(mixed, {"integrator (ode45 1, verner 1)",
                      "1 of 3 rows are not compared: warnings: energy 1"});
}

TEST(Fairness, TheLibrarysCodeIsNotEqualForAllFormulations) {
  std::vector<Record> records = Store({1e-3, 1e-6, 1e-9}, {0.1, 0.2, 0.4});
  ExpectWords(Statement(records), {"not equal: the library's code", "execution generated"});
  for (Record& record : records) record.Set("execution", std::string("generated"));
  ExpectNone(Statement(records), {"library's code"});
}

TEST(Fairness, WarnsOfTimesOfTwoMachinesAndOfANoisyOne) {
  std::vector<Record> records = Store({1e-3, 1e-6}, {0.1, 0.2});
  records[1].Set("machine", std::string("another"));
  records[3].Set("noise", std::string("A/A spread 9 %"));
  ExpectWords(Statement(records),
              {"machine (another 1, m 1)", "warning: the costs are times of more",
               "warning: noisy machine in 1 of 2 timings"});
  for (Record& record : records) record.Set("wall_s_median", Value());
  ExpectNone(Statement(records), {"warning"});  // rhs_equivalents are no times
}

TEST(Fairness, SaysWhatReferencesAreCertifiedTo) {
  std::vector<Record> records = Store({1e-3, 1e-13}, {0.1, 0.2});
  records[0].Set("reference_error", 1e-11);
  records[0].Set("reference_valid_until", 8.0);
  records[2].Set("reference_error", 3e-12);
  ExpectWords(Statement(records),
              {"certified to 3.0e-12 to 1.0e-11 m", "1 row has no larger error than that",
               "1 row goes beyond the validity limit of the reference"});
}

TEST(Fairness, CountsOfImplicitIntegratorsAreNotAllTheyDo) {
  std::vector<Record> records = Store({1e-3, 1e-6}, {0.1, 0.2});
  for (Record& record : records) record.Set("wall_s_median", Value());
  ExpectWords(Statement(records), {"cost: rhs_equivalents"});
  ExpectNone(Statement(records), {"leaves out Jacobians"});
  records[2].Set("newton_iterations", std::int64_t{40});
  ExpectWords(Statement(records), {"leaves out Jacobians"});
}

/// Two problems differ in what each has alone in common.
TEST(Fairness, WhatIsEqualInEachProblemIsEqual) {
  std::vector<Record> records = Store({1e-3, 1e-6}, {0.1, 0.2});
  for (Record record : Store({1e-2, 1e-5}, {10.0, 20.0})) {
    record.Set("mechanism", std::string("other"));
    if (record.Find("problem_id") != nullptr) record.Set("problem_id", std::string("problem-2"));
    records.push_back(record);
  }
  ExpectWords(Statement(records), {"mechanism and start (in each problem)"});
}

TEST(WorkPrecisionFigures, DrawTheFrontWarningsAndFailures) {
  std::vector<Record> records = Store({1e-3, 1e-2, 1e-6, 1e-7}, {0.1, 0.2, 0.3, 0.4});
  records[2].Set("warnings", std::string("energy"));
  records[4].Set("outcome", std::string("singular"));
  records[5].Set("wall_s_median", Value());
  records[4].Set("cpu_s", 0.05);
  const WorkPrecision work_precision = MakeWorkPrecision(records, {});
  const Figure figure = WorkPrecisionFigure(work_precision, work_precision.problems.front());
  std::size_t flagged = 0, crosses = 0;
  for (const Curve& curve : figure.curves) {
    flagged += curve.style.flagged ? curve.x.size() : 0;
    crosses += curve.crosses.size();
    for (const auto& cross : curve.crosses) EXPECT_EQ(cross.first, 0.05);
  }
  EXPECT_EQ(flagged, 1u);
  EXPECT_EQ(crosses, 1u);
  const Curve& stairs = figure.curves.back();
  EXPECT_EQ(stairs.label, "Pareto front");
  EXPECT_EQ(stairs.x, (std::vector<double>{0.1, 0.4, 0.4}));
  EXPECT_EQ(stairs.y, (std::vector<double>{1e-3, 1e-3, 1e-7}));
}

TEST(WorkPrecisionFigures, TheLineOfTolerancesIsTheirMultipleByTheLink) {
  const WorkPrecision work_precision =
      MakeWorkPrecision(Store({1e-3, 1e-2, 1e-6}, {0.1, 0.2, 0.3}), {});
  const Figure figure = ToleranceFigure(work_precision, work_precision.problems.front(), "ode45");
  const Curve& line = figure.curves.back();
  EXPECT_EQ(line.label, "error = tolerance x link");
  ASSERT_EQ(line.x.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_DOUBLE_EQ(line.x[i], i == 0 ? 1e-5 : 1e-3);
    EXPECT_DOUBLE_EQ(line.y[i], 2.0 * line.x[i]);  // links are 2 m long
  }
}

TEST(WorkPrecisionFigures, MarksAreRunsAndDashesJoinWhatIsBestAtALevel) {
  const WorkPrecision work_precision =
      MakeWorkPrecision(Store({1e-3, 1e-2, 1e-6, 1e-7}, {0.1, 0.2, 0.3, 0.4}), {});
  const Figure figure = WorkPrecisionFigure(work_precision, work_precision.problems.front());
  std::size_t marks = 0;
  for (const Curve& curve : figure.curves) {
    EXPECT_NE(curve.points, curve.line) << "marks, or a line";
    marks += curve.points ? curve.x.size() : 0;
  }
  EXPECT_EQ(marks, 4u);
  EXPECT_LE(GnuplotScript(figure, FigureSize::kOneColumn).legend_rows, kLegendRows);
}

TEST(WorkPrecisionFigures, ErrorsOverTimeHaveTheTrustHorizon) {
  std::vector<Record> records = Store({1e-3, 1e-6}, {0.1, 0.2});
  EXPECT_EQ(WorkPrecisionFigures(MakeWorkPrecision(records, {})).size(), 2u)
      << "no series, no third";
  for (Record& record : records) {
    if (record.Text("kind") != "accuracy") continue;
    record = Changed(record, "series.error_t", std::vector<double>{0, 5, 10}, "series.error",
                     std::vector<double>{0, 1e-9, 1e-6}, "reference_valid_until", 7.5);
  }
  const WorkPrecision work_precision = MakeWorkPrecision(records, {});
  const Figure figure = ErrorOverTimeFigure(work_precision.problems.front(), "ode45");
  ASSERT_EQ(figure.curves.size(), 2u) << "the finest tolerance, and the horizon";
  EXPECT_EQ(figure.curves[1].label, "validity limit of the reference");
  EXPECT_EQ(figure.curves[1].x, (std::vector<double>{7.5, 7.5}));
  EXPECT_EQ(WorkPrecisionFigures(work_precision).size(), 3u);
}

}  // namespace work_precision_test
}  // namespace loopbench::harness
