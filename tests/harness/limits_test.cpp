// Work of any size ends by limits, in a process of its own, with a reason.
#include <sys/resource.h>

#include "harness/config/experiment_reader.h"
#include "harness/run/processes.h"
#include "harness/run/timing.h"
#include "mechanism/algebra/dense_memory.h"
#include "tests/harness/cli_fixture.h"

namespace loopbench::harness::limits_test {

/// Most memory that this process has had [MiB].
double PeakMemory() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

/// tiny.json on a family member.
std::string OnFamily(const std::string& family, const std::string& limits,
                     const std::string& solver) {
  return R"({"name": "large", "problems": [{"mechanism": )" + family + R"(, "horizon": 0.5}],
    "methods": [{"formulation": "lagrange", "enforcement": "acceleration", "solver": ")" +
         solver + R"("}], "tolerances": 1e-6, "limits": )" + limits +
         R"(, "timing": {"repeats": 0}})";
}

/// A ladder as a file, from consistent positions and one given speed.
std::string LadderFile(int windows, double angle) {
  std::string bodies, joints, start;
  const auto body = [&](const std::string& name) {
    bodies += (bodies.empty() ? "" : ",") + ("{\"name\": \"" + name) +
              R"(", "mass": 1, "inertia": 0.1, "points": {"A": [0, 0], "B": [1, 0]}})";
  };
  const auto joint = [&](const std::string& name, const std::string& from, const std::string& at,
                         const std::string& to, const std::string& end) {
    joints += (joints.empty() ? "" : ",") + ("{\"name\": \"" + name) +
              R"(", "type": "revolute", "from": {"body": ")" + from + "\", \"at\": " + at +
              R"(}, "to": {"body": ")" + to + R"(", "at": ")" + end + "\"}}";
  };
  for (int i = 0; i <= windows; ++i) {
    const std::string n = std::to_string(i), next = std::to_string(i + 1);
    body("crank" + n);
    joint("O" + n, "ground", "[" + n + ", 0]", "crank" + n, "A");
    start += (start.empty() ? "\"O" : ", \"O") + n + "\": " + std::to_string(angle);
    if (i == windows) break;
    body("coupler" + n);
    joint("P" + n, "crank" + n, "\"B\"", "coupler" + n, "A");
    joint("Q" + n, "coupler" + n, "\"B\"", "crank" + next, "B");
    start += ", \"P" + n + "\": " + std::to_string(-angle);
  }
  return R"({"name": "long", "gravity": [0, -9.81], "bodies": [)" + bodies + "], \"joints\": [" +
         joints + R"(], "initial": {"coordinates": {)" + start +
         R"(}, "fixed": ["O0"], "speeds": {"O0": 1.0}}})";
}

TEST(Memory, ThatCannotBeHadIsRefusedByName) {
  if (!LimitsMemory()) GTEST_SKIP() << "sanitizers reserve the address space";
  for (const double numbers : {1e9, 1e30}) {
    ProcessResult result;
    RunInProcesses(
        1, 1, [&](std::size_t) { return RequireDense("a matrix", numbers), std::string(); },
        [](std::size_t) { return ProcessLimits{.cpu_s = 10.0, .memory_mb = 64.0}; },
        [&](std::size_t, const ProcessResult& ended) { result = ended; });
    EXPECT_EQ(result.ending, ProcessEnding::kOverMemory);
    EXPECT_EQ(result.text, numbers == 1e9 ? "a matrix requires 8 GB, more than 64 MiB"
                                          : "a matrix requires 8e+21 GB, more than 64 MiB");
    EXPECT_LT(result.cpu_s, 1.0);
  }
  RequireDense("a small matrix", 1e4);
}

TEST(PrintedFromAChild, AreItsLinesHoweverItEnds) {
  const ProcessLimits limits = {.cpu_s = 0.2, .memory_mb = 0.0};
  testing::internal::CaptureStdout();
  EXPECT_EQ(PrintFromChild("file", limits, [] { return Print("all is well\n"), 1; }), 1);
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "all is well\n");
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  const auto endless = []() -> int {
    for (Print("so far\n");;) {
    }
  };
  EXPECT_EQ(PrintFromChild("file", limits, endless), 2);
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "so far\n");
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "file: cut off (process-time-limit): killed after 0.2 s of CPU time\n");
  EXPECT_THROW(PrintFromChild("file", limits, []() -> int { throw std::runtime_error("no"); }),
               std::runtime_error);
}

TEST(TimingFamilies, AreMadeWhereTheyAreTimed) {
  Experiment experiment =
      ReadExperiment(std::string(LOOPBENCH_SOURCE_DIR) + "/configs/experiments/paper/paper.json");
  const Method method;
  experiment.timing.families = {{"chain", {3, 1'000'000}, {method}},
                                {"ladder", {1, 1'000'000}, {method}}};
  const double before = PeakMemory();
  std::size_t members = 0;
  for (const TimingGroup& group : TimingGroups(experiment)) {
    if (group.simulate) continue;
    ++members;
    EXPECT_EQ(group.cases.front().mechanism, group.name);
    if (!group.name.ends_with("000000")) {
      EXPECT_EQ(group.describe().name, group.name);
    }
  }
  EXPECT_EQ(members, 4u);
  EXPECT_LT(PeakMemory() - before, 50.0) << "MiB; two million bodies take a hundred times as much";
}

using Words = std::vector<std::string>;

Words With(Words words, const std::string& word) {
  words.push_back(word);
  return words;
}

TEST_F(CommandLineTest, FormulationsTooDenseForTheirLimitsSaySo) {
  if (!LimitsMemory()) GTEST_SKIP() << "sanitizers reserve the address space";
  const Words why = {"multipliers are dense", "matrices of 4000 constraints and 4001 speeds",
                     "requires 1.28 GB", "more than 200 MiB"};
  Write("large.json", OnFamily(R"({"family": "ladder", "windows": 2000})",
                               R"({"cpu_s": 10, "memory_mb": 200})", "plain"));
  Expect("run large.json --out out", 0, {"ran 1 case (1 not finished)"});
  const std::vector<Record> records = ReadRecords(folder_ / "out");
  ASSERT_EQ(records.size(), 1u);
  EXPECT_EQ(records[0].Text("outcome"), "memory-limit");
  for (const std::string& word : why) {
    ExpectWords(records[0].Text("message"), {word});
  }
  Expect("estimate large.json", 0,
         With(With(why,
                   "Pilot run stopped: ladder-2000 "
                   "lagrange/acceleration/joint/plain: memory-limit"),
              "1 case, 1 run"));
  Expect("check large.json", 0, {"1 case"});
}

TEST_F(CommandLineTest, LargeStartsAndMultipliersAreSparse) {
  if (!LimitsMemory()) GTEST_SKIP() << "sanitizers reserve the address space";
  Write("large.json", OnFamily(R"({"family": "ladder", "windows": 2000})",
                               R"({"cpu_s": 10, "memory_mb": 200})", "rank-revealing"));
  Expect("run large.json --out out", 0, {"ran 1 case"});
  const std::vector<Record> records = ReadRecords(folder_ / "out");
  ASSERT_EQ(records.size(), 1u);
  EXPECT_EQ(records[0].Text("outcome"), "finished") << records[0].Text("message");
}

/// All bars in line, and one speed given: only dense factors can tell which others it allows.
TEST_F(CommandLineTest, StartsTooDenseForTheirLimitsSaySo) {
  if (!LimitsMemory()) GTEST_SKIP() << "sanitizers reserve the address space";
  const Words why = {"long: its loops are close to a position where they lose rank",
                     "the consistent start is dense", "4000 constraints by 4001 speeds",
                     "requires 0.384 GB", "more than 128 MiB"};
  Write("long.json", LadderFile(2000, 0.0));
  Write("large.json", R"({"name": "large", "problems": [{"mechanism": "long.json", "horizon": 0.5}],
    "methods": [{"formulation": "odca", "enforcement": "acceleration"}], "tolerances": 1e-6,
    "limits": {"cpu_s": 10, "memory_mb": 128}, "timing": {"repeats": 0}})");
  Expect("check large.json", 2,
         With(why, "problem \"long\": its start was not assembled (memory-limit)"));
  Expect("check large.json --no-assembly", 0, {"1 case"});
  Expect("explain long.json --memory-limit 128", 2, With(why, "long.json: cut off (memory-limit)"));
  Expect("check long.json --memory-limit 128", 2, why);
  Write("long.json", LadderFile(2000, 1.0));
  Expect("check long.json --memory-limit 128", 0, {"4001 bodies"});
}

TEST_F(CommandLineTest, PilotsAreCutOffByTheLimitOfTheirCase) {
  // a step of so many bodies takes longer than all of the limit
  Write("large.json", OnFamily(R"({"family": "chain", "bars": 100000})",
                               R"({"cpu_s": 0.01, "memory_mb": 6000})", "rank-revealing"));
  ExpectEnding(
      Call("estimate large.json"), 0,
      {"Pilot run stopped: chain-100000", "process-time-limit", "of CPU time", "1 case, 1 run"});
}

TEST_F(CommandLineTest, CheckAssemblesStarts) {
  EditMechanism("\"C\": [1.5, 0.0]", "\"C\": [5.0, 0.0]");
  Expect("check four-bar.json", 2,
         {"four-bar.json: found a start that cannot be assembled", "does not close",
          "expected one from which every loop closes", "--no-assembly"});
  Expect("check tiny.json four-bar.json", 2, {"tiny.json: problem \"four-bar\": found a start"});
  Expect("check tiny.json four-bar.json --no-assembly", 0, {"2 cases", "3 bodies"});
}

TEST_F(CommandLineTest, CheckNamesTheCombinationWhoseStartDoesNotClose) {
  std::string text = kTinyExperiment;
  text.insert(text.find("\"timing\""), R"("sweep": [{"name": "apart", "values": [1.4, 1.5, 5, 6],
      "field": "/problems/0/mechanism/ground/points/C/0"}], )");
  Write("sweep.json", text);
  const Ending ending = Call("check sweep.json");
  ExpectEnding(ending, 2, {"problem \"four-bar\": found a start", "(at apart = 5)"});
  EXPECT_EQ(ending.text.find("apart = 6"), std::string::npos) << "the first combination is enough";
}

}  // namespace loopbench::harness::limits_test
