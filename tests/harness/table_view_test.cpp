// What a table of a store shows: rows, columns, order, groups and warnings; effects of factors.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "harness/base/text.h"
#include "harness/judge/tables.h"
#include "tests/harness/records.h"

namespace loopbench::harness {
namespace table_view_test {

Record Accuracy(const std::string& mechanism, double drift, double stiffness) {
  return RecordOf("kind", "accuracy", "mechanism", mechanism, "formulation", "odca",
                  "spring.stiffness", stiffness, "rtol", 1e-8, "outcome", "finished",
                  "drift_position_max", drift, "drift.loop.B", drift, "series.drift",
                  std::vector<double>{0.0, drift});
}

Record Timing(const std::string& mechanism, double spread, const std::string& noise) {
  return RecordOf("kind", "timing", "mechanism", mechanism, "rhs_ns_median", 100.0, "aa_spread",
                  spread, "load1", 3.0, "processors", 2, "governor", "", "noise", noise);
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
  return MessageOf([&] { MakeTable(records, view); });
}

TEST(TableView, TheKindIsWhatTheStoreHas) {
  const std::vector<Record> both = {Timing("a", 0, ""), Accuracy("b", 1, 1)};
  EXPECT_EQ(MakeTable(both, {}).title, "Drift");
  EXPECT_EQ(MakeTable(both, {.kind = "timing"}).rows.size(), 1u);
  EXPECT_EQ(MakeTable(std::vector<Record>{Timing("a", 0, "")}, {}).title, "Timing");
  Record other = RecordOf("kind", "benchmark", "instructions", 12);
  const Table table = MakeTable(std::vector<Record>{other}, {});
  EXPECT_EQ(Keys(table), "kind instructions ");
  EXPECT_EQ(MakeTable(both, {.kind = "all"}).rows.size(), 2u);
}

TEST(TableView, ParametersOfASweepAreColumnsWithoutBeingAskedFor) {
  const std::vector<Record> records = {Accuracy("a", 1, 10), Accuracy("a", 2, 20)};
  for (const bool compact : {false, true}) {
    const std::string keys = Keys(MakeTable(records, {.compact = compact}));
    ExpectWords(keys, {"spring.stiffness outcome "});
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
    ExpectWords(text, {"(did you mean \"mechanism\"?)", "spring.stiffness"});
  }
  // a column of the tables that no record fills is empty, not unknown
  EXPECT_EQ(Refusal(records, {.columns = {"correction_max"}}), "");
}

TEST(TableView, SortsByNumberOrTextWithMissingValuesLast) {
  Record missing = Changed(Accuracy("d", 0, 1), "drift_position_max", Value());
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
  const std::string text = ToText(table);
  EXPECT_EQ(std::ranges::count(text, '='), 2) << text;
  ASSERT_NE(text.find("spring.stiffness = 10\n"), std::string::npos) << text;
  EXPECT_LT(text.find("spring.stiffness = 9\n"), text.find("spring.stiffness = 10\n")) << text;
  EXPECT_EQ(Values(table, "mechanism"), "b a c ");
}

// Not resolved: one run.
Record SingleRun() {
  return Changed(Accuracy("b", 1, 1), "growth_exponent", 9.68, "growth_resolved", false,
                 "growth_hypothesis", "t^2", "growth_hypothesis_resolved", false,
                 "energy_growth_exponent", 1.02);
}

Record Ensemble() {
  return Changed(Accuracy("a", 1, 1), "growth_exponent", 2.031, "growth_resolved", true,
                 "growth_hypothesis", "t^2", "growth_hypothesis_resolved", true);
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
      ExpectWords(text, {"9.68?"});
      EXPECT_EQ(text.find("2.03?"), std::string::npos) << text;
    }
    // a number stays a number where machines read it
    EXPECT_EQ(table.rows[1].Number("growth_exponent"), 9.68);
  }
  const Table laws = MakeTable(
      records, {.columns = {"growth_hypothesis", "energy_growth_exponent", "growth_resolved"}});
  ExpectWords(ToMarkdown(laws), {"| t^2? | 1.02? |", "| t^2 |  |"});
  // digits below digits
  const std::string text = ToText(MakeTable(records, {.columns = {"growth_exponent"}}));
  ExpectWords(text, {"2.03\n"});
  EXPECT_EQ(text.find("2.03\n") - text.rfind('\n', text.find("2.03\n")),
            text.find("9.68?\n") - text.rfind('\n', text.find("9.68?\n")))
      << text;
}

TEST(TableView, WhatChosenColumnsHideIsSaidInEveryFormat) {
  Record failed = Changed(SingleRun(), "outcome", "singular");
  const std::vector<Record> records = {Ensemble(), failed};
  const Table bare = MakeTable(records, {.columns = {"growth_exponent"}});
  for (const char* format : {"text", "csv", "markdown", "json", "latex"}) {
    const std::string text = Render(bare, format);
    ExpectWords(text, {"1 of 2 runs did not finish", "not resolved"});
  }
  // columns that say it themselves, and runs of which there is nothing to say
  EXPECT_TRUE(MakeTable(records, {}).notes.empty());
  EXPECT_TRUE(MakeTable(records, {.columns = {"outcome", "drift_position_max"}}).notes.empty());
  EXPECT_TRUE(
      MakeTable(std::vector<Record>{Ensemble()}, {.columns = {"growth_exponent"}}).notes.empty());
}

TEST(TableView, FlaggedRowsHaveTheMarkOfTheCaptionAndTheirReasonsInTheDocument) {
  Record flagged = Changed(SingleRun(), "warnings", "energy", "energy_error_relative", 0.03);
  const std::vector<Record> records = {Ensemble(), flagged};
  const TableView bare{.compact = true, .columns = {"formulation", "growth_exponent"}};
  const std::string text = ToLatex(MakeTable(records, bare));
  ExpectWords(text, {"1 of 2 rows", "odca* & $9.68?$", "odca & $2.03$"});
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
    return RecordOf("kind", "precision", "mechanism", "four-bar", "coordinates", coordinates,
                    "solver", "rank-revealing", "integrator", integrator, "scalar", "double",
                    "rtol", 1e-6, "outcome", "finished");
  };
  const std::vector<Record> rungs = {rung("joint", "ode45"), rung("absolute", "ode45")};
  const Table table = MakeTable(rungs, {.kind = "precision", .compact = true});
  ExpectWords(ToText(table), {" abs "});
  EXPECT_EQ(Keys(table).find("integrator"), std::string::npos) << Keys(table);
  // any key of cases that is needed comes in, and none besides
  const Table both = MakeTable(std::vector<Record>{rung("joint", "ode45"), rung("joint", "gragg"),
                                                   rung("absolute", "ode45")},
                               {.kind = "precision", .compact = true});
  ExpectWords(Keys(both), {"integrator outcome"});
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
  ExpectWords(loaded[1], {"below 2 %"});
}

TEST(TableView, ReferencesAreAKindOfTheirOwn) {
  std::vector<Record> records(2);
  records[0] = Changed(records[0], "kind", "reference", "mechanism", "kite", "message",
                       "lagrange ends at 21 s");
  records[1].Set("kind", std::string("accuracy"));
  records[1].Set("mechanism", std::string("four-bar"));
  const Table table = MakeTable(records, {.kind = "references", .compact = true});
  ASSERT_EQ(table.rows.size(), 1u);
  EXPECT_EQ(table.title, "References");
  ExpectWords(ToText(table), {"lagrange ends at 21 s"});
  // of a store with runs the runs are shown unless asked otherwise
  EXPECT_EQ(MakeTable(records, {.compact = true}).title, "Drift");
}

Record RunOf(const std::string& mechanism, const std::string& formulation,
             const std::string& enforcement, const std::string& coordinates, double drift,
             double exponent) {
  return RecordOf("mechanism", mechanism, "formulation", formulation, "enforcement", enforcement,
                  "coordinates", coordinates, "solver", "plain", "integrator", "ode45", "rtol",
                  1e-8, "horizon", 10.0, "outcome", "finished", "drift_position_max", drift,
                  "growth_exponent", exponent);
}

// Drift as findings 1 describe it: level and geometry decide, the formulation does not; absolute
// coordinates undo what the square geometry gives.
std::vector<Record> Planted() {
  std::vector<Record> records;
  for (const char* mechanism :
       {"square-four-bar", "four-bar", "square-seven-bar", "general-seven-bar"}) {
    for (const char* formulation : {"odca", "lagrange", "reduction"}) {
      for (const char* enforcement : {"acceleration", "velocity"}) {
        for (const char* coordinates : {"joint", "absolute"}) {
          const bool square = std::string(mechanism).starts_with("square");
          const bool invariant = square && coordinates == std::string("joint");
          const bool velocity = enforcement == std::string("velocity");
          const double drift = invariant ? 1e-14 : velocity ? 1e-9 : 1e-7;
          records.push_back(
              RunOf(mechanism, formulation, enforcement, coordinates, drift, velocity ? 1 : 2));
        }
      }
    }
  }
  return records;
}

Record RowOf(const Table& table, const std::string& factor, const std::string& to,
             const std::string& within) {
  for (const Record& row : table.rows) {
    if (row.Text("factor") == factor && row.Text("to") == to && row.Text("within") == within) {
      return row;
    }
  }
  ADD_FAILURE() << "no row " << factor << " " << to << " " << within << "\n" << ToText(table);
  return {};
}

// Ratios are recovered through a logarithm and an exponential: a few units of round-off.
constexpr double kRoundOff = 1e-13;

TEST(Factorial, AFactorWithoutEffectHasRatioOne) {
  const Record row = RowOf(FactorialTable(Planted()), "formulation", "lagrange", "all");
  EXPECT_EQ(row.Number("pairs"), 16);
  EXPECT_NEAR(row.Number("ratio_mean"), 1.0, kRoundOff);
  EXPECT_EQ(row.Number("ratio_min"), 1.0);
  EXPECT_EQ(row.Number("ratio_max"), 1.0);
  EXPECT_EQ(row.Number("exponent_difference"), 0.0);
}

TEST(Factorial, CoordinatesMatterOnSquareProblemsOnly) {
  const Table table = FactorialTable(Planted());
  const Record square = RowOf(table, "coordinates", "absolute", "square");
  EXPECT_EQ(square.Number("pairs"), 12);
  EXPECT_NEAR(square.Number("ratio_mean") / 1e6, 1.0, kRoundOff);
  EXPECT_NEAR(square.Number("ratio_min") / 1e5, 1.0, kRoundOff);
  EXPECT_NEAR(square.Number("ratio_max") / 1e7, 1.0, kRoundOff);
  const Record general = RowOf(table, "coordinates", "absolute", "general");
  EXPECT_NEAR(general.Number("ratio_mean"), 1.0, kRoundOff);
}

TEST(Factorial, GeometryMattersInJointCoordinatesOnly) {
  const Table table = FactorialTable(Planted());
  EXPECT_NEAR(RowOf(table, "geometry", "general", "joint").Number("ratio_mean") / 1e6, 1.0,
              kRoundOff);
  EXPECT_NEAR(RowOf(table, "geometry", "general", "absolute").Number("ratio_mean"), 1.0, kRoundOff);
}

TEST(Factorial, TheLevelChangesTheExponent) {
  const Record row = RowOf(FactorialTable(Planted()), "enforcement", "acceleration", "general");
  EXPECT_EQ(row.Number("exponent_difference"), 1.0);
  EXPECT_NEAR(row.Number("ratio_mean") / 100.0, 1.0, kRoundOff);
}

TEST(Factorial, OtherTolerancesAndHorizonsTakeNoPart) {
  EXPECT_TRUE(FactorialTable(Planted(), 1e-6).rows.empty());
  EXPECT_TRUE(FactorialTable(Planted(), 1e-8, 100.0).rows.empty());
}

TEST(Factorial, FailedRunsAreCountedAndTheLastOfEqualRunsWins) {
  std::vector<Record> records = {
      RunOf("four-bar", "odca", "acceleration", "joint", 1e-7, 2),
      RunOf("four-bar", "odca", "acceleration", "absolute", 1e-9, 2),
      RunOf("four-bar", "odca", "acceleration", "absolute", 3e-7, 2),
      RunOf("four-bar", "lagrange", "acceleration", "joint", 0.0, 2),
      RunOf("four-bar", "lagrange", "acceleration", "absolute", 1e-7, 2),
  };
  records[3].Set("outcome", std::string("singular"));
  const Record row = RowOf(FactorialTable(records), "coordinates", "absolute", "all");
  EXPECT_EQ(row.Number("pairs"), 1);
  EXPECT_EQ(row.Number("left_out"), 1);
  EXPECT_NEAR(row.Number("ratio_mean"), 3.0, kRoundOff);
}

TEST(Factorial, DriftBelowRoundOffCountsAsRoundOff) {
  const std::vector<Record> records = {RunOf("toggle", "odca", "acceleration", "joint", 0.0, 1),
                                       RunOf("toggle", "odca", "acceleration", "absolute",
                                             std::numeric_limits<double>::epsilon() / 4, 1)};
  EXPECT_NEAR(RowOf(FactorialTable(records), "coordinates", "absolute", "all").Number("ratio_mean"),
              1.0, kRoundOff);
}

// A sweep over a mass: each ratio compares runs of the same mass, whatever their order.
TEST(Factorial, RunsOfDifferentParametersAreNoPair) {
  std::vector<Record> records;
  for (const double mass : {1.0, 10.0}) {
    for (const char* coordinates : {"joint", "absolute"}) {
      const bool joint = coordinates == std::string("joint");
      Record record = RecordOf("mass", mass);  // keys of a case stand before its results
      const Record run =
          RunOf("toggle", "odca", "acceleration", coordinates, (joint ? 1e-8 : 3e-8) * mass, 2);
      for (const auto& [key, value] : run.items()) record.Set(key, value);
      records.push_back(record);
    }
  }
  const Record row = RowOf(FactorialTable(records), "coordinates", "absolute", "all");
  EXPECT_EQ(row.Number("pairs"), 2);
  EXPECT_NEAR(row.Number("ratio_min"), 3, 1e-12);
  EXPECT_NEAR(row.Number("ratio_max"), 3, 1e-12);
}

}  // namespace table_view_test
}  // namespace loopbench::harness
