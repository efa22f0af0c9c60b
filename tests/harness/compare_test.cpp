// The gate: what is planted is caught, what is unchanged passes, what cannot be compared is said.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "harness/base/record.h"
#include "harness/base/store.h"
#include "harness/judge/judge.h"

namespace loopbench::harness {
namespace compare_test {

/// Times around `centre` with the spread of a quiet machine, 1 %.
std::vector<double> Times(double centre, unsigned seed, int count = 15) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(centre, 0.01 * centre);
  std::vector<double> times(count);
  for (double& time : times) time = normal(random);
  return times;
}

Record SoundRecord(const std::string& mechanism, unsigned seed) {
  Record record;
  record.Set("kind", std::string("accuracy"));
  record.Set("mechanism", mechanism);
  record.Set("rtol", 1e-8);
  record.Set("outcome", std::string("finished"));
  record.Set("steps", std::int64_t{1000});
  record.Set("rhs_operations", std::int64_t{617});
  record.Set("instructions", std::int64_t{100'000});
  record.Set("state_hash", std::string("00000000000000aa"));
  record.Set("drift_position_max", 2e-7);
  record.Set("energy_error_max", 3e-14);
  record.Set("series.rhs_ns", Times(500.0, seed));
  record.Set("machine", std::string("here"));
  record.Set("compiler", std::string("GNU 12"));
  record.Set("flags", std::string("-O2"));
  record.Set("libm", std::string("0123"));
  return record;
}

std::vector<Record> Sound(unsigned seed = 1) {
  return {SoundRecord("four-bar", seed), SoundRecord("toggle", seed + 100)};
}

/// Sound records whose first has one value changed.
std::vector<Record> With(const std::string& key, const Value& value) {
  std::vector<Record> records = Sound(2);
  records[0].Set(key, value);
  return records;
}

int Exit(const std::vector<Record>& base, const std::vector<Record>& fresh,
         const CompareOptions& options = {}) {
  return Compare(base, fresh, options).ExitCode(options);
}

/// The only finding with this judgement.
Finding Only(const ComparisonReport& report, Judgement judgement) {
  EXPECT_EQ(report.Count(judgement), 1);
  const auto at = std::ranges::find(report.findings, judgement, &Finding::judgement);
  return at == report.findings.end() ? Finding{} : *at;
}

void ExpectChange(const std::string& key, const Value& value, Judgement judgement) {
  const ComparisonReport report = Compare(Sound(), With(key, value), {});
  EXPECT_EQ(Only(report, judgement).measure.key, key);
  EXPECT_EQ(report.ExitCode({}), judgement == Judgement::kWorse ? 1 : 0) << key;
}

TEST(Compare, PassesAnUnchangedBuildTwentyTimes) {
  for (unsigned run = 0; run < 20; ++run) {
    const ComparisonReport report = Compare(Sound(1000 + run), Sound(2000 + run), {});
    EXPECT_EQ(report.Count(Judgement::kSame), static_cast<int>(report.findings.size())) << run;
    EXPECT_EQ(report.ExitCode({}), 0) << run;
  }
}

TEST(Compare, CatchesThreeTimesTheDrift) {
  ExpectChange("drift_position_max", 6e-7, Judgement::kWorse);
  ExpectChange("drift_position_max", 2e-7 * 1.051, Judgement::kWorse);
  ExpectChange("drift_position_max", 2e-7 / 3, Judgement::kBetter);
  EXPECT_EQ(Exit(Sound(), With("drift_position_max", 2e-7 * 1.049)), 0);
}

TEST(Compare, TakesRoundOffForEqual) {
  EXPECT_EQ(Exit(Sound(), With("energy_error_max", 9e-12)), 0);
  ExpectChange("energy_error_max", 2e-11, Judgement::kWorse);
}

TEST(Compare, CatchesFivePercentMoreInstructions) {
  ExpectChange("instructions", std::int64_t{105'000}, Judgement::kWorse);
  ExpectChange("instructions", std::int64_t{95'000}, Judgement::kBetter);
  EXPECT_EQ(Exit(Sound(), With("instructions", std::int64_t{101'900})), 0);
}

TEST(Compare, TakesCountsHashesAndOutcomesExactly) {
  ExpectChange("steps", std::int64_t{1001}, Judgement::kWorse);
  ExpectChange("steps", std::int64_t{999}, Judgement::kBetter);
  ExpectChange("rhs_operations", std::int64_t{618}, Judgement::kWorse);
  ExpectChange("state_hash", std::string("00000000000000ab"), Judgement::kWorse);
  ExpectChange("outcome", std::string("singular"), Judgement::kWorse);
}

TEST(Compare, CatchesNewWarningsAndFailedMembers) {
  const ComparisonReport report =
      Compare(Sound(), With("singularity_crossings", std::int64_t{3}), {});
  EXPECT_EQ(Only(report, Judgement::kWorse).measure.key, "warnings");
  EXPECT_EQ(Only(report, Judgement::kWorse).fresh, "singular-crossing");
  const ComparisonReport back =
      Compare(With("singularity_crossings", std::int64_t{3}), Sound(), {});
  EXPECT_EQ(Only(back, Judgement::kBetter).measure.key, "warnings");
  std::vector<Record> base = Sound(), fresh = Sound(2);
  for (std::vector<Record>* records : {&base, &fresh}) {
    records->front().Set("ensemble_failed", std::int64_t{0});
    records->front().Set("error_final", 1e-9);
  }
  EXPECT_EQ(Exit(base, fresh), 0);
  fresh.front().Set("error_final", 5.0);
  EXPECT_EQ(Only(Compare(base, fresh, {}), Judgement::kWorse).measure.key, "error_final");
}

TEST(Compare, EqualCasesAreEqualThoughOneStoreHasANamesake) {
  const auto with = [](const std::string& content, const std::string& case_id) {
    Record record;
    record.Set("kind", std::string("accuracy"));
    record.Set("mechanism", std::string("four-bar"));
    record.Set("case_id", case_id);
    record.Set("config_hash", content);
    record.Set("outcome", std::string("finished"));
    record.Set("drift_position_max", 1e-7);
    return record;
  };
  std::vector<Record> both = WithContents({with("a", "1"), with("b", "2")});
  std::vector<Record> one = WithContents({with("a", "1")});
  ShareContents(&both, &one);
  const ComparisonReport report = Compare(both, one, {});
  EXPECT_EQ(report.only_base.size(), 1u);
  EXPECT_TRUE(report.only_fresh.empty());
  EXPECT_GT(report.Count(Judgement::kSame), 0);
}

TEST(Compare, ReportsARunThatNoLongerFailsAsBetter) {
  const ComparisonReport report = Compare(With("outcome", std::string("singular")), Sound(), {});
  EXPECT_EQ(Only(report, Judgement::kBetter).measure.key, "outcome");
  EXPECT_EQ(report.ExitCode({}), 0);
}

TEST(Compare, CatchesAResultThatIsGone) {
  ExpectChange("drift_position_max", Value(), Judgement::kWorse);
  ExpectChange("drift_position_max", std::numeric_limits<double>::quiet_NaN(), Judgement::kWorse);
}

/// Every measure of these records, with values that none of them can have.
std::vector<std::pair<std::string, Value>> OddValues() {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  std::vector<std::pair<std::string, Value>> odd;
  for (const std::string key :
       {"steps", "rhs_operations", "instructions", "drift_position_max", "energy_error_max"}) {
    for (const Value& value : {Value(std::string("oops")), Value(std::vector<double>{1.0}),
                               Value(nan), Value(infinity), Value(-1.0), Value(true), Value()}) {
      odd.emplace_back(key, value);
    }
  }
  for (const Value& value : {Value(1.0), Value(std::vector<double>{1.0}), Value(), Value(true)}) {
    odd.emplace_back("outcome", value);
    odd.emplace_back("state_hash", value);
  }
  for (const Value& value :
       {Value(std::string("oops")), Value(1.0), Value(), Value(std::vector<double>{1.0, nan}),
        Value(std::vector<double>{1.0, infinity}), Value(std::vector<double>{1.0, -1.0})}) {
    odd.emplace_back("series.rhs_ns", value);
  }
  return odd;
}

TEST(Compare, CallsAValueThatIsNoneADifferenceOnEitherSide) {
  for (const auto& [key, value] : OddValues()) {
    SCOPED_TRACE(key + " " + Shown(With(key, value)[0], key));
    ComparisonReport report = Compare(Sound(), With(key, value), {});
    EXPECT_EQ(Only(report, Judgement::kWorse).measure.key, key);
    EXPECT_NE(Only(report, Judgement::kWorse).why.find("in NEW: expected"), std::string::npos);
    EXPECT_EQ(report.ExitCode({}), 1);
    report = Compare(With(key, value), Sound(), {});
    EXPECT_EQ(Only(report, Judgement::kDifferent).measure.key, key);
    EXPECT_NE(Only(report, Judgement::kDifferent).why.find("in BASE: expected"), std::string::npos);
    EXPECT_EQ(report.ExitCode({}), 1);
    // equal garbage is no equal result
    report = Compare(With(key, value), With(key, value), {});
    EXPECT_EQ(Only(report, Judgement::kDifferent).measure.key, key);
    EXPECT_EQ(report.ExitCode({}), 1);
  }
}

TEST(Compare, CallsAValueThatOneSideLacksADifference) {
  for (const char* key :
       {"steps", "instructions", "state_hash", "drift_position_max", "series.rhs_ns"}) {
    SCOPED_TRACE(key);
    std::vector<Record> lacking = Sound();
    Record rest;
    for (const auto& [name, value] : lacking[0].items()) {
      if (name != key) rest.Set(name, value);
    }
    lacking[0] = rest;
    ComparisonReport report = Compare(Sound(), lacking, {});
    EXPECT_EQ(Only(report, Judgement::kWorse).measure.key, key);
    EXPECT_EQ(Only(report, Judgement::kWorse).why, "not in NEW");
    report = Compare(lacking, Sound(), {});
    EXPECT_EQ(Only(report, Judgement::kDifferent).measure.key, key);
    EXPECT_EQ(Only(report, Judgement::kDifferent).why, "not in BASE");
    EXPECT_EQ(report.ExitCode({}), 1);
    EXPECT_EQ(Compare(lacking, lacking, {}).ExitCode({}), 0);
  }
}

TEST(Compare, TakesWhatAFailedRunLacksForPartOfItsFailure) {
  std::vector<Record> failed = Sound();
  Record stub;
  for (const char* key : {"kind", "mechanism", "rtol", "machine", "compiler", "flags", "libm"}) {
    stub.Set(key, *failed[0].Find(key));
    if (std::string(key) == "rtol") stub.Set("outcome", std::string("singular"));
  }
  failed[0] = stub;
  EXPECT_EQ(Exit(failed, Sound()), 0);  // better, and no more
  EXPECT_EQ(Exit(Sound(), failed), 1);
  // a run that blows up in one way on both sides ends in null on both
  failed = With("outcome", std::string("non-finite"));
  failed[0].Set("drift_position_max", Value());
  const ComparisonReport report = Compare(failed, failed, {});
  EXPECT_EQ(Only(report, Judgement::kNotMeasured).measure.key, "drift_position_max");
  EXPECT_EQ(report.ExitCode({}), 0);
}

TEST(Compare, CatchesSlowerTimesBeyondTwoPercentOnly) {
  ExpectChange("series.rhs_ns", Times(525.0, 7), Judgement::kWorse);
  ExpectChange("series.rhs_ns", Times(475.0, 7), Judgement::kBetter);
  // 1 % is clearly resolved by 500 values and still not worth a message
  std::vector<Record> base = Sound(), fresh = Sound();
  base[0].Set("series.rhs_ns", Times(500.0, 8, 500));
  fresh[0].Set("series.rhs_ns", Times(505.0, 9, 500));
  EXPECT_EQ(Compare(base, fresh, {}).Count(Judgement::kWorse), 0);
}

/// A busy machine: half of the samples take nine times as long, in NEW all three times as long.
TEST(Compare, OverlappingSamplesOfDistantMediansAreNotTheSame) {
  std::vector<Record> base = Sound(), fresh = Sound();
  std::vector<double> times;
  for (int i = 0; i < 7; ++i) times.push_back(i < 4 ? 750.0 + i : 6600.0 + i);
  base[0].Set("series.rhs_ns", times);
  for (double& time : times) time *= 3.0;
  fresh[0].Set("series.rhs_ns", times);
  const Finding overlap = Only(Compare(base, fresh, {}), Judgement::kNotMeasured);
  EXPECT_EQ(overlap.measure.key, "series.rhs_ns");
  EXPECT_EQ(overlap.why, "ratio 3 of medians, but samples overlap");
}

TEST(Compare, SaysWhenSamplesAreTooSmall) {
  std::vector<Record> base = Sound(), fresh = Sound();
  base[0].Set("series.rhs_ns", Times(500.0, 1, 3));
  fresh[0].Set("series.rhs_ns", Times(700.0, 2, 3));
  const Finding finding = Only(Compare(base, fresh, {}), Judgement::kNotMeasured);
  EXPECT_EQ(finding.measure.key, "series.rhs_ns");
  EXPECT_NE(finding.why.find("too few repetitions"), std::string::npos);
}

/// Sixteen timings, one of them `factor` times as long in NEW.
ComparisonReport OneOfSixteen(double factor, int repeats) {
  std::vector<Record> base, fresh;
  for (unsigned i = 0; i < 16; ++i) {
    base.push_back(SoundRecord("m" + std::to_string(i), 100 + i));
    fresh.push_back(base.back());
    base.back().Set("series.rhs_ns", Times(500.0, 200 + i, repeats));
    fresh.back().Set("series.rhs_ns", Times(i == 3 ? factor * 500.0 : 500.0, 300 + i, repeats));
  }
  return Compare(base, fresh, {});
}

// No rank test of five repetitions can decide among sixteen times: 16 * 2 / 252 > 0.05.
TEST(Compare, ATimeFarApartDecidesHoweverFewRepetitionsThereAre) {
  for (const int repeats : {3, 5, 7}) {
    for (const double factor : {10.0, 2.0, 0.5, 0.1}) {
      const ComparisonReport report = OneOfSixteen(factor, repeats);
      const Finding found = Only(report, factor > 1.0 ? Judgement::kWorse : Judgement::kBetter);
      EXPECT_NE(found.one.find("m3"), std::string::npos) << factor << " " << repeats;
      EXPECT_EQ(report.ExitCode({}), factor > 1.0 ? 1 : 0) << factor << " " << repeats;
    }
  }
  // nothing can be decided about any time: that is not "the same"
  const ComparisonReport undecided = OneOfSixteen(1.3, 5);
  EXPECT_EQ(undecided.ExitCode({}), 2);
  EXPECT_EQ(undecided.Obstacle({}),
            "16 times not comparable: too few repetitions to decide among 16 times");
  EXPECT_EQ(OneOfSixteen(1.0, 15).ExitCode({}), 0);
  // samples that overlap are not apart, even if their medians are
  std::vector<Record> base = Sound(), fresh = Sound();
  base[0].Set("series.rhs_ns", std::vector<double>{500.0, 510.0, 5000.0});
  fresh[0].Set("series.rhs_ns", std::vector<double>{4900.0, 5000.0, 5100.0});
  EXPECT_EQ(Compare(base, fresh, {}).Count(Judgement::kWorse), 0);
}

TEST(Compare, NeverComparesTimesOfTwoMachines) {
  std::vector<Record> fresh = Sound();
  for (Record& record : fresh) {
    record.Set("machine", std::string("there"));
    record.Set("series.rhs_ns", Times(5000.0, 3));
  }
  const ComparisonReport report = Compare(Sound(), fresh, {});
  EXPECT_EQ(report.Count(Judgement::kNotMeasured, "times"), 2);
  EXPECT_EQ(report.Count(Judgement::kSame, "hashes"), 2);  // bits do not depend on the machine
  EXPECT_EQ(report.ExitCode({}), 2);  // times that both have, and none could be compared
  EXPECT_EQ(report.Obstacle({}), "2 times not comparable: another machine");
  CompareOptions without;
  without.only = {"outcomes", "hashes", "counts"};
  EXPECT_EQ(Exit(Sound(), fresh, without), 0);
  CompareOptions times;
  times.only = {"times"};
  EXPECT_EQ(Exit(Sound(), fresh, times), 2);  // nothing was measured
  // not knowing the machine is as bad
  std::vector<Record> nameless = Sound();
  for (Record& record : nameless) record.Set("machine", Value());
  EXPECT_EQ(Exit(nameless, nameless, times), 2);
}

TEST(Compare, ComparesTimesBeyondAChangeOfTheMachinesSpeed) {
  struct Case {
    double speed, time;
    Judgement expected;
  };
  // the times of BASE are near 500; a change of speed by s leaves ratios below 1.5 s^2 undecided
  for (const Case& one : {Case{1.02, 5000.0, Judgement::kWorse},
                          {1.3, 600.0, Judgement::kNotMeasured},
                          {0.7, 600.0, Judgement::kNotMeasured},
                          {1.3, 5000.0, Judgement::kWorse},
                          {0.7, 5000.0, Judgement::kWorse},
                          {1.3, 50.0, Judgement::kBetter}}) {
    std::vector<Record> base = Sound(), fresh = Sound();
    base[0].Set("calibration_ns", 10'000.0);
    fresh[0].Set("calibration_ns", 10'000.0 * one.speed);
    fresh[0].Set("series.rhs_ns", Times(one.time, 3));
    EXPECT_EQ(Compare(base, fresh, {}).Count(one.expected, "times"), 1)
        << one.speed << " " << one.time;
  }
}

TEST(Compare, HoldsWhatRoundOffMovesToOneArithmeticOnly) {
  for (const std::string key : {"compiler", "flags", "libm"}) {
    std::vector<Record> fresh = Sound();
    for (Record& record : fresh) {
      record.Set(key, std::string("other"));
      record.Set("state_hash", std::string("00000000000000bb"));
      record.Set("steps", std::int64_t{1003});
      record.Set("drift_position_max", 2.6e-7);
    }
    ComparisonReport report = Compare(Sound(), fresh, {});
    EXPECT_EQ(report.ExitCode({}), 0) << key;
    EXPECT_EQ(report.Count(Judgement::kNotMeasured, "hashes"), 2) << key;
    EXPECT_EQ(report.Count(Judgement::kSame, "errors"), 4) << key;
    // operations do not depend on it, and a drift of three times is none of round-off
    fresh[0].Set("rhs_operations", std::int64_t{700});
    fresh[1].Set("drift_position_max", 6e-7);
    report = Compare(Sound(), fresh, {});
    EXPECT_EQ(report.Count(Judgement::kWorse), 2) << key;
  }
}

TEST(Compare, SaysWhatIsMissing) {
  std::vector<Record> one = {SoundRecord("four-bar", 1)};
  const ComparisonReport report = Compare(Sound(), one, {});
  ASSERT_EQ(report.only_base.size(), 1u);
  EXPECT_NE(report.only_base[0].find("toggle"), std::string::npos);
  EXPECT_EQ(report.ExitCode({}), 2);
  CompareOptions subset;
  subset.subset = true;
  EXPECT_EQ(report.ExitCode(subset), 0);
  EXPECT_EQ(Compare(one, Sound(), {}).only_fresh.size(), 1u);
  EXPECT_EQ(Exit(one, Sound()), 2);  // a base that has lost cases is none
  CompareOptions added;
  added.added = true;
  EXPECT_EQ(Exit(one, Sound(), added), 0);
  EXPECT_EQ(Exit({}, {}), 2);
  EXPECT_EQ(Exit(one, {SoundRecord("toggle", 1)}), 2);
}

TEST(Compare, DoesNotPickOneOfTwoRecordsOfACase) {
  std::vector<Record> twice = Sound();
  twice.push_back(twice[0]);
  const ComparisonReport report = Compare(Sound(), twice, {});
  EXPECT_EQ(report.ambiguous.size(), 1u);
  EXPECT_EQ(report.ExitCode({}), 2);
}

TEST(Compare, LooksAtChosenGroupsOnly) {
  CompareOptions counts;
  counts.only = {"counts", "instructions"};
  const ComparisonReport report = Compare(Sound(), With("drift_position_max", 1.0), counts);
  EXPECT_EQ(report.ExitCode(counts), 0);
  EXPECT_EQ(report.findings.size(), 6u);  // steps, operations and instructions of two cases
}

TEST(Origin, OfThisProgramIsComplete) {
  Record record;
  Stamp(record);
  const Origin origin = OriginOf(record);
  EXPECT_TRUE(origin.SameArithmetic(ThisOrigin()));
  EXPECT_TRUE(origin.SameMachine(ThisOrigin()));
  EXPECT_EQ(origin.libm.size(), 16u);
  EXPECT_FALSE(origin.commit.empty());
  EXPECT_FALSE(Origin{}.SameArithmetic(Origin{}));
  EXPECT_FALSE(Origin{}.SameMachine(Origin{}));
}

}  // namespace compare_test
}  // namespace loopbench::harness
