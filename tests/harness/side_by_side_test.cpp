// Runs that take turns on one thread, and on several; threads of one right-hand side.
#include <sys/resource.h>
#include <unistd.h>

#include "harness/run/run.h"
#include "mechanism/algebra/lanes.h"
#include "tests/harness/cli_fixture.h"

namespace loopbench::harness::side_by_side_test {

/// Counts those that wait for it.
class Counter final : public SharedWork {
 public:
  void Do() noexcept override {
    most = std::max(most, waiting);
    waiting = 0;
    ++done;
  }
  int waiting = 0, most = 0, done = 0;
};

Counter& CounterOf(SideBySide& beside) {
  if (beside.works.empty()) beside.works.push_back(std::make_unique<Counter>());
  return dynamic_cast<Counter&>(*beside.works[0]);
}

TEST(SideBySide, BringsEveryRunToItsEndOnce) {
  for (const int threads : {1, 3}) {
    for (const int count : {0, 1, 3, 100}) {
      std::vector<int> ended(static_cast<std::size_t>(count));
      RunSideBySide(count, threads, [&](int run, SideBySide& beside) {
        for (int meeting = 0; meeting < run % 7; ++meeting) {
          Counter& counter = CounterOf(beside);
          const int before = counter.done;
          ++counter.waiting;
          beside.Meet();
          EXPECT_GT(counter.done, before);
        }
        ++ended[static_cast<std::size_t>(run)];
      });
      EXPECT_EQ(std::ranges::count(ended, 1), count);
    }
  }
}

TEST(SideBySide, DoesTheWorkOfAllLanesAtOnce) {
  int most = 0, done = 0;
  RunSideBySide(4 * kLanes, 1, [&](int, SideBySide& beside) {
    Counter& counter = CounterOf(beside);
    for (int meeting = 0; meeting < 10; ++meeting) {
      ++counter.waiting;
      beside.Meet();
    }
    most = counter.most;
    done = counter.done;
  });
  if (most == 1) GTEST_SKIP() << "one stack under sanitizers";
  EXPECT_EQ(most, kLanes);
  EXPECT_EQ(done, 40) << "four fillings of the lanes, ten meetings each";
}

/// A run's clock stands while others compute, and in work that belongs to no run.
TEST(SideBySide, EachRunHasItsOwnTime) {
  const auto compute = [](double seconds) {
    const double end = ThreadCpuSeconds() + seconds;
    while (ThreadCpuSeconds() < end) {
    }
  };
  std::vector<double> cpu_s(3), wall_s(3);
  double compiling_s = 0.0;
  const double begin_s = WallSeconds();
  RunSideBySide(3, 1, [&](int run, SideBySide& beside) {
    CounterOf(beside);
    const CpuLimit time(1.0);
    beside.Meet();
    compute(0.02 * run);
    if (run == 1) {
      const ForeignWork compiling(compiling_s);
      compute(0.03);
    }
    beside.Meet();
    cpu_s[static_cast<std::size_t>(run)] = time.cpu_s();
    wall_s[static_cast<std::size_t>(run)] = time.wall_s();
  });
  // the sums hold however long other work of the machine interrupts the runs
  const double all_s = WallSeconds() - begin_s;
  EXPECT_GE(compiling_s, 0.03);
  EXPECT_LE(wall_s[0] + wall_s[1] + wall_s[2] + compiling_s, all_s + 1e-6);
  for (const int run : {0, 1, 2}) {
    const auto at = static_cast<std::size_t>(run);
    EXPECT_GE(wall_s[at], 0.019 * run);
    EXPECT_LE(cpu_s[at], wall_s[at] + 1e-3);
  }
}

TEST(SideBySide, ThrowsWhatTheFirstRunThrewWhenAllHaveEnded) {
  for (const int threads : {1, 3}) {
    std::atomic<int> ended = 0;
    const auto run = [&](int i, SideBySide& beside) {
      if (i != 3) beside.Meet();
      if (i == 3 || i == 2) throw std::runtime_error("run " + std::to_string(i));
      ++ended;
    };
    try {
      RunSideBySide(20, threads, run);
      ADD_FAILURE() << "nothing was thrown";
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "run 2");
    }
    EXPECT_EQ(ended, 18);
  }
}

/// Eigen's workspaces are on the stack, up to a mebibyte each.
TEST(SideBySide, HasStacksForWorkspaces) {
  const auto fill = [](int value) {
    volatile char workspace[std::size_t{4} << 20];
    for (std::size_t i = 0; i < sizeof(workspace); i += 4096)
      workspace[i] = static_cast<char>(value);
    return static_cast<int>(workspace[sizeof(workspace) - 4096]);
  };
  int sum = 0;
  RunSideBySide(3, 1, [&](int run, SideBySide& beside) {
    beside.Meet();
    sum += fill(run);
  });
  EXPECT_EQ(sum, 3);
}

/// Returns the number of runs that end with at most `mebibytes` of further address space.
int EndedWithin(std::size_t mebibytes) {
  std::size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  const rlim_t most = pages * static_cast<std::size_t>(getpagesize()) + (mebibytes << 20);
  const rlimit limit{most, most};
  if (setrlimit(RLIMIT_AS, &limit) != 0) return -1;
  std::atomic<int> ended = 0;
  RunSideBySide(20, 3, [&](int, SideBySide& beside) {
    Counter& counter = CounterOf(beside);
    ++counter.waiting;
    beside.Meet();
    ++ended;
  });
  return ended;
}

TEST(SideBySideDeathTest, GoesOnWithTheStacksThatThereAre) {
#if defined(__SANITIZE_ADDRESS__)
  GTEST_SKIP() << "the sanitizer reserves the whole address space";
#endif
  // none, two, and more than there are lanes; threads have stacks of 8 MiB as well
  for (const std::size_t mebibytes : {4, 20, 200}) {
    EXPECT_EXIT(_exit(EndedWithin(mebibytes)), ::testing::ExitedWithCode(20), "") << mebibytes;
  }
}

TEST_F(CommandLineTest, ThreadsChangeNothingButTimes) {
  // long enough for threads to have work of their own
  Write("long.json", R"({"name": "long",
    "problems": [{"mechanism": {"family": "ladder", "windows": 2100}, "horizon": 0.02}],
    "methods": [{"formulation": "odca", "enforcement": "velocity", "threads": [1, 2]}],
    "tolerances": 1e-6, "timing": {"repeats": 1}})");
  Expect("run long.json --out out", 0, {"ran 4 cases"});
  std::string hash;
  int with_threads = 0;
  for (const Record& record : ReadRecords(folder_ / "out")) {
    ASSERT_EQ(record.Text("outcome"), "finished") << record.Text("message");
    with_threads += record.Number("threads") == 2.0;
    if (record.Text("kind") != "accuracy") continue;
    if (hash.empty()) hash = record.Text("state_hash");
    EXPECT_EQ(record.Text("state_hash"), hash);
  }
  EXPECT_EQ(with_threads, 2);
  Expect("list long.json --filter threads=2", 0, {"threads", "1 case"});
  Expect("list long.json --filter threads=3", 2, {"no case matches"});
  Expect("list long.json --filter thread=2", 2, {"no such key", "threads"});
  Expect("run long.json --no-timing --threads 3 --out three", 0, {"ran 1 case"});
  const std::vector<Record> three = ReadRecords(folder_ / "three");
  ASSERT_EQ(three.size(), 1u) << "columns that differed in threads alone are one";
  EXPECT_EQ(three[0].Text("state_hash"), hash);
  EXPECT_EQ(three[0].Number("threads"), 3.0);
  Expect("run long.json --no-timing --threads 3 --filter threads=3 --out three", 0,
         {"ran 0 cases, 1 reused"});
  Expect("run long.json --threads 0 --out none", 2, {"--threads"});
}

}  // namespace loopbench::harness::side_by_side_test
