// What a merge writes, and when it is there.
#include <unistd.h>

#include "harness/base/record.h"
#include "harness/observers/reference.h"
#include "tests/harness/cli_fixture.h"
#include "tests/harness/records.h"
#include "tests/reference/cases.h"

namespace loopbench::harness::merge_test {

class MergeCommandTest : public CommandLineTest {
 protected:
  /// The same store again, its records changed.
  void CopyStore(const std::string& from, const std::string& to,
                 const std::function<void(Record*)>& change) const {
    fs::copy(folder_ / from, folder_ / to, fs::copy_options::recursive);
    fs::remove(folder_ / to / "results.jsonl");
    for (Record record : ReadRecords(folder_ / from)) {
      change(&record);
      ResultStore(folder_ / to).Append(record);
    }
  }
  std::vector<fs::path> Files(const std::string& folder) const {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder_ / folder)) {
      files.push_back(entry.path());
    }
    std::ranges::sort(files);
    return files;
  }
  void ExpectTrajectories(const std::string& store, const std::string& wanted) const {
    const std::vector<fs::path> files = Files(store + "/trajectories");
    EXPECT_EQ(files.size(), 2u);
    for (const fs::path& file : files) {
      const fs::path other = folder_ / wanted / "trajectories" / file.filename();
      EXPECT_TRUE(ReadFile(file) == ReadFile(other)) << file;
    }
  }
};

TEST_F(MergeCommandTest, TrajectoriesAreThoseOfTheRecordsThatAreKept) {
  Write("two.json", std::string(kTinyExperiment).insert(1, R"("output": {"number": 3},)"));
  Expect("run two.json --out whole", 0, {"ran 2 cases"});
  CopyStore("whole", "cut",
            [](Record* record) { record->Set("outcome", std::string("time-limit")); });
  for (const fs::path& file : Files("cut/trajectories"))
    WriteFileAtomically(file, "t [s]\n0\n", Onto::kAnyFile);
  Expect("merge cut whole --out m1", 0, {": 2 cases"});
  Expect("merge whole cut --out m2", 0, {": 2 cases"});
  ExpectTrajectories("m1", "whole");
  ExpectTrajectories("m2", "whole");

  // two stores of one run: it is enough that one of them has the file
  CopyStore("whole", "bare", [](Record*) {});
  fs::remove_all(folder_ / "bare/trajectories");
  for (const std::string order : {"whole bare --out m3", "bare whole --out m4"}) {
    const Ending merged = Call("merge " + order);
    ExpectEnding(merged, 0, {": 2 cases"});
    ExpectNone(merged.text, {"warning"});
    ExpectTrajectories(order.substr(order.size() - 2), "whole");
  }
  // and another run's is none
  Expect("merge cut bare --out m5", 0,
         {"no store has trajectories/", "as the run that is kept wrote it"});
  EXPECT_FALSE(fs::exists(folder_ / "m5/trajectories"));
}

TEST_F(MergeCommandTest, OneThatFailsLeavesNothing) {
  Expect("run tiny.json --out a", 0);
  ExpectEnding(Call("merge a --out deep/m", "ulimit -f 1;"), 2, {"File too large"});
  EXPECT_FALSE(fs::exists(folder_ / "deep"));
  fs::create_directory(folder_ / "m");
  ExpectEnding(Call("merge a --out m", "ulimit -f 1;"), 2, {"File too large"});
  EXPECT_TRUE(Files("m").empty());
  // what one that was killed left
  Write("m/results.jsonl.merging", "{\"kind\":");
  Expect("merge a --out m", 0, {": 2 cases"});
  EXPECT_EQ(Files("m").size(), 1u);
  EXPECT_EQ(ReadRecords(folder_ / "m").size(), 2u);
}

TEST_F(MergeCommandTest, OneAtATime) {
  Expect("run tiny.json --out a", 0);
  fs::create_directory(folder_ / "m");
  const int other = OpenLocked(folder_ / "m/results.jsonl.merging");
  Expect("merge a --out m", 2,
         {"m/results.jsonl.merging", "in use by process " + std::to_string(::getpid())});
  EXPECT_FALSE(fs::exists(folder_ / "m/results.jsonl"));
  ::close(other);
  {
    const ResultStore run(folder_ / "m");  // that has no record yet
    Expect("merge a --out m", 2, {"m/results.jsonl'", "in use by process "});
  }
  Expect("merge a --out m", 0, {": 2 cases"});
}

TEST_F(MergeCommandTest, TheTargetIsLookedAtBeforeTheStores) {
  Expect("run tiny.json --out a", 0);
  Write("bad.jsonl", "no record\n");
  Expect("merge bad.jsonl --out a", 2, {"a/results.jsonl: found records, expected a new"});
  Expect("merge bad.jsonl --out m", 2, {"bad.jsonl:1:"});
  EXPECT_FALSE(fs::exists(folder_ / "m"));
}

// Runs of one case may differ in what the table of measures says varies, and in nothing else.
TEST_F(MergeCommandTest, WhatVariesStandsInTheTableOfMeasures) {
  const auto refusal_of = [this](std::string_view key) -> std::string {
    std::vector<fs::path> stores;
    for (const char* value : {"1", "2"}) {
      Record record = RecordOf("kind", "accuracy", "id", "0123456789abcdef", "outcome", "finished",
                               std::string(key), value);
      stores.push_back(folder_ / fmt::format("{}-{}.jsonl", key, value));
      WriteFileAtomically(stores.back(), ToJsonLine(record) + '\n');
    }
    try {
      MergedStores{stores};
    } catch (const std::exception& error) {
      return error.what();
    }
    return "";
  };
  int varying = 0;
  for (const Measure& measure : Measures()) {
    const bool is_text = measure.type == ValueType::kText && !measure.key.ends_with('*');
    if (!is_text || measure.key == "id" || measure.key == "outcome" || measure.key == "checksum") {
      continue;
    }
    const bool varies = measure.repeats == Repeats::kNever;
    EXPECT_EQ(refusal_of(measure.key).empty(), varies) << measure.key;
    varying += varies;
  }
  EXPECT_GT(varying, 3);
  ExpectWords(refusal_of("of_another_program"), {"has of_another_program 1 in the first"});
}

TEST_F(MergeCommandTest, ALinkStaysOne) {
  Expect("run tiny.json --out a", 0);
  fs::create_directories(folder_ / "far/away");
  fs::create_symlink("far/away/m.jsonl", folder_ / "m.jsonl");
  Expect("merge a --out m.jsonl", 0, {": 2 cases"});
  EXPECT_TRUE(fs::is_symlink(folder_ / "m.jsonl"));
  EXPECT_EQ(ReadRecords(folder_ / "far/away/m.jsonl").size(), 2u);
}

TEST_F(MergeCommandTest, ALinkThatLeadsNowhereIsNamed) {
  Expect("run tiny.json --out a", 0);
  fs::create_symlink("nowhere/m.jsonl", folder_ / "m.jsonl");
  Expect("merge a --out m.jsonl", 2,
         {"m.jsonl: found a symbolic link to nowhere/m.jsonl, whose folder is not there"});
  fs::create_symlink("nowhere", folder_ / "m");
  Expect("merge a --out m", 2,
         {"cannot make folder 'm': 'm' is a symbolic link to 'nowhere', which is not there"});
  Expect("merge a --out m/below", 2, {"'m' is a symbolic link to 'nowhere'"});
  fs::create_symlink("one.jsonl", folder_ / "two.jsonl");
  fs::create_symlink("two.jsonl", folder_ / "one.jsonl");
  Expect("merge a --out one.jsonl", 2, {"one.jsonl: found a symbolic link in a circle of them"});
  EXPECT_TRUE(fs::is_symlink(folder_ / "one.jsonl"));
}

// Certified references go with the stores that are merged.

MechanismDescription Pendulum() {
  return ReadMechanism(kConfigs / "mechanisms/pendulum.json").description;
}

/// Two pictures of a pendulum that hangs, certified to `bound` until `until`.
Reference Certificate(double bound, double until, double cpu_s = 1.0) {
  Reference reference;
  reference.scalar = "long-double";
  reference.times = {0.0, 1.0};
  const MechanismDescription user = Pendulum();
  reference.snapshots.assign(2, {.bodies = std::vector<BodyState>(user.bodies.size()),
                                 .joints = std::vector<double>(user.joints.size())});
  reference.bounds.assign(2, {.position = bound});
  reference.trust_horizon = until;
  reference.cpu_s = cpu_s;
  return reference;
}

class MergeReferencesTest : public CommandLineTest {
 protected:
  void SetUp() override {
    CommandLineTest::SetUp();
    Expect("run tiny.json --no-timing --shard 1/2 --out a", 0);
    Expect("run tiny.json --no-timing --shard 2/2 --out b", 0);
  }
  fs::path File(const std::string& store, const std::string& id) const {
    return ReferencePath(folder_ / store / "results.jsonl", id);
  }
  void Certify(const std::string& store, const std::string& id, const Reference& reference) const {
    WriteReference(File(store, id), id, Pendulum(), reference);
  }
};

TEST_F(MergeReferencesTest, AreThoseOfAllStores) {
  Certify("a", "0000000000000001", Certificate(1e-15, 1.0));
  Certify("a", "0000000000000002", Certificate(1e-15, 1.0));
  Certify("b", "0000000000000002", Certificate(1e-15, 1.0, 7.0));  // as good, made more slowly
  Certify("b", "0000000000000003", Certificate(1e-14, 0.0));
  const Ending merged = Call("merge a b --out m");
  ExpectEnding(merged, 0, {"3 references beside it"});
  ExpectNone(merged.text, {"is kept"});
  for (const auto& [store, id] :
       {std::pair("a", "0000000000000001"), {"a", "0000000000000002"}, {"b", "0000000000000003"}}) {
    EXPECT_EQ(ReadFile(File("m", id)), ReadFile(File(store, id))) << id;
    EXPECT_TRUE(ReadReference(File("m", id), id, Pendulum()));
  }
}

TEST_F(MergeReferencesTest, KeepTheFinerCertificateInAnyOrderAndSayIt) {
  const std::string longer = "0000000000000001", finer = "0000000000000002";
  Certify("a", longer, Certificate(1e-15, 0.0));
  Certify("b", longer, Certificate(1e-15, 1.0));
  Certify("a", finer, Certificate(1e-17, 1.0));
  Certify("b", finer, Certificate(1e-15, 1.0));
  for (const std::string order : {"a b", "b a"}) {
    const Ending merged = Call("merge " + order + " --out m");
    ExpectEnding(merged, 0, {"two certificates of one reference", longer, finer, "is kept"});
    EXPECT_EQ(ReadFile(File("m", longer)), ReadFile(File("b", longer)));
    EXPECT_EQ(ReadFile(File("m", finer)), ReadFile(File("a", finer)));
    fs::remove_all(folder_ / "m");
  }
}

TEST_F(MergeReferencesTest, AreRefusedDamagedOrUnderAnotherNameBeforeAnythingIsWritten) {
  const std::string id = "0000000000000001";
  Certify("b", id, Certificate(1e-15, 1.0));
  const std::string sound = ReadFile(File("b", id));
  std::string changed = sound;
  changed.replace(changed.find("long-double"), 4, "shor");
  WriteFileAtomically(File("b", id), changed, Onto::kAnyFile);
  Expect("merge a b --out m", 2, {"0000000000000001.json", "checksum"});
  EXPECT_FALSE(fs::exists(folder_ / "m"));
  WriteFileAtomically(File("b", id), sound, Onto::kAnyFile);
  fs::rename(File("b", id), File("b", "0000000000000002"));
  Expect("merge a b --out m", 2,
         {"found reference \"0000000000000001\", expected \"0000000000000002\""});
  EXPECT_FALSE(fs::exists(folder_ / "m"));
}

}  // namespace loopbench::harness::merge_test
