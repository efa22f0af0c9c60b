#include <gtest/gtest.h>

#include "harness/config/mechanism_reader.h"
#include "harness/judge/analysis.h"
#include "tests/harness/cli_fixture.h"
#include "tests/harness/records.h"

namespace loopbench::harness {
namespace model_warnings_test {

std::vector<std::string> WarningsOf(const MechanismDescription& description) {
  return FindWarnings(description, AnalyseStructure(description));
}

MechanismDescription Scene(const std::string& name) {
  return ReadMechanism(kConfigs / ("mechanisms/" + name + ".json")).description;
}

void ExpectWarning(const MechanismDescription& description, const std::string& part) {
  const std::vector<std::string> warnings = WarningsOf(description);
  ASSERT_EQ(warnings.size(), 1u) << testing::PrintToString(warnings);
  ExpectWords(warnings[0], {part});
}

TEST(ModelWarningsTest, SoundScenesHaveNone) {
  for (const char* name : {"four-bar", "seven-bar", "general-seven-bar", "pendulum",
                           "square-four-bar", "square-seven-bar", "parallelogram", "toggle"}) {
    EXPECT_EQ(WarningsOf(Scene(name)), std::vector<std::string>{}) << name;
  }
}

TEST(ModelWarningsTest, SingularStartsAreNamed) {
  for (const char* name : {"parallelogram-singular-start", "toggle-singular-start"}) {
    ExpectWarning(Scene(name), "the start is a singular configuration");
  }
}

TEST(ModelWarningsTest, MassesFarApartAreNamed) {
  MechanismDescription scene = Scene("four-bar");
  scene.bodies[2].mass = 0.99e8;
  EXPECT_EQ(WarningsOf(scene), std::vector<std::string>{});
  scene.bodies[2].mass = 1.01e8;
  ExpectWarning(scene, "times the mass of");
}

TEST(ModelWarningsTest, FloatingPartsAreNamed) {
  MechanismDescription scene = Scene("four-bar");
  scene.bodies.push_back(scene.bodies[1]);
  scene.bodies.back().name = "loose";
  ExpectWarning(scene, "no joint connects loose; it floats");
}

using ExplainMechanismTest = CommandLineTest;

TEST_F(ExplainMechanismTest, NamesLoopsAndEndsWell) {
  ExpectEnding(Call("explain four-bar.json"), 0,
               {"OC OA AB BC", "1 by counting", "1 by rank", "Redundant constraints: 0"});
}

TEST_F(ExplainMechanismTest, CouplingsThatFollowFromOthersAreCounted) {
  std::string text = ReadFile(kConfigs / "mechanisms/geared-five-bar.json");
  text.insert(text.find("    {\"name\": \"gears\""),
              R"({"name": "again", "coefficients": {"A": 2.0, "E": 1.0}}, )");
  Write("geared.json", text);
  ExpectEnding(Call("explain geared.json"), 0,
               {"1 by rank", "Redundant constraints: 1", "couplings: 1 of them"});
}

TEST_F(ExplainMechanismTest, StartThatDoesNotCloseIsSaidAfterAllElse) {
  EditMechanism("\"C\": [1.5, 0.0]", "\"C\": [5.0, 0.0]");
  ExpectEnding(Call("explain four-bar.json"), 2,
               {"OC OA AB BC", "Plan of O-DCA", "closed by joint \"OC\" does not close"});
}

TEST_F(ExplainMechanismTest, MissedGuessesAreNamed) {
  EditMechanism("\"AB\": 0.841188", "\"AB\": 0.2");
  const std::string missed =
      "the guess of joint \"AB\" is missed: its angle starts at 0.841188 rad, guessed 0.2 rad";
  const Ending explained = Call("explain four-bar.json"), checked = Call("check four-bar.json");
  ExpectEnding(explained, 0, {missed});
  ExpectEnding(checked, 0, {"warning: four-bar.json: four-bar: " + missed});
  EXPECT_EQ(explained.text.find("\"BC\" is missed"), std::string::npos);
  EditMechanism("\"AB\": 0.841188", "\"AB\": 0.4");  // 0.44 rad away
  EXPECT_EQ(Call("check four-bar.json").text.find("missed"), std::string::npos);
}

TEST_F(ExplainMechanismTest, ExperimentOptionsAreRefused) {
  ExpectEnding(Call("explain four-bar.json --filter mechanism=a"), 2, {"are for experiments"});
}

}  // namespace model_warnings_test
}  // namespace loopbench::harness
