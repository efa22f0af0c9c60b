// Work in child processes: each way to end has its name, and the others go on.
#include "harness/run/processes.h"

#include <sys/wait.h>
#include <unistd.h>

#include "harness/base/text.h"
#include "tests/standard.h"

namespace loopbench::harness::processes_test {

using Results = std::map<std::size_t, ProcessResult>;

Results RunAll(const std::vector<std::function<std::string()>>& pieces, int jobs,
               const ProcessLimits& limits = {}) {
  Results results;
  RunInProcesses(
      pieces.size(), jobs, [&](std::size_t i) { return pieces[i](); },
      [&](std::size_t) { return limits; },
      [&](std::size_t i, const ProcessResult& result) { results[i] = result; });
  return results;
}

/// The ending of a result, and a part of its text.
void ExpectResult(const ProcessResult& result, ProcessEnding ending, const std::string& part) {
  EXPECT_EQ(result.ending, ending) << result.text;
  EXPECT_NE(result.text.find(part), std::string::npos) << result.text;
}

constexpr ProcessLimits kImpatient = {.cpu_s = 10.0, .memory_mb = 0.0, .idle_s = 0.5};

std::string Hang() {
  for (;;) ::pause();
}

/// Computes for some CPU time [s].
std::string Compute(double seconds) {
  const double begin = ThreadCpuSeconds();
  while (ThreadCpuSeconds() < begin + seconds) {
  }
  return "done";
}

/// Has another process stop this one for a while [s].
void BeStopped(double seconds) {
  const pid_t self = ::getpid();
  if (::fork() == 0) {
    ::kill(self, SIGSTOP);
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
    ::kill(self, SIGCONT);
    ::_exit(0);
  }
}

std::string Hoard() {
  std::vector<std::vector<char>> hoard;
  for (;;) hoard.emplace_back(1 << 20, 'x');
}

TEST(ProcessesTest, AnswersComeBackWhole) {
  const std::string large(3'000'000, 'a');  // many times what a pipe holds
  const std::vector<std::string> texts = {"small", large, ""};
  const Results results =
      RunAll({[&] { return texts[0]; }, [&] { return texts[1]; }, [&] { return texts[2]; }}, 2);
  ASSERT_EQ(results.size(), 3u);
  for (const auto& [i, result] : results) {
    EXPECT_EQ(result.ending, ProcessEnding::kAnswered);
    EXPECT_EQ(result.text, texts[i]);
  }
}

TEST(ProcessesTest, EachEndingHasItsName) {
  const Results results =
      RunAll({[]() -> std::string { throw std::logic_error("a reason"); },
              [] { return ::raise(SIGKILL), std::string(); }, []() -> std::string { ::_exit(7); },
              Hang, [] { return std::string("fine"); }},
             3, kImpatient);
  ExpectResult(results.at(0), ProcessEnding::kThrew, "a reason");
  ExpectResult(results.at(1), ProcessEnding::kKilled, "signal 9");
  ExpectResult(results.at(2), ProcessEnding::kCrashed, "exit code 7");
  ExpectResult(results.at(3), ProcessEnding::kOverTime, "0.5 s asleep");
  ExpectResult(results.at(4), ProcessEnding::kAnswered, "fine");
}

/// The operator, or the system for lack of memory, ends a process: no result of its work.
TEST(ProcessesTest, AKilledProcessStartsOnceMore) {
  const std::filesystem::path mark = std::filesystem::path(testing::TempDir()) / "killed";
  const Results results = RunAll({[&] {
                                    if (!std::filesystem::exists(mark)) {
                                      WriteFileAtomically(mark, "");
                                      ::raise(SIGTERM);
                                    }
                                    return std::string("done");
                                  },
                                  [] { return std::string("fine"); }},
                                 1);
  EXPECT_EQ(results.at(0).text, "done");
  EXPECT_EQ(results.at(1).text, "fine");
}

TEST(ProcessesTest, WaitingForAProgramIsNoSleep) {
  const Results results = RunAll({[] {
                                   return RunProgram({"sh", "-c", "sleep 2; echo x"}).output;
                                 }},
                                 1, kImpatient);
  EXPECT_EQ(results.at(0).text, "x\n");
}

TEST(ProcessesTest, CpuTimeIsLimited) {
  const Results results = RunAll({[] { return Compute(60.0); }, [] { return Compute(0.01); }}, 2,
                                 {.cpu_s = 0.3, .memory_mb = 0.0});
  ExpectResult(results.at(0), ProcessEnding::kOverTime, "0.3 s of CPU time");
  EXPECT_GE(results.at(0).cpu_s, 0.29);
  EXPECT_LT(results.at(0).cpu_s, 1.0);
  EXPECT_EQ(results.at(1).text, "done");
}

// Each takes 0.1 s of a limit of 0.4 s; together they keep the processors busy for at least twice
// the limit, and each lasts nearly that long.
TEST(ProcessesTest, OfMoreJobsThanProcessorsNoneIsOverTime) {
  const std::size_t count = 8 * std::max(1u, std::thread::hardware_concurrency());
  const std::vector<std::function<std::string()>> pieces(count, [] { return Compute(0.1); });
  double longest = 0.0;
  for (const auto& [i, result] :
       RunAll(pieces, static_cast<int>(count), {.cpu_s = 0.4, .memory_mb = 0.0, .idle_s = 0.5})) {
    EXPECT_EQ(result.text, "done") << i;
    longest = std::max(longest, result.wall_s);
  }
  EXPECT_GT(longest, 0.4) << "or nothing is shown";
}

TEST(ProcessesTest, StoppingIsNeitherComputingNorIdling) {
  const Results results = RunAll({[] { return BeStopped(1.5), Compute(0.05); }}, 1,
                                 {.cpu_s = 0.4, .memory_mb = 0.0, .idle_s = 0.5});
  EXPECT_EQ(results.at(0).text, "done");
  EXPECT_GE(results.at(0).wall_s, 1.4);
}

TEST(ProcessesTest, NapsOfAnotherKindOfHangingAreIdlingToo) {
  const auto nap = []() -> std::string {
    for (;;) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  };
  const Results results = RunAll({nap}, 1, kImpatient);
  EXPECT_EQ(results.at(0).ending, ProcessEnding::kOverTime);
}

TEST(ProcessesTest, AnAnswerThatWaitsToBeReadIsNotIdling) {
  const std::string large(3'000'000, 'a');
  std::map<std::size_t, ProcessResult> results;
  RunInProcesses(
      2, 2, [&](std::size_t i) { return i == 0 ? std::string("first") : Compute(0.1) + large; },
      [](std::size_t) { return kImpatient; },
      [&](std::size_t i, const ProcessResult& result) {
        results[i] = result;
        if (i == 0) std::this_thread::sleep_for(std::chrono::seconds(1));  // a slow disk
      });
  EXPECT_EQ(results.at(1).text.size(), large.size() + 4);
}

TEST(ProcessesTest, MemoryIsLimited) {
  if (!LimitsMemory()) GTEST_SKIP() << "sanitizers reserve the address space";
  const Results results = RunAll({Hoard, [] { return std::string(8 << 20, 'x'); }}, 1,
                                 {.cpu_s = 0.0, .memory_mb = 64.0});
  EXPECT_EQ(results.at(0).ending, ProcessEnding::kOverMemory);
  EXPECT_EQ(results.at(1).ending, ProcessEnding::kAnswered) << "8 MiB are within 64";
}

TEST(ProcessesTest, ChildrenDoNotChangeTheParent) {
  static int touched = 0;
  RunAll({[] { return ++touched, std::string(); }}, 1);
  EXPECT_EQ(touched, 0);
}

TEST(ProcessesTest, WhatDoneThrowsEndsEverything) {
  int calls = 0;
  EXPECT_THROW(RunInProcesses(
                   3, 3, [](std::size_t i) { return i == 0 ? std::string("x") : Hang(); },
                   [](std::size_t) { return ProcessLimits{}; },
                   [&](std::size_t, const ProcessResult&) {
                     ++calls;
                     throw std::runtime_error("enough");
                   }),
               std::runtime_error);
  EXPECT_EQ(calls, 1);
  // the hanging ones were killed and reaped: no child is left to wait for
  EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1);
}

/// Results by task, and how many processes there were.
std::pair<Results, std::size_t> Share(std::size_t count,
                                      const std::function<std::string(std::size_t)>& work,
                                      const ProcessLimits& limits = {}) {
  Results results;
  const auto all = [&](const std::vector<std::size_t>& tasks) {
    std::vector<std::string> texts;
    for (const std::size_t task : tasks) texts.push_back(work(task));
    return texts;
  };
  const std::size_t processes = RunInSharedProcesses(
      count, 2, all, [&](std::size_t) { return limits; },
      [&](const std::vector<TaskResult>& ended) {
        for (const TaskResult& one : ended) {
          EXPECT_TRUE(results.emplace(one.task, one.result).second) << one.task << " ended twice";
        }
      });
  return {results, processes};
}

TEST(SharedProcessesTest, AnswerEveryTaskInFewProcesses) {
  const auto text = [](std::size_t i) {
    return std::string(i % 7, 'x') + "\n" + std::to_string(i) + (i % 3 == 0 ? "\n" : "");
  };
  const auto [results, processes] = Share(500, text);
  ASSERT_EQ(results.size(), 500u);
  for (const auto& [i, result] : results) {
    EXPECT_EQ(result.ending, ProcessEnding::kAnswered);
    EXPECT_EQ(result.text, text(i));
  }
  EXPECT_LT(processes, 100u);
}

TEST(SharedProcessesTest, LongTasksHaveTheirOwn) {
  const auto [results, processes] = Share(6, [](std::size_t) { return Compute(0.11); });
  EXPECT_EQ(results.size(), 6u);
  EXPECT_EQ(processes, 6u);
}

TEST(SharedProcessesTest, WhatEndsAProcessEndsOneTaskOnly) {
  const auto work = [](std::size_t i) -> std::string {
    if (i == 50) std::raise(SIGSEGV);
    if (i == 100) throw std::runtime_error("no");
    if (i == 150) return Hoard();
    if (i == 200) return Compute(10.0);
    return std::to_string(i);
  };
  const bool limits_memory = LimitsMemory();
  const auto [results, processes] =
      Share(limits_memory ? 250 : 150, work, {.cpu_s = 0.5, .memory_mb = 64.0});
  ASSERT_EQ(results.size(), limits_memory ? 250u : 150u);
  for (const auto& [i, result] : results) {
    const auto expected = i == 50    ? ProcessEnding::kCrashed
                          : i == 100 ? ProcessEnding::kThrew
                          : i == 150 ? ProcessEnding::kOverMemory
                          : i == 200 ? ProcessEnding::kOverTime
                                     : ProcessEnding::kAnswered;
    EXPECT_EQ(result.ending, expected) << i << ": " << result.text;
    if (expected == ProcessEnding::kAnswered) {
      EXPECT_EQ(result.text, std::to_string(i));
    }
  }
  EXPECT_EQ(results.at(100).text, "no");
}

}  // namespace loopbench::harness::processes_test
