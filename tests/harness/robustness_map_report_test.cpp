// A robustness map as a whole: table, page, gate and picture of planted records.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "harness/base/text.h"
#include "harness/figures/figures.h"
#include "harness/judge/judge.h"
#include "tests/harness/robustness_map_runs.h"

namespace loopbench::harness {
namespace robustness_map_report_test {

testing::AssertionResult Contains(const std::string& text, const std::string& part) {
  return testing::IsSubstring("part", "text", part, text);
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
  EXPECT_TRUE(Contains(ToCsv(MapCellTable(map)), "odca-1e-08,1,\"drift 1, energy 1\"\n"));
}

TEST(RobustnessMapReport, PrintsCellsByMethod) {
  const std::string text = ToText(MapTable(SmallMap(SmallRecords())));
  EXPECT_TRUE(Contains(text, "one, \"1e-8\"  ok 2.5e-07  inaccurate 0.5\n"));
  EXPECT_TRUE(Contains(text, "two          ?           -\n"));
  EXPECT_TRUE(Contains(text, "B  multipliers\n"));
  EXPECT_TRUE(Contains(text, "4 cells: 1 holds, 1 inaccurate, 1 not measured, 1 not applicable"));
  EXPECT_EQ(text.find('\033'), std::string::npos);
  const std::string coloured = ToText(MapTable(SmallMap(SmallRecords())), true);
  EXPECT_TRUE(Contains(coloured, "\033[31minaccurate 0.5"));
  EXPECT_TRUE(Contains(coloured, "\033[32mok 2.5e-07"));
}

TEST(RobustnessMapReport, PageHasLimitsAndProvenance) {
  const std::string page = MapMarkdown(SmallMap(SmallRecords()), {"command: loopbench robustness"});
  EXPECT_TRUE(
      Contains(page, "| one, \"1e-8\" | holds branch 2.5e-07 rad | inaccurate branch 0.5 rad |"));
  EXPECT_TRUE(Contains(page, "| branch_error_max <= 1e-06 [rad] | a reason |"));
  EXPECT_TRUE(Contains(page, "command: loopbench robustness"));
}

TEST(RobustnessMapReport, ListsDemandsThatAreNotMet) {
  const std::vector<std::string> broken = BrokenDemands(SmallMap(SmallRecords()));
  ASSERT_EQ(broken.size(), 2u);
  EXPECT_TRUE(Contains(broken[0], "multipliers / one, \"1e-8\": inaccurate branch 0.5 rad"));
  EXPECT_TRUE(Contains(broken[1], "O-DCA / two: not measured (no record matches)"));
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
  const MapDrawing drawing = DrawMap(map);
  for (const char* text :
       {"\"O-DCA\"", "\"singular\"", "\"Two methods\"", "\"33 %\"", "\"?\"", "\"not measured\"",
        "\"finished, demand not met\"", "\"frame: must hold and does not\""}) {
    EXPECT_TRUE(Contains(drawing.script, text));
  }
  EXPECT_EQ(drawing.script.find("holds, with warnings"), std::string::npos);
  const auto path = std::filesystem::path(testing::TempDir()) / "loopbench-robustness-map.svg";
  std::filesystem::remove(path);
  const auto error = WriteMapFigure(path, map);
  ASSERT_FALSE(error.has_value()) << *error;
  const std::string svg = ReadFile(path);
  EXPECT_TRUE(Contains(svg, "not measured"));
  EXPECT_TRUE(Contains(svg, "width=\"178.15mm\""));
  EXPECT_TRUE(Contains(svg, "</svg>"));
  std::filesystem::remove(path);
  EXPECT_TRUE(WriteMapFigure(path, map, FigureSize::kOneColumn, "no-such-gnuplot")
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
  const auto refusal = [&](const std::string& text) -> std::string {
    try {
      MapFromCsv(rules, text, "map.csv");
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_TRUE(Contains(refusal(""), "map.csv: found no"));
  EXPECT_TRUE(Contains(refusal("a,b\n1,2\n"), "map.csv:2: found no column \"group\""));
  EXPECT_TRUE(Contains(refusal(csv + "one,two\n"), "map.csv:7: found 2 fields"));
  std::string twice = csv, other = csv;
  twice += csv.substr(csv.rfind('\n', csv.size() - 2) + 1);
  EXPECT_TRUE(Contains(refusal(twice), "expected each cell of the rules once"));
  other.replace(other.find(",holds,"), 7, ",hold,");
  EXPECT_TRUE(Contains(refusal(other), "map.csv:3: found state \"hold\""));
}

}  // namespace robustness_map_report_test
}  // namespace loopbench::harness
