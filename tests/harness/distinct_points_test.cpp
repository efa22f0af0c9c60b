// Choice of the records that differ in a picture with fewer points than records.
#include "harness/figures/figures.h"
#include "tests/harness/records.h"

namespace loopbench::harness::distinct_points_test {

constexpr std::size_t kMost = 1000;

Record Point(double x, double y, const std::string& formulation = "odca") {
  return RecordOf("kind", "accuracy", "formulation", formulation, "outcome", "finished", "steps", x,
                  "energy_error_max", y, "drift_position_max", 1.0,  // nobody asks for it
                  "mass", 2.0);
}

FreeFigure Wanted() {
  return {.x = "steps", .y = "energy_error_max", .group = "formulation", .log = ""};
}

TEST(DistinctPoints, AreAllOfFewCutDownToWhatIsDrawn) {
  DistinctPoints points(Wanted(), kMost);
  for (std::size_t i = 0; i < kMost; ++i) points.Add(Point(1.0, 1.0));
  EXPECT_EQ(points.records().size(), kMost) << "equal ones too, as of a store that is held";
  EXPECT_EQ(points.cell(), 0.0);
  EXPECT_EQ(points.records()[0].Find("drift_position_max"), nullptr);
  EXPECT_EQ(points.records()[0].Number("mass"), 2.0) << "a parameter";
}

/// A line over a small part of its values, and one over ten decades. Each point has a kept point
/// within two cells, linear and logarithmic.
TEST(DistinctPoints, StandForAllOthersOnEitherAxis) {
  for (const bool decades : {false, true}) {
    const auto y_of = [decades](double x) {
      return decades ? std::pow(10.0, -10.0 * x) : 9.81 + 1e-6 * x;
    };
    DistinctPoints points(Wanted(), kMost);
    constexpr int kAll = 20'000;
    for (int i = 0; i <= kAll; ++i) points.Add(Point(1.0 * i / kAll, y_of(1.0 * i / kAll)));
    EXPECT_EQ(points.seen(), kAll + 1u);
    EXPECT_LE(points.records().size(), kMost);
    EXPECT_GE(points.records().size(), kMost / 10);
    double furthest = 0.0, before = 0.0;
    for (const Record& one : points.records()) {
      furthest = std::max(furthest, one.Number("steps") - before);
      before = one.Number("steps");
    }
    EXPECT_LE(std::max(furthest, 1.0 - before), 2.0 * points.cell()) << decades;
  }
}

TEST(DistinctPoints, LoseNoCurveNoFailureAndNoWarning) {
  DistinctPoints points(Wanted(), kMost);
  for (int i = 0; i < 5000; ++i) points.Add(Point(i, i));
  const Record failed = Changed(Point(2500.0, 2500.0), "outcome", "step-limit"),
               flagged = Changed(Point(2500.0, 2500.0), "warnings", "energy");
  for (int times = 0; times < 3; ++times) {
    for (const Record& one : {failed, flagged, Point(2500.0, 2500.0, "lagrange")}) points.Add(one);
  }
  const auto count = [&points](const char* key, const std::string& text) {
    return std::ranges::count_if(points.records(),
                                 [&](const Record& one) { return one.Text(key) == text; });
  };
  EXPECT_EQ(count("outcome", "step-limit"), 1);
  EXPECT_EQ(count("warnings", "energy"), 1);
  EXPECT_EQ(count("formulation", "lagrange"), 1);
}

TEST(DistinctPoints, RefuseWhatCannotBeThinned) {
  DistinctPoints points(Wanted(), 10);
  Record series = Changed(Point(1.0, 1.0), "energy_error_max", std::vector<double>{1.0, 2.0});
  EXPECT_THROW(points.Add(series), ConfigError);
  const auto add_curves = [&points] {
    for (int i = 0; i < 12; ++i) points.Add(Point(1.0, 1.0, "method " + std::to_string(i)));
  };
  EXPECT_THROW(add_curves(), ConfigError);
}

}  // namespace loopbench::harness::distinct_points_test
