// Stores that were damaged, edited, torn, shared or are none at all: nothing is lost, nothing is
// taken for what it is not, and every refusal names its place.
#include <sys/stat.h>
#include <unistd.h>

#include "harness/base/record.h"
#include "tests/harness/cli_fixture.h"
#include "tests/harness/records.h"

namespace loopbench::harness::store_integrity_test {

testing::AssertionResult Contains(const std::string& text, const std::string& part) {
  return testing::IsSubstring("part", "text", part, text);
}

class StoreIntegrity : public CommandLineTest {
 protected:
  void SetUp() override {
    CommandLineTest::SetUp();
    Record record =
        RecordOf("kind", "accuracy", "mechanism", "four-bar", "drift_position_max", 1.25e-7,
                 "outcome", "finished", "series.drift", std::vector<double>{0.0, 1e-9, 1.25e-7});
    ResultStore store(folder_ / "store");
    store.Append(record);
    record.Set("mechanism", std::string("toggle"));
    store.Append(record);
    text_ = ReadFile(folder_ / "store/results.jsonl");
  }

  /// Returns the error or the first warning of reading `text` as a store, or "".
  std::string Complaint(const std::string& text) const {
    const fs::path file = folder_ / "changed.jsonl";
    std::ofstream(file, std::ios::binary) << text;
    std::vector<std::string> warnings;
    const std::string error = MessageOf<std::runtime_error>([&] { ReadRecords(file, &warnings); });
    if (!error.empty()) return error;
    return warnings.empty() ? "" : warnings.front();
  }

  std::string text_;
};

TEST_F(StoreIntegrity, EveryFlippedBitIsSeen) {
  ASSERT_EQ(Complaint(text_), "");
  for (std::size_t bit = 0; bit < 8 * text_.size(); ++bit) {
    std::string changed = text_;
    changed[bit / 8] = static_cast<char>(changed[bit / 8] ^ (1 << (bit % 8)));
    const std::string complaint = Complaint(changed);
    ASSERT_TRUE(Contains(complaint, "changed.jsonl:")) << "bit " << bit;
  }
}

TEST_F(StoreIntegrity, AnEditedValueIsNamedWithBothChecksums) {
  std::string edited = text_;
  const std::string key = "\"drift_position_max\":";
  edited.insert(edited.rfind(key) + key.size(), "9");
  const std::string complaint = Complaint(edited);
  const std::string checksum = text_.substr(text_.size() - 19, 16);
  EXPECT_TRUE(Contains(complaint, "changed.jsonl:2: the line was changed"));
  EXPECT_TRUE(Contains(complaint, "found checksum \"" + checksum + "\", expected \""));
  for (const char* call : {"compare store changed.jsonl", "table changed.jsonl",
                           "merge changed.jsonl --out m", "plot changed.jsonl --out f"}) {
    Expect(call, 2, {"changed.jsonl:2: the line was changed"});
  }
}

// Another program that reads and writes the lines spells them otherwise: Python's json.dumps puts
// blanks in, sorts keys, or ends a line with blanks.
TEST_F(StoreIntegrity, AWrongChecksumIsRefusedInEverySpelling) {
  const std::string line = text_.substr(0, text_.find('\n'));
  const auto with = [](std::string text, const std::string& from, const std::string& to) {
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) {
      text.replace(at, from.size(), to);
    }
    return text;
  };
  const std::string edited = with(line, "1.25e-07", "1.25e-15");
  ASSERT_NE(edited, line);
  const std::size_t end = edited.find(",\"checksum\"");
  const std::string checksum = edited.substr(end + 1, edited.size() - end - 2);
  for (const std::string& changed :
       {edited, with(with(edited, ":", ": "), ",", ", "), edited + " ", with(edited, "\":", "\" :"),
        "{" + checksum + "," + edited.substr(1, end - 1) + "}",
        with(edited, "checksum", "\\u0063hecksum"),
        with(edited, "\"checksum\":", "\"checksum\":\t")}) {
    EXPECT_TRUE(Contains(Complaint(changed + "\n"), "the line was changed")) << changed;
  }
}

// Every command that reads rejects a missing checksum like a wrong one, with or without the format.
TEST_F(StoreIntegrity, AMissingChecksumIsRefusedByEveryReader) {
  const std::size_t first = text_.find('\n') + 1;
  std::string with_format = text_.substr(0, text_.find(",\"checksum\"")) + "}\n";
  std::string bare = with_format;
  bare.replace(bare.find("\"format\":2,"), 11, "");
  const auto expect = [this](const std::string& text, int line) {
    const std::string named =
        fmt::format("changed.jsonl:{}: found a line without its checksum, expected one", line);
    EXPECT_TRUE(Contains(Complaint(text), named)) << text;
    for (const char* call : {"table changed.jsonl", "compare store changed.jsonl",
                             "merge changed.jsonl --out m", "plot changed.jsonl --out f",
                             "report changed.jsonl", "export-metrics changed.jsonl --out e.csv",
                             "history add changed.jsonl --store h --commit a --date 2026-01-01"}) {
      Expect(call, 2, {named});
    }
    Expect("run tiny.json --out changed.jsonl", 2, {"without its checksum", "nothing"});
  };
  expect(with_format, 1);
  expect(text_ + with_format, 3);
  expect(text_ + bare, 3);
  expect(bare + text_.substr(first), 1);
  // lines by hand alone are read, and nothing with a checksum is appended to them
  EXPECT_EQ(Complaint(bare), "");
  Expect("table changed.jsonl", 0, {"four-bar"});
  Expect("run tiny.json --out changed.jsonl", 2, {"without its checksum", "nothing"});
  EXPECT_EQ(ReadFile(folder_ / "changed.jsonl"), bare);
}

// Address space from too little to start with to enough: an exit code and a message, no signal.
TEST_F(StoreIntegrity, MemoryThatIsTooSmallIsSaid) {
#if defined(__SANITIZE_ADDRESS__)
  GTEST_SKIP() << "the sanitizer reserves the whole address space";
#endif
  Record record = ReadRecords(folder_ / "store").front();
  std::vector<Record> records;
  for (int i = 0; i < 3000; ++i) {
    record.Set("case_id", fmt::format("{:016x}", i));
    record.Set("series.drift", std::vector<double>(20, 1e-9 * i));
    records.push_back(record);
  }
  ResultStore(folder_ / "large").Append(records);
  fs::create_directory(folder_ / "other");
  fs::copy_file(folder_ / "large/results.jsonl", folder_ / "other/results.jsonl");
  int refusals = 0;
  for (const char* call : {"table large", "compare large other", "report large"}) {
    for (int kilobytes = 26'000; kilobytes < 60'000; kilobytes += 3'000) {
      const Ending ending = Call(call, fmt::format("ulimit -v {} &&", kilobytes));
      const bool is_started = ending.code != 127;  // which the loader of shared libraries returns
      const bool is_done = ending.code == 0 || ending.text.find("Compared") != std::string::npos;
      if (is_done) break;  // more memory is enough, too
      if (!is_started) continue;
      ++refusals;
      EXPECT_EQ(ending.code, 2) << kilobytes << ' ' << call << ": " << ending.text;
      EXPECT_TRUE(Contains(ending.text, "memory")) << kilobytes << ' ' << call;
    }
  }
  EXPECT_GT(refusals, 5);
}

TEST_F(StoreIntegrity, LinesMadeByHandNeedNoChecksum) {
  EXPECT_EQ(Complaint("{\"kind\":\"timing\",\"bodies\":3}\n"), "");
  EXPECT_EQ(Complaint("{\"kind\":\"timing\",\"bodies\":3}\r\n\r\n\n"), "");
  EXPECT_TRUE(Contains(Complaint("{}\n"), "changed.jsonl:1: found a record without values"));
}

TEST_F(StoreIntegrity, ValuesOfWrongTypeAreNamed) {
  const auto of = [&](const std::string& item) {
    return Complaint("{\"kind\":\"timing\"," + item + "}\n");
  };
  const std::pair<const char*, const char*> refused[] = {
      {R"("drift_position_max":"oops")",
       "changed.jsonl:1: key 'drift_position_max': expected a number or null, found \"oops\""},
      {R"("drift_position_max":[1])", "found an array"},
      {R"("steps":true)", "expected a number or null, found true"},
      {R"("outcome":1)", "expected a string or null, found 1"},
      {R"("series.rhs_ns":2.5)", "expected an array of numbers, found 2.5"},
      {R"("series.rhs_ns":[1,[2]])", "expected an array of numbers"},
      {R"("growth_resolved":"yes")", "expected true, false or null"},
      {R"("steps":1,"steps":2)", "key 'steps': expected each key once"},
      {R"("rtol":1e999)", "expected one that fits a double"},
      {R"("rtol":1e-999)", "at least 4.9e-324"},
      {R"("a":{"b":1})", "key 'a'"},
      {R"("a":["x"])", "expected an array of numbers, found \"x\""},
      {R"("a":18446744073709551615)", "below 2^63"},
      {R"("a":oops)", R"("kind":"timing","a":oops})"}};
  for (const auto& [item, words] : refused) EXPECT_TRUE(Contains(of(item), words)) << item;
  EXPECT_TRUE(Contains(Complaint("{\"kind\":\"timing\"}\noops\n"), "changed.jsonl:2:"));
  EXPECT_TRUE(Contains(MessageOf<std::runtime_error>([&] { ReadRecords(folder_ / "none.jsonl"); }),
                       "No such file"));
  EXPECT_EQ(of(R"("steps":null,"mass":"heavy","stiffness":[1,null],"flag":true)"), "");
}

TEST_F(StoreIntegrity, DepthAndLengthCostNoMoreThanTheirBytes) {
  constexpr std::size_t kDeep = 1'000'000;
  const std::string open(kDeep, '['), close(kDeep, ']');
  EXPECT_TRUE(Contains(Complaint("{\"a\":[" + open + "1" + close + "]}\n"), "found an array"));
  EXPECT_TRUE(Contains(Complaint(open + "\n"), "expected a JSON object, found an array"));
  std::string objects;
  for (std::size_t i = 0; i < kDeep; ++i) objects += "{\"a\":";
  EXPECT_TRUE(Contains(Complaint(objects), "found an object"));
  std::string wide = "{\"kind\":\"timing\"";
  for (int i = 0; i < 300'000; ++i) wide += ",\"k" + std::to_string(i) + "\":0";
  EXPECT_EQ(Complaint(wide + "}\n"), "");
}

TEST_F(StoreIntegrity, EveryBeginningOfALineIsTornAndNothingElse) {
  const std::string line = text_.substr(0, text_.find('\n'));
  for (std::size_t length = 1; length < line.size(); ++length) {
    ASSERT_TRUE(IsTornRecord(line.substr(0, length))) << length;
  }
  EXPECT_FALSE(IsTornRecord(line));
  EXPECT_FALSE(IsTornRecord(line + "J"));
  EXPECT_FALSE(IsTornRecord("notes without a line end"));
  EXPECT_FALSE(IsTornRecord("{\"todo\": \"buy"));
}

TEST_F(StoreIntegrity, WhatIsNoStoreStaysAsItIs) {
  const std::vector<std::string> texts = {"notes without a line end",
                                          "one\rtwo\r",
                                          "{\"kind\":\"accuracy\"}\rsecond line",
                                          text_ + "notes",
                                          "notes\n" + text_ + "{\"kind\":\"acc",
                                          "{\"todo\": \"buy milk",
                                          "{\"a\":1}",
                                          "{\"a\":1}\n"};
  for (const std::string& text : texts) {
    Write("notes.jsonl", text);
    for (const char* call : {"merge store --out notes.jsonl", "run tiny.json --out notes.jsonl"}) {
      Expect(call, 2, {"notes.jsonl:", "nothing was changed"});
      EXPECT_EQ(ReadFile(folder_ / "notes.jsonl"), text);
    }
  }
}

TEST_F(StoreIntegrity, AFileAsStoreHasItsTablesBesideIt) {
  Expect("run tiny.json --out new/mine.jsonl", 0, {"ran 2 cases"});
  EXPECT_EQ(ReadRecords(folder_ / "new/mine.jsonl").size(), 2u);
  EXPECT_TRUE(fs::exists(folder_ / "new/mine.drift.csv"));
  EXPECT_FALSE(fs::exists(folder_ / "new/drift.csv")) << "which may be somebody's";
}

TEST_F(StoreIntegrity, AnotherFormatIsRefusedByNameAndNoneIsThatOfBefore) {
  EXPECT_TRUE(Contains(Complaint("{\"format\":2,\"kind\":\"timing\",\"bodies\":3}\n"),
                       "found a line without its checksum"));
  EXPECT_EQ(FromJsonLine(text_.substr(0, text_.find('\n'))).Find("format"), nullptr);
  for (const char* other : {"1", "3", "2.0", "\"2\"", "null", "[2]"}) {
    const std::string said =
        Complaint(std::string("{\"format\":") + other + ",\"kind\":\"timing\"}\n");
    ExpectWords(said, {"key 'format': expected "});
  }
  const std::string later = Complaint("{\"format\":3,\"kind\":\"timing\",\"more\":{}}\n");
  ExpectWords(later, {"expected 2, the format that this version reads, found 3"});
}

TEST_F(StoreIntegrity, ATornLineStopsAMerge) {
  Write("torn.jsonl", text_.substr(0, text_.size() - 30));
  Expect("merge torn.jsonl --out merged", 2, {"torn.jsonl:2:", "give its command again"});
  EXPECT_FALSE(fs::exists(folder_ / "merged"));
}

TEST_F(StoreIntegrity, RecordsOfOneIdThatDifferStopAMerge) {
  Expect("run tiny.json --out a", 0);
  const std::vector<Record> records = ReadRecords(folder_ / "a");
  const auto write = [&](const std::string& name, const std::string& key, const Value& value) {
    Record changed = records[0];
    changed.Set(key, value);
    ResultStore(folder_ / name).Append(changed);
  };
  write("drift.jsonl", "drift_position_max", 123.0);
  write("series.jsonl", "series.drift", std::vector<double>{1.0});
  write("more.jsonl", "extra", 1.0);
  write("time.jsonl", "wall_s", 123.0);
  write("late.jsonl", "outcome", std::string("time-limit"));
  const std::string id = records[0].Text("id");
  for (const std::string order : {"a drift.jsonl", "drift.jsonl a"}) {
    Expect("merge " + order + " --out m", 2,
           {" and ", "drift.jsonl", id, "drift_position_max", "123", "is inconsistent"});
  }
  Expect("merge a series.jsonl --out m", 2, {"series.drift"});
  Expect("merge a more.jsonl --out m", 2, {"has extra nothing in the first and 1"});
  EXPECT_FALSE(fs::exists(folder_ / "m"));
  // times differ from run to run, and a run that was cut short gives way
  Expect("merge a time.jsonl --out times", 0, {"3 records of 2 stores: 2 cases"});
  for (const std::string order : {"a late.jsonl --out m1", "late.jsonl a --out m2"}) {
    Expect("merge " + order, 0, {": 2 cases"});
  }
  ExpectNone(Call("table m1 --format csv --columns outcome,steps").text, {"time-limit"});
  ExpectNone(Call("table m2 --format csv --columns outcome,steps").text, {"time-limit"});
}

TEST_F(StoreIntegrity, TheLockIsOfTheFileByWhateverName) {
  fs::create_directory_symlink("store", folder_ / "linked");
  fs::create_symlink("store/results.jsonl", folder_ / "alias.jsonl");
  fs::create_hard_link(folder_ / "store/results.jsonl", folder_ / "hard.jsonl");
  const std::string holder = "in use by process " + std::to_string(::getpid());
  {
    const ResultStore store(folder_ / "store");
    fs::remove(folder_ / "store/results.jsonl.lock");  // what earlier versions locked
    for (const char* name : {"store", "linked", "alias.jsonl", "hard.jsonl"}) {
      EXPECT_TRUE(
          Contains(MessageOf<std::runtime_error>([&] { ResultStore(folder_ / name); }), holder))
          << name;
    }
  }
  EXPECT_EQ(MessageOf<std::runtime_error>([&] { ResultStore(folder_ / "linked"); }), "");
}

TEST_F(StoreIntegrity, AStoreThatIsReplacedOrRemovedIsNoticed) {
  for (const bool replace : {true, false}) {
    ResultStore store(folder_ / "store");
    store.Append(Record{});
    if (replace) {
      Write("store/results.jsonl", text_);
    } else {
      fs::remove(folder_ / "store/results.jsonl");
    }
    EXPECT_TRUE(Contains(MessageOf<std::runtime_error>([&] { store.Append(Record{}); }),
                         "was removed or replaced"));
    if (!replace) continue;
    EXPECT_EQ(ReadFile(folder_ / "store/results.jsonl"), text_);
  }
}

TEST_F(StoreIntegrity, WhatIsNoRegularFileIsRefused) {
  ASSERT_EQ(::mkfifo((folder_ / "pipe.jsonl").c_str(), 0600), 0);
  fs::create_symlink("/dev/zero", folder_ / "zero.jsonl");
  for (const std::string name : {"pipe.jsonl", "zero.jsonl"}) {
    Expect("table " + name, 2, {name, "regular file"});
    Expect("merge store --out " + name, 2, {name, "regular file"});
  }
}

TEST_F(StoreIntegrity, ALimitOfFileSizesIsAnErrorAndLeavesWholeRecords) {
  std::string many = kTinyExperiment;
  many.replace(many.find("[1e-6]"), 6, "[1e-4, 1e-5, 1e-6, 1e-7, 1e-8]");
  Write("many.json", many);
  ExpectEnding(Call("run many.json --out out", "ulimit -f 64;"), 2, {"File too large"});
  const std::string text = ReadFile(folder_ / "out/results.jsonl");
  EXPECT_TRUE(text.ends_with("\n"));
  EXPECT_GE(ReadRecords(folder_ / "out").size(), 1u);
  for (const auto& entry : fs::directory_iterator(folder_ / "out")) {
    EXPECT_EQ(entry.path().filename(), "results.jsonl") << "nothing half-written";
  }
  Expect("run many.json --out out", 0, {"10 "});
}

// Stores that are not held whole (32 MiB and more): messages are true of all of it.

constexpr int kLines = 20'000;

class LargeStore : public CommandLineTest {
 protected:
  /// Masses 0 to 4.5; the last of them with a parameter and a measure that no other has.
  static std::string Line(int i) {
    Record record;
    record.Set("kind", std::string("accuracy"));
    record.Set("mass", 0.5 * (i % 10));
    if (i % 10 == 9) record.Set("friction", 0.1);
    record.Set("case_id", std::to_string(i));
    record.Set("outcome", std::string("finished"));
    record.Set("message", std::string(2000, 'x') + "\"mass\":1.5,");  // behind the keys: no key
    if (i % 10 == 9) record.Set("drift_position_max", 1e-9);
    return ToJsonLine(record) + '\n';
  }
  void SetUp() override {
    CommandLineTest::SetUp();
    for (int i = 0; i < kLines; ++i) text_ += Line(i);
    Write("large.jsonl", text_);
    ASSERT_TRUE(IsLarge(folder_ / "large.jsonl"));
  }
  std::string text_;
};

TEST_F(LargeStore, DamageIsNamedByItsLineInTheFile) {
  text_[text_.rfind("xxx")] = 'y';  // in the last line, far behind the first that is looked at
  Write("large.jsonl", text_);
  Expect("run tiny.json --out large.jsonl", 2, {"large.jsonl:20000: ", "nothing was changed"});
  Expect("table large.jsonl --where mass=4.5", 2, {"large.jsonl:20000: "});
}

TEST_F(LargeStore, AKeyThatOnlyOtherRecordsHaveIsKnown) {
  for (const std::string key : {"friction=0.1", "friction<1", "drift_position_max<1"}) {
    const Ending ending = Call("table large.jsonl --where mass=1.5 --where '" + key + "'");
    ExpectNone(ending.text, {"which no record has", "no record has a number"});
  }
  Expect("table large.jsonl --where mass=1.5 --where frction=0.1", 2, {"which no record has"});
  // and no more of the others is read than that
  const Selection where = {ParseCondition("mass=1.5"), ParseCondition("friction<1")};
  EXPECT_EQ(ReadRecords(folder_ / "large.jsonl", where, nullptr).size(), 2000u + 2u);
}

TEST_F(LargeStore, OnlyChosenParametersAreRead) {
  const auto chosen = [this](const std::string& condition) {
    return ReadRecords(folder_ / "large.jsonl", {ParseCondition(condition)}, nullptr);
  };
  const std::vector<Record> some = chosen("mass=1.5");
  ASSERT_EQ(some.size(), 2001u);  // the first one stays
  EXPECT_EQ(some[1].Text("case_id"), "3");
  EXPECT_EQ(some.back().Text("case_id"), "19993");
  EXPECT_EQ(chosen("mass<1").size(), 4000u);
  // measured values, and keys that distinguish methods of a problem, are selected later
  EXPECT_EQ(chosen("outcome=crashed").size(), 20'000u);
  // damage in what is read is named by its line, all else is as in a small store
  text_[text_.find("\"mass\":1.5") + 7] = '2';
  Write("large.jsonl", text_);
  const std::string error = MessageOf<std::runtime_error>([&] { chosen("mass=2.5"); });
  ExpectWords(error, {"large.jsonl:4:"});
  EXPECT_EQ(chosen("mass=1.5").size(), 2000u);
}

}  // namespace loopbench::harness::store_integrity_test
