// Order, notes and figures of runs in several scalars.
#include "harness/figures/figures.h"
#include "harness/judge/tables.h"
#include "tests/harness/records.h"
#include "tests/standard.h"

namespace loopbench::harness::precision_report_test {

Record SweepLevel(const std::string& scalar, double rtol, const std::string& outcome = "finished") {
  return RecordOf("kind", "precision", "mechanism", "four-bar", "formulation", "odca",
                  "enforcement", "velocity", "coordinates", "joint", "solver", "rank-revealing",
                  "integrator", "ode45", "rtol", rtol, "horizon", 5.0, "scalar", scalar, "outcome",
                  outcome, "error_final", 10 * rtol, "drift_position_max", rtol);
}

std::vector<Record> Ladder() {
  return {Changed(SweepLevel("float128", 1e-25), "integrator", "gragg"),
          SweepLevel("float", 1e-4),
          SweepLevel("float", 1e-8, "step-too-small"),
          SweepLevel("float128", 1e-4),
          SweepLevel("float128", 1e-8),
          SweepLevel("double", 1e-4),
          SweepLevel("double", 1e-8)};
}

TEST(PrecisionReportTest, ScalarsStandSideBySideAndTheReferenceLast) {
  const Table table = MakeTable(Ladder(), {.kind = "precision"});
  std::vector<std::string> order;
  for (const Record& row : table.rows) order.push_back(row.Text("scalar") + row.Text("rtol"));
  EXPECT_EQ(order,
            (std::vector<std::string>{"float0.0001", "double0.0001", "float1280.0001", "float1e-08",
                                      "double1e-08", "float1281e-08", "float1281e-25"}));
  EXPECT_FALSE(table.notes.empty());
}

TEST(PrecisionReportTest, StoresWithoutAccuracyShowTheirLadders) {
  EXPECT_EQ(MakeTable(Ladder(), {}).title, "Precision");
  EXPECT_TRUE(MakeTable(Ladder(), {.kind = "drift"}).rows.empty());
}

TEST(PrecisionReportTest, OneFigurePerLadderWithErrorAndDriftOfEachScalar) {
  const std::vector<NamedFigure> figures = PrecisionFigures(Ladder());
  ASSERT_EQ(figures.size(), 1u);
  EXPECT_EQ(figures[0].name, "precision-four-bar-odca-velocity-joint-rank-revealing");
  const Figure& figure = figures[0].figure;
  ASSERT_EQ(figure.curves.size(), 3u);
  EXPECT_EQ(figure.y_label, "error at the end [m]");
  EXPECT_EQ(figure.curves[0].label, "float");
  EXPECT_EQ(figure.curves[2].label, "float128");
  ASSERT_EQ(figure.below.size(), 1u);
  EXPECT_EQ(figure.below[0].y_label, "largest drift [m]");
  EXPECT_EQ(figure.below[0].curves[2].y, (std::vector<double>{1e-4, 1e-8}));
  // the reference is no point; a run that failed is a cross without a height
  EXPECT_EQ(figure.curves[2].x, (std::vector<double>{1e-4, 1e-8}));
  EXPECT_EQ(figure.curves[0].x, (std::vector<double>{1e-4}));
  ASSERT_EQ(figure.curves[0].crosses.size(), 1u);
  EXPECT_EQ(figure.curves[0].crosses[0].first, 1e-8);
  EXPECT_TRUE(std::isnan(figure.curves[0].crosses[0].second));
  EXPECT_TRUE(PrecisionFigures({}).empty());
}

}  // namespace loopbench::harness::precision_report_test
