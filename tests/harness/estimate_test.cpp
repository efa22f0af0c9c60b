// What pilots over a part of the horizon say of the whole.
#include "harness/base/record.h"
#include "harness/config/experiment_reader.h"
#include "harness/suite/suite.h"
#include "tests/standard.h"

namespace loopbench::harness::estimate_test {

TEST(Estimate, ARateGoesOnWithItsSlopeToWhereRunsEnd) {
  const Rate rate = {.running_s = 1.0, .reached = 0.1, .slope_s = 5.0};
  EXPECT_DOUBLE_EQ(rate.Running(0.05), 0.5);
  EXPECT_DOUBLE_EQ(rate.Running(0.1), 1.0);
  EXPECT_DOUBLE_EQ(rate.Running(1.0), 1.0 + 0.9 * 5.0);
  Rate failed = rate;
  failed.ends_at = 0.1;
  EXPECT_DOUBLE_EQ(failed.Running(1.0), 1.0);
  Rate limited = rate;
  limited.most_s = 2.0;
  EXPECT_DOUBLE_EQ(limited.Running(1.0), 2.0);
}

/// Pilots write rows where an experiment asks for them, and go without where they cannot.
TEST(Estimate, NeedsNoPlaceForRows) {
  const std::vector<Experiment> experiments = {
      ReadExperiment(LOOPBENCH_SOURCE_DIR "/configs/experiments/examples/trajectories.json")};
  const std::vector<Case> cases = SelectCases(experiments[0], {});
  const char* before = std::getenv("TMPDIR");
  const std::string kept = before != nullptr ? before : "";
  ::setenv("TMPDIR", "/nowhere", 1);
  Estimate estimate(experiments, {});
  const double seconds = estimate.OfCase(0, cases[0]);
  before != nullptr ? ::setenv("TMPDIR", kept.c_str(), 1) : ::unsetenv("TMPDIR");
  EXPECT_GT(seconds, 0.0);
  EXPECT_TRUE(estimate.cut_off().empty());
}

/// A pilot for each column, at the one tolerance that the filter leaves; timings need no more.
TEST(Estimate, PilotsAreOfWhatIsAskedForAndServeTimings) {
  const std::vector<Experiment> experiments = {
      ReadExperiment(LOOPBENCH_SOURCE_DIR "/configs/experiments/examples/report.json")};
  const Selection filter = {ParseCondition("rtol=1e-8"), ParseCondition("mechanism=four-bar"),
                            ParseCondition("formulation=odca")};
  Estimate estimate(experiments, {}, filter);
  const std::vector<Case> cases = SelectCases(experiments[0], filter);
  ASSERT_EQ(cases.size(), 6u);
  double seconds = 0.0;
  for (const Case& one : cases) seconds += estimate.OfCase(0, one);
  EXPECT_EQ(estimate.pilots(), cases.size());
  const std::vector<TimingGroup> groups = TimingGroups(experiments[0], filter);
  ASSERT_EQ(groups.size(), 1u);
  EXPECT_EQ(groups[0].cases.size(), cases.size());
  EXPECT_GT(estimate.OfTiming(0, groups[0]), 0.0);
  EXPECT_EQ(estimate.pilots(), cases.size());
  EXPECT_GT(seconds, 0.0);
}

#ifdef LOOPBENCH_PRECISIONS
/// The parallelogram passes positions in line, where long double is not enough.
TEST(Estimate, AReferenceThatTakesAWiderScalarHasAPilotOfThatToo) {
  const std::vector<Experiment> experiments = {
      ReadExperiment(LOOPBENCH_SOURCE_DIR "/configs/experiments/examples/report.json")};
  for (const auto& [mechanism, pilots] : {std::pair("four-bar", 1u), {"parallelogram", 2u}}) {
    const std::vector<Case> cases = SelectCases(experiments[0], {});
    const auto one = std::ranges::find_if(cases, [&](const Case& any) {
      return experiments[0].problems[any.problem].name == mechanism;
    });
    ASSERT_NE(one, cases.end());
    Estimate estimate(experiments, {});
    EXPECT_GT(estimate.OfReference(0, ReferenceOf(experiments[0], *one, "results.jsonl")), 0.0);
    EXPECT_EQ(estimate.pilots(), pilots) << mechanism;
  }
}
#endif

}  // namespace loopbench::harness::estimate_test
