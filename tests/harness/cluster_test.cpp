// Runs in parts, by the folder alone: what a cluster's engine calls, and what is known without one.
#include <unistd.h>

#include "harness/base/record.h"
#include "tests/harness/cli_fixture.h"

namespace loopbench::harness::cluster_test {

class Cluster : public CommandLineTest {
 protected:
  /// The deterministic part of a store: its records without times.
  std::vector<std::string> Lines(const std::string& store) const {
    std::vector<std::string> lines;
    for (const Record& record : ReadRecords(folder_ / store)) {
      Record kept;
      for (const auto& [key, value] : record.items()) {
        if (key != "wall_s" && key != "cpu_s") kept.Set(key, value);
      }
      lines.push_back(ToJsonLine(kept));
    }
    return lines;
  }
  Ending Part(const std::string& k) const {
    return Call("", "sh parts/part.sh " + k + " 2>&1; exit $?;");
  }
};

/// The first key of two lines that is not the same.
std::string Difference(const std::string& line, const std::string& other) {
  const Record one = FromJsonLine(line), two = FromJsonLine(other);
  for (const auto& [key, value] : one.items()) {
    if (one.Text(key) != two.Text(key)) {
      return key + ": " + one.Text(key) + " and " + two.Text(key);
    }
  }
  return "a series, or the order of keys";
}

constexpr const char* kSix = R"({
  "name": "six", "tolerances": [1e-6, 1e-8],
  "problems": [{"mechanism": "four-bar.json", "horizon": 0.5}],
  "methods": [{"formulation": ["odca", "lagrange", "reduction"], "enforcement": "acceleration"}],
  "timing": {"repeats": 0}
})";

TEST_F(Cluster, PartsAreMergedToWhatOneRunGives) {
  Write("six.json", kSix);
  Expect("run six.json --no-timing --out whole", 0, {"ran 6 cases"});
  Expect("submit six.json --tasks 4 --no-timing --no-queue --out parts", 0,
         {"6 cases in 4 parts", "part.sh K"});
  Expect("status parts", 0, {"six in 4 parts", "4 waiting"});
  for (const char* k : {"4", "2", "1"}) EXPECT_EQ(Part(k).code, 0);
  Expect("status parts", 0, {"3 done, 1 waiting"});
  Expect("collect parts", 1, {"1 of 4 parts are not done: 3; nothing was merged"});
  EXPECT_FALSE(fs::exists(folder_ / "parts/whole"));
  EXPECT_EQ(Part("3").code, 0);
  ExpectEnding(Part("3"), 0, {"ran 0 cases"});  // a second time: nothing is left
  Expect("collect parts", 0, {"6 records of 4 stores: 6 cases"});
  // a run writes cases as they end, long ones first; a merge in the order of the experiment
  std::vector<std::string> merged = Lines("parts/whole"), whole = Lines("whole");
  ExpectWords(merged.front(), {"odca"});
  ExpectWords(merged.back(), {"reduction"});
  std::ranges::sort(merged);
  std::ranges::sort(whole);
  ASSERT_EQ(merged.size(), whole.size());
  for (std::size_t i = 0; i < whole.size(); ++i) {
    EXPECT_TRUE(merged[i] == whole[i]) << Difference(merged[i], whole[i]);
  }
  Expect("collect parts", 0, {"is there already"});
  const Ending status = Call("status parts --json");
  ExpectEnding(status, 0, {"\"cases\":6", "\"done\":6", "\"failed\":0", "\"to_do\":0"});
}

TEST_F(Cluster, AMergeIsThereWhenItIsWhole) {
  Expect("submit tiny.json --tasks 2 --no-timing --no-queue --out parts", 0);
  for (const char* k : {"1", "2"}) EXPECT_EQ(Part(k).code, 0);
  ExpectEnding(Call("collect parts", "ulimit -f 1;"), 2, {"File too large"});
  const auto is_merged = [this] {
    return Call("status parts").text.find("merged: ") != std::string::npos;
  };
  EXPECT_FALSE(is_merged());
  Write("parts/whole/results.jsonl", "");  // as earlier versions left it
  EXPECT_FALSE(is_merged());
  {
    const int other = OpenLocked(folder_ / "parts/whole/results.jsonl.merging");
    Expect("status parts", 0, {"being merged"});
    Expect("collect parts", 2, {"in use by process "});
    ::close(other);
  }
  Expect("collect parts", 0, {"2 records of 2 stores: 2 cases"});
  EXPECT_TRUE(is_merged());
  Expect("collect parts", 0, {"is there already"});
}

TEST_F(Cluster, FailedCasesAreCountedAsSuch) {
  Write("six.json", kSix);
  Expect("submit six.json --tasks 2 --no-timing --no-queue --out parts", 0);
  setenv("LOOPBENCH_FAULT", "crash:formulation=lagrange", 1);
  for (const char* k : {"1", "2"}) EXPECT_EQ(Part(k).code, 0);
  unsetenv("LOOPBENCH_FAULT");
  Expect("status parts --json", 0, {"\"done\":4", "\"failed\":2", "\"to_do\":0"});
}

TEST_F(Cluster, AChangedMechanismIsNotMerged) {
  Write("six.json", kSix);
  Expect("submit six.json --tasks 2 --no-timing --no-queue --out parts", 0);
  EXPECT_EQ(Part("1").code, 0);
  EditMechanism("\"mass\": 1.0,", "\"mass\": 1.01,");
  EXPECT_EQ(Part("2").code, 0);
  Expect("collect parts", 1, {"3 of 6 cases are in no part", "nothing was merged"});
  EXPECT_FALSE(fs::exists(folder_ / "parts/whole"));
}

TEST_F(Cluster, ScriptsSayWhatWasAsked) {
  Write("six.json", kSix);
  const Ending dry = Call(
      "submit six.json --tasks 3 --jobs 2 --time 1:00:00 --partition cpu --sbatch=--account=a "
      "--filter 'formulation!=odca' --set /limits/cpu_s=5 --out parts --dry-run");
  ExpectEnding(dry, 0,
               {"#SBATCH --array=1-3", "#SBATCH --requeue", "#SBATCH --cpus-per-task=2",
                "#SBATCH --time=1:00:00", "#SBATCH --partition=cpu", "#SBATCH --account=a",
                "--filter 'formulation!=odca'", "--set /limits/cpu_s=5", "--jobs 2 --wait",
                "--shard \"$part/3\"", " collect ", "4 cases in 3 parts; nothing was written"});
  EXPECT_FALSE(fs::exists(folder_ / "parts"));
}

TEST_F(Cluster, APathMayHoldWhatSlurmAndShellsRead) {
  Write("six.json", kSix);
  // what people copy from the terminal too
  const std::string quoted = "'" + folder_.string() + "/a b%j #";
  ExpectEnding(
      Call("submit six.json --tasks 2 --no-timing --no-queue --out 'a b%j #'"), 0,
      {"each part: sh " + quoted + "/part.sh' K; then: loopbench collect " + quoted + "'\n"});
  Expect("submit six.json --tasks 2 --no-queue --out 'a b%j #'", 2,
         {"to resume it: loopbench submit --resubmit --out " + quoted + "'\n"});
  ExpectEnding(Call("", "sh 'a b%j #/part.sh' 1 2>&1; exit $?;"), 0, {"ran 3 cases"});
  const std::string text = ReadFile(folder_ / "a b%j #/collect.sh");
  ExpectWords(text, {"#SBATCH --output=\"" + folder_.string() + "/a b%%j #/logs/collect.log\"\n"});
  Expect("submit six.json --tasks 2 --out 'a b%j' --dry-run", 0,
         {"/a b%%j/logs/%a.log\"", "/a b%%j/logs/collect.log\""});
  // a line end would end a comment line, and begin a command
  const std::string refused = "found a line end in '", submit = "submit six.json --tasks 2 ";
  for (const char* end : {"\n", "\r"}) {
    for (const std::string option :
         {"--out 'a", "--out x --set '/name=\"a", "--out x --filter 'rtol=1", "--out x --time '1",
          "--out x --sbatch '--comment=a"}) {
      Expect(submit + option + end + "touch pwned' --dry-run", 2, {refused});
    }
  }
  Write("a\nb.json", kSix);
  Expect("submit 'a\nb.json' --tasks 2 --out x --dry-run", 2, {"experiment: " + refused});
}

TEST_F(Cluster, APartIsANumberOfThem) {
  Write("six.json", kSix);
  Expect("submit six.json --tasks 2 --no-timing --no-queue --out parts", 0);
  for (const char* k : {"01", "3", "0", "../x", "-1", "''", "1x", "99999999999999999999"}) {
    ExpectEnding(Part(k), 2, {"part.sh: found '", "expected the number of a part, 1 to 2"});
    EXPECT_FALSE(fs::exists(folder_ / "parts/parts")) << k;
  }
  ExpectEnding(Part(""), 2, {"expected the number of a part, 1 to 2"});
}

TEST_F(Cluster, AgainTakesWhatTheFolderSays) {
  Write("six.json", kSix);
  Expect("submit six.json --tasks 3 --no-timing --no-queue --out parts", 0);
  EXPECT_EQ(Part("2").code, 0);
  for (const char* option : {"--tasks 7", "--jobs 1", "--time 1", "--partition p", "--sbatch=--a",
                             "--filter a=b", "--set /a=b", "--no-timing", "--isolate"}) {
    const std::string name = std::string(option).substr(0, std::string(option).find_first_of(" ="));
    Expect(std::string("submit --resubmit --out parts ") + option, 2,
           {"--resubmit: found " + name +
            " beside it, expected none: the folder contains the options"});
  }
  fs::remove(folder_ / "parts/part.sh");  // of a submit that was killed
  Expect("submit --resubmit --no-queue --out parts", 0,
         {"2 of 3 parts are not done: 1, 3", "part.sh K"});
  EXPECT_FALSE(fs::exists(folder_ / "parts/array.sh"));
  for (const char* k : {"1", "3"}) EXPECT_EQ(Part(k).code, 0);
  Expect("submit --resubmit --no-queue --out parts", 0, {"every part is done"});
}

TEST_F(Cluster, ACaseOfTwoFilesIsOneCaseOfOnePart) {
  Write("six.json", kSix);
  Expect("submit six.json ./six.json --tasks 2 --no-queue --out parts", 2,
         {"six.json: found twice, expected each experiment once"});
  std::string other = kSix;
  other.replace(other.find("[1e-6, 1e-8]"), 12, "[1e-6, 1e-7]");
  Write("other.json", other);
  const std::string submit = "submit six.json other.json --tasks 4 --no-timing --no-queue";
  Expect(submit + " --out parts", 0, {"9 cases in 4 parts"});
  for (const char* k : {"1", "2", "3", "4"}) EXPECT_EQ(Part(k).code, 0);
  Expect("status parts --json", 0, {"\"cases\":9", "\"done\":9", "\"to_do\":0"});
  Expect("collect parts", 0, {"9 records of 4 stores: 9 cases"});
}

TEST_F(Cluster, OfSubmitsAtOnceOneMakesTheFolder) {
  Write("six.json", kSix);
  std::string all;
  for (int i = 0; i < 8; ++i) {
    all += "('" LOOPBENCH_BINARY
           "' submit six.json --tasks 2 --no-queue --out parts >/dev/null 2>&1"
           " && echo made) & ";
  }
  EXPECT_EQ(Call("", all + "wait; exit 0;").text, "made\n");
}

TEST_F(Cluster, WhatCannotRunIsRefusedBeforeAnythingIsWritten) {
  Write("six.json", kSix);
  Expect("submit six.json --tasks 7 --no-queue --out parts", 2,
         {"--tasks: found 7, expected at most 6"});
  Expect("submit none.json --tasks 2 --no-queue --out parts", 2, {"none.json"});
  Expect("submit six.json --filter mas=1 --tasks 2 --no-queue --out parts", 2, {"no such key"});
  Expect("submit --tasks 2 --out parts", 2, {"found no experiment"});
  Expect("submit six.json --resubmit --out parts", 2, {"found experiments beside it"});
  Expect("submit --resubmit --out parts", 2, {"parts/cluster.json: no such file"});
  Expect("submit six.json --sbatch=account --out parts", 2,
         {"found 'account', expected an option that begins with --"});
  EXPECT_FALSE(fs::exists(folder_ / "parts"));
  Write("bin/sbatch", "#!/bin/sh\necho hello\n");
  fs::permissions(folder_ / "bin/sbatch", fs::perms::owner_all);
  ExpectEnding(Call("submit six.json --tasks 2 --out said", "PATH=$PWD/bin:$PATH"), 2,
               {"sbatch: found \"hello", "expected a job number"});
  Expect("status nowhere", 2, {"nowhere/cluster.json: no such file"});
  Expect("submit six.json --tasks 2 --no-queue --out parts", 0);
  Expect("submit six.json --tasks 2 --no-queue --out parts", 2,
         {"expected a new one", "--resubmit"});
}

TEST_F(Cluster, DamageIsNamedWithItsKey) {
  Write("six.json", kSix);
  Expect("submit six.json --tasks 2 --no-queue --out parts", 0);
  const std::string whole = ReadFile(folder_ / "parts/cluster.json");
  const auto expect = [this](const std::string& text, const std::vector<std::string>& words) {
    Write("parts/cluster.json", text);
    const Ending ending = Call("status parts");
    ExpectEnding(ending, 2, {"parts/cluster.json: "});
    ExpectEnding(ending, 2, words);
  };
  expect("",
         {"found an empty file", "submit once more, without --resubmit, after: rm parts/cluster"});
  expect("{\"kind\":\"cluster\"}\n", {"\"experiment\": found nothing, expected a text"});
  const std::string bare = whole.substr(0, whole.find(",\"checksum\"")) + "}";
  const auto with = [&bare](const std::string& from, const std::string& to) {
    std::string text = bare;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return WithChecksum(text.replace(at, from.size(), to)) + "\n";
  };
  expect(bare + "\n", {"found a line without its checksum"});
  expect(with("\"parts\":2", "\"parts\":\"two\""), {"\"parts\": found \"two\", expected a whole"});
  expect(with("\"parts\":2", "\"parts\":0"), {"\"parts\": found 0, expected 1 to 100000"});
  expect(with("\"parts\":2", "\"parts\":3"), {"\"cases_of_parts\": found 2 numbers, expected 3"});
  expect(with("\"isolate\":false", "\"isolate\":1"), {"\"isolate\": found 1, expected true or"});
  expect(with("\"cases_of_parts\":[", "\"cases_of_parts\":null,\"x\":["),
         {"\"cases_of_parts\": found null, expected numbers"});
  expect(with("\"program\":\"", "\"program\":7,\"x\":\""),
         {"\"program\": found 7, expected a text"});
  expect("no JSON\n", {});
}

}  // namespace loopbench::harness::cluster_test
