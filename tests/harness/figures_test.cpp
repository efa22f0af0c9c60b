// Figures carry labels with units and every curve, and say why when they cannot be drawn.
#include "harness/figures/figures.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "harness/figures/figure_recipes.h"
#include "harness/text/files.h"

namespace loopbench::harness {
namespace figures_test {

testing::AssertionResult Contains(const std::string& text, const std::string& part) {
  if (text.find(part) != std::string::npos) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "no '" << part << "' in " << text.substr(0, 2000);
}

class FiguresTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        std::filesystem::path(testing::TempDir()) /
        (std::string("loopbench-") + testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::remove_all(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  // The SVG text, or the reason why there is none.
  std::string Draw(const Figure& figure) const {
    const auto error = WriteFigure(folder_ / "figure.svg", figure);
    return error ? "error: " + *error : ReadFile(folder_ / "figure.svg");
  }

  std::filesystem::path folder_;
};

Record RunOf(const std::string& formulation, const std::string& coordinates, double exponent) {
  Record record;
  record.Set("mechanism", std::string("four-bar"));
  record.Set("formulation", formulation);
  record.Set("enforcement", std::string(formulation == "reduction" ? "velocity" : "acceleration"));
  record.Set("coordinates", coordinates);
  record.Set("solver", std::string("as-published"));
  record.Set("rtol", 1e-8);
  record.Set("horizon", 10.0);
  record.Set("outcome", std::string("finished"));
  record.Set("t_reached", 10.0);
  record.Set("growth_exponent", exponent);
  std::vector<double> t;
  std::vector<double> drift;
  for (int i = 0; i <= 200; ++i) {
    t.push_back(0.05 * i);
    drift.push_back(1e-10 * std::pow(t.back(), exponent));
  }
  record.Set("series.t", t);
  record.Set("series.angle.crank", drift);
  record.Set("series.angle.rocker", t);
  record.Set("series.drift_t", t);
  record.Set("series.drift", drift);
  return record;
}

std::size_t Count(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
    ++count;
  }
  return count;
}

TEST_F(FiguresTest, DriftHasUnitsCurvesAndFittedSlopes) {
  const std::string svg = Draw(DriftFigure(std::vector<Record>{RunOf("odca", "joint", 1.97),
                                                               RunOf("lagrange", "absolute", 2.0),
                                                               RunOf("reduction", "joint", 1.03)}));
  EXPECT_TRUE(Contains(svg, "time [s]"));
  EXPECT_TRUE(Contains(svg, "position drift, running maximum [m]"));
  EXPECT_TRUE(Contains(svg, "odca, acceleration, joint: t^1.97"));
  EXPECT_TRUE(Contains(svg, "lagrange, acceleration, absolute: t^2.00"));
  EXPECT_TRUE(Contains(svg, "reduction, velocity, joint: t^1.03"));
  EXPECT_TRUE(Contains(svg, "four-bar: drift, as-published, rtol 1e-08"));
  // Three curves, each with marks and an entry of the legend, and three slope lines.
  EXPECT_EQ(Count(svg, "id=\"gnuplot_plot_"), 12u);
}

TEST_F(FiguresTest, TheSameFigureGivesTheSameBytes) {
  const Figure figure = AnglesFigure(RunOf("odca", "joint", 1.0));
  const std::string first = Draw(figure);
  EXPECT_TRUE(Contains(first, "angle [rad]"));
  EXPECT_TRUE(Contains(first, "<text>crank</text>"));
  EXPECT_TRUE(Contains(first, "<text>rocker</text>"));
  EXPECT_EQ(first, Draw(figure));
}

TEST_F(FiguresTest, LabelsAreNeitherGnuplotCodeNorMarkup) {
  Figure figure = AnglesFigure(RunOf("odca", "joint", 1.0));
  figure.title = "it's <b> & `id` \"x\" q_{1} \n\\n $t @a \xc3\xa9";
  const std::string svg = Draw(figure);
  EXPECT_TRUE(Contains(svg, "it's &lt;b> &amp; `id` "));
  EXPECT_TRUE(Contains(svg, "q_{1} \\n\\n $t @a \xc3\xa9"));
}

TEST_F(FiguresTest, ValuesThatALogarithmicAxisCannotShowAreSkipped) {
  Figure figure;
  figure.log_x = figure.log_y = true;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  figure.curves.push_back({"some", {0.0, 1.0, 2.0, 3.0, 4.0}, {1.0, 0.0, nan, 5.0, 7.0}, {}, {}});
  figure.curves.push_back({"none", {1.0}, {0.0}, {}, {}});
  const std::string script = GnuplotScript(figure);
  EXPECT_TRUE(Contains(script, "$c0 << EOD\n3 5\n4 7\nEOD\n"));
  EXPECT_TRUE(Contains(script, "set format x '%g'\n"));  // 1e-08, not 0.000000010
  const std::string svg = Draw(figure);
  EXPECT_TRUE(Contains(svg, "<text>some</text>"));
  EXPECT_TRUE(Contains(svg, "<text>none</text>"));
}

TEST_F(FiguresTest, AFailedRunEndsInACrossAndIsNamed) {
  Record failed = RunOf("lagrange", "joint", 2.0);
  failed.Set("outcome", std::string("singular"));
  failed.Set("t_reached", 1.25);
  const std::string svg =
      Draw(SingularFigure(std::vector<Record>{RunOf("odca", "joint", 2.0), failed}));
  EXPECT_TRUE(Contains(svg, "lagrange (singular at 1.25 s)"));
  EXPECT_TRUE(Contains(svg, "xlink:href='#gpPt1'"));
  EXPECT_FALSE(Contains(svg, "t^"));
}

TEST_F(FiguresTest, LongSeriesAreThinnedToWhatTheEyeSees) {
  Figure figure;
  Curve curve;
  for (int i = 0; i <= 100000; ++i) {
    curve.x.push_back(i * 1e-3);
    curve.y.push_back(1.0);
  }
  figure.curves.push_back(curve);
  const std::string script = GnuplotScript(figure);
  EXPECT_LT(Count(script, "\n"), 1000u);
  EXPECT_TRUE(Contains(script, "\n100 1\nEOD"));
}

TEST_F(FiguresTest, AMissingGnuplotIsAReasonAndNoFile) {
  const Figure figure = AnglesFigure(RunOf("odca", "joint", 1.0));
  const auto error = WriteFigure(folder_ / "figure.svg", figure, "no-such-gnuplot");
  ASSERT_TRUE(error.has_value());
  EXPECT_TRUE(Contains(*error, "'no-such-gnuplot' not found; install gnuplot-nox"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "figure.svg"));
}

TEST_F(FiguresTest, AFigureWithoutPointsIsAReason) {
  const auto error = WriteFigure(folder_ / "figure.svg", DriftFigure({}));
  ASSERT_TRUE(error.has_value());
  EXPECT_TRUE(Contains(*error, "no curve has a point to draw"));
}

TEST(FigureRecipes, OneFigureOfAnglesPerSceneAndOneOfDriftPerTolerance) {
  Record coarse = RunOf("odca", "joint", 2.0);
  coarse.Set("rtol", 1e-6);
  Record singular = RunOf("odca", "joint", 2.0);
  singular.Set("mechanism", std::string("a name that says nothing"));
  singular.Set("singularity_distance_min", 1e-3);
  const std::vector<NamedFigure> figures = AllFigures(std::vector<Record>{
      RunOf("lagrange", "joint", 2.0), RunOf("odca", "joint", 2.0), coarse, singular});
  std::string names;
  for (const NamedFigure& figure : figures) names += figure.name + " ";
  EXPECT_EQ(names,
            "angles-a name that says nothing-10s angles-four-bar-10s "
            "singular-a name that says nothing-10s-rtol-1e-08 drift-four-bar-10s-rtol-1e-06 "
            "drift-four-bar-10s-rtol-1e-08 ");
  EXPECT_EQ(figures[1].figure.title,
            "four-bar: angles, odca, acceleration, joint, as-published, rtol 1e-08");
  EXPECT_EQ(figures[4].figure.curves.size(), 2u);
  EXPECT_GT(figures[4].figure.curves[0].style.width, figures[4].figure.curves[1].style.width);
}

std::string TitleOfAngles(const std::vector<Record>& records) {
  return AllFigures(records).front().figure.title;
}

TEST(FigureRecipes, AnglesAreThoseOfTheRunThatIsTrustedMost) {
  const Record drifting = RunOf("odca", "joint", 2.0);
  Record closed = RunOf("lagrange", "absolute", 2.0);
  closed.Set("enforcement", std::string("position"));
  closed.Set("rtol", 1e-6);
  const std::string position =
      "four-bar: angles, lagrange, position, absolute, as-published, rtol ";
  EXPECT_EQ(TitleOfAngles({drifting, closed}), position + "1e-06");
  EXPECT_EQ(TitleOfAngles({closed, drifting}), position + "1e-06");
  Record finer = closed;
  finer.Set("rtol", 1e-10);
  EXPECT_EQ(TitleOfAngles({finer, closed, drifting}), position + "1e-10");
  finer.Set("energy_error_relative", 0.5);
  EXPECT_EQ(TitleOfAngles({finer, closed, drifting}), position + "1e-06");
  closed.Set("doubts", std::string("columns disagree"));
  EXPECT_EQ(TitleOfAngles({finer, closed, drifting}).find("position"), std::string::npos);
  Record swept;
  swept.Set("mass", 5.0);  // a parameter of a sweep stands before the results
  for (const auto& [key, value] : closed.items()) swept.Set(key, value);
  EXPECT_TRUE(Contains(TitleOfAngles({swept}), "mass 5"));
}

TEST(FigureRecipes, DisplacementsHaveAFigureOfTheirOwnInMetres) {
  Record record = RunOf("odca", "joint", 2.0);
  record.Set("series.displacement.slider", record.Numbers("series.t"));
  const std::vector<NamedFigure> figures = AllFigures(std::vector<Record>{record});
  ASSERT_EQ(figures.size(), 3u);
  EXPECT_EQ(figures[0].figure.y_label, "angle [rad]");
  EXPECT_EQ(figures[0].figure.curves.size(), 2u);
  EXPECT_EQ(figures[1].name, "displacements-four-bar-10s");
  EXPECT_EQ(figures[1].figure.y_label, "displacement [m]");
  ASSERT_EQ(figures[1].figure.curves.size(), 1u);
  EXPECT_EQ(figures[1].figure.curves[0].label, "slider");
}

TEST(FigureRecipes, AMotionTooFastForThePointsIsShownByItsOpening) {
  Record record = RunOf("odca", "joint", 2.0);
  record.Set("series.opening_t", std::vector<double>{0.0, 0.1, 0.2});
  record.Set("series.opening.angle.crank", std::vector<double>{0.0, 1.0, 0.0});
  const Figure figure = AnglesFigure(record);
  EXPECT_TRUE(figure.title.ends_with("(the first 0.2 of 10 s)")) << figure.title;
  ASSERT_EQ(figure.curves.size(), 1u);
  EXPECT_EQ(figure.curves[0].label, "crank");
  EXPECT_EQ(figure.curves[0].x.size(), 3u);
}

TEST(FigureRecipes, EveryWayOfKeepingLoopsClosedLooksItsOwn) {
  std::vector<Record> records;
  for (const char* formulation : {"odca", "lagrange", "reduction"}) {
    for (const char* level : {"acceleration", "velocity", "position", "baumgarte"}) {
      for (const char* coordinates : {"joint", "absolute"}) {
        for (const char* solver : {"as-published", "rank-revealing"}) {
          records.push_back(RunOf(formulation, coordinates, 2.0));
          records.back().Set("enforcement", std::string(level));
          records.back().Set("solver", std::string(solver));
        }
      }
    }
  }
  std::set<std::string> looks;
  for (const Curve& curve : DriftFigure(records).curves) {
    const CurveStyle& style = curve.style;
    EXPECT_FALSE(style.doubtful);
    looks.insert(style.color + (style.filled ? " filled " : " open ") +
                 std::to_string(static_cast<int>(style.shape)));
  }
  EXPECT_EQ(looks.size(), 48u);
}

TEST_F(FiguresTest, OnlyDoubtfulRunsAreDashed) {
  std::vector<Record> records = {RunOf("odca", "absolute", 2.0), RunOf("reduction", "joint", 2.0)};
  EXPECT_FALSE(Contains(GnuplotScript(DriftFigure(records)), "dt ("));
  records[1].Set("doubts", std::string("drift"));
  EXPECT_TRUE(Contains(GnuplotScript(DriftFigure(records)), "dt ("));
  EXPECT_TRUE(Contains(Draw(DriftFigure(records)), "dashed: doubtful"));
}

}  // namespace figures_test
}  // namespace loopbench::harness
