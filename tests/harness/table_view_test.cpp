// What a table of a store shows: rows, columns, order, groups and warnings.
#include "harness/report/table_view.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "harness/config/config_error.h"
#include "harness/report/columns.h"

namespace loopbench::harness {
namespace {

Record Accuracy(const std::string& mechanism, double drift, double stiffness) {
  Record record;
  record.Set("kind", std::string("accuracy"));
  record.Set("mechanism", mechanism);
  record.Set("formulation", std::string("odca"));
  record.Set("spring.stiffness", stiffness);
  record.Set("rtol", 1e-8);
  record.Set("outcome", std::string("finished"));
  record.Set("drift_position_max", drift);
  record.Set("drift.loop.B", drift);
  record.Set("series.drift", std::vector<double>{0.0, drift});
  return record;
}

Record Timing(const std::string& mechanism, double spread, const std::string& noise) {
  Record record;
  record.Set("kind", std::string("timing"));
  record.Set("mechanism", mechanism);
  record.Set("rhs_ns_median", 100.0);
  record.Set("aa_spread", spread);
  record.Set("load1", 3.0);
  record.Set("processors", std::int64_t{2});
  record.Set("governor", std::string());
  record.Set("noise", noise);
  return record;
}

std::string Keys(const Table& table) {
  std::string keys;
  for (const TableColumn& column : table.columns) keys += column.key + " ";
  return keys;
}

std::string Values(const Table& table, const std::string& key) {
  std::string values;
  for (const Record& row : table.rows) values += row.Text(key) + " ";
  return values;
}

std::string Refusal(const std::vector<Record>& records, const TableView& view) {
  try {
    MakeTable(records, view);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(TableView, TheKindIsWhatTheStoreHas) {
  const std::vector<Record> both = {Timing("a", 0, ""), Accuracy("b", 1, 1)};
  EXPECT_EQ(MakeTable(both, {}).title, "Drift");
  EXPECT_EQ(MakeTable(both, {.kind = "timing"}).rows.size(), 1u);
  EXPECT_EQ(MakeTable(std::vector<Record>{Timing("a", 0, "")}, {}).title, "Timing");
  Record other;
  other.Set("kind", std::string("benchmark"));
  other.Set("instructions", std::int64_t{12});
  const Table table = MakeTable(std::vector<Record>{other}, {});
  EXPECT_EQ(Keys(table), "kind instructions ");
  EXPECT_EQ(MakeTable(both, {.kind = "all"}).rows.size(), 2u);
}

TEST(TableView, ParametersOfASweepAreColumnsWithoutBeingAskedFor) {
  const std::vector<Record> records = {Accuracy("a", 1, 10), Accuracy("a", 2, 20)};
  for (const bool compact : {false, true}) {
    const std::string keys = Keys(MakeTable(records, {.compact = compact}));
    EXPECT_NE(keys.find("spring.stiffness outcome "), std::string::npos) << keys;
    EXPECT_EQ(keys.find("drift.loop"), std::string::npos) << keys;
    EXPECT_EQ(keys.find("series"), std::string::npos) << keys;
  }
}

TEST(TableView, ColumnsAreThoseChosenInTheirOrder) {
  const Table table =
      MakeTable(std::vector<Record>{Accuracy("a", 1e-9, 10)},
                {.columns = {"spring.stiffness", "drift_position_max", "drift.loop.B"}});
  EXPECT_EQ(Keys(table), "spring.stiffness drift_position_max drift.loop.B ");
  EXPECT_EQ(table.columns[1].header, "drift, position [m]");
  EXPECT_EQ(UnitOf(table.columns[1]), "m");
  EXPECT_EQ(UnitOf(table.columns[2]), "m");
  EXPECT_EQ(UnitOf(table.columns[0]), "");
}

TEST(TableView, UnknownKeysAreRefusedWithOptionAndNearestSpelling) {
  const std::vector<Record> records = {Accuracy("a", 1, 10)};
  for (const auto& [view, option] : std::vector<std::pair<TableView, std::string>>{
           {{.columns = {"mechanisn"}}, "--columns"},
           {{.group = "mechanisn"}, "--group"},
           {{.sort = "mechanisn"}, "--sort"},
           {{.where = {{"mechanisn", {"a"}}}}, "--where"}}) {
    const std::string text = Refusal(records, view);
    EXPECT_TRUE(text.starts_with(option + ": found \"mechanisn\"")) << text;
    EXPECT_NE(text.find("(did you mean \"mechanism\"?)"), std::string::npos) << text;
    EXPECT_NE(text.find("spring.stiffness"), std::string::npos) << text;
  }
  // a column of the tables that no record fills is empty, not unknown
  EXPECT_EQ(Refusal(records, {.columns = {"correction_max"}}), "accepted");
}

TEST(TableView, SortsByNumberOrTextWithMissingValuesLast) {
  Record missing = Accuracy("d", 0, 1);
  missing.Set("drift_position_max", Value());
  const std::vector<Record> records = {Accuracy("a", 5, 1), missing, Accuracy("c", 30, 1),
                                       Accuracy("b", 4, 1)};
  EXPECT_EQ(Values(MakeTable(records, {.sort = "drift_position_max"}), "mechanism"), "b a c d ");
  EXPECT_EQ(
      Values(MakeTable(records, {.sort = "drift_position_max", .descending = true}), "mechanism"),
      "c a b d ");
  EXPECT_EQ(Values(MakeTable(records, {.sort = "mechanism", .descending = true}), "mechanism"),
            "d c b a ");
}

TEST(TableView, GroupsComeInOrderOfTheirValueAndKeepTheOrderWithin) {
  const std::vector<Record> records = {Accuracy("a", 5, 10), Accuracy("b", 4, 9),
                                       Accuracy("c", 6, 10)};
  const Table table =
      MakeTable(records, {.group = "spring.stiffness", .sort = "drift_position_max"});
  const std::vector<RowGroup> groups = Groups(table);
  ASSERT_EQ(groups.size(), 2u);
  EXPECT_EQ(groups[0].heading, "spring.stiffness = 9");
  EXPECT_EQ(groups[1].heading, "spring.stiffness = 10");
  EXPECT_EQ(Values(table, "mechanism"), "b a c ");
}

TEST(TableView, TheShortTableMarksSlopesThatAreNotResolved) {
  Record resolved = Accuracy("a", 1, 1), single = Accuracy("b", 1, 1);
  resolved.Set("growth_exponent", 2.031);
  resolved.Set("growth_resolved", true);
  single.Set("growth_exponent", 9.68);
  single.Set("growth_resolved", false);
  const Table table = MakeTable(std::vector<Record>{resolved, single}, {.compact = true});
  EXPECT_EQ(Values(table, "growth_exponent"), "2.03  9.68? ");
  ASSERT_EQ(table.notes.size(), 1u);
  EXPECT_NE(table.notes[0].find("? marks what is not resolved"), std::string::npos);
  EXPECT_TRUE(MakeTable(std::vector<Record>{resolved}, {.compact = true}).notes.empty());
  EXPECT_EQ(MakeTable(std::vector<Record>{single}, {}).rows[0].Number("growth_exponent"), 9.68);
}

TEST(TableView, NoisyTimingsWarnWithTheWorstNumbersAndQuietOnesDoNot) {
  EXPECT_TRUE(NoiseWarnings(std::vector<Record>{Timing("a", 0.01, "")}).empty());
  const Table table =
      MakeTable(std::vector<Record>{Timing("a", 0.01, ""), Timing("b", 0.051, "A/A"),
                                    Timing("c", 0.03, "A/A")},
                {.kind = "timing"});
  ASSERT_EQ(table.notes.size(), 2u);
  EXPECT_EQ(table.notes[0],
            "warning: noisy machine in 2 of 3 timings (column noise says why): load up to 3.0 on 2 "
            "processors, the same column timed twice differed by up to 5.1 % (b)");
  EXPECT_EQ(table.notes[1],
            "warning: differences between columns below 6 % mean nothing here; repeat on a quiet "
            "machine");
  // a loaded machine may time two equal columns alike by luck
  const std::vector<std::string> loaded =
      NoiseWarnings(std::vector<Record>{Timing("a", 0.001, "load 3.0 on 2 processors")});
  ASSERT_EQ(loaded.size(), 2u);
  EXPECT_NE(loaded[1].find("below 2 %"), std::string::npos) << loaded[1];
}

}  // namespace
}  // namespace loopbench::harness
