// Series of a history, their steps, and the page that shows them.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "harness/base/text.h"
#include "harness/history/history.h"
#include "tests/harness/history_of.h"

namespace loopbench::harness {
namespace history_test {

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
  EXPECT_NE(Page().find("from 0"), std::string::npos);
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
  EXPECT_NE(Page().find(">999999999998</td>"), std::string::npos);  // and both can be told apart
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
  EXPECT_NE(Page().find("</html>"), std::string::npos);
  StepsOfDrift({0.1, 0.1 * (1.0 + 1e-11), 0.1});
  EXPECT_NE(Page().find("</html>"), std::string::npos);
  StepsOfDrift({5e-324, 0.0, 1e-323});
  EXPECT_NE(Page().find("</html>"), std::string::npos);
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
  EXPECT_NE(found.warnings[0].find("torn"), std::string::npos);
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
  EXPECT_EQ(page.find("<img"), std::string::npos);
  EXPECT_NE(page.find("&lt;img"), std::string::npos);
  // a row with a small line and a chart of each series, which a filter finds by its text
  EXPECT_NE(page.find("<tr class=\"series\"><td>"), std::string::npos);
  EXPECT_NE(page.find("<svg class=\"spark\""), std::string::npos);
  // dark where the system is
  EXPECT_NE(page.find("dataset.theme = dark.matches"), std::string::npos);
}

}  // namespace history_test
}  // namespace loopbench::harness
