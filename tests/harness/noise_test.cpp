// When the machine counts as noisy: planted numbers on either side of each threshold.
#include "harness/base/record.h"
#include "harness/config/experiment_reader.h"
#include "harness/run/timing.h"
#include "tests/standard.h"

namespace loopbench::harness::noise_test {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

MachineState Quiet() { return {.load1 = 1.0, .processors = 2, .governor = "performance"}; }

TEST(Noise, AQuietMachineHasNoReason) {
  EXPECT_EQ(NoiseReasons(Quiet(), 0.019, 0.0), "");
  EXPECT_EQ(NoiseReasons({.load1 = 2.0, .processors = 2, .governor = ""}, 0.0, 0.019), "");
}

TEST(Noise, EachSignAloneIsAReasonWithItsNumber) {
  EXPECT_EQ(NoiseReasons(Quiet(), 0.051, 0.0),
            "A/A spread 5.1 % of right-hand sides (quiet: up to 2 %)");
  EXPECT_EQ(NoiseReasons(Quiet(), 0.0, 0.3),
            "A/A spread 30.0 % of whole simulations (quiet: up to 2 %)");
  MachineState loaded = Quiet();
  loaded.load1 = 2.1;
  EXPECT_EQ(NoiseReasons(loaded, 0.0, 0.0), "load 2.1 on 2 processors");
  loaded.processors = 4;  // a processor is free
  EXPECT_EQ(NoiseReasons(loaded, 0.0, 0.0), "");
  MachineState saving = Quiet();
  saving.governor = "powersave";
  EXPECT_EQ(NoiseReasons(saving, 0.0, 0.0), "CPU governor powersave");
}

TEST(Noise, ReasonsAddUp) {
  const MachineState bad{.load1 = 3.0, .processors = 1, .governor = "ondemand"};
  EXPECT_EQ(NoiseReasons(bad, 0.025, kNaN),
            "A/A spread 2.5 % of right-hand sides (quiet: up to 2 %); load 3.0 on 1 processor; CPU "
            "governor ondemand");
}

TEST(Noise, WhatWasNotMeasuredIsNoReason) {
  EXPECT_EQ(NoiseReasons({.load1 = kNaN, .processors = 2, .governor = ""}, kNaN, kNaN), "");
}

TEST(Noise, ThresholdsAreThoseAsked) {
  EXPECT_EQ(NoiseReasons(Quiet(), 0.051, 0.0, {.aa_spread = 0.06}), "");
  EXPECT_NE(NoiseReasons(Quiet(), 0.0, 0.0, {.load_per_processor = 0.25}), "");
}

TEST(Noise, AaSpreadIsTheRelativeDifferenceOfMedians) {
  // an outlier in one sample does not move its median
  EXPECT_DOUBLE_EQ(AaSpread({100, 90, 110}, {105, 95, 1000}), 0.05);
  EXPECT_DOUBLE_EQ(AaSpread({105, 95, 1000}, {100, 90, 110}), 0.05);
  EXPECT_EQ(AaSpread({3, 1, 2}, {1, 2, 3}), 0.0);
  EXPECT_TRUE(std::isnan(AaSpread({}, {1, 2, 3})));
}

TEST(Noise, QuantilesAreMembersOfTheSample) {
  const std::vector<double> sample = {5, 1, 4, 2, 3};
  EXPECT_EQ(Quantile(sample, 0.0), 1);
  EXPECT_EQ(Quantile(sample, 0.5), 3);
  EXPECT_EQ(Quantile(sample, 0.9), 5);  // rank 3.6, the nearest
  EXPECT_EQ(Quantile(sample, 0.1), 1);
  EXPECT_EQ(Quantile(sample, 1.0), 5);
  EXPECT_TRUE(std::isnan(Quantile({}, 0.5)));
}

TEST(Noise, QuietRoundsAreTheFirstUndisturbedAndThenTheLeastDisturbed) {
  using Rounds = std::vector<std::size_t>;
  EXPECT_EQ(QuietRounds({100, 150, 101, 100.5, 102}, 100.0, 3), (Rounds{0, 2, 3}));
  EXPECT_EQ(QuietRounds({150, 102, 180, 140, 100}, 100.0, 3), (Rounds{1, 3, 4}));
  EXPECT_EQ(QuietRounds({150, 140, 160}, 100.0, 3), (Rounds{0, 1, 2})) << "there are no others";
  EXPECT_EQ(QuietRounds({150, 140}, 100.0, 3), (Rounds{0, 1}));
}

TEST(Noise, TheCalibrationKnowsItsLeast) {
  const double one = CalibrationNs();
  EXPECT_LE(CalibrationBaselineNs(), one);
  const double known = CalibrationBaselineNs();
  for (int i = 0; i < 10; ++i) {
    const double again = CalibrationNs();
    EXPECT_GE(again, CalibrationBaselineNs());
  }
  EXPECT_LE(CalibrationBaselineNs(), known);
}

TEST(Noise, TheMachineHasProcessorsAndALoad) {
  const MachineState machine = ReadMachineState();
  EXPECT_GE(machine.processors, 1);
  EXPECT_GE(machine.load1, 0.0);
}

// No time is asserted, only what must hold on the slowest machine: order statistics are in order,
// the A/A pair was measured, and its second half is no row of its own.
TEST(TimeTogether, RecordsHoldOrderedStatisticsAndTheAaPair) {
  Experiment experiment =
      ReadExperiment(std::string(LOOPBENCH_SOURCE_DIR) + "/configs/experiments/paper/paper.json");
  experiment.problems.resize(1);
  experiment.timing.horizon = 0.1;
  experiment.timing.repeats = 3;
  experiment.timing.families.clear();
  const std::vector<TimingGroup> groups = TimingGroups(experiment);
  ASSERT_EQ(groups.size(), 1u);
  const std::vector<Record> records = TimeTogether(experiment, groups[0]);
  EXPECT_EQ(records.size(), CountTimings(experiment));
  for (const Record& record : records) {
    ASSERT_EQ(record.Text("outcome"), "finished") << record.Text("message");
    for (const std::string of : {"rhs_ns", "wall_s"}) {
      EXPECT_GT(record.Number(of + "_min"), 0.0);
      EXPECT_LE(record.Number(of + "_min"), record.Number(of + "_p10"));
      EXPECT_LE(record.Number(of + "_p10"), record.Number(of + "_median"));
      EXPECT_LE(record.Number(of + "_median"), record.Number(of + "_p90"));
    }
    EXPECT_GE(record.Number("aa_spread"), 0.0);
    EXPECT_GE(record.Number("aa_spread_wall"), 0.0);
    EXPECT_EQ(record.Number("aa_spread"), records[0].Number("aa_spread"));
    EXPECT_GE(record.Number("load1"), 0.0);
    for (const char* calibration : {"calibration_ns", "calibration_wall_ns"}) {
      EXPECT_GT(record.Number(calibration), 1e3);  // 16000 sums of numbers cannot be had in less
      EXPECT_EQ(record.Number(calibration), records[0].Number(calibration));
    }
    EXPECT_EQ(record.Number("repeats"), 3);
    EXPECT_GE(record.Number("discarded_repetitions"), 0.0);
    const MachineState machine{.load1 = record.Number("load1"),
                               .processors = static_cast<int>(record.Number("processors")),
                               .governor = record.Text("governor")};
    EXPECT_EQ(record.Text("noise"),
              NoiseReasons(machine, record.Number("aa_spread"), record.Number("aa_spread_wall")));
  }
}

}  // namespace loopbench::harness::noise_test
