// What accuracy costs: joins of runs and timings, fronts against domination by definition, the
// cheapest methods, what is left out and why, and the statement of what was equal.
#include "harness/judge/tradeoff.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "harness/figures/tradeoff_figures.h"
#include "harness/judge/fairness.h"
#include "harness/judge/tradeoff_report.h"
#include "harness/text/config_error.h"
#include "tests/harness/cli_fixture.h"

namespace loopbench::harness {
namespace tradeoff_test {

Record Keys(const std::string& kind, const std::string& formulation, double rtol) {
  Record record;
  record.Set("kind", kind);
  record.Set("experiment", std::string("e"));
  record.Set("mechanism", std::string("four-bar"));
  record.Set("formulation", formulation);
  record.Set("enforcement", std::string("position"));
  record.Set("coordinates", std::string("joint"));
  record.Set("solver", std::string("rank-revealing"));
  record.Set("integrator", std::string("ode45"));
  record.Set("rtol", rtol);
  record.Set("atol", rtol);
  record.Set("horizon", 10.0);
  record.Set("case_id", kind + formulation + std::to_string(rtol));
  record.Set("outcome", std::string("finished"));
  return record;
}

Record RunOf(const std::string& formulation, double rtol, double error) {
  Record record = Keys("accuracy", formulation, rtol);
  record.Set("t_reached", 10.0);
  record.Set("doubts", std::string());
  record.Set("scene_id", std::string("scene"));
  record.Set("link_length", 2.0);
  record.Set("rhs_equivalents", 1.0 / error);
  record.Set("error_position_max", error);
  record.Set("machine", std::string("m"));
  record.Set("wall_s", 1e-9);  // beside other runs, observed: nobody's cost
  return record;
}

Record TimingOf(const std::string& formulation, double rtol, double wall) {
  Record record = Keys("timing", formulation, rtol);
  record.Set("wall_s_median", wall);
  record.Set("series.wall_s", std::vector<double>{wall});
  record.Set("machine", std::string("m"));
  record.Set("noise", std::string());
  return record;
}

/// Runs of error `errors[i]` with timings of `walls[i]`, all of them different cases.
std::vector<Record> Store(const std::vector<double>& errors, const std::vector<double>& walls) {
  std::vector<Record> records;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const std::string formulation = i % 2 == 0 ? "odca" : "lagrange";
    const double rtol = std::pow(10.0, -3.0 - static_cast<double>(i));
    records.push_back(RunOf(formulation, rtol, errors[i]));
    records.push_back(TimingOf(formulation, rtol, walls[i]));
  }
  return records;
}

std::vector<TradeoffRow> OnlyRows(const Tradeoff& tradeoff) {
  EXPECT_EQ(tradeoff.problems.size(), 1u);
  return tradeoff.problems.front().rows;
}

/// By definition: nobody is as good in both and better in one.
bool IsBeaten(const TradeoffRow& row, const std::vector<TradeoffRow>& rows) {
  return std::ranges::any_of(rows, [&](const TradeoffRow& other) {
    return other.reason.empty() && other.error <= row.error && other.cost <= row.cost &&
           (other.error < row.error || other.cost < row.cost);
  });
}

TEST(Tradeoff, TheFrontIsWhatNobodyBeats) {
  std::mt19937 generator(7);
  std::uniform_int_distribution<int> any(1, 12);  // few values: many ties
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<double> errors, walls;
    for (int i = 0; i < 20; ++i) {
      errors.push_back(std::pow(10.0, -any(generator)));
      walls.push_back(0.001 * any(generator));
    }
    std::vector<Record> records = Store(errors, walls);
    records[2].Set("doubts", std::string("energy"));
    records[4].Set("outcome", std::string("singular"));
    int front = 0;
    for (const TradeoffRow& row : OnlyRows(MakeTradeoff(records, {}))) {
      if (!row.reason.empty()) {
        EXPECT_FALSE(row.on_front) << row.reason;
        continue;
      }
      EXPECT_EQ(row.on_front, !IsBeaten(row, OnlyRows(MakeTradeoff(records, {}))));
      front += row.on_front ? 1 : 0;
    }
    EXPECT_GE(front, 1);
  }
}

TEST(Tradeoff, TheCostIsThatOfTheSameCase) {
  std::vector<Record> records = Store({1e-3, 1e-6, 1e-9}, {0.1, 0.2, 0.4});
  records.push_back(TimingOf("odca", 0.5, 1e-7));  // of a case that was not run
  records.push_back(TimingOf("odca", 1e-3, 7.0));
  records.back().Set("horizon", 20.0);
  for (const TradeoffRow& row : OnlyRows(MakeTradeoff(records, {}))) {
    EXPECT_EQ(row.reason, "");
    const double expected = row.error == 1e-3 ? 0.1 : row.error == 1e-6 ? 0.2 : 0.4;
    EXPECT_EQ(row.cost, expected);
    EXPECT_EQ(row.timing.Number("rtol"), row.record.Number("rtol"));
  }
}

TEST(Tradeoff, FixedStepsAreCasesOfTheirOwn) {
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
  const auto rows = OnlyRows(MakeTradeoff(records, {}));
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].cost, 10.0);
  EXPECT_EQ(rows[0].error, 0.1);
  EXPECT_EQ(rows[1].cost, 100.0);
}

TEST(Tradeoff, RowsThatAreNotComparedSayWhy) {
  std::vector<Record> records = Store({1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8}, {1, 1, 1, 1, 1, 1});
  records[0].Set("outcome", std::string("singular"));
  records[0].Set("t_reached", 0.312);
  records[2].Set("doubts", std::string("energy drift"));
  records[4].Set("error_position_max", Value());
  records[7].Set("outcome", std::string("time-limit"));
  records[7].Set("wall_s_median", Value());
  records.erase(records.begin() + 9);  // the timing of the fifth
  std::vector<std::string> reasons;
  for (const TradeoffRow& row : OnlyRows(MakeTradeoff(records, {}))) reasons.push_back(row.reason);
  std::ranges::sort(reasons);
  EXPECT_EQ(reasons,
            (std::vector<std::string>{"", "doubts: energy drift", "no error_position_max",
                                      "not timed", "singular at 0.312 s", "timing: time-limit"}));
}

/// What the reference cannot tell apart is not what a row may win by.
TEST(Tradeoff, NoErrorIsBelievedBelowWhatTheReferenceIsCertifiedTo) {
  std::vector<Record> records = Store({1e-12, 3e-12}, {2.0, 1.0});
  for (Record& record : records) record.Set("reference_error", 2e-12);
  const auto rows = OnlyRows(MakeTradeoff(records, {}));
  EXPECT_EQ(rows[0].error, 3e-12);
  EXPECT_FALSE(rows[0].is_bound);
  EXPECT_TRUE(rows[0].on_front);
  EXPECT_EQ(rows[1].error, 1e-12 + 2e-12);
  EXPECT_TRUE(rows[1].is_bound);
  EXPECT_FALSE(rows[1].on_front) << "as good as the other as far as anybody knows, and dearer";
}

TEST(Tradeoff, FallsBackAndSaysSo) {
  std::vector<Record> records = Store({1e-3, 1e-6}, {1.0, 2.0});
  EXPECT_TRUE(MakeTradeoff(records, {}).remarks.empty());
  for (Record& record : records) {
    record.Set("error_position_max", Value());
    record.Set("closed_form_error_max", 0.5);
    record.Set("drift_position_max", 0.25);
  }
  Tradeoff tradeoff = MakeTradeoff(records, {});
  EXPECT_EQ(tradeoff.error, "closed_form_error_max");
  ASSERT_EQ(tradeoff.remarks.size(), 1u);
  EXPECT_NE(tradeoff.remarks[0].find("no record has error_position_max"), std::string::npos);
  for (Record& record : records) record.Set("closed_form_error_max", Value());
  std::erase_if(records, [](const Record& record) { return record.Text("kind") == "timing"; });
  tradeoff = MakeTradeoff(records, {});
  EXPECT_EQ(tradeoff.error, "drift_position_max");
  EXPECT_EQ(tradeoff.cost, "rhs_equivalents");
  ASSERT_EQ(tradeoff.remarks.size(), 2u);
  EXPECT_NE(tradeoff.remarks[0].find("no distance from the right motion"), std::string::npos);
  EXPECT_NE(tradeoff.remarks[1].find("no accuracy case was timed"), std::string::npos);
}

/// The usual timings of an experiment are at one tolerance for all: of no accuracy case.
TEST(Tradeoff, TimingsOfOtherCasesAreNoCost) {
  std::vector<Record> records = Store({1e-3, 1e-6}, {1.0, 2.0});
  for (Record& record : records) {
    if (record.Text("kind") == "timing") record.Set("horizon", 1.0);
  }
  EXPECT_EQ(MakeTradeoff(records, {}).cost, "rhs_equivalents");
  for (const TradeoffRow& row : OnlyRows(MakeTradeoff(records, {.cost = "wall_s"}))) {
    EXPECT_EQ(row.reason, "not timed");
  }
}

TEST(Tradeoff, RefusesWhatNoRecordHas) {
  const std::vector<Record> records = Store({1e-3}, {1.0});
  EXPECT_THROW(MakeTradeoff(records, {.error = "error_positoin_max"}), ConfigError);
  EXPECT_THROW(MakeTradeoff(records, {.error = "closed_form_error_max"}), ConfigError);
  EXPECT_THROW(MakeTradeoff(records, {.error = "mechanism"}), ConfigError);
  EXPECT_THROW(MakeTradeoff(records, {.cost = "walls"}), ConfigError);
  EXPECT_THROW(MakeTradeoff(records, {.per = {"mechanisms"}}), ConfigError);
  EXPECT_THROW(MakeTradeoff(records, {.where = {ParseCondition("rtol<1e-9")}}), ConfigError);
  std::vector<Record> empty = records;
  empty[0].Set("error_position_max", Value());
  EXPECT_THROW(MakeTradeoff(empty, {}), ConfigError);
}

TEST(Tradeoff, ConditionsSeeTheTimingToo) {
  const std::vector<Record> records = Store({1e-3, 1e-6, 1e-9}, {0.1, 0.2, 0.4});
  const Tradeoff fast = MakeTradeoff(records, {.where = {ParseCondition("wall_s_median<0.3")}});
  EXPECT_EQ(OnlyRows(fast).size(), 2u);
}

TEST(Tradeoff, ProblemsAreComparedEachByItself) {
  std::vector<Record> records = Store({1e-3, 1e-6}, {0.1, 0.2});
  for (Record record : Store({1e-2, 1e-5}, {10.0, 20.0})) {
    record.Set("mechanism", std::string("slow"));
    record.Set("case_id", "slow" + record.Text("case_id"));
    records.push_back(record);
  }
  const Tradeoff tradeoff = MakeTradeoff(records, {});
  ASSERT_EQ(tradeoff.problems.size(), 2u);
  EXPECT_EQ(tradeoff.problems[0].name, "four-bar, horizon 10");
  for (const TradeoffProblem& problem : tradeoff.problems) {
    for (const TradeoffRow& row : problem.rows) EXPECT_TRUE(row.on_front);
  }
  const Tradeoff one = MakeTradeoff(records, {.per = {"horizon"}});
  EXPECT_EQ(one.problems.size(), 1u);
}

TEST(Tradeoff, TheCheapestOfEachFormulationReachesTheError) {
  // odca 1e-4 at 0.1 and 1e-10 at 0.9, lagrange 1e-7 at 0.3
  const std::vector<Record> records = Store({1e-4, 1e-7, 1e-10}, {0.1, 0.3, 0.9});
  const TradeoffProblem problem = MakeTradeoff(records, {}).problems.front();
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

TEST(TradeoffReport, SaysNoneReachedIt) {
  const std::vector<Record> records = Store({1e-4, 1e-7}, {0.1, 0.3});
  const Tradeoff tradeoff = MakeTradeoff(records, {});
  const std::string overview = ToText(OverviewTable(tradeoff));
  EXPECT_NE(overview.find("none reached it"), std::string::npos) << overview;
  EXPECT_NE(overview.find("0.3 (3.00)"), std::string::npos) << overview;
  EXPECT_NE(ToCsv(CheapestTable(tradeoff)).find("none reached it"), std::string::npos);
}

TEST(TradeoffReport, ListsFrontAndReasonsAndHidesOnlyTheBeaten) {
  std::vector<Record> records = Store({1e-3, 1e-2, 1e-6}, {0.1, 0.2, 0.3});
  records[4].Set("doubts", std::string("energy"));
  const Tradeoff tradeoff = MakeTradeoff(records, {});
  const Table brief = TradeoffTable(tradeoff, {});
  ASSERT_EQ(brief.rows.size(), 2u);
  EXPECT_EQ(brief.rows[0].Text("front"), "*");
  EXPECT_EQ(brief.rows[1].Text("reason"), "doubts: energy");
  EXPECT_NE(ToText(brief).find("1 more row was compared and beaten"), std::string::npos);
  EXPECT_EQ(TradeoffTable(tradeoff, {.compact = true, .all = true}).rows.size(), 3u);
  const std::string csv = ToCsv(TradeoffTable(tradeoff, {.compact = false, .all = true}));
  EXPECT_NE(csv.find("problem,formulation,enforcement,coordinates,solver,integrator,rtol,error,"),
            std::string::npos)
      << csv;
  const std::string page = TradeoffMarkdown(tradeoff, {"command: x"});
  for (const char* part :
       {"cheapest method for an error", "equal in all compared rows", "energy", "command: x"}) {
    EXPECT_NE(page.find(part), std::string::npos) << part;
  }
}

std::string Statement(const std::vector<Record>& records) {
  return fmt::format("{}", fmt::join(FairnessStatement(MakeTradeoff(records, {})), "\n"));
}

void ExpectWords(const std::string& text, const std::vector<std::string>& words,
                 bool there = true) {
  for (const std::string& word : words) {
    EXPECT_EQ(text.find(word) != std::string::npos, there) << word << " in\n" << text;
  }
}

TEST(Fairness, SaysWhatWasEqualAndWhatWasNot) {
  std::vector<Record> records = Store({1e-3, 1e-6, 1e-9}, {0.1, 0.2, 0.4});
  const std::string alike = Statement(records);
  ExpectWords(alike, {"error: error_position_max", "cost: wall_s_median [s]", "integrator ode45",
                      "machine m", "threads 1", "simplifications none", "mechanism and start scene",
                      "not recorded: compiler"});
  ExpectWords(alike,
              {"formulation (odca 2, lagrange 1)", "tolerance (0.001 1, 0.0001 1, 1e-05 1)"});
  ExpectWords(alike, {"warning", "not compared"}, false);
  for (const int i : {2, 3})
    records[static_cast<std::size_t>(i)].Set("integrator", std::string("verner"));
  records[4].Set("doubts", std::string("energy"));
  const std::string mixed = Statement(records);
  ExpectWords(mixed,
              {"integrator (ode45 1, verner 1)", "1 of 3 rows are not compared: doubts: energy 1"});
}

TEST(Fairness, WarnsOfTimesOfTwoMachinesAndOfANoisyOne) {
  std::vector<Record> records = Store({1e-3, 1e-6}, {0.1, 0.2});
  records[1].Set("machine", std::string("another"));
  records[3].Set("noise", std::string("A/A spread 9 %"));
  ExpectWords(Statement(records),
              {"machine (another 1, m 1)", "warning: the costs are times of more",
               "warning: noisy machine in 1 of 2 timings"});
  for (Record& record : records) record.Set("wall_s_median", Value());
  ExpectWords(Statement(records), {"warning"}, false);  // rhs_equivalents are no times
}

TEST(Fairness, SaysWhatReferencesAreCertifiedTo) {
  std::vector<Record> records = Store({1e-3, 1e-13}, {0.1, 0.2});
  records[0].Set("reference_error", 1e-11);
  records[0].Set("trust_horizon", 8.0);
  records[2].Set("reference_error", 3e-12);
  ExpectWords(Statement(records),
              {"certified to 3.0e-12 to 1.0e-11 m", "1 row has no larger error than that",
               "1 row goes beyond the trust horizon"});
}

/// Two problems differ in what each has alone in common.
TEST(Fairness, WhatIsEqualInEachProblemIsEqual) {
  std::vector<Record> records = Store({1e-3, 1e-6}, {0.1, 0.2});
  for (Record record : Store({1e-2, 1e-5}, {10.0, 20.0})) {
    record.Set("mechanism", std::string("other"));
    if (record.Find("scene_id") != nullptr) record.Set("scene_id", std::string("scene-2"));
    records.push_back(record);
  }
  ExpectWords(Statement(records), {"mechanism and start (in each problem)"});
}

TEST(TradeoffFigures, DrawTheFrontDoubtsAndFailures) {
  std::vector<Record> records = Store({1e-3, 1e-2, 1e-6, 1e-7}, {0.1, 0.2, 0.3, 0.4});
  records[2].Set("doubts", std::string("energy"));
  records[4].Set("outcome", std::string("singular"));
  records[5].Set("wall_s_median", Value());
  records[4].Set("cpu_s", 0.05);
  const Tradeoff tradeoff = MakeTradeoff(records, {});
  const Figure figure = WorkPrecisionFigure(tradeoff, tradeoff.problems.front());
  std::size_t doubted = 0, crosses = 0;
  for (const Curve& curve : figure.curves) {
    doubted += curve.style.doubtful ? curve.x.size() : 0;
    crosses += curve.crosses.size();
    for (const auto& cross : curve.crosses) EXPECT_EQ(cross.first, 0.05);
  }
  EXPECT_EQ(doubted, 1u);
  EXPECT_EQ(crosses, 1u);
  const Curve& stairs = figure.curves.back();
  EXPECT_EQ(stairs.label, "Pareto front");
  EXPECT_EQ(stairs.x, (std::vector<double>{0.1, 0.4, 0.4}));
  EXPECT_EQ(stairs.y, (std::vector<double>{1e-3, 1e-3, 1e-7}));
}

TEST(TradeoffFigures, TheLineOfTolerancesIsTheirMultipleByTheLink) {
  const Tradeoff tradeoff = MakeTradeoff(Store({1e-3, 1e-2, 1e-6}, {0.1, 0.2, 0.3}), {});
  const Figure figure = ToleranceFigure(tradeoff, tradeoff.problems.front(), "ode45");
  const Curve& line = figure.curves.back();
  EXPECT_EQ(line.label, "error = tolerance x link");
  ASSERT_EQ(line.x.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_DOUBLE_EQ(line.x[i], i == 0 ? 1e-5 : 1e-3);
    EXPECT_DOUBLE_EQ(line.y[i], 2.0 * line.x[i]);  // links are 2 m long
  }
}

TEST(TradeoffFigures, ErrorsOverTimeHaveTheTrustHorizon) {
  std::vector<Record> records = Store({1e-3, 1e-6}, {0.1, 0.2});
  EXPECT_EQ(TradeoffFigures(MakeTradeoff(records, {})).size(), 2u) << "no series, no third";
  for (Record& record : records) {
    if (record.Text("kind") != "accuracy") continue;
    record.Set("series.error_t", std::vector<double>{0, 5, 10});
    record.Set("series.error", std::vector<double>{0, 1e-9, 1e-6});
    record.Set("trust_horizon", 7.5);
  }
  const Tradeoff tradeoff = MakeTradeoff(records, {});
  const Figure figure = ErrorOverTimeFigure(tradeoff.problems.front(), "ode45");
  ASSERT_EQ(figure.curves.size(), 2u) << "the finest tolerance, and the horizon";
  EXPECT_EQ(figure.curves[1].label, "trust horizon");
  EXPECT_EQ(figure.curves[1].x, (std::vector<double>{7.5, 7.5}));
  EXPECT_EQ(TradeoffFigures(tradeoff).size(), 3u);
}

class TradeoffProgram : public CommandLineTest {};

TEST_F(TradeoffProgram, PrintsAndWritesWhatAccuracyCosts) {
  Write("pendulum.json", ReadFile(kConfigs / "mechanisms/pendulum.json"));
  Write("e.json", R"({"name": "e", "tolerances": [1e-4, 1e-6, 1e-8], "fixed_steps": [0.02],
    "integrator": ["ode45", "verner"], "scenes": [{"mechanism": "pendulum.json", "horizon": 0.5}],
    "columns": [{"formulation": ["odca", "lagrange"], "enforcement": "position"}],
    "timing": {"repeats": 2, "cases": true}})");
  ExpectEnding(Call("run e.json --out out"), 0, {"32 run now"});
  ExpectEnding(Call("tradeoff out --figures"), 0,
               {"closed_form_error_max against wall_s_median", "problem = pendulum, horizon 0.5",
                "no record has error_position_max", "equal in all compared rows",
                "tradeoff-overview.csv", "wrote 3 figures to out/figures"});
  for (const char* file : {"tradeoff.csv", "tradeoff.md", "tradeoff-overview.csv",
                           "figures/work-precision-pendulum-horizon-0.5.svg",
                           "figures/tolerance-pendulum-horizon-0.5-verner.svg"}) {
    EXPECT_TRUE(fs::exists(folder_ / "out" / file)) << file;
  }
  const std::string csv = ReadFile(folder_ / "out/tradeoff.csv");
  EXPECT_EQ(std::ranges::count(csv.substr(0, csv.find("\n#")), '\n'), 16) << csv;
  ExpectEnding(Call("tradeoff out --cost steps --classes 1e-2 --where integrator=verner --out t"),
               0, {"against steps", "wrote t/tradeoff.csv"});
  ExpectEnding(Call("tradeoff out --error nothing"), 2, {"--error: found \"nothing\""});
  ExpectEnding(Call("tradeoff out --classes nan"), 2, {"expected a number from 0"});
  ExpectEnding(Call("tradeoff out --format csv --where 'rtol<1e-7'"), 0, {"problem,formulation"});
}

}  // namespace tradeoff_test
}  // namespace loopbench::harness
