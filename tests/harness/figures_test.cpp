// Figures carry labels with units and every curve, and say why when they cannot be drawn.
#include "harness/figures/figures.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "harness/base/text.h"
#include "tests/harness/cli_fixture.h"
#include "tests/harness/records.h"

namespace loopbench::harness {
namespace figures_test {

class FiguresTest : public testing::Test {
 protected:
  // The SVG text, or the reason why there is none.
  std::string Draw(const Figure& figure) const {
    const auto error = WriteFigure(folder_ / "figure.svg", figure);
    return error ? "error: " + *error : ReadFile(folder_ / "figure.svg");
  }

  TemporaryFolder temporary_{"loopbench-figures-test"};
  std::filesystem::path folder_ = temporary_.path() / "new";
};

Record RunOf(const std::string& formulation, const std::string& coordinates, double exponent) {
  std::vector<double> t, drift;
  for (int i = 0; i <= 200; ++i) {
    t.push_back(0.05 * i);
    drift.push_back(1e-10 * std::pow(t.back(), exponent));
  }
  return RecordOf("mechanism", "four-bar", "formulation", formulation, "enforcement",
                  formulation == "reduction" ? "velocity" : "acceleration", "coordinates",
                  coordinates, "solver", "plain", "rtol", 1e-8, "horizon", 10.0, "outcome",
                  "finished", "t_reached", 10.0, "growth_exponent", exponent, "series.t", t,
                  "series.angle.crank", drift, "series.angle.rocker", t, "series.drift_t", t,
                  "series.drift", drift);
}

TEST_F(FiguresTest, DriftHasUnitsChannelsAndFittedPowers) {
  std::vector<Record> records = {RunOf("odca", "joint", 1.97), RunOf("lagrange", "absolute", 2.2),
                                 RunOf("reduction", "joint", 1.03)};
  for (Record& record : records) {
    record.Set("growth_resolved", record.Text("formulation") != "lagrange");
    record.Set("growth_from", 1.0);
    record.Set("growth_to", 10.0);
  }
  const Figure figure = DriftFigure(records);
  const std::string svg = Draw(figure);
  ExpectWords(
      svg, {"time [s]", "position drift, running maximum [m]", "four-bar: drift, plain, rtol 10⁻⁸",
            "<text>1.97</text>", "<text>2.20?</text>", "<text>1.03</text>", "?: not resolved",
            "<text>lagrange</text>", "<text>velocity</text>", "<text>absolute</text>"});
  // through the data, over the window of the fit: drift is 1e-10 t^1.97
  ExpectWords(GnuplotScript(figure).script, {"[1:10] 1e-10*(x/1)**(1.97) with lines"});
  EXPECT_EQ(CountOf(GnuplotScript(figure).script, "**(2.2)"), 0u) << "not resolved";
}

TEST_F(FiguresTest, ValuesThatALogarithmicAxisCannotShowAreSkipped) {
  Figure figure;
  figure.log_x = figure.log_y = true;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  figure.curves.push_back(
      {.label = "some", .x = {0.0, 1.0, 2.0, 3.0, 4.0}, .y = {1.0, 0.0, nan, 5.0, 7.0}});
  figure.curves.push_back({.label = "none", .x = {1.0}, .y = {0.0}});
  ExpectWords(GnuplotScript(figure).script, {"$c0 << EOD\n3 5\n4 7\nEOD\n"});
  ExpectWords(Draw(figure), {"<text>some</text>", "<text>none</text>"});
}

TEST_F(FiguresTest, AFailedRunEndsInACrossAndIsNamed) {
  const Record failed =
      Changed(RunOf("lagrange", "joint", 2.0), "outcome", "singular", "t_reached", 1.25);
  const std::string svg =
      Draw(DriftFigure(std::vector<Record>{RunOf("odca", "joint", 2.0), failed}, true));
  ExpectWords(svg, {"<text>singular at 1.25 s</text>", "xlink:href='#gpPt1'", "×: failed run"});
  EXPECT_EQ(CountOf(svg, "fitted powers"), 0u);
}

TEST_F(FiguresTest, ARunThatFailsAtItsStartHasACrossOnTheAxisAndTakesNoWidth) {
  std::vector<Record> records = {RunOf("odca", "joint", 2.0), RunOf("lagrange", "joint", 2.0),
                                 RunOf("reduction", "joint", 2.0)};
  const std::vector<double> none;
  for (std::size_t i = 1; i < records.size(); ++i) {
    records[i] = Changed(records[i], "outcome", "singular", "t_reached", 0.0, "series.drift_t",
                         none, "series.drift", none);
  }
  const std::string right = GnuplotScript(DriftFigure(std::span(records).first(1), true)).script;
  const std::string script = GnuplotScript(DriftFigure(records, true)).script;
  // in the colours of both, one above the other
  ExpectWords(script, {"at first 0, graph 0.03 point pt 2 ps 0.45 lw 1.2 lc rgb '#BB5566'",
                       "at first 0, graph 0.06 point pt 2 ps 0.45 lw 1.2 lc rgb '#DDAA33'",
                       "failed run (singular at 0 s)"});
  ExpectWords(script, {right.substr(right.find("set rmargin"), 30)});
  // a logarithmic axis of time has no zero: there the cross is in the corner
  ExpectWords(GnuplotScript(DriftFigure(records)).script, {"at graph 0, graph 0.03 point"});
}

TEST_F(FiguresTest, LongSeriesKeepTheirExtremes) {
  Figure figure;
  Curve curve{.label = "a", .x = {}, .y = {}};
  for (int i = 0; i <= 200000; ++i) {
    curve.x.push_back(i * 1e-3);
    curve.y.push_back(std::sin(1000.0 * i));  // many periods in a column
  }
  curve.y[77777] = 3.0;
  curve.y[123456] = -4.0;
  figure.curves.push_back(curve);
  const std::string script = GnuplotScript(figure).script;
  EXPECT_LT(CountOf(script, "\n"), 6500u) << "four points in each third of a point's width";
  ExpectWords(script, {"\n77.777 3\n", "\n123.456 -4\n", "\n200 "});
}

TEST_F(FiguresTest, WithoutGnuplotOrPointsThereIsAReasonAndNoFile) {
  const auto path = folder_ / "figure.svg";
  const Figure figure = MotionFigure(RunOf("odca", "joint", 1.0));
  ExpectWords(
      WriteFigure(path, figure, FigureSize::kTwoColumn, "no-such-gnuplot").value_or("drawn"),
      {"'no-such-gnuplot' not found; install gnuplot-nox"});
  ExpectWords(WriteFigure(path, DriftFigure({})).value_or("drawn"),
              {"no curve has a point to draw"});
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(FigureRecipes, OneFigureOfMotionPerProblemAndOneOfDriftPerTolerance) {
  const Record run = RunOf("odca", "joint", 2.0);
  const std::vector<NamedFigure> figures = AllFigures(std::vector<Record>{
      RunOf("lagrange", "joint", 2.0), run, Changed(run, "rtol", 1e-6),
      Changed(run, "mechanism", "a name that says nothing", "singularity_distance_min", 1e-3)});
  std::string names;
  for (const NamedFigure& figure : figures) names += figure.name + " ";
  EXPECT_EQ(names,
            "motion-a name that says nothing-10s motion-four-bar-10s "
            "singular-a name that says nothing-10s-rtol-1e-08 drift-four-bar-10s-rtol-1e-06 "
            "drift-four-bar-10s-rtol-1e-08 ");
  EXPECT_EQ(figures[1].figure.title, "four-bar, lagrange, acceleration, joint, plain, rtol 10⁻⁸");
  EXPECT_EQ(figures[4].figure.curves.size(), 2u);
}

std::string TitleOfMotion(const std::vector<Record>& records) {
  return AllFigures(records).front().figure.title;
}

TEST(FigureRecipes, MotionIsThatOfTheRunThatIsTrustedMost) {
  const Record drifting = RunOf("odca", "joint", 2.0);
  Record closed =
      Changed(RunOf("lagrange", "absolute", 2.0), "enforcement", "projection", "rtol", 1e-6);
  const std::string position = "four-bar, lagrange, projection, absolute, plain, rtol ";
  EXPECT_EQ(TitleOfMotion({drifting, closed}), position + "10⁻⁶");
  EXPECT_EQ(TitleOfMotion({closed, drifting}), position + "10⁻⁶");
  Record finer = Changed(closed, "rtol", 1e-10);
  EXPECT_EQ(TitleOfMotion({finer, closed, drifting}), position + "10⁻¹⁰");
  finer.Set("energy_error_relative", 0.5);
  EXPECT_EQ(TitleOfMotion({finer, closed, drifting}), position + "10⁻⁶");
  closed.Set("warnings", std::string("columns disagree"));
  EXPECT_EQ(TitleOfMotion({finer, closed, drifting}).find("projection"), std::string::npos);
  Record swept;
  swept.Set("mass", 5.0);  // a parameter of a sweep stands before the results
  for (const auto& [key, value] : closed.items()) swept.Set(key, value);
  ExpectWords(TitleOfMotion({swept}), {"mass 5"});
}

TEST_F(FiguresTest, DisplacementsHaveAPanelOfTheirOwnInMetres) {
  Record record = RunOf("odca", "joint", 2.0);
  record.Set("series.displacement.slider", record.Numbers("series.t"));
  const Figure both = MotionFigure(record);
  EXPECT_EQ(both.y_label, "angle [rad]");
  EXPECT_EQ(both.curves.size(), 2u);
  ASSERT_EQ(both.below.size(), 1u);
  EXPECT_EQ(both.below[0].y_label, "displacement [m]");
  ASSERT_EQ(both.below[0].curves.size(), 1u);
  EXPECT_EQ(both.below[0].curves[0].label, "slider");
  ExpectWords(Draw(both), {"angle [rad]", "displacement [m]", "<text>slider</text>",
                           "<text>crank</text>", "<text>rocker</text>"});
  const std::vector<double>& times = record.Numbers("series.t");
  const Record slider = RecordOf("series.t", times, "series.displacement.slider", times);
  EXPECT_EQ(MotionFigure(slider).y_label, "displacement [m]");
  EXPECT_TRUE(MotionFigure(slider).below.empty());
}

TEST(FigureRecipes, AMotionTooFastForThePointsIsShownByItsOpening) {
  const Figure figure = MotionFigure(
      Changed(RunOf("odca", "joint", 2.0), "series.opening_t", std::vector<double>{0.0, 0.1, 0.2},
              "series.opening.angle.crank", std::vector<double>{0.0, 1.0, 0.0}));
  EXPECT_TRUE(figure.title.ends_with("(the first 0.2 of 10 s)")) << figure.title;
  ASSERT_EQ(figure.curves.size(), 1u);
  EXPECT_EQ(figure.curves[0].label, "crank");
  EXPECT_EQ(figure.curves[0].x.size(), 3u);
}

// Every method there is, each with a drift of its own.
std::vector<Record> AllMethods() {
  std::vector<Record> records;
  for (const char* formulation : {"odca", "lagrange", "reduction"}) {
    for (const std::string level : {"acceleration", "velocity", "projection", "baumgarte"}) {
      for (const char* coordinates : {"joint", "absolute"}) {
        for (const char* solver : {"plain", "rank-revealing"}) {
          const double exponent = 1.0 + 0.1 * static_cast<double>(records.size());
          records.push_back(Changed(RunOf(formulation, coordinates, exponent), "enforcement", level,
                                    "solver", solver));
        }
      }
    }
  }
  return records;
}

TEST(FigureRecipes, EveryWayOfKeepingLoopsClosedLooksItsOwn) {
  std::set<std::string> looks;
  for (const Curve& curve : DriftFigure(AllMethods()).curves) {
    const CurveStyle& style = curve.style;
    EXPECT_FALSE(style.flagged);
    looks.insert(style.color + ' ' + std::to_string(style.dash) + ' ' +
                 std::to_string(style.width) + std::to_string(static_cast<int>(style.shape)));
  }
  EXPECT_EQ(looks.size(), 48u);
}

TEST(FigureRecipes, AChannelTellsOnePropertyAndNoOther) {
  const std::vector<Record> records = AllMethods();
  const auto looks_by = [&](const char* key, const auto& look) {
    std::map<std::string, std::set<std::string>> looks;
    for (const Record& record : records) looks[record.Text(key)].insert(look(StyleOf(record)));
    std::set<std::string> different;
    for (const auto& [value, own] : looks) {
      EXPECT_EQ(own.size(), 1u) << value;
      different.insert(own.begin(), own.end());
    }
    EXPECT_EQ(different.size(), looks.size()) << key;
  };
  looks_by("formulation", [](const CurveStyle& style) { return style.color; });
  looks_by("enforcement", [](const CurveStyle& style) { return std::to_string(style.dash); });
  looks_by("coordinates",
           [](const CurveStyle& style) { return std::to_string(static_cast<int>(style.shape)); });
  looks_by("solver", [](const CurveStyle& style) { return std::to_string(style.width); });
  std::set<std::string> dashes;
  for (std::size_t dash = 0; dash < kDashes; ++dash) dashes.insert(LineLook({.dash = dash}));
  EXPECT_EQ(dashes.size(), kDashes);
}

// Lightness of what is drawn in grey (Rec. 601).
double Grey(const std::string& color) {
  const auto part = [&](std::size_t at) { return std::stoi(color.substr(at, 2), nullptr, 16); };
  return (0.299 * part(1) + 0.587 * part(3) + 0.114 * part(5)) / 255.0;
}

TEST(FigureRecipes, FormulationsDifferInGrey) {
  const auto grey = [](const char* formulation) {
    return Grey(StyleOf(RunOf(formulation, "joint", 1.0)).color);
  };
  // steps of an eighth are told apart on paper
  EXPECT_GT(grey("lagrange") - grey("odca"), 0.125);
  EXPECT_GT(grey("reduction") - grey("lagrange"), 0.125);
}

TEST_F(FiguresTest, EveryLetterHasItsMeaningInTheLegend) {
  std::vector<Record> records = AllMethods();
  // pairs that coincide and differ in all but the solver: lists that cannot be shortened
  for (std::size_t i = 0; i < records.size() / 2; ++i) {
    records[records.size() - 1 - i].Set("series.drift", records[i].Numbers("series.drift"));
  }
  const Figure figure = DriftFigure(records);
  const auto is_letter = [](const Curve& curve) { return curve.several; };
  ASSERT_GT(std::ranges::count_if(MergedCurves(figure, FigureSize::kTwoColumn), is_letter), 12);
  for (const FigureSize size : {FigureSize::kOneColumn, FigureSize::kTwoColumn}) {
    ASSERT_EQ(WriteFigure(folder_ / "figure.svg", figure, size), std::nullopt);
    const std::string svg = ReadFile(folder_ / "figure.svg");
    std::size_t letters = 0;
    for (char letter = 'A'; letter <= 'Z'; ++letter) {
      if (CountOf(svg, fmt::format("<text>{} ", letter)) == 0) continue;
      ++letters;
      // the label may begin on the next line
      EXPECT_GT(
          CountOf(svg, fmt::format("{}: ", letter)) + CountOf(svg, fmt::format("{}:<", letter)), 0u)
          << letter;
    }
    const Drawing script = GnuplotScript(figure, size);
    if (size == FigureSize::kOneColumn) {
      EXPECT_LE(script.legend_rows, kLegendRows);
    } else {
      EXPECT_GT(letters, 12u) << "the wider size has them all";
      EXPECT_EQ(CountOf(svg, "…"), 0u);
    }
    EXPECT_GE(script.legend_rows, 4u) << "formulations, levels, coordinates, what coincides";
  }
  Figure many;
  for (int i = 0; i < 20; ++i) {
    many.curves.push_back({.label = fmt::format("curve {}", i), .x = {0, 1}, .y = {0, 1.0 * i}});
  }
  EXPECT_EQ(GnuplotScript(many).legend_rows, 0u) << "named at their ends";
  ExpectWords(Draw(many), {"<text>curve 7</text>"});
}

TEST_F(FiguresTest, CurvesThatCoincideAreDrawnOnceAndListed) {
  std::vector<Record> records = {RunOf("odca", "joint", 2.0), RunOf("lagrange", "joint", 2.0),
                                 RunOf("odca", "absolute", 1.0),
                                 RunOf("lagrange", "absolute", 1.0)};
  Figure figure = DriftFigure(records);
  std::vector<Curve> merged = MergedCurves(figure, FigureSize::kTwoColumn);
  ASSERT_EQ(merged.size(), 2u);
  EXPECT_EQ(merged[0].label, "odca = lagrange, joint");
  EXPECT_EQ(merged[0].style.color, "#000000") << "of both";
  EXPECT_EQ(merged[0].style.shape, Shape::kCircle) << "joint coordinates, as both have";
  const std::string svg = Draw(figure);
  ExpectWords(svg, {"coincide: A: odca = lagrange, joint;  B: odca = lagrange, absolute",
                    "<text>A 2.00?</text>"});
  // a flagged run is never hidden by a sound one, nor is one that failed
  records[0].Set("warnings", std::string("energy"));
  records[2].Set("outcome", std::string("singular"));
  EXPECT_EQ(MergedCurves(DriftFigure(records), FigureSize::kTwoColumn).size(), 4u);
}

TEST(DrawnPoints, WhatIsNearerThanALineCoincides) {
  const PlotArea area{
      .x = {.low = 0, .high = 100}, .y = {.low = 0, .high = 100}, .width = 100, .height = 100};
  const std::vector<Point> line = {{0, 10}, {50, 10}, {100, 60}};
  const auto shifted = [&](double dx, double dy) {
    std::vector<Point> points = line;
    for (Point& point : points) point = {point.first + dx, point.second + dy};
    return points;
  };
  EXPECT_TRUE(Coincide(area, line, shifted(0, 0.9)));
  EXPECT_FALSE(Coincide(area, line, shifted(0, 1.1)));
  EXPECT_TRUE(Coincide(area, line, std::vector<Point>{{0, 10}, {25, 10.5}, {50, 10}, {100, 60}}));
  EXPECT_FALSE(Coincide(area, line, std::vector<Point>{{0, 10}, {50, 10}})) << "ends early";
  EXPECT_FALSE(Coincide(area, line, {}));
}

TEST(Axes, HaveNumbersAsAllFiguresHaveThem) {
  const std::map<double, std::string> texts = {
      {1e-8, "10⁻⁸"}, {2.5e-6, "2.5·10⁻⁶"}, {0.25, "0.25"},    {-1e-3, "-10⁻³"},
      {1e10, "10¹⁰"}, {0.0, "0"},           {1234.5, "1234.5"}};
  for (const auto& [value, text] : texts) EXPECT_EQ(NumberText(value), text);
  const auto labels = [](const Axis& axis, int most) {
    std::string text;
    for (const Tick& tick : Ticks(axis, most)) text += tick.label.empty() ? "" : tick.label + " ";
    return text;
  };
  EXPECT_EQ(labels({1e-3, 20, true}, 6), "10⁻³ 10⁻² 10⁻¹ 10⁰ 10¹ ");
  EXPECT_EQ(labels({1e-16, 1e-4, true}, 6), "10⁻¹⁵ 10⁻¹² 10⁻⁹ 10⁻⁶ ");
  EXPECT_EQ(labels({2, 7, true}, 6), "2 3 4 5 6 7 ");
  EXPECT_EQ(labels({-1.5, 1.5, false}, 6), "-1.5 -1.0 -0.5 0 0.5 1.0 1.5 ");
  EXPECT_EQ(labels({1.8e-3, 0.08, true}, 7), "0.002 0.005 0.01 0.02 0.05 ");
  EXPECT_EQ(labels({3e-7, 6e-6, true}, 6), "5·10⁻⁷ 10⁻⁶ 2·10⁻⁶ 5·10⁻⁶ ");
  EXPECT_EQ(labels({0.011, 9.9, true}, 4), "0.1 1 ");
  EXPECT_EQ(labels({0, 3e-7, false}, 4), "0 1·10⁻⁷ 2·10⁻⁷ 3·10⁻⁷ ");
}

TEST(Axes, HaveNumbersAllAlong) {
  // no logarithmic axis, however long and wherever it begins, has them on one side alone
  for (int i = 0; i < 400; ++i) {
    for (const double decades : {0.25, 0.5, 0.9, 1.2, 1.5, 1.9, 2.4, 2.9, 3.5, 6.0, 12.0}) {
      const double low = std::pow(10.0, 0.013 * i - 9.0);
      const Axis axis{low, low * std::pow(10.0, decades), true};
      for (const int most : {4, 6, 7}) {
        if (most == 4 && decades < 0.9) continue;  // room for a single number at times
        std::vector<double> places = {0.0};
        for (const Tick& tick : Ticks(axis, most)) {
          if (!tick.label.empty()) places.push_back(axis.Place(tick.at));
        }
        places.push_back(1.0);
        for (std::size_t k = 1; k < places.size(); ++k) {
          EXPECT_LT(places[k] - places[k - 1], 0.6) << low << ' ' << decades << ' ' << most;
        }
        EXPECT_LE(places.size(), static_cast<std::size_t>(most) + 3);
      }
    }
  }
}

TEST_F(FiguresTest, SizesAreThoseOfColumnsWithLettersOfEightPoints) {
  const Figure figure = MotionFigure(RunOf("odca", "joint", 1.0));
  for (const auto& [size, width] : std::map<FigureSize, std::string>{
           {FigureSize::kOneColumn, "85.02mm"}, {FigureSize::kTwoColumn, "178.15mm"}}) {
    ASSERT_EQ(WriteFigure(folder_ / "figure.svg", figure, size), std::nullopt);
    const std::string svg = ReadFile(folder_ / "figure.svg");
    // one unit of the drawing is one point
    ExpectWords(svg, {"width=\"" + width + "\"", "font-size=\"8.00\"",
                      fmt::format("viewBox=\"0 0 {:.0f} ", PointsOf(std::stod(width)))});
  }
}

// Names come from files of anybody.
TEST_F(FiguresTest, HostileNamesAreDrawnAsTheyAre) {
  const std::string names[] = {
      "q\"'`touch pwned`",     "$x @y {z} %s %%", "a\nb\tc", "\\frac{1}{2} ^_ <b>&amp;",
      "system('touch pwned')", "= , = ,",         ""};
  std::vector<Record> records;
  for (const std::string& name : names) {
    Record record = RunOf(name, name, 1.0 + static_cast<double>(records.size()));
    record.Set("mechanism", name);
    record.Set("series.angle." + name, record.Numbers("series.t"));
    record.Set("series.displacement." + name, record.Numbers("series.t"));
    ASSERT_EQ(WriteFigure(folder_ / "motion.svg", MotionFigure(record)), std::nullopt) << name;
    records.push_back(std::move(record));
  }
  const std::string svg = Draw(DriftFigure(records));
  ExpectWords(svg, {"`touch pwned`", "$x @y {z} %s %%", "a\\nb\\tc"});
  EXPECT_FALSE(std::filesystem::exists("pwned"));
  // neither gnuplot code nor markup
  Figure figure = MotionFigure(RunOf("odca", "joint", 1.0));
  figure.title = "it's <b> & `id` \"x\" q_{1} \n\\n $t @a \xc3\xa9";
  ExpectWords(Draw(figure), {"it's &lt;b> &amp; `id` ", "q_{1} \\n\\n $t @a \xc3\xa9"});
}

TEST_F(FiguresTest, FlaggedRunsHaveHollowMarks) {
  std::vector<Record> records = {RunOf("odca", "absolute", 2.0), RunOf("reduction", "joint", 2.5)};
  EXPECT_EQ(CountOf(Draw(DriftFigure(records)), "flagged"), 0u);
  records[1].Set("warnings", std::string("drift"));
  ExpectWords(Draw(DriftFigure(records)), {"<text>flagged</text>"});
  for (const Figure& figure : {DriftFigure(records), MotionFigure(records[1])}) {
    ExpectWords(GnuplotScript(figure).script, {"with points pt 6 "});
  }
}

}  // namespace figures_test
}  // namespace loopbench::harness
