// Measurements over commits: what is kept and refused, and which state is a base.
#include "harness/history/history.h"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "harness/base/store.h"
#include "harness/base/text.h"
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
  EXPECT_EQ(added.results.extension(), ".jsonl");
  EXPECT_EQ(FindingsOf(ReadHistory(folder_)).series.size(), 2u);  // steps and drift
}

// Of a history that an earlier version wrote: the ending stands before the hash.
TEST_F(HistoryOf, ResultsAreReadWhateverTheirEnding) {
  const HistoryEntry added = Add(1, {Measured("bar", 1e-3, 7)});
  const std::string old = "x-00.jsonl-73cea767";
  fs::rename(added.results, folder_ / "results" / old);
  Record line = ReadRecords(folder_ / "history.jsonl").front();
  line.Set("results", "results/" + old);
  fs::remove(folder_ / "history.jsonl");
  ResultStore(folder_ / "history.jsonl").Append(line);
  EXPECT_EQ(FindingsOf(ReadHistory(folder_)).series.size(), 2u);
}

TEST_F(HistoryOf, ALineWithoutOneOfItsTextsIsNamed) {
  const std::string commit = Add(1, {Measured("bar", 1e-3, 7)}).commit;
  const Record whole = ReadRecords(folder_ / "history.jsonl").front();
  for (const std::string key : {"date", "machine", "results"}) {
    Record line = whole;
    line.Set(key, std::string());
    fs::remove(folder_ / "history.jsonl");
    ResultStore(folder_ / "history.jsonl").Append(line);
    try {
      ReadHistory(folder_);
      FAIL() << key;
    } catch (const ConfigError& error) {
      const std::string message = error.what();
      EXPECT_NE(message.find("commit " + commit + ": \"" + key + "\": found nothing"),
                std::string::npos)
          << message;
    }
  }
}

TEST_F(HistoryOf, CommitsWhoseCasesAllFailAreKept) {
  std::vector<Record> records = {Measured("bar", 1e-3, 7)};
  Add(1, records);
  records[0].Set("outcome", std::string("time limit"));
  Add(2, records);
  EXPECT_EQ(FindingsOf(ReadHistory(folder_)).endings.size(), 1u);
}

TEST_F(HistoryOf, WhatCannotReplaceReplacesNothing) {
  const HistoryEntry first = Add(1, {Measured("bar", 1e-3, 7)});
  const std::string before = ReadFile(first.results);
  const HistoryEntry second = Add(1, {Measured("bar", 1e-3, 8)}, /*replaces=*/true);
  // what the line of before points at is whole, whether that of now was written or not
  EXPECT_NE(first.results, second.results);
  EXPECT_EQ(ReadFile(first.results), before);
}

TEST_F(HistoryOf, DatesAreThoseOfACalendar) {
  const std::vector<Record> records = {Measured("bar", 1e-3, 7)};
  for (const char* date : {"2026-99-99", "2026-02-29", "2026-00-10", "2026-01-01T24:00:00Z",
                           "2026-01-01T10:60:00Z", "2026-01-01T10:00:60Z"}) {
    EXPECT_NE(Refusal({.commit = "a", .date = date}, records).find(date), std::string::npos);
  }
  EXPECT_EQ(Refusal({.commit = "a", .date = "2028-02-29T23:59:59Z"}, records), "taken");
}

TEST_F(HistoryOf, AWholeNameIsNoBeginningOfAnother) {
  const auto add = [&](const char* commit) {
    AddToHistory(folder_, {.commit = commit, .date = "2026-11-24"}, {Measured("bar", 1, 1)}, false);
  };
  add("caf\xc3\xa9");
  EXPECT_THROW(MarkInHistory(folder_, {"", "good"}), ConfigError);
  EXPECT_THROW(MarkInHistory(folder_, {"caf\xc3", "good"}), ConfigError);
  EXPECT_EQ(MarkInHistory(folder_, {"caf", "good"}).commit, "caf\xc3\xa9");
  add("v1");
  add("v1.1");
  EXPECT_EQ(MarkInHistory(folder_, {"v1", "good"}).commit, "v1");
  EXPECT_THROW(MarkInHistory(folder_, {"v", "good"}), ConfigError);
}

TEST_F(HistoryOf, MeasuredAgainTakesThePlaceAndLosesTheMark) {
  Add(1, {Measured("bar", 1e-3, 10)});
  MarkInHistory(folder_, {CommitName(1), "bad", "slow disk"});
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

TEST_F(HistoryOf, WhatSomebodyAcceptedStaysAccepted) {
  Add(1, {Measured("bar", 1e-3, 10)});
  MarkInHistory(folder_, {CommitName(1), "accepted", "exact mass matrix"});
  Add(1, {Measured("bar", 1e-3, 11)}, /*replaces=*/true);
  const Mark mark = MarkInHistory(
      folder_, {CommitName(1), "bad", "compare ended with 1", /*keeps_accepted=*/true});
  EXPECT_EQ(mark.mark, "accepted");
  const History history = ReadHistory(folder_);
  EXPECT_EQ(history.entries[0].mark, "accepted");
  EXPECT_EQ(history.entries[0].note, "exact mass matrix");
  MarkInHistory(folder_, {CommitName(1), "bad", "a person's word"});
  EXPECT_EQ(ReadHistory(folder_).entries[0].mark, "bad");
}

TEST_F(HistoryOf, BaseIsOfThisMachineWhereItHasOne) {
  History history;
  const auto add = [&](const char* commit, const char* machine, const char* mark) {
    history.entries.push_back({.commit = commit, .date = "", .machine = machine, .mark = mark});
  };
  const auto base = [&](const char* machine) {
    const HistoryEntry good = *LastGood(history, machine);
    return good.machine + good.commit;
  };
  add("1", "A", "");
  EXPECT_EQ(base("B"), "A1");  // there is no other
  add("2", "B", "");
  EXPECT_EQ(base("A"), "A1");
  EXPECT_EQ(base("B"), "B2");
  add("3", "A", "good");
  add("4", "B", "good");
  EXPECT_EQ(base("A"), "A3");
  EXPECT_EQ(base("C"), "B4");
  add("5", "B", "accepted");  // holds on all machines
  add("6", "B", "good");
  EXPECT_EQ(base("A"), "B5");
  EXPECT_EQ(base("B"), "B6");
  EXPECT_EQ(LastGoodOfMachine(history, "A")->commit, "3");  // but not for times
  add("7", "A", "bad");
  add("8", "A", "good");
  EXPECT_EQ(base("A"), "A8");
}

TEST_F(HistoryOf, BaseIsTheLastGoodState) {
  EXPECT_THROW(ReadHistory(folder_), ConfigError);
  for (int number = 1; number <= 4; ++number) Add(number, {Measured("bar", 1e-3, number)});
  const std::string machine = ThisOrigin().machine;
  const auto base = [&] { return LastGood(ReadHistory(folder_), machine)->commit; };
  EXPECT_EQ(base(), CommitName(4));  // nobody said anything: the last one
  MarkInHistory(folder_, {CommitName(4), "bad", ""});
  EXPECT_EQ(base(), CommitName(3));
  MarkInHistory(folder_, {CommitName(2), "good", ""});
  EXPECT_EQ(base(), CommitName(2));  // what somebody looked at comes before what nobody did
  MarkInHistory(folder_, {CommitName(3), "accepted", "new mass matrix"});
  EXPECT_EQ(base(), CommitName(3));
  EXPECT_EQ(ReadHistory(folder_).entries[2].note, "new mass matrix");
  EXPECT_THROW(MarkInHistory(folder_, {"0", "good", ""}), ConfigError);   // several begin so
  EXPECT_THROW(MarkInHistory(folder_, {"ff", "good", ""}), ConfigError);  // none does
  for (int number = 1; number <= 4; ++number) {
    MarkInHistory(folder_, {CommitName(number), "bad", ""});
  }
  EXPECT_FALSE(LastGood(ReadHistory(folder_), machine).has_value());
}

TEST_F(HistoryOf, DamagedLinesAreNamedAndATornOneIsNot) {
  Add(1, {Measured("bar", 1e-3, 1)});
  const std::string whole = ReadFile(folder_ / "history.jsonl");
  WriteFileAtomically(folder_ / "history.jsonl", whole + R"({"kind":"commit","commit":"f)");
  EXPECT_EQ(ReadHistory(folder_).entries.size(), 1u);
  EXPECT_EQ(ReadHistory(folder_).warnings.size(), 1u);
  std::vector<std::string> torn;
  AddToHistory(folder_, {.commit = CommitName(3), .date = Date(3)}, {Measured("bar", 1e-3, 1)},
               false, &torn);
  EXPECT_EQ(torn.size(), 1u);  // and not again: it is gone
  EXPECT_TRUE(ReadHistory(folder_).warnings.empty());
  WriteFileAtomically(folder_ / "history.jsonl", whole + R"({"kind":"commit","commit":"f)");
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

}  // namespace history_test
}  // namespace loopbench::harness
