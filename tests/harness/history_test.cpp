// Measurements over commits: what is kept and refused, which state is a base, series and their
// steps, and the page that shows them.
#include "harness/base/store.h"
#include "tests/harness/history_of.h"

namespace loopbench::harness::history_test {

std::vector<double> ValuesOf(const HistorySeries& series) {
  return Mapped<double>(series.values, &HistoryValue::value);
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
  ExpectNone(ReadFile(history.entries[0].results), {"series.t"});
}

TEST_F(HistoryOf, WhatIsNoMeasurementIsRefused) {
  const std::vector<Record> good = {Measured("bar", 1e-3, 1)};
  ExpectWords(Refusal({.commit = "a", .date = "yesterday"}, good), {"\"yesterday\""});
  ExpectWords(Refusal({.commit = "a", .date = "2026-11-24T10:00:00+01:00"}, good), {"UTC"});
  ExpectWords(Refusal({.commit = "a", .date = "2026-11-24"}, {}), {"no record"});
  std::vector<Record> two = {Measured("bar", 1e-3, 1), Measured("rod", 1e-3, 1)};
  two[1].Set("machine", std::string("another one"));
  ExpectWords(Refusal({.commit = "a", .date = "2026-11-24"}, two), {"one machine"});
  EXPECT_FALSE(fs::exists(folder_));  // nothing half-written
  EXPECT_EQ(Refusal({.commit = "a", .date = "2026-11-24"}, good), "taken");
  ExpectWords(Refusal({.commit = "a", .date = "2026-11-24"}, good), {"--replace"});
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

// File of a history by an earlier version: the ending stands before the hash.
TEST_F(HistoryOf, ResultsAreReadWhateverTheirEnding) {
  const HistoryEntry added = Add(1, {Measured("bar", 1e-3, 7)});
  const std::string old = "x-00.jsonl-73cea767";
  fs::rename(added.results, folder_ / "results" / old);
  Record line =
      Changed(ReadRecords(folder_ / "history.jsonl").front(), "results", "results/" + old);
  fs::remove(folder_ / "history.jsonl");
  ResultStore(folder_ / "history.jsonl").Append(line);
  EXPECT_EQ(FindingsOf(ReadHistory(folder_)).series.size(), 2u);
}

TEST_F(HistoryOf, ALineWithoutOneOfItsTextsIsNamed) {
  const std::string commit = Add(1, {Measured("bar", 1e-3, 7)}).commit;
  const Record whole = ReadRecords(folder_ / "history.jsonl").front();
  for (const std::string key : {"date", "machine", "results"}) {
    Record line = Changed(whole, key, "");
    fs::remove(folder_ / "history.jsonl");
    ResultStore(folder_ / "history.jsonl").Append(line);
    ExpectWords(MessageOf([&] { ReadHistory(folder_); }),
                {"commit " + commit + ": \"" + key + "\": found nothing"});
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
    ExpectWords(Refusal({.commit = "a", .date = date}, records), {date});
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
  ExpectWords(MessageOf<std::exception>([&] { ReadHistory(folder_); }), {"history.jsonl:2"});
}

class SeriesOfAHistory : public HistoryOf {
 protected:
  /// The steps of a measure of one case that has these values.
  template <typename Values, typename Set>
  std::vector<LevelChange> Steps(const std::string& measure, const Values& values, const Set& set) {
    fs::remove_all(folder_);
    int number = 0;
    for (const auto value : values) {
      std::vector<Record> records = {Measured("bar", 1e-3, 1)};
      set(&records[0], value);
      Add(++number, records);
    }
    for (const HistorySeries& series : FindingsOf(ReadHistory(folder_)).series) {
      if (series.measure == measure) return series.changes;
    }
    ADD_FAILURE() << "no series of " << measure;
    return {};
  }
  std::vector<LevelChange> StepsOfCounts(const std::vector<std::int64_t>& values) {
    return Steps("steps", values,
                 [](Record* record, std::int64_t value) { record->Set("steps", value); });
  }
  std::vector<LevelChange> StepsOfDrift(const std::vector<double>& values) {
    return Steps("drift_position_max", values,
                 [](Record* record, double value) { record->Set("drift_position_max", value); });
  }
  std::string Page() {
    const History history = ReadHistory(folder_);
    return HistoryPage(history, FindingsOf(history), "page", {});
  }
};

void ExpectStep(const std::vector<LevelChange>& found, std::size_t at, double before,
                double after) {
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].at, at);
  EXPECT_EQ(found[0].before, before);  // medians of what was measured, to the last bit
  EXPECT_EQ(found[0].after, after);
}

TEST_F(SeriesOfAHistory, ZeroIsALevel) {
  ExpectStep(StepsOfCounts({0, 0, 0, 0, 500, 500, 500}), 4, 0.0, 500.0);
  ExpectWords(Page(), {"from 0"});
  ExpectStep(StepsOfCounts({500, 500, 500, 0, 0, 0, 0}), 3, 500.0, 0.0);
  ExpectStep(StepsOfCounts({0, 0, 0, 0, 1, 1, 1}), 4, 0.0, 1.0);
  ExpectStep(StepsOfDrift({0, 0, 0, 0, 1e-3, 1e-3, 1e-3}), 4, 0.0, 1e-3);
  ExpectStep(StepsOfDrift({1e-3, 1e-3, 1e-3, 0, 0, 0, 0}), 3, 1e-3, 0.0);
  EXPECT_TRUE(StepsOfDrift({0, 0, 0, 1e-12, 1e-12, 1e-12}).empty());  // round-off
  EXPECT_TRUE(StepsOfCounts({0, 0, 0, 0, 0, 0}).empty());
}

TEST_F(SeriesOfAHistory, AnyChangeOfACountIsAStep) {
  ExpectStep(StepsOfCounts({5'000'000, 5'000'000, 5'000'000, 5'000'001, 5'000'001, 5'000'001}), 3,
             5e6, 5'000'001.0);
  ExpectStep(StepsOfCounts({999'999'999'998, 999'999'999'998, 999'999'999'998, 999'999'999'999,
                            999'999'999'999, 999'999'999'999}),
             3, 999'999'999'998.0, 999'999'999'999.0);
  ExpectWords(Page(), {">999999999998</td>"});  // and both can be told apart
  // beside a step that is a million times larger
  std::vector<std::int64_t> values;
  for (int i = 0; i < 60; ++i) values.push_back(i < 20 ? 2 : i < 40 ? 5'000'000 : 5'000'001);
  const std::vector<LevelChange> found = StepsOfCounts(values);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].at, 20u);
  EXPECT_EQ(found[1].at, 40u);
}

TEST_F(SeriesOfAHistory, LevelsAreAsMeasured) {
  ExpectStep(StepsOfCounts({5, 5, 5, 7, 7, 7}), 3, 5.0, 7.0);
  const History history = ReadHistory(folder_);
  const Table table = StepTable(history, FindingsOf(history));
  ASSERT_EQ(table.rows.size(), 1u);
  EXPECT_EQ(table.rows[0].Text("before"), "5");
}

// Values that differ in the last bit have no numbers between them to stand on an axis.
TEST_F(SeriesOfAHistory, PageOfValuesThatAreAllButEqualEnds) {
  StepsOfDrift({0.1, std::nextafter(0.1, 1.0), 0.1});
  ExpectWords(Page(), {"</html>"});
  StepsOfDrift({0.1, 0.1 * (1.0 + 1e-11), 0.1});
  ExpectWords(Page(), {"</html>"});
  StepsOfDrift({5e-324, 0.0, 1e-323});
  ExpectWords(Page(), {"</html>"});
}

// A clock of 10 ms says 0 of what is short.
TEST_F(SeriesOfAHistory, TimesOfZeroAreNotPooled) {
  for (int number = 1; number <= 6; ++number) {
    std::vector<Record> records;
    for (int k = 0; k < 7; ++k) {
      const double time = k == 0 || number == 3 ? 0.0 : 1e-3 * k;
      records.push_back(Measured("case" + std::to_string(k), 1e-3, 1, {time, time, time}));
    }
    Add(number, records);
  }
  bool is_pooled = false;
  for (const HistorySeries& series : FindingsOf(ReadHistory(folder_)).series) {
    is_pooled |= series.one == kAllCases && series.values.size() == 5;  // all but the third
    for (const HistoryValue& value : series.values) {
      EXPECT_TRUE(std::isfinite(value.value) && value.common > 0.0) << series.one;
      if (series.one == kAllCases) {
        EXPECT_EQ(value.value, 1.0);
      }
    }
  }
  EXPECT_TRUE(is_pooled);
}

TEST_F(SeriesOfAHistory, CasesOfOneNameHaveNoEndings) {
  std::vector<Record> records = {Measured("bar", 1e-3, 1), Measured("bar", 1e-3, 2),
                                 Measured("rod", 1e-3, 1)};
  records[1].Set("outcome", std::string("singular"));
  Add(1, records);
  Add(2, records);
  EXPECT_TRUE(FindingsOf(ReadHistory(folder_)).endings.empty());
}

TEST_F(SeriesOfAHistory, TornLinesOfResultsAreSaid) {
  const HistoryEntry entry = Add(1, {Measured("bar", 1e-3, 1), Measured("rod", 1e-3, 1)});
  const std::string whole = ReadFile(entry.results);
  WriteFileAtomically(entry.results, whole.substr(0, whole.size() - 20));
  const HistoryFindings found = FindingsOf(ReadHistory(folder_));
  ASSERT_EQ(found.warnings.size(), 1u);
  ExpectWords(found.warnings[0], {"torn"});
}

TEST_F(HistoryOf, OtherEndingsAreSteps) {
  std::vector<Record> records = {Measured("bar", 1e-3, 1), Measured("rod", 1e-3, 1)};
  Add(1, records);
  Add(2, records);
  records[1].Set("outcome", std::string("singular"));
  Add(3, records);
  records[0].Set("warnings", std::string("energy"));
  Add(4, records);
  const HistoryFindings found = FindingsOf(ReadHistory(folder_));
  ASSERT_EQ(found.endings.size(), 2u);
  EXPECT_EQ(found.endings[0].entry, 2u);
  EXPECT_EQ(found.endings[0].after, "singular");
  EXPECT_EQ(found.endings[1].entry, 3u);
  EXPECT_EQ(found.endings[1].measure, "warnings");
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
  MarkInHistory(folder_, {CommitName(2), "accepted", hostile});
  const History history = ReadHistory(folder_);
  const std::string page = HistoryPage(history, FindingsOf(history), hostile, {hostile});
  ExpectNone(page, {"<img"});
  ExpectWords(page, {"&lt;img"});
  // a row with a small line and a chart of each series, which a filter finds by its text
  ExpectWords(page, {"<tr class=\"series\"><td>", "<svg class=\"spark\""});
  // dark where the system is
  ExpectWords(page, {"dataset.theme = dark.matches"});
}

}  // namespace loopbench::harness::history_test
