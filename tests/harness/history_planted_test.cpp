// Steps planted in 200 commits, on machines as they are.
#include "harness/judge/judge.h"
#include "tests/harness/history_of.h"

namespace loopbench::harness::history_test {

constexpr std::size_t kCommits = 200, kCases = 8;
using ByCase = std::vector<std::vector<double>>;  ///< [case][commit]
/// Effects of a machine on equal times.
struct Machine {
  ByCase noise;         ///< of their logarithms
  ByCase calibrations;  ///< [ns]; none if the speed of the machine is unknown
};

/// Reads the noise of a machine with shared cores, relative to the medians. Each record has the
/// times of a right-hand side and of a simulation, then their calibrations.
Machine SharedMachine(const char* noise = "timing-noise.csv") {
  std::ifstream file(fs::path(LOOPBENCH_SOURCE_DIR) / "tests/harness" / noise);
  Machine machine{ByCase(kCases), ByCase(kCases)};
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream cells(line);
    std::string cell;
    for (std::size_t record = 0; record < kCases / 2; ++record) {
      for (ByCase* columns : {&machine.noise, &machine.calibrations}) {
        for (const std::size_t one : {2 * record, 2 * record + 1}) {
          std::getline(cells, cell, ',');
          (*columns)[one].push_back(std::stod(cell));
        }
      }
    }
  }
  for (std::vector<double>& column : machine.noise) {
    const double middle = Median(column);
    for (double& value : column) value = std::log(value / middle);
  }
  return machine;
}

/// One percent, as two runs of one program on a machine of one's own differ (the A/A spread that
/// timings call quiet is 2 %), and a run in twenty that something disturbed.
Machine QuietMachine() {
  std::mt19937_64 random(17);
  std::normal_distribution<double> normal(0.0, 0.01);
  Machine machine{ByCase(kCases, std::vector<double>(kCommits)), {}};
  for (std::vector<double>& column : machine.noise) {
    for (double& value : column) value = normal(random) + (random() % 20 == 0 ? 0.15 : 0.0);
  }
  return machine;
}

/// A step planted in a case, and whether it was found within five commits of its place: it is three
/// standard deviations high, so that the noise decides on a commit or two.
struct Planted {
  std::string one, measure;
  double ratio = 1.0;
  int at = 0;
  bool found = false;
};

/// Five steps of 3 % in times and in instructions, five of a factor of 1.5 in drift.
std::vector<Planted> PlantedSteps() {
  std::vector<Planted> planted;
  for (int k = 0; k < 5; ++k) {
    const std::string one = "case" + std::to_string(k);
    planted.push_back({one, "wall_s", 1.03, 31 + 33 * k});
    planted.push_back({one, "instructions", 1.03, 31 + 33 * k});
    planted.push_back({"case" + std::to_string((k + 3) % static_cast<int>(kCases)),
                       "drift_position_max", 1.5, 22 + 37 * k});
  }
  return planted;
}

class PlantedHistory : public HistoryOf {
 protected:
  /// Adds 200 commits of eight cases with the planted steps; what is found is told to `planted_`.
  void Follow(const Machine& machine) {
    for (std::size_t commit = 0; commit < kCommits; ++commit) {
      std::vector<Record> records;
      for (std::size_t k = 0; k < kCases; ++k) {
        const std::string one = "case" + std::to_string(k);
        const auto at = [&](const char* measure) { return Level(one, measure, commit); };
        const double size = static_cast<double>(k + 1);
        const double time = 1e-3 * size * at("wall_s") * std::exp(machine.noise[k][commit]);
        records.push_back(Measured(one, 1e-7 * at("drift_position_max"),
                                   static_cast<std::int64_t>(1000 + k),
                                   {time, 1.1 * time, 1.5 * time}));
        records.back().Set("instructions", std::round(1e6 * size * at("instructions")));
        if (machine.calibrations.empty()) continue;
        records.back().Set("calibration_wall_ns", machine.calibrations[k][commit]);
      }
      Add(static_cast<int>(commit), records);
    }
    for (const HistorySeries& series : FindingsOf(ReadHistory(folder_)).series) {
      for (const LevelChange& change : series.changes) Judge(series, change);
    }
    std::printf("found: drift %d, instructions %d, times %d of 5; %zu false alarms\n",
                Found("drift_position_max"), Found("instructions"), Found("wall_s"),
                false_alarms_.size());
  }
  int Found(const std::string& measure) const {
    return static_cast<int>(std::ranges::count_if(planted_, [&measure](const Planted& step) {
      return step.found && step.measure == measure;
    }));
  }

  std::vector<Planted> planted_ = PlantedSteps();
  std::vector<std::string> false_alarms_;

 private:
  double Level(const std::string& one, const std::string& measure, std::size_t commit) const {
    double level = 1.0;
    for (const Planted& step : planted_) {
      if (step.one == one && step.measure == measure && static_cast<int>(commit) >= step.at)
        level *= step.ratio;
    }
    return level;
  }
  void Judge(const HistorySeries& series, const LevelChange& change) {
    const int at = static_cast<int>(series.values[change.at].entry);
    const auto step = std::ranges::find_if(planted_, [&](const Planted& one) {
      return series.one.ends_with(one.one) && one.measure == series.measure &&
             std::abs(one.at - at) <= 5;
    });
    if (step == planted_.end()) {
      false_alarms_.push_back(series.one + " " + series.measure + " at " + std::to_string(at));
    } else {
      step->found = true;
      EXPECT_NEAR(change.after / change.before, step->ratio, 0.02);  // 3 standard errors of medians
    }
  }
};

/// In how many series a step of the times of all eight cases is found at its place, `after` commits
/// from the end. Expects no other step.
std::size_t FoundNearTheEnd(const fs::path& folder, std::size_t before, std::size_t after,
                            double ratio, unsigned seed) {
  fs::remove_all(folder);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0.0, 0.01);
  for (std::size_t commit = 0; commit < before + after; ++commit) {
    std::vector<Record> records;
    for (std::size_t k = 0; k < kCases; ++k) {
      const double time = 1e-3 * (commit < before ? 1.0 : ratio) * (1.0 + normal(random));
      records.push_back(Measured("case" + std::to_string(k), 1e-7, 1000, {time, 1.1 * time}));
    }
    AddToHistory(
        folder,
        {.commit = CommitName(static_cast<int>(commit)), .date = Date(static_cast<int>(commit))},
        records, false);
  }
  std::size_t found = 0;
  for (const HistorySeries& series : FindingsOf(ReadHistory(folder)).series) {
    for (const LevelChange& change : series.changes) found += change.at == before;
    EXPECT_LE(series.changes.size(), ratio == 1.0 ? 0u : 1u) << series.one;
  }
  return found;
}

/// Returns ratios of changes by case in 200 commits; the first `doubled` cases double at commit
/// 100.
std::map<std::string, std::vector<double>> ChangesIfDoubled(const fs::path& folder, int cases,
                                                            int doubled, double own, double common,
                                                            unsigned seed) {
  fs::remove_all(folder);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  for (int commit = 0; commit < 200; ++commit) {
    std::vector<Record> records;
    const double shared = common * normal(random);
    for (int k = 0; k < cases; ++k) {
      const double level = 1e-3 * (k < doubled && commit >= 100 ? 2.0 : 1.0);
      const double time = level * std::exp(shared + own * normal(random));
      records.push_back(Measured("case" + std::to_string(k), 1e-7, 1000, {time, 1.1 * time}));
    }
    AddToHistory(folder, {.commit = CommitName(commit), .date = Date(commit)}, records, false);
  }
  std::map<std::string, std::vector<double>> found;
  for (const HistorySeries& series : FindingsOf(ReadHistory(folder)).series) {
    for (const LevelChange& change : series.changes) {
      found[series.one].push_back(change.after / change.before);
      EXPECT_NEAR(static_cast<double>(change.at), 100.0, 1.0) << series.one;
    }
  }
  return found;
}

// Common variation is subtracted; changes of level are not, even if most cases have them.
TEST_F(PlantedHistory, EachCaseHasItsOwnChanges) {
  for (const int doubled : {2, 3, 4}) {
    for (unsigned seed = 0; seed < 3; ++seed) {
      auto found = ChangesIfDoubled(folder_, 5, doubled, 0.005, 0.02, seed);
      found.erase(kAllCases);
      EXPECT_EQ(found.size(), static_cast<std::size_t>(doubled));
      for (const auto& [one, ratios] : found) {
        EXPECT_LT(one.back(), '0' + doubled) << one;
        ASSERT_EQ(ratios.size(), 1u) << one;
        EXPECT_NEAR(ratios[0], 2.0, 0.02) << one;
      }
    }
  }
}

// The median of three is free of the change of one.
TEST_F(PlantedHistory, ThreeCasesShowTheirCommonVariation) {
  for (unsigned seed = 0; seed < 3; ++seed) {
    const auto found = ChangesIfDoubled(folder_, 3, 1, 0.005, 0.2, seed);
    ASSERT_EQ(found.size(), 1u) << seed;
    EXPECT_NEAR(found.begin()->second[0], 2.0, 0.02) << seed;  // with the common noise: 0.07 off
  }
}

TEST_F(PlantedHistory, OneCaseIsNotAllCases) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    const auto found = ChangesIfDoubled(folder_, 6, 1, 0.03, 0.0, seed);
    EXPECT_EQ(found.size(), 1u) << seed;
    EXPECT_FALSE(found.contains(kAllCases)) << seed;
  }
}

// People look at a history when something has just become slow, not twenty commits later.
TEST_F(PlantedHistory, StepsNearTheEndAreFound) {
  for (unsigned seed = 0; seed < 3; ++seed) {
    // nine series have the step: eight cases, and all of them together
    EXPECT_EQ(FoundNearTheEnd(folder_, 20, 5, 2.0, seed), 9u) << seed;
    EXPECT_EQ(FoundNearTheEnd(folder_, 20, 5, 0.5, seed), 9u) << seed;
    // in one short series of twenty the noise seems to last: 8 of 9 and more, 7 by chance
    EXPECT_GE(FoundNearTheEnd(folder_, 20, 8, 1.1, seed), 7u) << seed;
    EXPECT_GE(FoundNearTheEnd(folder_, 100, 8, 1.1, seed), 9u) << seed;
  }
}

TEST_F(PlantedHistory, TwoHundredQuietCommitsRaiseNoAlarm) {
  for (unsigned seed = 0; seed < 2; ++seed) FoundNearTheEnd(folder_, 200, 0, 1.0, seed);
}

TEST_F(PlantedHistory, StepsOfThreePercentAreFoundOnAQuietMachine) {
  Follow(QuietMachine());
  EXPECT_EQ(Found("drift_position_max"), 5);
  EXPECT_EQ(Found("instructions"), 5);
  EXPECT_GE(Found("wall_s"), 4);
  EXPECT_LE(false_alarms_.size(), 1u) << testing::PrintToString(false_alarms_);
}

TEST_F(PlantedHistory, StepsOfThreePercentAreFoundOnASharedMachine) {
  Follow(SharedMachine());
  EXPECT_EQ(Found("drift_position_max"), 5);
  EXPECT_EQ(Found("instructions"), 5);
  EXPECT_GE(Found("wall_s"), 4);
  EXPECT_LE(false_alarms_.size(), 1u) << testing::PrintToString(false_alarms_);
}

// Where half of the times say nothing, steps of 3 % are seldom sure: those that are not, are not
// made up.
TEST_F(PlantedHistory, NothingIsMadeUpOnAMachineThatOthersKeepBusy) {
  Follow(SharedMachine("timing-noise-busy.csv"));
  EXPECT_EQ(Found("drift_position_max"), 5);
  EXPECT_EQ(Found("instructions"), 5);
  EXPECT_LE(false_alarms_.size(), 1u) << testing::PrintToString(false_alarms_);
}

// Equal times without their calibration: the speed of the machine hides the planted step.
TEST_F(PlantedHistory, WithoutACalibrationASharedMachineHidesThem) {
  Machine machine = SharedMachine();
  machine.calibrations.clear();
  Follow(machine);
  EXPECT_EQ(Found("drift_position_max"), 5);
  EXPECT_EQ(Found("instructions"), 5);
  EXPECT_LE(false_alarms_.size(), 2u) << testing::PrintToString(false_alarms_);
}

}  // namespace loopbench::harness::history_test
