// The standard figures of a store: each that can be drawn, of the run that is trusted most.
#include "tests/harness/cli_fixture.h"

namespace loopbench::harness {
namespace cli_figures_test {

class FiguresOfAStore : public CommandLineTest {};

TEST_F(FiguresOfAStore, OneThatCannotBeDrawnDoesNotStopTheOthers) {
  // the drift of a pendulum, which has no loops, is zero: nothing for a logarithmic axis
  Write("pendulum.json", ReadFile(kConfigs / "mechanisms/pendulum.json"));
  Write("tiny.json", std::string(kTinyExperiment)
                         .replace(std::string(kTinyExperiment).find("{\"mechanism\": \"four"), 0,
                                  R"({"mechanism": "pendulum.json", "horizon": 0.5}, )"));
  ExpectEnding(Call("run tiny.json --out out"), 0, {});
  ExpectEnding(Call("plot out --out figures"), 2,
               {"drift-pendulum-0.5s-rtol-1e-06.svg: no curve has a point to draw",
                "wrote 3 of 4 figures to figures"});
  for (const char* name :
       {"motion-four-bar-0.5s", "motion-pendulum-0.5s", "drift-four-bar-0.5s-rtol-1e-06"}) {
    EXPECT_TRUE(fs::exists(folder_ / "figures" / (std::string(name) + ".svg"))) << name;
  }
}

TEST_F(FiguresOfAStore, MotionIsThatOfLevelPositionWhereItIsStored) {
  const std::string levels = R"("enforcement": ["acceleration", "projection"])";
  std::string text = kTinyExperiment;
  const std::string one = R"("enforcement": "acceleration")";
  Write("tiny.json", text.replace(text.find(one), one.size(), levels));
  ExpectEnding(Call("run tiny.json --out out"), 0, {});
  ExpectEnding(Call("plot out --out figures"), 0, {"wrote 2 figures"});
  ExpectEnding(Call("plot out --out a.pdf"), 2, {"found the ending \".pdf\"", "a file needs --x"});
  ExpectEnding(Call("plot out --out a.png --x rtol --y steps"), 2,
               {"found the ending \".png\"", "expected \".svg\", \".pdf\" or a folder"});
  const std::string svg = ReadFile(folder_ / "figures/motion-four-bar-0.5s.svg");
  EXPECT_NE(svg.find(", projection, joint, rank-revealing, rtol 10⁻⁶"), std::string::npos);
}

}  // namespace cli_figures_test
}  // namespace loopbench::harness
