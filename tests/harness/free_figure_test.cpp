// A figure of any value against any other: labels, scales, curves, and nothing dropped.
#include "harness/figures/figures.h"
#include "tests/harness/cli_fixture.h"
#include "tests/harness/in_child.h"
#include "tests/harness/records.h"

namespace loopbench::harness::free_figure_test {

Record RunOf(const std::string& formulation, double rtol, double drift) {
  return RecordOf("kind", "accuracy", "mechanism", "four-bar", "formulation", formulation, "rtol",
                  rtol, "horizon", 10.0, "steps", 100, "outcome", "finished", "drift_position_max",
                  drift, "series.drift_t", std::vector{0.0, 0.1, 10.0}, "series.drift",
                  std::vector{0.0, drift / 2, drift});
}

std::vector<Record> Runs() {
  return {RunOf("odca", 1e-6, 1e-4), RunOf("odca", 1e-10, 1e-8), RunOf("odca", 1e-8, 1e-6),
          RunOf("lagrange", 1e-6, 2e-4), RunOf("lagrange", 1e-8, 2e-6)};
}

FreeFigure DriftOverTolerance(const std::string& log = "") {
  return {.x = "rtol", .y = "drift_position_max", .group = "formulation", .log = log};
}

Figure FigureOf(const std::vector<Record>& runs, const FreeFigure& wanted = DriftOverTolerance()) {
  return MakeFreeFigure(runs, wanted).figure;
}

std::string Refusal(const std::vector<Record>& records, const FreeFigure& wanted) {
  return MessageOf<std::runtime_error>([&] { MakeFreeFigure(records, wanted); });
}

TEST(FreeFigure, HasOneCurvePerGroupInOrderOfXWithKeysAndUnits) {
  const Figure figure = FigureOf(Runs());
  EXPECT_EQ(figure.title, "drift_position_max over rtol: four-bar, horizon 10 s");
  EXPECT_EQ(figure.x_label, "rtol");
  EXPECT_EQ(figure.y_label, "drift, position [m]");
  EXPECT_EQ(figure.legend_title, "curves by formulation");
  ASSERT_EQ(figure.curves.size(), 2u);
  EXPECT_EQ(figure.curves[0].label, "lagrange");
  EXPECT_EQ(figure.curves[1].label, "odca");
  EXPECT_EQ(figure.curves[1].x, (std::vector<double>{1e-10, 1e-8, 1e-6}));
  EXPECT_EQ(figure.curves[1].y, (std::vector<double>{1e-8, 1e-6, 1e-4}));
  EXPECT_TRUE(figure.curves[1].line);
  EXPECT_NE(figure.curves[0].style.color, figure.curves[1].style.color);
}

TEST(FreeFigure, AxesAreLogarithmicWhenTheySpanTwoDecadesOrWhenAsked) {
  const std::vector<Record> near = {RunOf("odca", 1e-6, 1.0), RunOf("odca", 2e-6, 99.0)};
  const std::vector<Record> signs = {RunOf("odca", 1e-6, -1.0), RunOf("odca", 2e-6, 1e6)};
  const auto scales = [](const std::vector<Record>& runs, const std::string& log) {
    const Figure figure = FigureOf(runs, DriftOverTolerance(log));
    return std::pair(figure.log_x, figure.log_y);
  };
  EXPECT_EQ(scales(Runs(), ""), std::pair(true, true));
  EXPECT_FALSE(scales(near, "").second);
  EXPECT_FALSE(scales(signs, "").second);
  EXPECT_FALSE(scales(Runs(), "y").first);
  EXPECT_TRUE(scales(near, "y").second);
  EXPECT_FALSE(scales(Runs(), "none").second);
  ExpectPart(Refusal({RunOf("odca", 1e-6, -1.0)}, DriftOverTolerance("y")),
             "--log y: no value of drift_position_max is positive");
}

/// Drift of exactly zero: no line leads over it, and a curve without points is not in the legend.
TEST(FreeFigure, PointsThatALogarithmicAxisCannotShowAreGapsAndCounted) {
  std::vector<Record> runs = Runs();
  runs[2].Set("drift_position_max", 0.0);  // odca between two others
  runs.push_back(RunOf("reduction", 1e-6, 0.0));
  const FreeFigureResult result = MakeFreeFigure(runs, DriftOverTolerance("xy"));
  ASSERT_EQ(result.figure.curves.size(), 3u);  // lagrange, odca below and above
  EXPECT_EQ(result.figure.curves[1].label, "odca");
  EXPECT_EQ(result.figure.curves[1].x, std::vector<double>{1e-10});
  EXPECT_EQ(result.figure.curves[2].label, "");
  EXPECT_EQ(result.figure.curves[2].x, std::vector<double>{1e-6});
  EXPECT_EQ(result.remarks,
            std::vector<std::string>{"2 of 6 runs cannot be drawn on logarithmic axes: rtol or "
                                     "drift_position_max is not positive"});
}

TEST(FreeFigure, FailedRunsAreCrossesWithOrWithoutAValue) {
  std::vector<Record> runs = Runs();
  runs[1].Set("outcome", "singular");  // with a drift
  runs.push_back(Changed(RunOf("odca", 1e-12, 0.0), "outcome", "inconsistent-start",
                         "drift_position_max", Value()));
  const FreeFigureResult result = MakeFreeFigure(runs, DriftOverTolerance());
  const Curve& odca = result.figure.curves[1];
  EXPECT_EQ(odca.x, (std::vector<double>{1e-8, 1e-6}));
  ASSERT_EQ(odca.crosses.size(), 2u);
  EXPECT_EQ(odca.crosses[0].first, 1e-12);
  EXPECT_TRUE(std::isnan(odca.crosses[0].second));
  EXPECT_EQ(odca.crosses[1], (std::pair{1e-10, 1e-8}));
  EXPECT_EQ(result.remarks,
            std::vector<std::string>{"2 of 6 runs failed and are drawn as crosses"});
  const std::string script = GnuplotScript(result.figure).script;
  ExpectPart(script, "at first 1e-12, graph 0.03 point pt 2");
  ExpectPart(script, "at first 1e-10, first 1e-08 point pt 2");
  ExpectPart(script, "failed run");
}

TEST(FreeFigure, FlaggedRunsAreHollowAndCounted) {
  std::vector<Record> runs = Runs();
  runs[1].Set("warnings", "energy");
  for (Record& run : runs) {
    if (run.Find("warnings") == nullptr) run.Set("warnings", std::string());
  }
  const FreeFigureResult values = MakeFreeFigure(runs, DriftOverTolerance());
  EXPECT_TRUE(values.figure.curves[0].hollow.empty());  // lagrange
  EXPECT_EQ(values.figure.curves[1].hollow,
            (std::vector<std::pair<double, double>>{{1e-10, 1e-8}}));
  ExpectPart(GnuplotScript(values.figure).script, "$c1h with points pt");
  ASSERT_EQ(values.remarks.size(), 1u);
  EXPECT_EQ(values.remarks[0].find("1 of 5 runs finished with warnings"), 0u) << values.remarks[0];
  const FreeFigureResult series = MakeFreeFigure(
      runs, {.x = "series.drift_t", .y = "series.drift", .group = "rtol", .log = ""});
  EXPECT_EQ(std::ranges::count_if(series.figure.curves,
                                  [](const Curve& curve) { return curve.style.flagged; }),
            1);
}

std::vector<std::string> LabelsDrawn(const Figure& figure) {
  std::vector<std::string> labels;
  for (const Curve& curve : MergedCurves(figure, FigureSize::kTwoColumn)) {
    if (!curve.label.empty()) labels.push_back(curve.label);
  }
  return labels;
}

TEST(FreeFigure, CurvesThatCoincideAreOneBlackCurveWithBothNames) {
  std::vector<Record> runs;
  for (const char* formulation : {"odca", "lagrange", "reduction"}) {
    for (const double rtol : {1e-6, 1e-8, 1e-10}) {
      const double apart = formulation[0] == 'r' ? 10.0 : 1.0;
      runs.push_back(RunOf(formulation, rtol, apart * 100.0 * rtol));
    }
  }
  const std::vector<std::string> names = {"lagrange = odca", "reduction"};
  const Figure joined = FigureOf(runs);
  EXPECT_EQ(LabelsDrawn(joined), names);
  EXPECT_EQ(MergedCurves(joined, FigureSize::kTwoColumn)[0].style.color, "#000000");
  ExpectPart(GnuplotScript(joined).script, "\"lagrange = odca\"");
  // flagged runs keep their hollow marks, failed ones their crosses, in the colour of each
  runs[0].Set("warnings", "energy");
  runs[4].Set("warnings", "energy");
  for (const std::size_t failed : {2u, 5u}) {
    runs[failed].Set("outcome", "singular");
    runs[failed].Set("drift_position_max", Value());
  }
  const Figure marked = FigureOf(runs);
  EXPECT_EQ(LabelsDrawn(marked), names);
  const std::vector<Curve> drawn = MergedCurves(marked, FigureSize::kTwoColumn);
  EXPECT_EQ(drawn[0].hollow.size(), 2u);
  EXPECT_TRUE(drawn[0].crosses.empty());
  std::vector<std::string> colors;
  for (const Curve& curve : drawn) {
    if (!curve.crosses.empty()) colors.push_back(curve.style.color);
  }
  EXPECT_EQ(colors,
            (std::vector<std::string>{marked.curves[0].style.color, marked.curves[1].style.color}));
  // clouds of points too
  for (const std::size_t again : {1u, 4u}) runs.push_back(runs[again]);
  const Figure cloud = FigureOf(runs);
  ASSERT_FALSE(cloud.curves[0].line);
  EXPECT_EQ(LabelsDrawn(cloud), names);
  runs.back().Set("drift_position_max", 1e-4);
  EXPECT_EQ(LabelsDrawn(FigureOf(runs)).size(), 3u);
}

TEST(FreeFigure, LabelsReplaceTextsOfAxesAndCurvesAndATitleTheTitle) {
  FreeFigure wanted = DriftOverTolerance();
  const double titled = GnuplotScript(FigureOf(Runs())).page.height;
  wanted.title = "";
  wanted.labels = {"rtol=relative tolerance", "odca=O-DCA", "drift_position_max="};
  const Figure figure = FigureOf(Runs(), wanted);
  EXPECT_EQ(figure.title, "");
  EXPECT_LT(GnuplotScript(figure).page.height, titled) << "nor does it take a line";
  EXPECT_EQ(figure.x_label, "relative tolerance");
  EXPECT_EQ(figure.y_label, "");
  EXPECT_EQ(figure.curves[0].label, "lagrange");
  EXPECT_EQ(figure.curves[1].label, "O-DCA");
  for (const char* wrong : {"rtol", "newton=N", "=N"}) {
    wanted.labels = {wrong};
    EXPECT_EQ(Refusal(Runs(), wanted),
              std::string("--label ") + wrong +
                  ": expected NAME=TEXT, where NAME is rtol, drift_position_max or the label of a "
                  "curve");
  }
}

TEST(FreeFigure, PointsThatShareAnXAreNotJoinedAndTheRemarkSaysWhatIsMixed) {
  FreeFigure wanted = DriftOverTolerance();
  wanted.group = "";
  const FreeFigureResult result = MakeFreeFigure(Runs(), wanted);
  ASSERT_EQ(result.figure.curves.size(), 1u);
  EXPECT_FALSE(result.figure.curves[0].line);
  EXPECT_EQ(result.figure.curves[0].label, "");
  ASSERT_EQ(result.remarks.size(), 1u);
  ExpectPart(result.remarks[0], "curves mix values of formulation;");
}

// Levels differ by the dashes of their lines.
TEST(FreeFigure, CloudsOfPointsDifferByColourAndMark) {
  std::vector<Record> runs;
  for (const char* level : {"acceleration", "velocity", "projection"}) {
    for (const double drift : {1.0, 2.0}) {
      runs.push_back(Changed(RunOf("odca", 1e-6, drift), "enforcement", level));
    }
  }
  runs.push_back(Changed(RunOf("odca", 1e-8, 1.0), "drift_position_max", Value()));
  FreeFigure wanted = DriftOverTolerance();
  wanted.group = "enforcement";
  const FreeFigureResult result = MakeFreeFigure(runs, wanted);
  std::set<std::pair<std::string, Shape>> styles;
  for (const Curve& curve : result.figure.curves) {
    EXPECT_FALSE(curve.line);
    styles.emplace(curve.style.color, curve.style.shape);
  }
  EXPECT_EQ(styles.size(), 3u);
  EXPECT_EQ(result.remarks.back(),
            "1 of 7 runs are not drawn: no value of rtol or drift_position_max");
}

TEST(FreeFigure, TextsOnTheHorizontalAxisAreNamedTicks) {
  FreeFigure wanted = DriftOverTolerance();
  wanted.x = "formulation";
  wanted.group = "rtol";
  const Figure figure = FigureOf(Runs(), wanted);
  EXPECT_EQ(figure.x_ticks, (std::vector<std::string>{"lagrange", "odca"}));
  ASSERT_EQ(figure.curves.size(), 3u);
  EXPECT_EQ(figure.curves[0].label, "10⁻¹⁰");
  EXPECT_EQ(figure.curves[0].x, (std::vector<double>{2}));
  EXPECT_FALSE(figure.log_x);
  ExpectPart(GnuplotScript(figure).script, "(\"lagrange\" 1, \"odca\" 2)");
}

TEST(FreeFigure, TwoSeriesGiveACurvePerRecordAndALabelPerGroup) {
  FreeFigure wanted = DriftOverTolerance();
  wanted.x = "series.drift_t";
  wanted.y = "series.drift";
  const Figure figure = FigureOf(Runs(), wanted);
  EXPECT_EQ(figure.x_label, "time [s]");
  ASSERT_EQ(figure.curves.size(), 5u);
  EXPECT_EQ(figure.curves[0].label, "lagrange");
  EXPECT_EQ(figure.curves[1].label, "");
  EXPECT_TRUE(figure.log_y);  // the drift of zero at the start does not count
  EXPECT_EQ(figure.curves[2].y.size(), 3u);
}

TEST(FreeFigure, MistakesAreNamed) {
  const std::pair<const char*, const char*> rows[] = {
      {"drift_position_mx",
       "--y: found \"drift_position_mx\", which no record has (did you mean "
       "\"drift_position_max\"?)"},
      {"outcome", "--y outcome: found \"finished\", expected numbers"},
      {"series.drift", "expected two series or two values"},
      {"correction_max", "no record has values of both rtol and correction_max"}};
  for (const auto& [y, refusal] : rows) {
    FreeFigure wanted = DriftOverTolerance();
    wanted.y = y;
    ExpectPart(Refusal(Runs(), wanted), refusal);
  }
}

TEST(FreeFigure, ValuesThatDifferByRoundOffOrNotAtAllCanBeDrawn) {
  const TemporaryFolder folder("loopbench-flat-figure");
  for (const double difference : {0.0, 1e-15, 1e-9}) {
    for (const double level : {0.0, 1.0, -5e-8}) {
      const std::vector<Record> runs = {
          RunOf("odca", 1e-6, level),
          RunOf("odca", 1e-6 * (1 + difference), level * (1 + difference))};
      const Figure figure = FigureOf(runs);
      EXPECT_EQ(WriteFigure(folder.path() / "flat.svg", figure), std::nullopt)
          << difference << " at " << level;
    }
  }
}

TEST(FreeFigure, SvgHasTheSameBytesEachTimeAndPdfIsOne) {
  const TemporaryFolder temporary("loopbench-free-figure");
  const std::filesystem::path folder = temporary.path();
  std::vector<Record> runs = Runs();
  runs[1].Set("outcome", "singular");
  const Figure figure = FigureOf(runs);
  EXPECT_EQ(WriteFigure(folder / "a.svg", figure), std::nullopt);
  EXPECT_EQ(WriteFigure(folder / "b.svg", figure), std::nullopt);
  const std::string svg = ReadFile(folder / "a.svg");
  EXPECT_EQ(svg, ReadFile(folder / "b.svg"));
  for (const char* part : {"drift, position [m]", "curves by formulation", "failed run"}) {
    ExpectPart(svg, part);
  }
  EXPECT_EQ(WriteFigure(folder / "a.pdf", figure), std::nullopt);
  EXPECT_TRUE(ReadFile(folder / "a.pdf").starts_with("%PDF-"));
}

}  // namespace loopbench::harness::free_figure_test
