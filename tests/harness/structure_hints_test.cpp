// Idle freedoms, hints, and the degrees of freedom that a file expects.
#include "harness/judge/analysis.h"
#include "tests/harness/cli_fixture.h"

namespace loopbench::harness::structure_hints_test {

const std::vector<std::string> kNone;

std::vector<std::string> Idle(const MechanismDescription& description) {
  return NamesOf(description, FindIdleFreedoms(description, AnalyseStructure(description)));
}

/// RSSR: crank on O, coupler between two balls A and B, rocker on Q. `b` is the type of B.
std::string Rssr(const std::string& b) {
  return fmt::format(R"({{"name": "rssr", "space": "spatial", "gravity": [0, 0, -9.81],
    "bodies": [{{"name": "crank", "mass": 1, "inertia": 0.01, "com": [0.1, 0, 0]}},
               {{"name": "coupler", "mass": 1, "inertia": 0.05, "com": [0.4, 0.02, 0]}},
               {{"name": "rocker", "mass": 1, "inertia": 0.05, "com": [0.3, 0, 0]}}],
    "joints": [
      {{"name": "O", "type": "revolute", "from": {{"body": "ground"}}, "to": {{"body": "crank"}}}},
      {{"name": "Q", "type": "revolute", "from": {{"body": "ground", "at": [0.9, 0.3, -0.1]}},
        "to": {{"body": "rocker"}}, "axis": [0.2, 1, 0.3]}},
      {{"name": "A", "type": "spherical", "from": {{"body": "crank", "at": [0.2, 0, 0]}},
        "to": {{"body": "coupler"}}}},
      {{"name": "B", "type": "{}", "from": {{"body": "rocker", "at": [0.6, 0, 0]}},
        "to": {{"body": "coupler", "at": [0.9, 0, 0]}}}}],
    "initial": {{"coordinates": {{"O": 0.5, "Q": -1.4}}, "fixed": ["O"]}}}})",
                     b);
}

MechanismDescription Parsed(const std::string& text) {
  return ParseMechanism(text, "m.json").description;
}

TEST(IdleFreedomTest, ACouplerBetweenBallsSpins) {
  const MechanismDescription balls = Parsed(Rssr("spherical")), fork = Parsed(Rssr("universal"));
  EXPECT_EQ(Idle(balls),
            std::vector<std::string>{"spin of coupler about the line of its joints A and B"});
  EXPECT_EQ(Idle(fork), kNone);
  // a fork takes the spin and nothing else
  EXPECT_EQ(AnalyseStructure(balls).freedom(), 2);
  EXPECT_EQ(AnalyseStructure(fork).freedom(), 1);
}

/// Each leg of two bodies between two balls spins as a whole; with a cylindrical joint inside, both
/// bodies do, each on its own.
TEST(IdleFreedomTest, LegsBetweenBallsSpin) {
  MechanismDescription platform = Shipped("stewart-platform").description;
  const int freedom = AnalyseStructure(platform).freedom();
  EXPECT_EQ(Idle(platform), kNone);
  for (std::size_t j = 0; j < platform.joints.size(); ++j) {
    JointDescription& joint = platform.joints[j];
    if (joint.type != JointType::kUniversal) continue;
    joint.type = JointType::kSpherical;
    for (JointValues& values : platform.initial.coordinates) {
      // guesses are zero angles: the unit quaternion
      if (values.joint == static_cast<int>(j)) values.values = {1, 0, 0, 0};
    }
  }
  EXPECT_EQ(Idle(platform).size(), 6u);
  EXPECT_EQ(Idle(platform).front(),
            "spin of lower1 and upper1 about the line of its joints U1 and P1");
  EXPECT_EQ(AnalyseStructure(platform).freedom(), freedom + 6);
  MechanismDescription loose = platform;
  loose.forces.clear();
  for (JointDescription& joint : loose.joints) {
    if (joint.name != "L3") continue;
    joint.type = JointType::kCylindrical;
    for (JointValues& values : loose.initial.coordinates) {
      if (loose.joints[static_cast<std::size_t>(values.joint)].name == "L3") {
        values.values = {0, values.values[0]};
      }
    }
  }
  EXPECT_EQ(Idle(loose).size(), 7u);
  EXPECT_EQ(AnalyseStructure(loose).freedom(), freedom + 7);
}

TEST(IdleFreedomTest, MotionsWithAPurposeAreNotIdle) {
  for (const char* name : {"four-bar", "four-bar-in-space", "bennett", "spatial-four-bar", "sarrus",
                           "screw-jack", "double-wishbone", "flyball-governor"}) {
    EXPECT_EQ(Idle(Shipped(name).description), kNone) << name;
  }
  // a door on two balls moves nothing else, but it is all that moves
  const MechanismDescription door =
      Parsed(R"({"name": "door", "space": "spatial", "gravity": [0, 0, -9.81],
    "bodies": [{"name": "door", "mass": 20, "inertia": 3, "com": [0.5, 0, 1]}],
    "joints": [{"name": "A", "type": "spherical", "from": {"body": "ground"}, "to": {"body": "door"}},
               {"name": "B", "type": "spherical", "from": {"body": "ground", "at": [0, 0, 2]},
                "to": {"body": "door", "at": [0, 0, 2]}}]})");
  EXPECT_EQ(Idle(door), kNone);
  EXPECT_EQ(AnalyseStructure(door).freedom(), 1);
}

std::vector<std::string> Hints(const MechanismDescription& description) {
  return FindHints(description, AnalyseStructure(description));
}

TEST(HintsTest, UsualMechanismsHaveNone) {
  for (const char* name :
       {"four-bar", "seven-bar", "andrews-squeezer", "stewart-platform", "slider-crank",
        "locomotive", "simple-pendulum", "rod-pendulum", "double-wishbone", "bennett"}) {
    EXPECT_EQ(Hints(Shipped(name).description), kNone) << name;
  }
}

TEST(HintsTest, BodiesThatHangAreNamed) {
  MechanismDescription description = Shipped("four-bar").description;
  BodyDescription arm = description.bodies[1];
  arm.name = "arm";
  JointDescription hinge = description.joints[0];
  hinge.name = "H";
  hinge.from = hinge.to;
  hinge.from.body = 2;
  hinge.to.body = static_cast<int>(description.bodies.size());
  description.bodies.push_back(arm);
  description.joints.push_back(hinge);
  EXPECT_EQ(Hints(description),
            std::vector<std::string>{"arm hangs by one joint and closes no loop, though other "
                                     "bodies do: is a joint missing?"});
  // a balanced rotor does so on purpose
  description.bodies.back().com = hinge.to.position;
  EXPECT_EQ(Hints(description), kNone);
  // without loops, chains end with a body
  EXPECT_EQ(Hints(Shipped("pendulum").description), kNone);
}

TEST(HintsTest, UnitsThatDoNotFitAreNamed) {
  MechanismDescription grams = Shipped("four-bar").description, millimetres = grams;
  grams.bodies[2].mass = 1e3;  // of a slender bar of 1 kg and 1 m, with its inertia in kg m^2
  grams.bodies[2].inertia *= 1.0 / 12.0;
  millimetres.bodies[3].inertia *= 1e6;
  ASSERT_EQ(Hints(millimetres).size(), 1u);
  ExpectWords(Hints(millimetres)[0],
              {"the radius of gyration of " + grams.bodies[3].name, "lengths in mm?"});
  ASSERT_EQ(Hints(grams).size(), 1u);
  ExpectWords(Hints(grams)[0], {"mass in g"});
}

/// A planar four-bar in space: 1 degree of freedom, 3 redundant constraints.
TEST(ExpectedFreedomTest, AMismatchNamesWhatWasFound) {
  MechanismFile file = ReadMechanism(kConfigs / "mechanisms/four-bar-in-space.json");
  const Structure structure = AnalyseStructure(file.description);
  EXPECT_EQ(FreedomFault(file.description, file.observe, structure), "");
  file.observe.expected = {1, "m.json:7: /expect/degrees_of_freedom"};
  EXPECT_EQ(FreedomFault(file.description, file.observe, structure), "");
  file.observe.expected->degrees_of_freedom = 3;
  const std::string fault = FreedomFault(file.description, file.observe, structure);
  EXPECT_TRUE(
      fault.starts_with("m.json:7: /expect/degrees_of_freedom: found 1, expected 3; "
                        "redundant constraints (3): "))
      << fault;
  MechanismFile balls = ParseMechanism(Rssr("spherical"), "m.json");
  balls.observe.expected = {1, "m.json:7: /expect/degrees_of_freedom"};
  EXPECT_EQ(FreedomFault(balls.description, balls.observe, AnalyseStructure(balls.description)),
            "m.json:7: /expect/degrees_of_freedom: found 2, expected 1; idle (1): spin of coupler "
            "about the line of its joints A and B");
}

std::string WithExpect(const std::string& expect) {
  return R"({"name": "p", "gravity": [0, -9.81],
"bodies": [{"name": "b", "mass": 1, "inertia": 1}],
"joints": [{"name": "J", "type": "revolute", "from": {"body": "ground"},
  "to": {"body": "b", "at": [1, 0]}}],
"expect": )" +
         expect + "}";
}

TEST(ExpectedFreedomTest, IsReadAndWritten) {
  const MechanismFile file = ParseMechanism(WithExpect("{\"degrees_of_freedom\": 1}"), "p.json");
  ASSERT_TRUE(file.observe.expected);
  EXPECT_EQ(file.observe.expected->degrees_of_freedom, 1);
  EXPECT_EQ(file.observe.expected->place, "p.json:5: /expect/degrees_of_freedom");
  const std::string text = MechanismText(file.description, file.observe);
  EXPECT_EQ(ParseMechanism(text, "q.json").observe.expected->degrees_of_freedom, 1) << text;
}

TEST(ExpectedFreedomTest, WrongValuesAreRefused) {
  for (const auto& [value, message] : std::vector<std::pair<std::string, std::string>>{
           {"{\"degrees_of_freedom\": -1}", "/degrees_of_freedom: found -1, expected an integer"},
           {"{\"degrees_of_freedom\": 1.5}", "/degrees_of_freedom: found 1.5, expected an integer"},
           {"{\"degrees_of_freedom\": \"3\"}", "/degrees_of_freedom: found \"3\", expected"},
           {"{\"degrees_of_freedom\": null}", "/degrees_of_freedom: found null, expected"},
           {"{\"degrees_of_freedom\": 1e30}", "/degrees_of_freedom: found 1e+30, expected"},
           {"{\"freedom\": 1}", "/freedom: found"},
           {"{}", "expected an integer from 0"},
           {"3", ": found 3, expected an object"},
           {"null", ": found null, expected an object"}}) {
    const std::string error =
        MessageOf<std::runtime_error>([&] { ParseMechanism(WithExpect(value), "p.json"); });
    EXPECT_TRUE(error.starts_with("p.json:5: /expect")) << value << ": " << error;
    ExpectWords(error, {message});
  }
}

}  // namespace loopbench::harness::structure_hints_test
