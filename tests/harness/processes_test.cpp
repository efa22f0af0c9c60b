// Work in child processes: each way to end has its name, and the others go on.
#include "harness/isolation/processes.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <map>
#include <stdexcept>
#include <vector>

namespace loopbench::harness {
namespace {

std::map<std::size_t, ProcessResult> RunAll(const std::vector<std::function<std::string()>>& pieces,
                                            int jobs, const ProcessLimits& limits = {}) {
  std::map<std::size_t, ProcessResult> results;
  RunInProcesses(
      pieces.size(), jobs, [&](std::size_t i) { return pieces[i](); },
      [&](std::size_t) { return limits; },
      [&](std::size_t i, const ProcessResult& result) { results[i] = result; });
  return results;
}

std::string Hang() {
  for (;;) ::pause();
}

std::string Hoard() {
  std::vector<std::vector<char>> hoard;
  for (;;) hoard.emplace_back(1 << 20, 'x');
}

TEST(ProcessesTest, AnswersComeBackWhole) {
  const std::string large(3'000'000, 'a');  // many times what a pipe holds
  const auto results = RunAll(
      {[] { return std::string("small"); }, [&] { return large; }, [] { return std::string(); }},
      2);
  ASSERT_EQ(results.size(), 3u);
  EXPECT_EQ(results.at(0).text, "small");
  EXPECT_EQ(results.at(1).text, large);
  EXPECT_EQ(results.at(2).text, "");
  for (const auto& [i, result] : results) EXPECT_EQ(result.ending, ProcessEnding::kAnswered);
}

TEST(ProcessesTest, EachEndingHasItsName) {
  const auto results =
      RunAll({[]() -> std::string { throw std::logic_error("a reason"); },
              [] { return ::raise(SIGKILL), std::string(); }, []() -> std::string { ::_exit(7); },
              Hang, [] { return std::string("fine"); }},
             3, {.wall_s = 0.3, .memory_mb = 0.0});
  EXPECT_EQ(results.at(0).ending, ProcessEnding::kThrew);
  EXPECT_EQ(results.at(0).text, "a reason");
  EXPECT_EQ(results.at(1).ending, ProcessEnding::kCrashed);
  EXPECT_NE(results.at(1).text.find("signal 9"), std::string::npos);
  EXPECT_EQ(results.at(2).ending, ProcessEnding::kCrashed);
  EXPECT_NE(results.at(2).text.find("exit code 7"), std::string::npos);
  EXPECT_EQ(results.at(3).ending, ProcessEnding::kOverTime);
  EXPECT_EQ(results.at(4).text, "fine");
}

TEST(ProcessesTest, MemoryIsLimited) {
  if (!LimitsMemory()) GTEST_SKIP() << "sanitizers reserve the address space";
  const auto results = RunAll({Hoard, [] { return std::string(8 << 20, 'x'); }}, 1,
                              {.wall_s = 0.0, .memory_mb = 64.0});
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

}  // namespace
}  // namespace loopbench::harness
