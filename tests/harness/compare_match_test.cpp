// compare --match: cases that meet by some of their keys, whatever else they were run with; and
// which state of a history is the base.
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "harness/judge/judge.h"
#include "tests/harness/cli_fixture.h"
#include "tests/harness/records.h"

namespace loopbench::harness {
namespace compare_match_test {

Record OneRun(const std::string& formulation, double rtol, double drift) {
  Record record = RecordOf("kind", "accuracy", "mechanism", "feeder", "formulation", formulation,
                           "rtol", rtol, "case_id", formulation + std::to_string(rtol),
                           "config_hash", "c0", "outcome", "finished", "steps", 100, "state_hash",
                           std::to_string(drift), "drift_position_max", drift);
  for (const char* key : {"machine", "compiler", "flags", "libm"}) {
    record.Set(key, std::string("x"));
  }
  return record;
}

CompareOptions By(std::vector<std::string> keys) {
  CompareOptions options;
  options.match = std::move(keys);
  return options;
}

TEST(CompareMatch, MeetsCasesOfOtherSettings) {
  const std::vector<Record> base = {OneRun("odca", 1e-8, 1e-7)},
                            fresh = {OneRun("odca", 1e-3, 3e-7)};
  EXPECT_EQ(Compare(base, fresh, {}).ExitCode({}), 2);
  const CompareOptions options = By({"mechanism", "formulation"});
  const ComparisonReport report = Compare(base, fresh, options);
  EXPECT_EQ(report.ExitCode(options), 1);
  EXPECT_EQ(report.Count(Judgement::kWorse), 1);
  EXPECT_EQ(report.Count(Judgement::kWorse, "errors"), 1);
  // other settings have other bits: that says nothing
  EXPECT_EQ(report.Count(Judgement::kNotMeasured, "hashes"), 1);
  ASSERT_EQ(report.other_settings.size(), 1u);
  EXPECT_EQ(report.other_settings[0], "accuracy feeder odca: rtol 1e-08 before, 0.001 now");
}

TEST(CompareMatch, StillWantsTheBitsOfEqualSettings) {
  const CompareOptions options = By({"mechanism", "formulation"});
  std::vector<Record> fresh = {OneRun("odca", 1e-8, 1e-7)};
  EXPECT_EQ(Compare({OneRun("odca", 1e-8, 1e-7)}, fresh, options).ExitCode(options), 0);
  fresh[0].Set("state_hash", std::string("other"));
  const ComparisonReport report = Compare({OneRun("odca", 1e-8, 1e-7)}, fresh, options);
  EXPECT_EQ(report.Count(Judgement::kWorse, "hashes"), 1);
  EXPECT_TRUE(report.other_settings.empty());
}

TEST(CompareMatch, ChoosesNoneOfSeveralAndMixesNoKinds) {
  const CompareOptions options = By({"mechanism"});
  const ComparisonReport report =
      Compare({OneRun("odca", 1e-8, 1e-7)},
              {OneRun("odca", 1e-8, 1e-7), OneRun("lagrange", 1e-8, 1e-7)}, options);
  EXPECT_EQ(report.ambiguous, std::vector<std::string>{"accuracy feeder"});
  EXPECT_EQ(report.ExitCode(options), 2);
  Record timing = Changed(OneRun("odca", 1e-8, 1e-7), "kind", "timing");
  const ComparisonReport kinds = Compare({OneRun("odca", 1e-8, 1e-7)}, {timing}, options);
  EXPECT_EQ(kinds.only_base.size(), 1u);
  EXPECT_EQ(kinds.only_fresh.size(), 1u);
}

TEST(OtherSettings, NamesKeysThatOneSideLacksAndTheContent) {
  Record base = OneRun("odca", 1e-8, 1e-7), fresh;
  for (const auto& [key, value] : base.items()) {
    fresh.Set(key, value);
    if (key == "rtol") fresh.Set("mass", 2.5);
  }
  EXPECT_EQ(OtherSettings(base, base), "");
  fresh.Set("config_hash", std::string("c1"));
  EXPECT_EQ(OtherSettings(base, fresh), "mass none before, 2.5 now, config_hash c0 before, c1 now");
}

class MatchCommands : public CommandLineTest {};

TEST_F(MatchCommands, AnotherMassIsComparedAndNamed) {
  ASSERT_EQ(Call("run tiny.json --out base").code, 0);
  EditMechanism("\"mass\": 1.0,", "\"mass\": 1.5,");
  ASSERT_EQ(Call("run tiny.json --out new").code, 0);
  ExpectEnding(Call("compare base new"), 2, {"ran another mechanism"});
  ExpectEnding(Call("compare base new --match mechanism,formulation --only outcomes --only hashes "
                    "--markdown s.md"),
               0,
               {"although they ran with other settings", "accuracy four-bar odca: config_hash "});
  const std::string summary = ReadFile(folder_ / "s.md");
  ExpectWords(summary, {"- accuracy four-bar odca: config_hash "});
  ExpectEnding(Call("compare base new --match mechnism"), 2,
               {"--match: found \"mechnism\"", "did you mean \"mechanism\""});
  ExpectEnding(Call("compare base new --match mechanism"), 2, {"more than once"});
}

// Shared runners are of several models: what was accepted on one is the base on all of them, but
// for times.
TEST_F(MatchCommands, TheLastGoodStateOfAnyMachineIsTheBase) {
  ASSERT_EQ(Call("run tiny.json --out run --no-timing").code, 0);
  std::vector<Record> records = ReadRecords(folder_ / "run");
  const auto add = [&](const std::string& commit, const std::string& machine, int day) {
    for (Record& record : records) record.Set("machine", machine);
    {
      ResultStore store(folder_ / commit);
      for (const Record& record : records) store.Append(record);
    }
    ExpectEnding(Call("history add " + commit + " --store kept --commit " + commit + " --date " +
                      "2026-01-0" + std::to_string(day)),
                 0, {"added 2 records"});
  };
  add("aaaa", "one", 1);
  add("bbbb", "two", 2);
  add("cccc", "one", 3);
  ASSERT_EQ(Call("history mark bbbb accepted --store kept").code, 0);
  ExpectEnding(Call("compare cccc --history kept"), 0, {"state, commit bbbb", "NO CHANGE"});
  add("bbbb2", "one", 2);
  ExpectEnding(Call("compare cccc --history kept --only times"), 2, {"state, commit cccc"});
}

TEST_F(MatchCommands, ReadingAHistoryBeginsNone) {
  ASSERT_EQ(Call("run tiny.json --out run").code, 0);
  const std::string git = "git -c init.defaultBranch=main init -q . && ";
  for (const char* command : {"history show --branch kept", "compare run --branch kept",
                              "history report --branch kept --out page.html"}) {
    ExpectEnding(Call(command, git), 2, {"found no branch \"kept\"", "git fetch origin kept:kept"});
  }
  EXPECT_FALSE(fs::exists(folder_ / ".git/refs/heads/kept"));
  EXPECT_FALSE(fs::exists(folder_ / "page.html"));
}

}  // namespace compare_match_test
}  // namespace loopbench::harness
