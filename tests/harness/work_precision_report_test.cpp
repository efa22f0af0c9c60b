// Error against cost: tables, figures and the statement of what was equal.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "harness/figures/figures.h"
#include "harness/judge/judge.h"
#include "tests/harness/work_precision_records.h"

namespace loopbench::harness {
namespace work_precision_report_test {

using namespace work_precision_records;

TEST(WorkPrecisionReport, SaysNoneReachedIt) {
  const std::vector<Record> records = Store({1e-4, 1e-7}, {0.1, 0.3});
  const WorkPrecision work_precision = MakeWorkPrecision(records, {});
  const std::string overview = ToText(OverviewTable(work_precision));
  EXPECT_NE(overview.find("none"), std::string::npos) << overview;
  EXPECT_NE(overview.find("0.3 (3.00)"), std::string::npos) << overview;
  EXPECT_NE(ToCsv(CheapestTable(work_precision)).find("none"), std::string::npos);
}

TEST(WorkPrecisionReport, ListsFrontAndReasonsAndHidesOnlyTheBeaten) {
  std::vector<Record> records = Store({1e-3, 1e-2, 1e-6}, {0.1, 0.2, 0.3});
  records[4].Set("warnings", std::string("energy"));
  const WorkPrecision work_precision = MakeWorkPrecision(records, {});
  const Table brief = WorkPrecisionTable(work_precision, {});
  ASSERT_EQ(brief.rows.size(), 2u);
  EXPECT_EQ(brief.rows[0].Text("front"), "*");
  EXPECT_EQ(brief.rows[1].Text("reason"), "warnings: energy");
  EXPECT_NE(ToText(brief).find("not shown: 1 dominated rows"), std::string::npos);
  EXPECT_EQ(WorkPrecisionTable(work_precision, {.compact = true, .all = true}).rows.size(), 3u);
  const std::string csv =
      ToCsv(WorkPrecisionTable(work_precision, {.compact = false, .all = true}));
  EXPECT_NE(csv.find("problem,formulation,enforcement,coordinates,solver,integrator,rtol,error,"),
            std::string::npos)
      << csv;
  const std::string page = WorkPrecisionMarkdown(work_precision, {"command: x"});
  for (const char* part :
       {"cheapest method for an error", "equal in all compared rows", "energy", "command: x"}) {
    EXPECT_NE(page.find(part), std::string::npos) << part;
  }
}

std::string Statement(const std::vector<Record>& records) {
  return fmt::format("{}", fmt::join(FairnessStatement(MakeWorkPrecision(records, {})), "\n"));
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
                      "machine m", "threads 1", "simplifications none",
                      "mechanism and start problem", "not recorded: compiler"});
  ExpectWords(alike,
              {"formulation (odca 2, lagrange 1)", "tolerance (0.001 1, 0.0001 1, 1e-05 1)"});
  ExpectWords(alike, {"warning", "not compared"}, false);
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
  ExpectWords(Statement(records), {"library's code"}, false);
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
  ExpectWords(Statement(records), {"leaves out Jacobians"}, false);
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
    record.Set("series.error_t", std::vector<double>{0, 5, 10});
    record.Set("series.error", std::vector<double>{0, 1e-9, 1e-6});
    record.Set("reference_valid_until", 7.5);
  }
  const WorkPrecision work_precision = MakeWorkPrecision(records, {});
  const Figure figure = ErrorOverTimeFigure(work_precision.problems.front(), "ode45");
  ASSERT_EQ(figure.curves.size(), 2u) << "the finest tolerance, and the horizon";
  EXPECT_EQ(figure.curves[1].label, "validity limit of the reference");
  EXPECT_EQ(figure.curves[1].x, (std::vector<double>{7.5, 7.5}));
  EXPECT_EQ(WorkPrecisionFigures(work_precision).size(), 3u);
}

}  // namespace work_precision_report_test
}  // namespace loopbench::harness
