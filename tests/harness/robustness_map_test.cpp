// Robustness maps: planted records turn each cell into each of its classes; what rows inherit, and
// all mistakes of a file at once; table, page, gate and picture.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "harness/base/text.h"
#include "harness/figures/figures.h"
#include "harness/judge/judge.h"
#include "tests/harness/records.h"

namespace loopbench::harness {
namespace robustness_map_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// A run of the parallelogram, to 20 s if it finished.
Record RunOf(const std::string& formulation, double rtol, double branch, double energy,
             const std::string& outcome = "finished") {
  return RecordOf("kind", "accuracy", "mechanism", "parallelogram", "formulation", formulation,
                  "rtol", rtol, "case_id", fmt::format("{}-{}", formulation, rtol), "outcome",
                  outcome, "t_reached", outcome == "finished" ? 20.0 : 0.3125, "branch_error_max",
                  branch, "energy_error_max", energy);
}

/// Such a run of O-DCA at 1e-8.
Record Odca(double branch, double energy, const std::string& outcome = "finished") {
  return RunOf("odca", 1e-8, branch, energy, outcome);
}

/// Branch within 1e-6 rad, energy within 500 rtol.
MapRow Row() {
  MapRow row;
  row.label = "parallelogram";
  row.select = {{"mechanism", {"parallelogram"}}};
  row.decides = {{.measure = "branch_error_max", .name = "branch", .unit = "rad", .number = 1e-6},
                 {.measure = "energy_error_max",
                  .name = "energy",
                  .unit = "J",
                  .number = 500.0,
                  .of = "rtol"}};
  row.must_hold = {false};
  return row;
}

MapCell CellOf(const std::vector<Record>& records, const MapRow& row = Row()) {
  return JudgeCell(row, 0, {"O-DCA", {{"formulation", {"odca"}}}}, records);
}

/// State, class and deciding number of such a cell: "holds, holds: locked, 0.31 s".
std::string Said(const std::vector<Record>& records, const MapRow& row = Row()) {
  const MapCell cell = CellOf(records, row);
  return fmt::format("{}, {}, {}", ToString(cell.state), ClassText(cell), DecidingNumber(cell));
}

TEST(MapCell, HoldsWithTheNumberClosestToItsLimit) {
  EXPECT_EQ(Said({Odca(2e-7, 5e-7)}), "holds, holds, branch 2e-07 rad");
  const MapCell cell = CellOf({Odca(2e-7, 5e-7)});
  EXPECT_EQ(cell.decided.measure, "branch_error_max");  // a fifth of its limit, energy a tenth
  EXPECT_NEAR(cell.decided.ratio, 0.2, 1e-12);
  const MapCell other = CellOf({Odca(2e-7, 4e-6)});
  EXPECT_EQ(DecidingNumber(other), "energy 4e-06 J");
  EXPECT_DOUBLE_EQ(other.decided.limit, 500 * 1e-8);
}

TEST(MapCell, IsInaccurateBeyondALimitAndNamesAllThatAre) {
  EXPECT_EQ(Said({Odca(0.71, 1e-3)}),
            "inaccurate, inaccurate, branch 0.71 rad");  // 7e5 limits against 200
  const MapCell cell = CellOf({Odca(0.71, 1e-3)});
  ExpectWords(cell.reason, {"branch_error_max = 0.71 [rad], limit 1e-06",
                            "energy_error_max = 0.001 [J], limit 5e-06"});
  EXPECT_EQ(cell.holding, 0u);
}

TEST(MapCell, TheLimitItselfHolds) {
  EXPECT_EQ(CellOf({Odca(1e-6, 0.0)}).state, CellState::kHolds);
  EXPECT_EQ(CellOf({Odca(std::nextafter(1e-6, 1.0), 0.0)}).state, CellState::kInaccurate);
}

TEST(MapCell, WhatIsNotFiniteIsInaccurate) {
  const std::string said = "inaccurate, inaccurate, branch not finite";
  EXPECT_EQ(Said({Odca(kNan, 1e-7)}), said);
  EXPECT_EQ(Said({Changed(Odca(0.0, 1e-7), "branch_error_max", Value())}), said);  // as stored
}

TEST(MapCell, NamesEveryOtherEndingOfARun) {
  std::vector<CellState> states;
  for (const RunEnding& ending : kRunEndings) {
    if (ending.word == "finished") continue;
    EXPECT_EQ(Said({Odca(0.0, 0.0, std::string(ending.word))}),
              fmt::format("{}, {}, at 0.312 s", ToString(ending.state), ending.word));
    states.push_back(ending.state);
  }
  EXPECT_EQ(std::ranges::count(states, CellState::kStopped), 8);
  EXPECT_EQ(std::ranges::count(states, CellState::kLimit), 4);
  EXPECT_EQ(std::ranges::count(states, CellState::kBroken), 3);
  EXPECT_EQ(CellOf({Odca(0.0, 0.0, "a new word")}).state, CellState::kBroken);
}

TEST(MapCell, WithoutRecordIsNotMeasuredAndNeverHolds) {
  const MapCell cell = CellOf({RunOf("lagrange", 1e-8, 0.0, 0.0)});
  EXPECT_EQ(cell.state, CellState::kNotMeasured);
  EXPECT_EQ(cell.reason, "no record matches");
  EXPECT_EQ(CellOf({Changed(Odca(0.0, 0.0), "kind", "timing")}).state, CellState::kNotMeasured);
}

TEST(MapCell, WithoutAMeasureThatDecidesIsNotMeasured) {
  MapRow row = Row();
  row.decides[0].measure = "closed_form_error_max";
  const MapCell cell = CellOf({Odca(0.0, 0.0)}, row);
  EXPECT_EQ(cell.state, CellState::kNotMeasured);
  EXPECT_EQ(cell.reason, "the record has no closed_form_error_max");
  EXPECT_EQ(cell.holding, 0u);
  // what is wrong all the same is not excused by what is missing
  EXPECT_EQ(CellOf({Odca(0.0, 1.0)}, row).state, CellState::kInaccurate);
  row = Row();
  row.decides[1].of = "tolerance";
  EXPECT_EQ(CellOf({Odca(0.0, 0.0)}, row).reason, "the record has no finite tolerance");
}

TEST(MapCell, FewerRecordsThanCasesAreNotMeasured) {
  MapRow row = Row();
  row.cases = 3;
  std::vector<Record> records = {RunOf("odca", 1e-6, 0.0, 0.0), Odca(0.0, 0.0)};
  MapCell cell = CellOf(records, row);
  EXPECT_EQ(cell.state, CellState::kNotMeasured);
  EXPECT_EQ(cell.reason, "2 of 3 cases have a record");
  EXPECT_EQ(HoldingCount(cell), "2/3");
  // bad enough already
  EXPECT_EQ(CellOf({records[0], Changed(records[1], "outcome", "crashed")}, row).word, "crashed");
  records.push_back(RunOf("odca", 1e-10, 0.0, 0.0));
  cell = CellOf(records, row);
  EXPECT_EQ(cell.state, CellState::kHolds);
  EXPECT_EQ(HoldingCount(cell), "3/3");
}

TEST(MapCell, TheWorstOfSeveralRecordsDecides) {
  // from good to bad; each, put among all better ones, is what the cell shows
  const std::vector<Record> records = {
      RunOf("odca", 1e-4, 1e-9, 0.0),           RunOf("odca", 1e-5, 1e-7, 0.0),
      RunOf("odca", 1e-6, 0.0, 0.0, "locked"),  RunOf("odca", 1e-7, 0.0, 0.0, "step-limit"),
      RunOf("odca", 1e-8, 1e-5, 0.0),           RunOf("odca", 1e-9, 1e-4, 0.0),
      RunOf("odca", 1e-10, 0.0, 0.0, "crashed")};
  std::vector<Record> some;
  for (const Record& record : records) {
    some.insert(some.begin(), record);
    const MapCell cell = CellOf(some);
    EXPECT_EQ(cell.case_id, record.Text("case_id"));
    EXPECT_EQ(cell.records, some.size());
    EXPECT_EQ(cell.holding, std::min<std::size_t>(some.size(), 2));
  }
}

TEST(MapCell, AnotherEndingMayBeRight) {
  MapRow row = Row();
  row.right = {"locked", "step-too-small"};
  row.decides = {{.measure = "t_reached", .unit = "s", .number = 0.32, .when = {"locked"}}};
  const Record locked = Odca(0.0, 0.0, "locked"), late = Changed(locked, "t_reached", 5.0);
  EXPECT_EQ(Said({locked}, row), "holds, holds: locked, 0.31 s");
  EXPECT_EQ(CellOf({late}, row).state, CellState::kInaccurate);
  // right at any time
  EXPECT_EQ(Said({Changed(late, "outcome", "step-too-small")}, row),
            "holds, holds: step-too-small, at 5 s");
  const MapCell cell = CellOf({Changed(late, "outcome", "singular")}, row);
  EXPECT_EQ(cell.word, "singular");
  EXPECT_EQ(cell.reason, "ended as singular, right is locked or step-too-small");
  // to go on as if all were well is wrong then, however small the errors
  EXPECT_EQ(Said({Odca(0.0, 0.0)}, row), "inaccurate, inaccurate, finished");
}

TEST(MapCell, CountsAreDemandedAtLeastAndEqual) {
  MapRow row = Row();
  row.decides = {{.measure = "kept",
                  .name = "kept",
                  .relation = Relation::kAtLeast,
                  .number = 1.0,
                  .of = "size"}};
  const Record all = Changed(Odca(0.0, 0.0), "size", 400, "kept", 400, "slip", 0.016, "rank", 3);
  EXPECT_EQ(CellOf({all}, row).state, CellState::kHolds);
  EXPECT_EQ(Said({Changed(all, "kept", 397)}, row), "inaccurate, inaccurate, kept 397 of 400");
  EXPECT_TRUE(std::isinf(CellOf({Changed(all, "kept", 0)}, row).decided.ratio));
  // a number is shown out of its own total only
  row.decides.push_back({.measure = "slip", .name = "slip", .unit = "m", .number = 1e-6});
  EXPECT_EQ(DecidingNumber(CellOf({all}, row)), "slip 0.016 m");
  row.decides = {{.measure = "rank", .relation = Relation::kEqual, .number = 3.0}};
  EXPECT_EQ(CellOf({all}, row).state, CellState::kHolds);
  EXPECT_EQ(CellOf({Changed(all, "rank", 2)}, row).state, CellState::kInaccurate);
}

TEST(MapCell, NotApplicableExcusesAMissingRecordOnly) {
  MapRow row = Row();
  row.not_applicable = {{"O-DCA", "there is nothing to feed back"}};
  EXPECT_EQ(CellOf({}, row).state, CellState::kNotApplicable);
  EXPECT_EQ(CellOf({}, row).reason, "there is nothing to feed back");
  EXPECT_EQ(CellOf({Odca(1.0, 0.0)}, row).state, CellState::kInaccurate);
}

TEST(MapCell, OneReasonExcusesAllColumnsThatNeedNotHold) {
  MapRow row = Row();
  row.others_not_applicable = "not run";
  EXPECT_EQ(CellOf({}, row).state, CellState::kNotApplicable);
  EXPECT_EQ(CellOf({}, row).reason, "not run");
  row.must_hold = {true};
  EXPECT_EQ(CellOf({}, row).state, CellState::kNotMeasured);
}

constexpr const char* kInheriting = R"({
  "title": "t",
  "methods": [{"label": "A", "select": {"formulation": "odca"}},
              {"label": "B", "select": {"formulation": "reduction", "rtol": [1e-6, 1e-8]}}],
  "groups": [
    {"label": "g", "select": {"horizon": 10}, "cases": 4, "rationale": "because", "required": "all",
     "not_applicable": {"B": "not B"},
     "criteria": [{"measure": "m", "limit": 500, "relative_to": "rtol", "unit": "rad", "name": "n"}],
     "rows": [
       {"label": "all of the group's", "select": {"mechanism": "x"}},
       {"label": "its own", "select": {"mechanism": "y"}, "expected_outcome": ["locked", "finished"],
        "criteria": [{"measure": "k", "at_least": 3}, {"measure": "t", "equal": 0, "when": "locked"}],
        "cases": 1, "rationale": "otherwise", "required": [], "not_applicable": {"A": "nor A"}}]}]
})";

TEST(MapRules, RowsInheritFromTheirGroup) {
  const MapRules rules = ParseMapRules(kInheriting, "map.json");
  ASSERT_EQ(rules.columns.size(), 2u);
  EXPECT_EQ(ToText(rules.columns[1].select), "formulation=reduction rtol=1e-06,1e-08");
  const MapRow& row = rules.groups.at(0).rows.at(0);
  EXPECT_EQ(ToText(row.select), "horizon=10 mechanism=x");
  ASSERT_EQ(row.decides.size(), 1u);
  EXPECT_EQ(ToText(row.decides[0]), "m <= 500 rtol [rad]");
  EXPECT_EQ(row.right, std::vector<std::string>{"finished"});
  EXPECT_EQ(row.cases, 4u);
  EXPECT_EQ(row.why, "because");
  EXPECT_EQ(row.must_hold, (std::vector<bool>{true, false}));  // all but what is not applicable
  EXPECT_EQ(row.not_applicable.at("B"), "not B");
}

TEST(MapRules, OneReasonMayStandForAllOtherColumns) {
  std::string text = kInheriting;
  text.replace(text.find(R"({"B": "not B"})"), 14, R"("elsewhere")");
  const MapRow row = ParseMapRules(text, "map.json").groups.at(0).rows.at(0);
  EXPECT_EQ(row.others_not_applicable, "elsewhere");
  EXPECT_TRUE(row.not_applicable.empty());
}

TEST(MapRules, RowsMaySayOtherwise) {
  const MapRow row = ParseMapRules(kInheriting, "map.json").groups.at(0).rows.at(1);
  EXPECT_EQ(ToText(row.decides.at(0)), "k >= 3");
  EXPECT_EQ(ToText(row.decides.at(1)), "t = 0 when locked");
  EXPECT_EQ(row.right, (std::vector<std::string>{"locked", "finished"}));
  EXPECT_EQ(row.cases, 1u);
  EXPECT_EQ(row.why, "otherwise");
  EXPECT_EQ(row.must_hold, (std::vector<bool>{false, false}));
  EXPECT_EQ(row.not_applicable.size(), 2u);
}

std::string MistakesOf(const std::string& text) {
  return MessageOf([&] { ParseMapRules(text, "map.json"); });
}

TEST(MapRules, AllMistakesAreReportedAtOnce) {
  const std::string message = MistakesOf(R"({
  "titel": "t",
  "methods": [{"label": "A", "select": {}}, {"label": "A", "select": {"rtol": null}}, {}],
  "groups": [
    {"label": "g", "rows": [
      {"label": "r", "select": {"a": 1}},
      {"label": "r", "select": {"a": 1}, "criteria": [
        {"measure": "m", "limit": 0},
        {"measure": "m", "limit": 1, "at_least": 1},
        {"measure": "m"},
        {"limit": "1", "when": ["locked"]}],
       "expected_outcome": ["lockd", "finished"], "required": ["C"], "not_applicable": {"D": "x"}},
      {"label": "no selection", "expected_outcome": "locked", "cases": 0}]},
    {"label": "empty", "rows": []}]
})");
  ExpectWords(
      "\n" + message,
      {"\nmap.json:2: /titel: found unknown key \"titel\", expected one of \"title\", \"comment\", "
       "\"methods\", \"groups\", \"$schema\", \"format\" (did you mean \"title\"?)\n",
       "\nmap.json:1: (top level): found no \"title\", expected a string that is not empty\n",
       "\nmap.json:3: /methods/0/select: found an empty object, expected at least one key\n"});
  ExpectWords(message,
              {"/methods/1/label: found \"A\", expected each name once",
               "/methods/1/select/rtol: found null", "/methods/2: found no \"label\"",
               "/methods/2: found no \"select\"",
               "/groups/0/rows/0: found nothing that decides about a finished run",
               "/groups/0/rows/1/label: found \"r\", expected each name once",
               "/groups/0/rows/1/criteria/0/limit: found 0, expected a number > 0",
               "/groups/0/rows/1/criteria/1/at_least: found 1, expected one of \"limit\"",
               "/groups/0/rows/1/criteria/2: found no number, expected one of \"limit\"",
               "/groups/0/rows/1/criteria/3: found no \"measure\"",
               "/groups/0/rows/1/criteria/3/limit: found \"1\"",
               "/groups/0/rows/1/criteria/3/when: found [\"locked\"], expected endings that are "
               "\"expected_outcome\"",
               "/groups/0/rows/1/expected_outcome/0: found \"lockd\"", "(did you mean \"locked\"?)",
               "/groups/0/rows/1/required/0: found \"C\"",
               "/groups/0/rows/1/not_applicable/D: found unknown key",
               "/groups/0/rows/2: found no \"select\"", "/groups/0/rows/2/cases: found 0",
               "/groups/1/rows: found an empty array, expected at least one row"});
  EXPECT_EQ(std::ranges::count(message, '\n'), 20) << message;
}

TEST(MapRules, ADemandOfFinishedRunsNeedsThatFinishingIsRight) {
  const std::string message = MistakesOf(R"({
  "title": "t",
  "methods": [{"label": "A", "select": {"formulation": "odca"}}],
  "groups": [{"label": "g", "rows": [
    {"label": "r", "select": {"a": 1}, "expected_outcome": "locked", "criteria": [{"measure": "t", "limit": 1}]}]}]
})");
  ExpectWords(message, {"/groups/0/rows/0/criteria/0: found no \"when\", which means finished, "
                        "expected endings that are \"expected_outcome\" here"});
}

constexpr const char* kRules = R"({
  "title": "Two methods", "comment": "For tests.",
  "methods": [{"label": "O-DCA", "select": {"formulation": "odca"}},
              {"label": "multipliers", "select": {"formulation": "lagrange"}}],
  "groups": [{"label": "singular", "select": {"mechanism": "parallelogram"},
    "criteria": [{"measure": "branch_error_max", "name": "branch", "limit": 1e-6, "unit": "rad"}],
    "rows": [
      {"label": "one, \"1e-8\"", "select": {"rtol": 1e-8}, "required": "all", "rationale": "a reason"},
      {"label": "two", "select": {"rtol": 1e-6}, "required": ["O-DCA"],
       "not_applicable": {"multipliers": "none"}}]}]
})";

RobustnessMap SmallMap(const std::vector<Record>& records) {
  return MakeRobustnessMap(ParseMapRules(kRules, "map.json"), records);
}

std::vector<Record> SmallRecords() {
  return {RunOf("odca", 1e-8, 2.5e-7, 0.0), RunOf("lagrange", 1e-8, 0.5, 0.0)};
}

TEST(RobustnessMapReport, ListsEveryCellWithEveryDigit) {
  EXPECT_EQ(ToCsv(MapCellTable(SmallMap(SmallRecords()))),
            "group,row,method,state,class,outcome,measure,value,unit,limit,ratio,t_reached,holding,"
            "records,cases,required,reason,case_id,with_warnings,warnings\n"
            "singular,\"one, \"\"1e-8\"\"\",O-DCA,holds,holds,finished,branch_error_max,2.5e-07,"
            "rad,1e-06,0.25,20,1,1,1,true,,odca-1e-08,0,\n"
            "singular,\"one, \"\"1e-8\"\"\",multipliers,inaccurate,inaccurate,finished,"
            "branch_error_max,0.5,rad,1e-06,500000,20,0,1,1,true,\"branch_error_max = 0.5 [rad], "
            "limit 1e-06\",lagrange-1e-08,0,\n"
            "singular,two,O-DCA,not measured,not measured,,,,,,,,0,0,1,true,no record matches,,0,\n"
            "singular,two,multipliers,not applicable,not applicable,,,,,,,,0,0,1,false,none,,0,\n");
}

TEST(RobustnessMapReport, NamesCellsThatHoldWithWarnings) {
  std::vector<Record> records = SmallRecords();
  EXPECT_EQ(CountFlagged(SmallMap(records)), "0 of 1 cells that hold have runs with warnings");
  for (Record& record : records) record.Set("warnings", std::string("energy drift"));
  const RobustnessMap map = SmallMap(records);
  EXPECT_EQ(CountFlagged(map), "1 of 1 cells that hold have runs with warnings");
  ExpectWords(ToCsv(MapCellTable(map)), {"odca-1e-08,1,\"drift 1, energy 1\"\n"});
}

TEST(RobustnessMapReport, PrintsCellsByMethod) {
  const std::string text = ToText(MapTable(SmallMap(SmallRecords())));
  ExpectWords(text, {"one, \"1e-8\"  ok 2.5e-07  inaccurate 0.5\n", "two          ?           -\n",
                     "B  multipliers\n",
                     "4 cells: 1 holds, 1 inaccurate, 1 not measured, 1 not applicable"});
  EXPECT_EQ(text.find('\033'), std::string::npos);
  const std::string coloured = ToText(MapTable(SmallMap(SmallRecords())), true);
  ExpectWords(coloured, {"\033[31minaccurate 0.5", "\033[32mok 2.5e-07"});
}

TEST(RobustnessMapReport, PageHasLimitsAndProvenance) {
  const std::string page = MapMarkdown(SmallMap(SmallRecords()), {"command: loopbench robustness"});
  ExpectWords(page,
              {"| one, \"1e-8\" | holds branch 2.5e-07 rad | inaccurate branch 0.5 rad |",
               "| branch_error_max <= 1e-06 [rad] | a reason |", "command: loopbench robustness"});
}

TEST(RobustnessMapReport, ListsDemandsThatAreNotMet) {
  const std::vector<std::string> broken = BrokenDemands(SmallMap(SmallRecords()));
  ASSERT_EQ(broken.size(), 2u);
  ExpectWords(broken[0], {"multipliers / one, \"1e-8\": inaccurate branch 0.5 rad"});
  ExpectWords(broken[1], {"O-DCA / two: not measured (no record matches)"});
}

TEST(RobustnessMapReport, RemarksOnKeysThatNoRecordHas) {
  MapRules rules = ParseMapRules(kRules, "map.json");
  rules.columns[0].select[0].key = "formulatoin";
  const RobustnessMap map = MakeRobustnessMap(rules, SmallRecords());
  ASSERT_EQ(map.remarks.size(), 1u);
  EXPECT_EQ(map.remarks[0],
            "no record has the key \"formulatoin\" (did you mean \"formulation\"?)");
}

TEST(RobustnessMapFigure, FoldsRowsOfAnExtremeWorstFirst) {
  MapRules rules = ParseMapRules(kRules, "map.json");
  MapGroup better = rules.groups[0];
  better.label = "a long name";
  better.short_label = "better";
  better.rows.pop_back();
  better.rows[0].decides.clear();  // what ends well holds
  rules.groups.push_back(better);
  std::vector<FoldedGroup> groups = Folded(MakeRobustnessMap(rules, SmallRecords()));
  ASSERT_EQ(groups.size(), 2u);
  // one row holds and one is not measured; one is inaccurate and one not applicable
  EXPECT_EQ(groups[0].label, "singular");
  EXPECT_EQ(groups[0].cells[0].worst, CellState::kNotMeasured);
  EXPECT_EQ(groups[0].cells[0].Share(), 0.5);
  EXPECT_TRUE(groups[0].cells[0].fails_demand);
  EXPECT_EQ(groups[0].cells[1].worst, CellState::kInaccurate);
  EXPECT_EQ(groups[0].cells[1].judged, 1u);
  EXPECT_EQ(groups[0].cells[1].Share(), 0.0);
  EXPECT_EQ(groups[1].label, "better");
  EXPECT_EQ(groups[1].Share(), 1.0);
  std::ranges::reverse(rules.groups);
  EXPECT_EQ(Folded(MakeRobustnessMap(rules, SmallRecords()))[0].label, "singular");
}

TEST(RobustnessMapFigure, HasAGlyphAndShadeForEachCell) {
  const RobustnessMap map = SmallMap(SmallRecords());
  const Drawing drawing = DrawMap(map);
  ExpectWords(drawing.script, {"\"O-DCA\"", "\"singular\"", "\"Two methods\"", "\"33 %\"", "\"?\"",
                               "\"not measured\"", "\"finished, demand not met\"",
                               "\"frame: must hold and does not\""});
  EXPECT_EQ(drawing.script.find("holds, with warnings"), std::string::npos);
  const auto path = std::filesystem::path(testing::TempDir()) / "loopbench-robustness-map.svg";
  std::filesystem::remove(path);
  const auto error = DrawWithGnuplot(path, drawing);
  ASSERT_FALSE(error.has_value()) << *error;
  const std::string svg = ReadFile(path);
  ExpectWords(svg, {"not measured", "width=\"178.15mm\"", "</svg>"});
  std::filesystem::remove(path);
  EXPECT_TRUE(DrawWithGnuplot(path, DrawMap(map, FigureSize::kOneColumn), "no-such-gnuplot")
                  ->find("install gnuplot") != std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(RobustnessMapFigure, IsAtMostAPageTall) {
  MapRules rules = ParseMapRules(kRules, "map.json");
  const MapGroup one = rules.groups[0];
  for (int i = 0; i < 40; ++i) {
    rules.groups.push_back(one);
    rules.groups.back().label = fmt::format("group {} with a name that is as long as two lines", i);
  }
  EXPECT_LE(DrawMap(MakeRobustnessMap(rules, {})).page.height, PointsOf(240.0));
}

TEST(RobustnessMapFigure, IsTheSameOfItsCsv) {
  MapRules rules = ParseMapRules(kRules, "map.json");
  rules.groups[0].label = "=\"a, b\"\n#";  // as much as CSV escapes
  const RobustnessMap map = MakeRobustnessMap(rules, SmallRecords());
  const std::string csv = "# a note\n" + ToCsv(MapCellTable(map));
  EXPECT_EQ(DrawMap(MapFromCsv(rules, csv, "map.csv")).script, DrawMap(map).script);
  const auto refusal = [&](const std::string& text) {
    return MessageOf([&] { MapFromCsv(rules, text, "map.csv"); });
  };
  ExpectWords(refusal(""), {"map.csv: found no"});
  ExpectWords(refusal("a,b\n1,2\n"), {"map.csv:2: found no column \"group\""});
  ExpectWords(refusal(csv + "one,two\n"), {"map.csv:7: found 2 fields"});
  std::string twice = csv, other = csv;
  twice += csv.substr(csv.rfind('\n', csv.size() - 2) + 1);
  ExpectWords(refusal(twice), {"expected each cell of the rules once"});
  other.replace(other.find(",holds,"), 7, ",hold,");
  ExpectWords(refusal(other), {"map.csv:3: found state \"hold\""});
}

}  // namespace robustness_map_test
}  // namespace loopbench::harness
