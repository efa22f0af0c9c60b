// Runs that are interrupted, misbehave, share a store or are split: nothing is lost, nothing
// counted twice.
#include <fcntl.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <unistd.h>

#include "tests/harness/cli_fixture.h"
#include "tests/harness/records.h"

namespace loopbench::harness::resume_test {

using Seconds = std::chrono::duration<double>;

/// drift.csv without provenance; no column of it is measured by a clock.
std::vector<std::string> TableOf(const fs::path& folder) {
  std::istringstream text(ReadFile(folder / "drift.csv"));
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);) {
    if (!line.starts_with("#")) lines.push_back(line);
  }
  return lines;
}

/// Four columns at each of `tolerances` tolerances: short cases of the four-bar.
std::string Sweep(int tolerances) {
  std::string list;
  for (int i = 0; i < tolerances; ++i) {
    list += (i > 0 ? ", " : "") + std::to_string(1000 + i) + "e-10";
  }
  return R"({"name": "sweep", "problems": [{"mechanism": "four-bar.json", "horizon": 0.05}],
  "methods": [{"formulation": ["odca", "lagrange"], "enforcement": "acceleration",
               "solver": ["plain", "rank-revealing"]}],
  "timing": {"repeats": 0}, "tolerances": [)" +
         list + "]}";
}

class Interruption : public CommandLineTest {
 protected:
  /// Starts the program in the folder, without its output.
  pid_t Start(const std::vector<std::string>& arguments) const {
    const pid_t pid = ::fork();
    if (pid != 0) return pid;
    const int null = ::open("/dev/null", O_RDWR);
    ::dup2(null, STDOUT_FILENO);
    ::dup2(null, STDERR_FILENO);
    std::vector<char*> argv = {const_cast<char*>(LOOPBENCH_BINARY)};
    for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
    argv.push_back(nullptr);
    if (::chdir(folder_.c_str()) == 0) ::execv(LOOPBENCH_BINARY, argv.data());
    ::_exit(127);
  }
};

TEST_F(Interruption, OfAThousandCasesTwentyTimesChangesNoDigit) {
  Write("sweep.json", Sweep(250));
  const auto begin = std::chrono::steady_clock::now();
  Expect("run sweep.json --out whole --jobs 2", 0, {"ran 1000 cases"});
  const double whole_s = Seconds(std::chrono::steady_clock::now() - begin).count();
  std::mt19937 random(1);
  std::uniform_real_distribution<double> moment(0.0, whole_s / 15);
  int killed = 0;
  for (int i = 0; i < 20; ++i) {
    const pid_t pid = Start({"run", "sweep.json", "--out", "parts", "--jobs", "2"});
    std::this_thread::sleep_for(Seconds(moment(random)));
    ::kill(pid, SIGKILL);
    int status = 0;
    ::waitpid(pid, &status, 0);
    killed += WIFSIGNALED(status);
  }
  EXPECT_GE(killed, 15) << "most runs must be cut short, or nothing is shown";
  const Ending last = Call("run sweep.json --out parts --jobs 2");
  ExpectEnding(last, 0, {"reused"});
  EXPECT_EQ(ReadRecords(folder_ / "parts").size(), 1000u) << "each case once";
  const auto whole = TableOf(folder_ / "whole"), parts = TableOf(folder_ / "parts");
  EXPECT_EQ(whole.size(), 1001u);
  EXPECT_EQ(whole, parts);
}

TEST_F(Interruption, OfTheStoreLosesNoRecordThatWasAcknowledged) {
  std::mt19937 random(2);
  std::uniform_int_distribution<int> microseconds(0, 4000);
  int cut = 0;
  for (int i = 0; i < 200; ++i) {
    const fs::path store = folder_ / ("store" + std::to_string(i));
    int ends[2];
    ASSERT_EQ(::pipe(ends), 0);
    const pid_t pid = ::fork();
    if (pid == 0) {
      ResultStore writer(store);
      for (std::int64_t n = 0;; ++n) {
        Record record =
            RecordOf("kind", "test", "n", n, "series", std::vector<double>(500, 1.0 / 3.0));
        writer.Append(record);
        if (::write(ends[1], "x", 1) != 1) ::_exit(1);
      }
    }
    ::close(ends[1]);
    std::this_thread::sleep_for(std::chrono::microseconds(microseconds(random)));
    ::kill(pid, SIGKILL);
    ::waitpid(pid, nullptr, 0);
    std::size_t acknowledged = 0;
    char byte;
    while (::read(ends[0], &byte, 1) == 1) ++acknowledged;
    ::close(ends[0]);
    if (!fs::exists(store / "results.jsonl")) {
      EXPECT_EQ(acknowledged, 0u);
      continue;
    }
    const std::string before = ReadFile(store / "results.jsonl");
    cut += !before.empty() && before.back() != '\n';
    const ResultStore reopened(store);  // mends what was torn
    const std::vector<Record> records = ReadRecords(store);
    EXPECT_GE(records.size(), acknowledged);
    EXPECT_LE(records.size(), acknowledged + 1);
    for (std::size_t n = 0; n < records.size(); ++n) {
      EXPECT_EQ(records[n].Number("n"), static_cast<double>(n));
      EXPECT_EQ(records[n].Numbers("series").size(), 500u);
    }
  }
  std::printf("torn lines in 200 kills: %d\n", cut);
}

TEST_F(Interruption, SecondRunOnAStoreIsRefusedAndNamesTheFirst) {
  Write("sweep.json", Sweep(250));
  const pid_t pid = Start({"run", "sweep.json", "--out", "out"});
  while (!fs::exists(folder_ / "out/results.jsonl")) std::this_thread::yield();
  Expect("run sweep.json --out out", 2,
         {"out/results.jsonl' is in use by process " + std::to_string(pid)});
  ::kill(pid, SIGKILL);
  ::waitpid(pid, nullptr, 0);
  Expect("run tiny.json --out out", 0, {"ran 2 cases"});
}

/// State hashes by case.
std::map<std::string, std::string> Hashes(const fs::path& store) {
  std::map<std::string, std::string> hashes;
  for (const Record& record : ReadRecords(store)) {
    hashes[record.Text("case_id")] = record.Text("state_hash") + record.Text("outcome");
  }
  return hashes;
}

TEST_F(Interruption, FaultsOfOneCaseAreItsOutcomeAndHarmNoOther) {
  std::string text = kTinyExperiment;
  text.replace(text.find("\"timing\""), 8, R"("limits": {"wall_s": 0.2}, "timing")");
  Write("tiny.json", text);
  Expect("run tiny.json --out clean", 0);
  const std::map<std::string, std::string> outcomes = {{"crash", "crashed"},
                                                       {"throw", "crashed"},
                                                       {"hang", "process-time-limit"},
                                                       {"memory", "memory-limit"},
                                                       {"garbage", "invalid-result"}};
  for (const auto& [fault, outcome] : outcomes) {
#ifdef __SANITIZE_ADDRESS__
    if (fault == "memory") continue;  // no memory limits under sanitizers
#endif
    const std::string out = "run-" + fault;
    ExpectEnding(
        Call("run tiny.json --out " + out, "LOOPBENCH_FAULT=" + fault + ":formulation=odca"), 0,
        {"ran 2 cases (1 not finished)", outcome});
    auto clean = Hashes(folder_ / "clean");
    int differ = 0;
    for (const auto& [id, hash] : Hashes(folder_ / out)) differ += hash != clean.at(id);
    EXPECT_EQ(differ, 1) << fault;
    Expect("run tiny.json --out " + out, 0, {"ran 0 cases, 2 reused"});
    Expect("run tiny.json --out " + out + " --rerun failed", 0, {"ran 1 case, 1 reused"});
    EXPECT_EQ(Hashes(folder_ / out), clean) << "the last record of a case counts";
    EXPECT_EQ(TableOf(folder_ / out), TableOf(folder_ / "clean"));
  }
}

TEST_F(Interruption, ByAFullDiskLeavesCompleteRecordsAndIsSaid) {
  const fs::path disk = folder_ / "disk";
  fs::create_directories(disk);
  if (::mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=1m") != 0) {
    GTEST_SKIP() << "mounting a file system needs root";
  }
  Write("sweep.json", Sweep(250));  // some 2 MB of records
  Expect("run sweep.json --out disk/out --jobs 2", 2, {"No space left on device"});
  const std::string text = ReadFile(disk / "out/results.jsonl");
  EXPECT_TRUE(text.ends_with("\n"));
  const std::size_t kept = ReadRecords(disk / "out").size();
  EXPECT_GT(kept, 10u);
  EXPECT_LT(kept, 1000u);
  EXPECT_FALSE(fs::exists(disk / "out/drift.csv")) << "no table of part of the cases";
  // the same store goes on where there is room
  fs::copy(disk / "out", folder_ / "moved", fs::copy_options::recursive);
  Expect("run sweep.json --out moved --jobs 2", 0, {std::to_string(kept) + " reused"});
  ::umount(disk.c_str());
}

// A disk that is full, or a file that may not grow, is no result of a method.
TEST_F(Interruption, AFaultOfTheMachineIsTheOutcomeOfNoCase) {
  Write("long.json", R"({"name": "long", "tolerances": [1e-6],
    "problems": [{"mechanism": "four-bar.json", "horizon": 1}],
    "methods": [{"formulation": ["odca", "lagrange"], "enforcement": "projection"}],
    "series": {"points": 2}, "output": {"step": 0.001}, "timing": {"repeats": 0}})");
  for (const char* isolate : {"", " --isolate"}) {
    fs::remove_all(folder_ / "out");
    const std::string run = std::string("run long.json --out out") + isolate;
    ExpectEnding(Call(run, "ulimit -f 200;"), 2, {"cannot write", ".csv", "File too large"});
    EXPECT_EQ(ReadFile(folder_ / "out/results.jsonl"), "");
    EXPECT_TRUE(fs::is_empty(folder_ / "out/trajectories")) << "no part of a trajectory is left";
    Expect(run, 0, {"ran 2 cases, 0 reused"});
  }
}

TEST(FullDisk, TakesBackWhatCouldNotBeWrittenWhole) {
  const fs::path store = fs::path(testing::TempDir()) / "loopbench-full-disk";
  fs::remove_all(store);
  Record record;
  record.Set("series", std::vector<double>(300, 1.0 / 3.0));
  const pid_t pid = ::fork();
  if (pid == 0) {
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit size = {20'000, 20'000};
    ::setrlimit(RLIMIT_FSIZE, &size);
    ResultStore writer(store);
    try {
      for (;;) writer.Append(record);
    } catch (const std::runtime_error& error) {
      ::_exit(std::string(error.what()).find("File too large") != std::string::npos ? 0 : 1);
    }
  }
  int status = 0;
  ::waitpid(pid, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 0);
  const std::string text = ReadFile(store / "results.jsonl");
  const std::string line = ToJsonLine(record) + '\n';
  EXPECT_EQ(text.size(), 20'000 / line.size() * line.size());
  fs::remove_all(store);
}

class Shards : public CommandLineTest {};

TEST_F(Shards, TogetherAreTheWhole) {
  Write("sweep.json", Sweep(5));
  Expect("run sweep.json --out whole", 0, {"ran 20 cases"});
  std::string parts;
  std::size_t sum = 0;
  for (const std::string k : {"1", "2", "3"}) {
    Expect("run sweep.json --shard " + k + "/3 --out part" + k, 0);
    sum += ReadRecords(folder_ / ("part" + k)).size();
    parts += " part" + k;
  }
  EXPECT_EQ(sum, 20u) << "no case in two shards";
  Expect("merge" + parts + " part2 --out merged", 0, {"of 4 stores: 20 cases"});
  EXPECT_EQ(Hashes(folder_ / "merged"), Hashes(folder_ / "whole"));
  Expect("run sweep.json --out merged", 0, {"ran 0 cases, 20 reused"});
  EXPECT_EQ(TableOf(folder_ / "merged"), TableOf(folder_ / "whole"));
}

TEST_F(Shards, ThatDisagreeAreRefused) {
  Expect("run tiny.json --out a", 0);
  Record other = ReadRecords(folder_ / "a").front();
  other.Set("state_hash", std::string("0123456789abcdef"));
  ResultStore(folder_ / "b.jsonl").Append(other);
  Expect("merge a b.jsonl --out c", 2,
         {"a and b.jsonl", "state_hash", "one of the stores is inconsistent"});
  EXPECT_FALSE(fs::exists(folder_ / "c/results.jsonl"));
}

TEST_F(Shards, AreMergedIntoANewStoreOnly) {
  Expect("run tiny.json --out a", 0);
  Expect("merge a --out a", 2, {"expected a new store"});
  EXPECT_EQ(ReadRecords(folder_ / "a").size(), 2u);
}

TEST_F(Shards, WithBadNumbersAreRefused) {
  for (const char* shard : {"0/2", "3/2", "1", "1/2x", "-1/2", "a/b", "4294967297/4294967298",
                            "1/4294967298", "1/", "/2", "+1/2", "1/1e3"}) {
    Expect(std::string("run tiny.json --shard ") + shard, 2, {"--shard", "k/n"});
  }
}

}  // namespace loopbench::harness::resume_test
