// What a table of a store shows: rows, columns, order, groups and warnings.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "harness/base/text.h"
#include "harness/judge/tables.h"

namespace loopbench::harness {
namespace table_view_test {

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

// Not resolved: one run.
Record SingleRun() {
  Record single = Accuracy("b", 1, 1);
  single.Set("growth_exponent", 9.68);
  single.Set("growth_resolved", false);
  single.Set("growth_hypothesis", std::string("t^2"));
  single.Set("growth_hypothesis_resolved", false);
  single.Set("energy_growth_exponent", 1.02);
  return single;
}

Record Ensemble() {
  Record resolved = Accuracy("a", 1, 1);
  resolved.Set("growth_exponent", 2.031);
  resolved.Set("growth_resolved", true);
  resolved.Set("growth_hypothesis", std::string("t^2"));
  resolved.Set("growth_hypothesis_resolved", true);
  return resolved;
}

TEST(TableView, SlopesThatAreNotResolvedAreMarkedWhateverTheColumns) {
  const std::vector<Record> records = {Ensemble(), SingleRun()};
  for (const TableView& view : {TableView{.compact = true}, TableView{},
                                TableView{.columns = {"mechanism", "growth_exponent"}},
                                TableView{.compact = true, .columns = {"growth_exponent"}},
                                TableView{.kind = "all", .columns = {"growth_exponent"}}}) {
    const Table table = MakeTable(records, view);
    for (const char* format : {"text", "markdown", "latex"}) {
      const std::string text = Render(table, format);
      EXPECT_NE(text.find("9.68?"), std::string::npos) << text;
      EXPECT_EQ(text.find("2.03?"), std::string::npos) << text;
    }
    // a number stays a number where machines read it
    EXPECT_EQ(table.rows[1].Number("growth_exponent"), 9.68);
  }
  const Table laws = MakeTable(
      records, {.columns = {"growth_hypothesis", "energy_growth_exponent", "growth_resolved"}});
  EXPECT_NE(ToMarkdown(laws).find("| t^2? | 1.02? |"), std::string::npos) << ToMarkdown(laws);
  EXPECT_NE(ToMarkdown(laws).find("| t^2 |  |"), std::string::npos) << ToMarkdown(laws);
  // digits below digits
  const std::string text = ToText(MakeTable(records, {.columns = {"growth_exponent"}}));
  EXPECT_NE(text.find("2.03\n"), std::string::npos) << text;
  EXPECT_EQ(text.find("2.03\n") - text.rfind('\n', text.find("2.03\n")),
            text.find("9.68?\n") - text.rfind('\n', text.find("9.68?\n")))
      << text;
}

TEST(TableView, WhatChosenColumnsHideIsSaidInEveryFormat) {
  Record failed = SingleRun();
  failed.Set("outcome", std::string("singular"));
  const std::vector<Record> records = {Ensemble(), failed};
  const Table bare = MakeTable(records, {.columns = {"growth_exponent"}});
  for (const char* format : {"text", "csv", "markdown", "json", "latex"}) {
    const std::string text = Render(bare, format);
    EXPECT_NE(text.find("1 of 2 runs did not finish"), std::string::npos) << text;
    EXPECT_NE(text.find("not resolved"), std::string::npos) << text;
  }
  // columns that say it themselves, and runs of which there is nothing to say
  EXPECT_TRUE(MakeTable(records, {}).notes.empty());
  EXPECT_TRUE(MakeTable(records, {.columns = {"outcome", "drift_position_max"}}).notes.empty());
  EXPECT_TRUE(
      MakeTable(std::vector<Record>{Ensemble()}, {.columns = {"growth_exponent"}}).notes.empty());
}

TEST(TableView, FlaggedRowsHaveTheMarkOfTheCaptionAndTheirReasonsInTheDocument) {
  Record flagged = SingleRun();
  flagged.Set("warnings", std::string("energy"));
  flagged.Set("energy_error_relative", 0.03);
  const std::vector<Record> records = {Ensemble(), flagged};
  const TableView bare{.compact = true, .columns = {"formulation", "growth_exponent"}};
  const std::string text = ToLatex(MakeTable(records, bare));
  EXPECT_NE(text.find("1 of 2 rows"), std::string::npos) << text;
  EXPECT_NE(text.find("odca* & $9.68?$"), std::string::npos) << text;
  EXPECT_NE(text.find("odca & $2.03$"), std::string::npos) << text;
  const std::size_t reason = text.find("error of the energy");
  ASSERT_NE(reason, std::string::npos) << text;
  EXPECT_NE(text[text.rfind('\n', reason) + 1], '%');
  const auto title = [&](const TableView& view) { return MakeTable(records, view).title; };
  const std::string start = "Drift - 1 of 2 rows are flagged (marked ";
  EXPECT_EQ(title(bare), start + "*, reasons below)");
  EXPECT_EQ(title({.compact = true, .columns = {"outcome", "growth_exponent"}}),
            start + "? in outcome, reasons below)");
  EXPECT_EQ(title({.columns = {"mechanism"}}), start + "*, column warnings has the reasons)");
  EXPECT_EQ(title({}), start + "? in outcome, reasons in column warnings)");
}

TEST(TableView, ShortTablesTellRowsApart) {
  // as runs of several scalars, whose short table had no column for the coordinates
  const auto rung = [](const std::string& coordinates, const std::string& integrator) {
    Record record;
    record.Set("kind", std::string("precision"));
    record.Set("mechanism", std::string("four-bar"));
    record.Set("coordinates", coordinates);
    record.Set("solver", std::string("rank-revealing"));
    record.Set("integrator", integrator);
    record.Set("scalar", std::string("double"));
    record.Set("rtol", 1e-6);
    record.Set("outcome", std::string("finished"));
    return record;
  };
  const std::vector<Record> rungs = {rung("joint", "ode45"), rung("absolute", "ode45")};
  const Table table = MakeTable(rungs, {.kind = "precision", .compact = true});
  EXPECT_NE(ToText(table).find(" abs "), std::string::npos) << ToText(table);
  EXPECT_EQ(Keys(table).find("integrator"), std::string::npos) << Keys(table);
  // any key of cases that is needed comes in, and none besides
  const Table both = MakeTable(std::vector<Record>{rung("joint", "ode45"), rung("joint", "gragg"),
                                                   rung("absolute", "ode45")},
                               {.kind = "precision", .compact = true});
  EXPECT_NE(Keys(both).find("integrator outcome"), std::string::npos) << Keys(both);
  EXPECT_EQ(Keys(both).find("solver"), std::string::npos) << Keys(both);
}

TEST(TableView, NoisyTimingsWarnWithTheWorstNumbersAndQuietOnesDoNot) {
  EXPECT_TRUE(NoiseWarnings(std::vector<Record>{Timing("a", 0.01, "")}).empty());
  const Table table =
      MakeTable(std::vector<Record>{Timing("a", 0.01, ""), Timing("b", 0.051, "A/A"),
                                    Timing("c", 0.03, "A/A")},
                {.kind = "timing"});
  ASSERT_EQ(table.notes.size(), 2u);
  EXPECT_EQ(table.notes[0],
            "warning: noisy machine in 2 of 3 timings (see column noise): load up to 3.0 on 2 "
            "processors, the same method timed twice differed by up to 5.1 % (b)");
  EXPECT_EQ(table.notes[1],
            "warning: differences between methods below 6 % are not significant; repeat on a quiet "
            "machine");
  // a loaded machine may time two equal columns alike by luck
  const std::vector<std::string> loaded =
      NoiseWarnings(std::vector<Record>{Timing("a", 0.001, "load 3.0 on 2 processors")});
  ASSERT_EQ(loaded.size(), 2u);
  EXPECT_NE(loaded[1].find("below 2 %"), std::string::npos) << loaded[1];
}

TEST(TableView, ReferencesAreAKindOfTheirOwn) {
  std::vector<Record> records(2);
  records[0].Set("kind", std::string("reference"));
  records[0].Set("mechanism", std::string("kite"));
  records[0].Set("message", std::string("lagrange ends at 21 s"));
  records[1].Set("kind", std::string("accuracy"));
  records[1].Set("mechanism", std::string("four-bar"));
  const Table table = MakeTable(records, {.kind = "references", .compact = true});
  ASSERT_EQ(table.rows.size(), 1u);
  EXPECT_EQ(table.title, "References");
  EXPECT_NE(ToText(table).find("lagrange ends at 21 s"), std::string::npos);
  // of a store with runs the runs are shown unless asked otherwise
  EXPECT_EQ(MakeTable(records, {.compact = true}).title, "Drift");
}

}  // namespace table_view_test
}  // namespace loopbench::harness
