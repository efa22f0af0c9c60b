
#include "harness/config/mechanism_reader.h"
#include "harness/judge/analysis.h"
#include "tests/harness/cli_fixture.h"
#include "tests/harness/records.h"

namespace loopbench::harness::model_warnings_test {

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

TEST(ModelWarningsTest, SpeedsOfNoBranchAreNamed) {
  // bar1 and bar3 of a flat rhombus turn alike, or bar2 and bar3 turn together about bar1's end
  struct Row {
    double bar1, bar3;
    std::size_t warnings;  ///< the start is singular: one at least
  };
  for (const Row& row : {Row{2, 2, 1}, Row{0, 2, 1}, Row{0, 0, 1}, Row{2, 1.2, 2}, Row{2, 0, 2}}) {
    MechanismDescription scene = Scene("parallelogram-singular-start");
    scene.initial.speeds = {{0, {row.bar1}}, {1, {row.bar3 - 2 * row.bar1}}, {2, {row.bar1}}};
    const std::vector<std::string> warnings = WarningsOf(scene);
    ASSERT_EQ(warnings.size(), row.warnings) << testing::PrintToString(warnings);
    ExpectWords(warnings[0], {"the start is a singular configuration"});
    if (row.warnings > 1) ExpectWords(warnings[1], {"belong to no motion"});
  }
}

// The speeds of a branch, at coordinates of six digits.
TEST(ModelWarningsTest, SpeedsOfABranchMayStartAtRoundedCoordinates) {
  MechanismDescription scene = Scene("parallelogram-singular-start");
  scene.initial.speeds = {{0, {2.0}}, {1, {-2.0}}, {2, {2.0}}};
  scene.initial.coordinates = {{0, {-1.570796}}, {1, {1e-6}}, {2, {3.141593}}};
  for (const std::string& warning : WarningsOf(scene)) {
    EXPECT_EQ(warning.find("belong to no motion"), std::string::npos) << warning;
  }
}

TEST(ModelWarningsTest, RedundantCouplingsAreNamed) {
  // Watt's sun and planet at both cranks of a parallelogram: the suns turn alike
  const auto planets = [](const std::string& couplings) {
    std::string text = TestData("planets.json");
    text.insert(text.find("],\n  \"initial\""), couplings);
    return ParseMechanism(text, "planets.json").description;
  };
  EXPECT_EQ(WarningsOf(planets("")), std::vector<std::string>{});
  ExpectWarning(planets(R"(, {"name": "suns", "coefficients": {"S": 1, "S2": -1}})"),
                "coupling \"suns\" follows from other constraints");
  ExpectWarning(planets(R"(, {"name": "again", "coefficients": {"S": 1, "O": -1, "B": 1}})"),
                "coupling \"again\" follows from other constraints");
  ExpectWarning(planets(R"(, {"name": "bars", "coefficients": {"O": 1, "C": -1}})"),
                "coupling \"bars\" follows from other constraints");
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

TEST(ModelWarningsTest, ForcesWithoutDirectionAreNamed) {
  // the end of the crank lies on the joint of the next bar
  struct Row {
    double stiffness, damping, length, preload;
    const char* part;  ///< "": no warning
  };
  for (const Row& row : {Row{1, 0, 0, 0, ""}, Row{2, 0, 1, 2, ""}, Row{0, 1, 0, 0, "its damping"},
                         Row{0, 0, 0, 5, "tension of 5 N"}, Row{3, 0, 2, 0, "tension of -6 N"}}) {
    MechanismDescription scene = Scene("four-bar");
    const JointDescription& joint = scene.joints[1];
    const BodyPoint from = {joint.from.body, joint.from.position},
                    to = {joint.to.body, joint.to.position};
    scene.forces.push_back(
        SpringDamper{from, to, row.stiffness, row.damping, row.length, row.preload});
    if (*row.part == '\0') {
      EXPECT_EQ(WarningsOf(scene), std::vector<std::string>{});
    } else {
      ExpectWarning(scene, "force 0 (spring_damper between ");
      ExpectWarning(scene, row.part);
    }
    std::get<SpringDamper>(scene.forces[0]).to.at.x() += 0.1;
    EXPECT_EQ(WarningsOf(scene), std::vector<std::string>{});
  }
}

using ExplainMechanismTest = CommandLineTest;

TEST_F(ExplainMechanismTest, NamesLoopsAndEndsWell) {
  Expect("explain four-bar.json", 0,
         {"OC OA AB BC", "1 by counting", "1 by rank", "Redundant constraints: 0"});
}

TEST_F(ExplainMechanismTest, CouplingsThatFollowFromOthersAreCounted) {
  std::string text = ReadFile(kConfigs / "mechanisms/geared-five-bar.json");
  text.insert(text.find("    {\"name\": \"gears\""),
              R"({"name": "again", "coefficients": {"A": 2.0, "E": 1.0}}, )");
  Write("geared.json", text);
  Expect("explain geared.json", 0,
         {"1 by rank", "Redundant constraints: 1", "coupling \"gears\" (at the start)",
          "coupling \"gears\" follows from other constraints"});
}

TEST_F(ExplainMechanismTest, StartThatDoesNotCloseIsSaidAfterAllElse) {
  EditMechanism("\"C\": [1.5, 0.0]", "\"C\": [5.0, 0.0]");
  Expect("explain four-bar.json", 2,
         {"OC OA AB BC", "Plan of O-DCA", "closed by joint \"OC\" does not close"});
}

TEST_F(ExplainMechanismTest, MissedGuessesAreNamed) {
  EditMechanism("\"AB\": 0.841188", "\"AB\": 0.2");
  const std::string missed =
      "the guess of joint \"AB\" is missed: its angle starts at 0.841188 rad, guessed 0.2 rad";
  const Ending explained = Call("explain four-bar.json"), checked = Call("check four-bar.json");
  ExpectEnding(explained, 0, {missed});
  ExpectEnding(checked, 0, {"warning: four-bar.json: four-bar: " + missed});
  ExpectNone(explained.text, {"\"BC\" is missed"});
  EditMechanism("\"AB\": 0.841188", "\"AB\": 0.4");  // 0.44 rad away
  ExpectNone(Call("check four-bar.json").text, {"missed"});
}

TEST_F(ExplainMechanismTest, ExperimentOptionsAreRefused) {
  Expect("explain four-bar.json --filter mechanism=a", 2, {"are for experiments"});
}

}  // namespace loopbench::harness::model_warnings_test
