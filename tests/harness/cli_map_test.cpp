// `loopbench map` as users call it.
#include "tests/harness/cli_fixture.h"

namespace loopbench::harness {
namespace cli_map_test {

constexpr const char* kMap = R"({
  "title": "Tiny map",
  "columns": [{"label": "O-DCA", "select": {"formulation": "odca"}},
              {"label": "reduction", "select": {"formulation": "reduction"}}],
  "groups": [{"label": "regular", "rows": [
    {"label": "four-bar", "select": {"mechanism": "four-bar"}, "must_hold": ["O-DCA"],
     "decides": [{"measure": "drift_position_max", "limit": 1e-3, "unit": "m"}]}]}]
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
  ExpectEnding(Call("map out --rules map.json"), 0,
               {"ok ", "?", "2 cells", "command: loopbench map"});
  EXPECT_FALSE(fs::exists(folder_ / "out/failure-map.csv"));
  ExpectEnding(Call("map out --rules map.json --out report"), 0, {"wrote report/failure-map.csv"});
  const std::string csv = ReadFile(folder_ / "report/failure-map.csv");
  EXPECT_NE(csv.find("regular,four-bar,O-DCA,holds,holds,finished,drift_position_max,"),
            std::string::npos);
  EXPECT_NE(csv.find("# command: "), std::string::npos);
  EXPECT_EQ(csv.find("# date: "), std::string::npos);
  EXPECT_NE(ReadFile(folder_ / "report/failure-map.md").find("# Tiny map"), std::string::npos);
  EXPECT_NE(ReadFile(folder_ / "report/failure-map.svg").find("</svg>"), std::string::npos);
  ExpectEnding(Call("map out --rules map.json --out report --format pdf"), 0, {"failure-map.pdf"});
  EXPECT_EQ(ReadFile(folder_ / "report/failure-map.pdf").substr(0, 5), "%PDF-");
}

TEST_F(MapCommandTest, GateFailsOnWhatMustHoldAndDoesNot) {
  ExpectEnding(Call("map out --rules map.json --gate"), 0, {"ok "});
  std::string map = kMap;
  Write("all.json", map.replace(map.find("[\"O-DCA\"]"), 9, "\"all\""));
  ExpectEnding(Call("map out --rules all.json"), 0, {});
  ExpectEnding(Call("map out --rules all.json --gate"), 1,
               {"must hold: reduction / four-bar: not measured (no record matches)"});
  map = kMap;
  Write("none.json", map.replace(map.find("\"must_hold\": [\"O-DCA\"],"), 23, ""));
  ExpectEnding(Call("map out --rules none.json --gate"), 2, {"--gate: no cell of none.json"});
}

TEST_F(MapCommandTest, RefusesBadInput) {
  ExpectEnding(Call("check map.json"), 0, {"failure map of 1 rows and 2 columns"});
  ExpectEnding(Call("map nowhere --rules map.json"), 2, {"nowhere"});
  ExpectEnding(Call("map out --rules nowhere.json"), 2, {"nowhere.json"});
  ExpectEnding(
      Call("map out --rules claims.json"), 2,
      {"claims.json:1: (top level): found claims (it has \"claims\"), expected a failure map"});
  ExpectEnding(Call("map out"), 2, {"--rules"});
  ExpectEnding(Call("map out --rules map.json --format png"), 2, {"png"});
  ExpectEnding(Call("map --help"), 0, {"must_hold", "inaccurate", "\"of\": \"rtol\""});
}

}  // namespace cli_map_test
}  // namespace loopbench::harness
