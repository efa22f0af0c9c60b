// The gate: what is planted is caught, what is unchanged passes, what cannot be compared is said.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "harness/base/record.h"
#include "harness/base/store.h"
#include "harness/history/history.h"
#include "harness/judge/judge.h"
#include "tests/harness/records.h"

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
  return RecordOf("kind", "accuracy", "mechanism", mechanism, "rtol", 1e-8, "outcome", "finished",
                  "steps", 1000, "rhs_operations", 617, "instructions", std::int64_t{100'000},
                  "state_hash", "00000000000000aa", "drift_position_max", 2e-7, "energy_error_max",
                  3e-14, "series.rhs_ns", Times(500.0, seed), "machine", "here", "compiler",
                  "GNU 12", "flags", "-O2", "libm", "0123");
}

std::vector<Record> Sound(unsigned seed = 1) {
  return {SoundRecord("four-bar", seed), SoundRecord("toggle", seed + 100)};
}

/// Sound records whose first has one value changed.
std::vector<Record> With(const std::string& key, const AnyValue& any) {
  std::vector<Record> records = Sound(2);
  records[0].Set(key, any.value);
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

/// Sound records whose first have these times.
ComparisonReport CompareTimes(const std::vector<double>& base, const std::vector<double>& fresh) {
  return Compare(With("series.rhs_ns", base), With("series.rhs_ns", fresh), {});
}

void ExpectChange(const std::string& key, const AnyValue& value, Judgement judgement) {
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
  ExpectChange("instructions", 105'000, Judgement::kWorse);
  ExpectChange("instructions", 95'000, Judgement::kBetter);
  EXPECT_EQ(Exit(Sound(), With("instructions", 101'900)), 0);
}

TEST(Compare, TakesCountsHashesAndOutcomesExactly) {
  ExpectChange("steps", 1001, Judgement::kWorse);
  ExpectChange("steps", 999, Judgement::kBetter);
  ExpectChange("rhs_operations", 618, Judgement::kWorse);
  ExpectChange("state_hash", "00000000000000ab", Judgement::kWorse);
  ExpectChange("outcome", "singular", Judgement::kWorse);
}

TEST(Compare, CatchesNewWarningsAndErrors) {
  const ComparisonReport report = Compare(Sound(), With("singularity_crossings", 3), {});
  EXPECT_EQ(Only(report, Judgement::kWorse).measure.key, "warnings");
  EXPECT_EQ(Only(report, Judgement::kWorse).fresh, "singular-crossing");
  const ComparisonReport back = Compare(With("singularity_crossings", 3), Sound(), {});
  EXPECT_EQ(Only(back, Judgement::kBetter).measure.key, "warnings");
  const std::vector<Record> base = With("error_final", 1e-9);
  EXPECT_EQ(Exit(base, base), 0);
  EXPECT_EQ(Only(Compare(base, With("error_final", 5.0), {}), Judgement::kWorse).measure.key,
            "error_final");
}

TEST(Compare, EqualCasesAreEqualThoughOneStoreHasANamesake) {
  const auto with = [](const std::string& content, const std::string& case_id) {
    return RecordOf("kind", "accuracy", "mechanism", "four-bar", "case_id", case_id, "config_hash",
                    content, "outcome", "finished", "drift_position_max", 1e-7);
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
  const ComparisonReport report = Compare(With("outcome", "singular"), Sound(), {});
  EXPECT_EQ(Only(report, Judgement::kBetter).measure.key, "outcome");
  EXPECT_EQ(report.ExitCode({}), 0);
}

TEST(Compare, CatchesAResultThatIsGone) {
  ExpectChange("drift_position_max", Value(), Judgement::kWorse);
  ExpectChange("drift_position_max", std::numeric_limits<double>::quiet_NaN(), Judgement::kWorse);
}

/// Every measure of these records, with values that none of them can have.
std::vector<std::pair<std::string, Value>> OddValues() {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(),
                   infinity = std::numeric_limits<double>::infinity();
  const std::vector<double> series = {1.0};
  std::vector<std::pair<std::string, Value>> odd;
  const auto add = [&odd](const std::string& key, const std::vector<AnyValue>& values) {
    for (const AnyValue& any : values) odd.emplace_back(key, any.value);
  };
  for (const char* key :
       {"steps", "rhs_operations", "instructions", "drift_position_max", "energy_error_max"}) {
    add(key, {"oops", series, nan, infinity, -1.0, true, Value()});
  }
  for (const char* key : {"outcome", "state_hash"}) add(key, {1.0, series, Value(), true});
  using Times = std::vector<double>;
  add("series.rhs_ns",
      {"oops", 1.0, Value(), Times{1.0, nan}, Times{1.0, infinity}, Times{1.0, -1.0}});
  return odd;
}

TEST(Compare, CallsAValueThatIsNoneADifferenceOnEitherSide) {
  for (const auto& [key, value] : OddValues()) {
    SCOPED_TRACE(key + " " + Shown(With(key, value)[0], key));
    ComparisonReport report = Compare(Sound(), With(key, value), {});
    EXPECT_EQ(Only(report, Judgement::kWorse).measure.key, key);
    ExpectWords(Only(report, Judgement::kWorse).why, {"in NEW: expected"});
    EXPECT_EQ(report.ExitCode({}), 1);
    report = Compare(With(key, value), Sound(), {});
    EXPECT_EQ(Only(report, Judgement::kDifferent).measure.key, key);
    ExpectWords(Only(report, Judgement::kDifferent).why, {"in BASE: expected"});
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
  failed = With("outcome", "non-finite");
  failed[0].Set("drift_position_max", Value());
  const ComparisonReport report = Compare(failed, failed, {});
  EXPECT_EQ(Only(report, Judgement::kNotMeasured).measure.key, "drift_position_max");
  EXPECT_EQ(report.ExitCode({}), 0);
}

TEST(Compare, CatchesSlowerTimesBeyondTwoPercentOnly) {
  ExpectChange("series.rhs_ns", Times(525.0, 7), Judgement::kWorse);
  ExpectChange("series.rhs_ns", Times(475.0, 7), Judgement::kBetter);
  // 1 % is clearly resolved by 500 values and still not worth a message
  EXPECT_EQ(CompareTimes(Times(500.0, 8, 500), Times(505.0, 9, 500)).Count(Judgement::kWorse), 0);
}

/// A busy machine: half of the samples take nine times as long, in NEW all three times as long.
TEST(Compare, OverlappingSamplesOfDistantMediansAreNotTheSame) {
  const std::vector<double> times = {750, 751, 752, 753, 6604, 6605, 6606},
                            tripled = {2250, 2253, 2256, 2259, 19812, 19815, 19818};
  const Finding overlap = Only(CompareTimes(times, tripled), Judgement::kNotMeasured);
  EXPECT_EQ(overlap.measure.key, "series.rhs_ns");
  EXPECT_EQ(overlap.why, "ratio 3 of medians, but samples overlap");
}

TEST(Compare, SaysWhenSamplesAreTooSmall) {
  const Finding finding =
      Only(CompareTimes(Times(500.0, 1, 3), Times(700.0, 2, 3)), Judgement::kNotMeasured);
  EXPECT_EQ(finding.measure.key, "series.rhs_ns");
  ExpectWords(finding.why, {"too few repetitions"});
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
      SCOPED_TRACE(fmt::format("{} {}", factor, repeats));
      const ComparisonReport report = OneOfSixteen(factor, repeats);
      const Finding found = Only(report, factor > 1.0 ? Judgement::kWorse : Judgement::kBetter);
      ExpectWords(found.one, {"m3"});
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
  EXPECT_EQ(CompareTimes({500.0, 510.0, 5000.0}, {4900.0, 5000.0, 5100.0}).Count(Judgement::kWorse),
            0);
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
    std::vector<Record> fresh = With("series.rhs_ns", Times(one.time, 3));
    fresh[0].Set("calibration_ns", 10'000.0 * one.speed);
    EXPECT_EQ(Compare(With("calibration_ns", 10'000.0), fresh, {}).Count(one.expected, "times"), 1)
        << one.speed << " " << one.time;
  }
}

TEST(Compare, HoldsWhatRoundOffMovesToOneArithmeticOnly) {
  for (const std::string key : {"compiler", "flags", "libm"}) {
    std::vector<Record> fresh = Sound();
    for (Record& record : fresh) {
      record = Changed(record, key, "other", "state_hash", "00000000000000bb", "steps", 1003,
                       "drift_position_max", 2.6e-7);
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
  ExpectWords(report.only_base[0], {"toggle"});
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

Record Case(int number) {
  return RecordOf("kind", "accuracy", "mechanism", "m" + std::to_string(number), "outcome",
                  "finished");
}

// So many that a list which is sought through for each of them would be felt.
TEST(CompareAmbiguous, ManyCasesThatAreThereTwiceAreEachNamedOnce) {
  constexpr int kCases = 20'000;
  std::vector<Record> once;
  for (int i = 0; i < kCases; ++i) once.push_back(Case(i));
  EXPECT_TRUE(Compare(once, once, {}).ambiguous.empty());
  std::vector<Record> thrice;
  for (int i = 0; i < 3; ++i) thrice.insert(thrice.end(), once.begin(), once.end());
  const ComparisonReport report = Compare(thrice, once, {});
  ASSERT_EQ(report.ambiguous.size(), std::size_t{kCases});
  EXPECT_EQ(std::set(report.ambiguous.begin(), report.ambiguous.end()).size(), std::size_t{kCases});
  ExpectWords(report.ambiguous.front(), {"m0"});
  EXPECT_TRUE(report.findings.empty());
  EXPECT_EQ(report.ExitCode({}), 2);
}

TEST(CompareAmbiguous, NothingComparedIsAnErrorOfJunit) {
  const std::string nothing = ComparisonJunit(Compare({}, {}, {}), {});
  ExpectWords(nothing, {"tests=\"1\" failures=\"0\" skipped=\"0\" errors=\"1\"",
                        "<error message=\"could not measure: "});
  // what fails says so by itself
  const std::vector<Record> twice = {Case(1), Case(1)};
  ExpectWords(ComparisonJunit(Compare(twice, {Case(1)}, {}), {}), {"errors=\"0\""});
  ExpectWords(ComparisonJunit(Compare({Case(1)}, {Case(1)}, {}), {}), {"errors=\"0\""});
}

}  // namespace compare_test
}  // namespace loopbench::harness
