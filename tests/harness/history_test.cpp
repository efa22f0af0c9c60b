// Measurements over commits: what is kept and refused, and which state is a base.
#include "harness/history/history.h"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "harness/history/history_page.h"
#include "harness/history/history_series.h"
#include "harness/store/result_store.h"
#include "harness/text/config_error.h"
#include "harness/text/files.h"
#include "tests/harness/history_of.h"

namespace loopbench::harness {
namespace history_test {

std::vector<double> ValuesOf(const HistorySeries& series) {
  std::vector<double> values;
  for (const HistoryValue& one : series.values) values.push_back(one.value);
  return values;
}

TEST_F(HistoryOf, CommitsStandInTheOrderOfTheirDates) {
  for (const int number : {3, 1, 2}) Add(number, {Measured("bar", 1e-3 * number, number)});
  const History history = ReadHistory(folder_);
  ASSERT_EQ(history.entries.size(), 3u);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(history.entries[i].commit, CommitName(i + 1));
  const HistoryFindings found = FindingsOf(history);
  for (const HistorySeries& series : found.series) {
    if (series.measure == "steps") {
      EXPECT_EQ(ValuesOf(series), (std::vector<double>{1.0, 2.0, 3.0}));
    }
  }
  // series of a run stay behind, samples of times do not
  EXPECT_EQ(ReadFile(history.entries[0].results).find("series.t"), std::string::npos);
}

TEST_F(HistoryOf, WhatIsNoMeasurementIsRefused) {
  const std::vector<Record> good = {Measured("bar", 1e-3, 1)};
  EXPECT_NE(Refusal({.commit = "a", .date = "yesterday"}, good).find("\"yesterday\""),
            std::string::npos);
  EXPECT_NE(Refusal({.commit = "a", .date = "2026-11-24T10:00:00+01:00"}, good).find("UTC"),
            std::string::npos);
  EXPECT_NE(Refusal({.commit = "a", .date = "2026-11-24"}, {}).find("no record"),
            std::string::npos);
  std::vector<Record> two = {Measured("bar", 1e-3, 1), Measured("rod", 1e-3, 1)};
  two[1].Set("machine", std::string("another one"));
  EXPECT_NE(Refusal({.commit = "a", .date = "2026-11-24"}, two).find("one machine"),
            std::string::npos);
  EXPECT_FALSE(fs::exists(folder_));  // nothing half-written
  EXPECT_EQ(Refusal({.commit = "a", .date = "2026-11-24"}, good), "taken");
  EXPECT_NE(Refusal({.commit = "a", .date = "2026-11-24"}, good).find("--replace"),
            std::string::npos);
  EXPECT_EQ(ReadHistory(folder_).entries.size(), 1u);
}

TEST_F(HistoryOf, NamesOfCommitsAreNoPaths) {
  const HistoryEntry added = AddToHistory(
      folder_, {.commit = "../../escaped", .date = "2026-11-24"}, {Measured("bar", 1, 1)}, false);
  EXPECT_EQ(added.results.parent_path(), folder_ / "results");
  // long names that begin alike have files of their own
  for (const char* name : {"release-2026-11-01", "release-2026-11-02"}) {
    AddToHistory(folder_, {.commit = name, .date = "2026-11-24"}, {Measured("bar", 1, 1)}, false);
  }
  std::set<fs::path> files;
  for (const HistoryEntry& entry : ReadHistory(folder_).entries) files.insert(entry.results);
  EXPECT_EQ(files.size(), 3u);
}

TEST_F(HistoryOf, MeasuredAgainTakesThePlaceAndLosesTheMark) {
  Add(1, {Measured("bar", 1e-3, 10)});
  MarkInHistory(folder_, CommitName(1), "bad", "slow disk");
  Add(1, {Measured("bar", 1e-3, 11)}, /*replaces=*/true);
  const History history = ReadHistory(folder_);
  ASSERT_EQ(history.entries.size(), 1u);
  EXPECT_EQ(history.entries[0].mark, "");
  for (const HistorySeries& one : FindingsOf(history).series) {
    if (one.measure == "steps") {
      EXPECT_EQ(ValuesOf(one), std::vector<double>{11.0});
    }
  }
}

TEST_F(HistoryOf, BaseIsTheLastGoodState) {
  EXPECT_THROW(ReadHistory(folder_), ConfigError);
  for (int number = 1; number <= 4; ++number) Add(number, {Measured("bar", 1e-3, number)});
  const std::string machine = ThisOrigin().machine;
  const auto base = [&] { return LastGood(ReadHistory(folder_), machine)->commit; };
  EXPECT_EQ(base(), CommitName(4));  // nobody said anything: the last one
  MarkInHistory(folder_, CommitName(4), "bad", "");
  EXPECT_EQ(base(), CommitName(3));
  MarkInHistory(folder_, CommitName(2), "good", "");
  EXPECT_EQ(base(), CommitName(2));  // what somebody looked at comes before what nobody did
  MarkInHistory(folder_, CommitName(3), "accepted", "new mass matrix");
  EXPECT_EQ(base(), CommitName(3));
  EXPECT_EQ(ReadHistory(folder_).entries[2].note, "new mass matrix");
  EXPECT_THROW(MarkInHistory(folder_, "0", "good", ""), ConfigError);   // several begin so
  EXPECT_THROW(MarkInHistory(folder_, "ff", "good", ""), ConfigError);  // none does
  for (int number = 1; number <= 4; ++number) {
    MarkInHistory(folder_, CommitName(number), "bad", "");
  }
  EXPECT_FALSE(LastGood(ReadHistory(folder_), machine).has_value());
}

TEST_F(HistoryOf, DamagedLinesAreNamedAndATornOneIsNot) {
  Add(1, {Measured("bar", 1e-3, 1)});
  const std::string whole = ReadFile(folder_ / "history.jsonl");
  WriteFileAtomically(folder_ / "history.jsonl", whole + R"({"kind":"commit","commit":"f)");
  EXPECT_EQ(ReadHistory(folder_).entries.size(), 1u);
  Add(2, {Measured("bar", 1e-3, 1)});  // and the next line does not continue it
  EXPECT_EQ(ReadHistory(folder_).entries.size(), 2u);
  WriteFileAtomically(folder_ / "history.jsonl", whole + "no line\n");
  try {
    ReadHistory(folder_);
    ADD_FAILURE() << "a line that is none was read";
  } catch (const std::exception& error) {
    EXPECT_NE(std::string(error.what()).find("history.jsonl:2"), std::string::npos) << error.what();
  }
}

TEST_F(HistoryOf, OtherEndingsAreSteps) {
  std::vector<Record> records = {Measured("bar", 1e-3, 1), Measured("rod", 1e-3, 1)};
  Add(1, records);
  Add(2, records);
  records[1].Set("outcome", std::string("singular"));
  Add(3, records);
  records[0].Set("doubts", std::string("energy"));
  Add(4, records);
  const HistoryFindings found = FindingsOf(ReadHistory(folder_));
  ASSERT_EQ(found.endings.size(), 2u);
  EXPECT_EQ(found.endings[0].entry, 2u);
  EXPECT_EQ(found.endings[0].after, "singular");
  EXPECT_EQ(found.endings[1].entry, 3u);
  EXPECT_EQ(found.endings[1].measure, "doubts");
}

TEST_F(HistoryOf, OneStepOfACountIsASingleOne) {
  for (int number = 1; number <= 30; ++number) {
    Add(number, {Measured("bar", 1e-3, number < 21 ? 100'000 : 100'001)});
  }
  const History history = ReadHistory(folder_);
  for (const HistorySeries& series : FindingsOf(history).series) {
    if (series.measure != "steps") continue;
    ASSERT_EQ(series.changes.size(), 1u);
    EXPECT_EQ(history.entries[series.values[series.changes[0].at].entry].commit, CommitName(21));
    EXPECT_EQ(series.changes[0].Confidence(), 1.0);
  }
}

TEST_F(HistoryOf, PageSaysNamesAsText) {
  const std::string hostile = "</script><img src=x onerror=alert(1)>\"'&";
  Add(1, {Measured(hostile, 1e-3, 1)});
  Add(2, {Measured(hostile, 0.0, 1)});
  MarkInHistory(folder_, CommitName(2), "accepted", hostile);
  const History history = ReadHistory(folder_);
  const std::string page = HistoryPage(history, FindingsOf(history), hostile, {hostile});
  EXPECT_EQ(page.find("<img"), std::string::npos);
  EXPECT_NE(page.find("&lt;img"), std::string::npos);
}

}  // namespace history_test
}  // namespace loopbench::harness
