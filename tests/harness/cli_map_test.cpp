// `loopbench robustness` as users call it.
#include "tests/harness/cli_fixture.h"

namespace loopbench::harness {
namespace cli_map_test {

constexpr const char* kMap = R"({
  "title": "Tiny map",
  "methods": [{"label": "O-DCA", "select": {"formulation": "odca"}},
              {"label": "reduction", "select": {"formulation": "reduction"}}],
  "groups": [{"label": "regular", "rows": [
    {"label": "four-bar", "select": {"mechanism": "four-bar"}, "required": ["O-DCA"],
     "criteria": [{"measure": "drift_position_max", "limit": 1e-3, "unit": "m"}]}]}]
})";

class MapCommandTest : public CommandLineTest {
 protected:
  void SetUp() override {
    CommandLineTest::SetUp();
    Write("map.json", kMap);
    ASSERT_EQ(Call("run tiny.json --out out").code, 0);
  }
};

TEST_F(MapCommandTest, PrintsAndWritesTheMap) {
  ExpectEnding(Call("robustness out --rules map.json"), 0,
               {"ok ", "?", "2 cells", "command: loopbench robustness"});
  EXPECT_FALSE(fs::exists(folder_ / "out/robustness-map.csv"));
  ExpectEnding(Call("robustness out --rules map.json --out report"), 0,
               {"wrote report/robustness-map.csv"});
  const std::string csv = ReadFile(folder_ / "report/robustness-map.csv");
  EXPECT_NE(csv.find("regular,four-bar,O-DCA,holds,holds,finished,drift_position_max,"),
            std::string::npos);
  EXPECT_NE(csv.find("# command: "), std::string::npos);
  EXPECT_EQ(csv.find("# date: "), std::string::npos);
  EXPECT_NE(ReadFile(folder_ / "report/robustness-map.md").find("# Tiny map"), std::string::npos);
  EXPECT_NE(ReadFile(folder_ / "report/robustness-map.svg").find("</svg>"), std::string::npos);
  ExpectEnding(Call("robustness out --rules map.json --out report --format pdf"), 0,
               {"robustness-map.pdf"});
  EXPECT_EQ(ReadFile(folder_ / "report/robustness-map.pdf").substr(0, 5), "%PDF-");
}

TEST_F(MapCommandTest, GateFailsOnWhatMustHoldAndDoesNot) {
  ExpectEnding(Call("robustness out --rules map.json --fail-on required"), 0, {"ok "});
  std::string map = kMap;
  Write("all.json", map.replace(map.find("[\"O-DCA\"]"), 9, "\"all\""));
  ExpectEnding(Call("robustness out --rules all.json"), 0, {});
  ExpectEnding(Call("robustness out --rules all.json --fail-on required"), 1,
               {"must hold: reduction / four-bar: not measured (no record matches)"});
  map = kMap;
  Write("none.json", map.replace(map.find("\"required\": [\"O-DCA\"],"), 23, ""));
  ExpectEnding(Call("robustness out --rules none.json --fail-on required"), 2,
               {"--fail-on required: no cell of none.json"});
}

TEST_F(MapCommandTest, RefusesBadInput) {
  ExpectEnding(Call("check map.json"), 0, {"robustness map of 1 row and 2 methods"});
  ExpectEnding(Call("robustness nowhere --rules map.json"), 2, {"nowhere"});
  ExpectEnding(Call("robustness out --rules nowhere.json"), 2, {"nowhere.json"});
  ExpectEnding(
      Call("robustness out --rules claims.json"), 2,
      {"claims.json:1: (top level): found claims (it has \"claims\"), expected a robustness map"});
  ExpectEnding(Call("robustness out"), 2, {"--rules"});
  ExpectEnding(Call("robustness out --rules map.json --format png"), 2, {"png"});
  ExpectEnding(Call("robustness --help"), 0,
               {"required", "inaccurate", "\"relative_to\": \"rtol\""});
}

}  // namespace cli_map_test
}  // namespace loopbench::harness
