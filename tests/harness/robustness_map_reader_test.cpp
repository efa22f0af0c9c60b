// Rules of robustness maps: what a row inherits, and all mistakes at once.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "harness/base/file_kind.h"
#include "harness/base/text.h"
#include "harness/judge/judge.h"

namespace loopbench::harness {
namespace robustness_map_reader_test {

constexpr const char* kRules = R"({
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
  const MapRules rules = ParseMapRules(kRules, "map.json");
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
  std::string text = kRules;
  text.replace(text.find(R"({"B": "not B"})"), 14, R"("elsewhere")");
  const MapRow row = ParseMapRules(text, "map.json").groups.at(0).rows.at(0);
  EXPECT_EQ(row.others_not_applicable, "elsewhere");
  EXPECT_TRUE(row.not_applicable.empty());
}

TEST(MapRules, RowsMaySayOtherwise) {
  const MapRow row = ParseMapRules(kRules, "map.json").groups.at(0).rows.at(1);
  EXPECT_EQ(ToText(row.decides.at(0)), "k >= 3");
  EXPECT_EQ(ToText(row.decides.at(1)), "t = 0 when locked");
  EXPECT_EQ(row.right, (std::vector<std::string>{"locked", "finished"}));
  EXPECT_EQ(row.cases, 1u);
  EXPECT_EQ(row.why, "otherwise");
  EXPECT_EQ(row.must_hold, (std::vector<bool>{false, false}));
  EXPECT_EQ(row.not_applicable.size(), 2u);
}

std::string MessageOf(const std::string& text) {
  try {
    ParseMapRules(text, "map.json");
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(MapRules, AllMistakesAreReportedAtOnce) {
  const std::string message = MessageOf(R"({
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
  std::istringstream lines(message);
  std::vector<std::string> found;
  for (std::string line; std::getline(lines, line);) found.push_back(line);
  const std::vector<std::string> expected = {
      "map.json:2: /titel: found unknown key \"titel\", expected one of \"title\", \"comment\", "
      "\"methods\", \"groups\", \"$schema\", \"format\" (did you mean \"title\"?)",
      "map.json:1: (top level): found no \"title\", expected a string that is not empty",
      "map.json:3: /methods/0/select: found an empty object, expected at least one key",
  };
  for (const std::string& line : expected) {
    EXPECT_NE(std::ranges::find(found, line), found.end()) << line << "\nnot in\n" << message;
  }
  for (const char* part :
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
        "/groups/1/rows: found an empty array, expected at least one row"}) {
    EXPECT_NE(message.find(part), std::string::npos) << part << "\nnot in\n" << message;
  }
  EXPECT_EQ(found.size(), 21u) << message;
}

TEST(MapRules, ADemandOfFinishedRunsNeedsThatFinishingIsRight) {
  const std::string message = MessageOf(R"({
  "title": "t",
  "methods": [{"label": "A", "select": {"formulation": "odca"}}],
  "groups": [{"label": "g", "rows": [
    {"label": "r", "select": {"a": 1}, "expected_outcome": "locked", "criteria": [{"measure": "t", "limit": 1}]}]}]
})");
  EXPECT_NE(message.find("/groups/0/rows/0/criteria/0: found no \"when\", which means finished, "
                         "expected endings that are \"expected_outcome\" here"),
            std::string::npos)
      << message;
}

TEST(MapRules, ThatAreShippedRead) {
  int count = 0;
  const std::filesystem::path configs =
      std::filesystem::path(LOOPBENCH_SOURCE_DIR) / "configs/experiments";
  for (const auto& entry : std::filesystem::recursive_directory_iterator(configs)) {
    if (entry.path().extension() != ".json" || KindOfFile(entry.path()) != FileKind::kMap) continue;
    EXPECT_FALSE(ReadMapRules(entry.path()).groups.empty()) << entry.path();
    ++count;
  }
  EXPECT_GE(count, 1);
}

}  // namespace robustness_map_reader_test
}  // namespace loopbench::harness
