// explain says all that decides a motion: parts, axes in their frames, forces, start, energy.
#include "harness/config/mechanism_reader.h"
#include "harness/judge/analysis.h"
#include "mechanism/model/kinematics.h"
#include "tests/harness/cli_fixture.h"

namespace loopbench::harness::explain_test {

using ExplainTest = CommandLineTest;

/// Columns may have any width.
void ExpectSqueezed(const Ending& ending, const std::vector<std::string>& words) {
  EXPECT_EQ(ending.code, 0) << ending.text;
  ExpectWords(std::regex_replace(ending.text, std::regex("[ \n]+"), " "), words);
}

struct AxisExample {
  std::string type;
  bool turned;            ///< F is turned by a right angle about z
  std::string more;       ///< further keys
  std::string from, to;   ///< what explain says of F and M
  Eigen::Vector3d first;  ///< in ground axes: along or about what the first coordinate moves
};

/// The rules for `axis` and `rotation` in docs/mechanism-files.md, by examples: texts of explain
/// and the motion itself.
TEST_F(ExplainTest, AxesAreSaidAndAreWhatJointsMoveAlongOrAbout) {
  const std::string x = "x = (1 0 0)", y = "y = (0 1 0)", z = "z = (0 0 1)";
  const std::string to_x = R"(, "axis": [1, 0, 0])", to_y = R"(, "axis": [0, 1, 0])",
                    to_z = R"(, "axis": [0, 0, 1])", pitch = R"(, "pitch": 0)";
  for (const AxisExample& example : std::vector<AxisExample>{
           {"revolute", false, "", z, z, {0, 0, 1}},
           {"revolute",
            false,
            R"(, "axis": [0, 2, 0])",
            "z = (0 1 0) -1.5708 0 0",
            "z = (0 1 0) -1.5708 0 0",
            {0, 1, 0}},
           // the axis is seen from the frame that the side's rotation has turned
           {"revolute", true, to_x, "z = (0 1 0)", "z = (1 0 0)", {0, 1, 0}},
           {"prismatic", true, "", "x = (0 1 0) 0 0 1.5708", x, {0, 1, 0}},
           {"prismatic", false, to_z, "x = (0 0 1)", "x = (0 0 1)", {0, 0, 1}},
           {"pin-in-slot", false, to_y, z + ", x = (0 1 0)", z, {0, 0, 1}},
           {"cylindrical", false, to_x, "z = (1 0 0)", "z = (1 0 0)", {1, 0, 0}},
           {"planar", false, to_x, "z = (1 0 0)", "z = (1 0 0)", {1, 0, 0}},
           {"helical", false, to_y + pitch, "z = (0 1 0)", "z = (0 1 0)", {0, 1, 0}},
           {"translation", false, "", x + ", " + y + ", " + z, x + ", " + y + ", " + z, {1, 0, 0}},
           {"schoenflies", false, to_x, "z = (1 0 0)", "z = (1 0 0)", {1, 0, 0}},
           // about x of F first, then about y of M
           {"universal", false, "", x, y, {1, 0, 0}},
           {"universal", true, "", "x = (0 1 0) 0 0 1.5708", y, {0, 1, 0}}}) {
    const auto& [type, turned, more, from, to, first] = example;
    SCOPED_TRACE(type + more);
    Write("m.json",
          fmt::format(R"({{"name": "m", "space": "spatial", "gravity": [0, 0, 0],
    "bodies": [{{"name": "b", "mass": 1, "inertia": 1}}],
    "joints": [{{"name": "J", "type": "{}", "from": {{"body": "ground"{}}},
                "to": {{"body": "b"}}{}}}]}})",
                      type, turned ? R"(, "rotation": [0, 0, 1.5707963267948966])" : "", more));
    ExpectSqueezed(Call("explain m.json"),
                   {"J F, from ground (0 0 0) " + from, "M, to b (0 0 0) " + to});
    const Mechanism<Spatial, double> mechanism(ReadMechanism(folder_ / "m.json").description,
                                               Coordinates::kJoint);
    Kinematics<Spatial, double> kinematics(mechanism);
    kinematics.UpdatePosition(VectorX<double>::Zero(mechanism.num_q()));
    const Direction<Spatial, double>& H = kinematics.joints()[0].H(0);
    const bool slides = type == "prismatic" || type == "translation";
    const Eigen::Vector3d direction = (slides ? H.linear : H.angular).eigen();
    EXPECT_LE((direction - first).norm(), 1e-15) << direction.transpose();
  }
}

TEST_F(ExplainTest, SaysAllThatTheFileSays) {
  const std::string shipped = "explain '" + (kConfigs / "mechanisms").string() + "/";
  ExpectSqueezed(
      Call(shipped + "double-wishbone.json'"),
      {"gravity (0 0 -9.81) m/s^2 in ground axes",
       "inertia is about com. Inertia is Ixx Iyy Izz, and Ixy Ixz Iyz",
       "chassis 1 300 20 20 20 0 0 0.5 LI (0 0.35 0.25)",
       "F, from chassis LI (0 0.35 0.25) z = (0.998752 0 0.0499376)",
       "F, from upright W (0 0 0) z = (0 1 0)",
       "spring_damper chassis at strut (0 0.45 0.75), lower at strut (0.014 0.259 -0.007)",
       "stiffness 60000 N/m, damping 3000 N s/m, length 0.582 m, preload 0 N", "angle 60 rad/s"});
  ExpectSqueezed(Call(shipped + "screw-jack.json'"),
                 {"pitch ", " m/rad",
                  "joint_torque joint bearing table of 3 points, t = 0 to 5 s, "
                  "straight lines [N m]"});
  ExpectSqueezed(Call(shipped + "rod-pendulum.json'"), {"rod", "length ", "given"});
  ExpectSqueezed(Call(shipped + "driven-four-bar.json'"), {"angle = ", "[rad]", "prescribed"});
  ExpectSqueezed(Call(shipped + "elastic-crank.json'"),
                 {"joint_spring joint hub stiffness 1e+08 N m/rad, rest 0 rad, preload 0 N m",
                  "joint_damper joint hub damping 20000 N m s/rad"});
}

TEST_F(ExplainTest, SaysTheAssembledStartAndItsEnergy) {
  // a bar of 1 m and 2 kg at 0 rad that turns at 3 rad/s; its com is at (0.5, 0)
  Write("bar.json", R"({"name": "bar", "gravity": [0, -10],
    "bodies": [{"name": "b", "mass": 2, "inertia": [1, 1, 0.5], "com": [0.5, 0]}],
    "joints": [{"name": "O", "type": "revolute", "from": {"body": "ground", "at": [0, 0.25]}, "to": {"body": "b"}}],
    "initial": {"coordinates": {"O": 0}, "speeds": {"O": 3}, "fixed": ["O"]}})");
  // 0.5 (0.5 + 2 0.25) 9 and 2 10 0.25
  ExpectSqueezed(Call("explain bar.json"), {"O angle 0 rad angle 3 rad/s fixed, speed",
                                            "Energy: kinetic 4.5 J + potential 5 J = 9.5 J"});
}

TEST_F(ExplainTest, FitsTheTerminalAndShortensLongMechanisms) {
  std::string bodies, joints;
  for (int i = 1; i <= 60; ++i) {
    const std::string comma = i < 60 ? "," : "",
                      on = i > 1 ? "b" + std::to_string(i - 1) : "ground";
    bodies += fmt::format(
        R"({{"name": "b{}", "mass": 1, "inertia": 1, "points": {{"first": [0.1, 0.2], "second": [0.3, 0.4], "third": [0.123456, 0.654321], "fourth": [1, 1]}}}}{})",
        i, comma);
    joints += fmt::format(
        R"({{"name": "j{}", "type": "revolute", "from": {{"body": "{}", "at": [1, 0]}}, "to": {{"body": "b{}"}}}}{})",
        i, on, i, comma);
  }
  Write("long.json", R"({"name": "long", "gravity": [0, 0], "bodies": [)" + bodies +
                         R"(], "joints": [)" + joints + "]}");
  const Ending brief = Call("explain long.json"), whole = Call("explain long.json --all");
  ExpectEnding(brief, 0, {"... and 31 more rows (--all shows them)"});  // 60 bodies and ground
  ExpectNone(brief.text, {"b60"});
  ExpectEnding(whole, 0, {"b60", "j60"});
  ExpectNone(whole.text, {"more rows"});
  std::istringstream lines(brief.text);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100u) << line;
}

TEST_F(ExplainTest, AnglesOfMoreThanATurnAreQuestionedAndNotRefused) {
  EditMechanism("\"OA\": -1.0", "\"OA\": 11.566370614359172");  // two turns on: it closes
  const std::string words =
      "more than a turn: OA = 11.5664 rad; angles are in rad, and 11.5664 degrees would be "
      "0.201871 "
      "rad";
  Expect("check four-bar.json", 0, {"warning: four-bar.json: four-bar: " + words});
  Expect("check tiny.json", 0, {"warning: tiny.json: four-bar: " + words});
  Expect("explain four-bar.json", 0, {words});
  for (const auto& entry : fs::directory_iterator(kConfigs / "mechanisms")) {
    EXPECT_TRUE(FindUnitWarnings(ReadMechanism(entry.path()).description).empty()) << entry.path();
  }
}

std::string LeverFile(const std::string& more) {
  return R"({"name": "lever", "gravity": [0, -10],
    "bodies": [{"name": "b", "mass": 2, "inertia": 1, "com": [0.5, 0]}],
    "joints": [{"name": "J:1", "type": "revolute", "from": {"body": "ground"},
                "to": {"body": "b"}}])" +
         more + "}";
}

TEST_F(ExplainTest, StaticsAndRangeAreAskedFor) {
  Write("lever.json", LeverFile(""));
  ExpectSqueezed(Call("explain lever.json --statics --range J:1"),
                 {"J:1 angle 10 N m --statics", "J:1 b 0 20 0", "Range of J:1 from 0 rad",
                  "low -6.28319 none within a turn", "high 6.28319 none within a turn"});
  ExpectNone(Call("explain lever.json").text, {"Reactions at rest"});
  Expect("explain lever.json --range J1", 2,
         {"found \"J1\", expected a joint (did you mean \"J:1\"?)"});
}

TEST_F(ExplainTest, UnexpectedFreedomEndsWithTwo) {
  Write("right.json", LeverFile(R"(, "expect": {"degrees_of_freedom": 1})"));
  Write("wrong.json", LeverFile(R"(, "expect": {"degrees_of_freedom": 0})"));
  for (const std::string command : {"explain", "explain --json", "check"}) {
    Expect(command + " right.json", 0);
    Expect(command + " wrong.json", 2,
           {"wrong.json:4: /expect/degrees_of_freedom: found 1, expected 0"});
  }
}

}  // namespace loopbench::harness::explain_test
