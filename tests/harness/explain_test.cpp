// explain says all that decides a motion: parts, axes in their frames, forces, start, energy.
#include <fmt/format.h>
#include <unistd.h>

#include "harness/config/mechanism_reader.h"
#include "harness/judge/analysis.h"
#include "mechanism/model/kinematics.h"
#include "tests/harness/cli_fixture.h"

namespace loopbench::harness {
namespace explain_test {

using ExplainTest = CommandLineTest;

/// The words with single spaces, as columns may have any width.
std::string Squeezed(const std::string& text) {
  std::string squeezed;
  for (const char c : text) {
    const char plain = c == '\n' ? ' ' : c;
    if (plain != ' ' || squeezed.empty() || squeezed.back() != ' ') squeezed += plain;
  }
  return squeezed;
}

void ExpectSqueezed(const Ending& ending, const std::vector<std::string>& words) {
  const std::string text = Squeezed(ending.text);
  EXPECT_EQ(ending.code, 0) << ending.text;
  for (const std::string& word : words) {
    EXPECT_NE(text.find(word), std::string::npos) << "no <" << word << "> in\n" << ending.text;
  }
}

struct AxisExample {
  std::string type, placed;  ///< keys beside the type
  std::string from, to;      ///< what explain says of F and M
  Eigen::Vector3d first;     ///< in ground axes: along or about what the first coordinate moves
  bool turns = true;

  friend std::ostream& operator<<(std::ostream& out, const AxisExample& one) {
    return out << one.type << one.placed;
  }
};

class AxisOf : public CommandLineTest, public testing::WithParamInterface<AxisExample> {
 protected:
  // gtest's names have slashes, which no folder may; examples run side by side
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / fmt::format("loopbench-axis-example-{}", ::getpid());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
};

/// What docs/mechanism-files.md says of `axis` and `rotation`, by example: explain's words and the
/// motion itself.
TEST_P(AxisOf, IsSaidAndIsWhatTheJointMovesAlongOrAbout) {
  const AxisExample& example = GetParam();
  Write("m.json", fmt::format(R"({{"name": "m", "space": "spatial", "gravity": [0, 0, 0],
    "bodies": [{{"name": "b", "mass": 1, "inertia": 1}}],
    "joints": [{{"name": "J", "type": "{}", "from": {{"body": "ground"{}}}]}})",
                              example.type, example.placed));
  ExpectSqueezed(Call("explain m.json"),
                 {"J F, from ground (0 0 0) " + example.from, "M, to b (0 0 0) " + example.to});
  const Mechanism<Spatial, double> mechanism(ReadMechanism(folder_ / "m.json").description,
                                             Coordinates::kJoint);
  Kinematics<Spatial, double> kinematics(mechanism);
  VectorX<double> q = VectorX<double>::Zero(mechanism.num_q());
  kinematics.UpdatePosition(q);
  const Direction<Spatial, double>& H = kinematics.joints()[0].H(0);
  const Eigen::Vector3d direction = (example.turns ? H.angular : H.linear).eigen();
  EXPECT_LE((direction - example.first).norm(), 1e-15) << direction.transpose();
}

// half a right angle and a right angle about z, in ground's axes
constexpr const char* kTurned = R"(, "rotation": [0, 0, 1.5707963267948966]}, "to": {"body": "b"})";

INSTANTIATE_TEST_SUITE_P(
    Kinds, AxisOf,
    testing::Values(
        AxisExample{
            "revolute", R"(}, "to": {"body": "b"})", "z = (0 0 1)", "z = (0 0 1)", {0, 0, 1}},
        AxisExample{"revolute",
                    R"(}, "to": {"body": "b"}, "axis": [0, 2, 0])",
                    "z = (0 1 0) -1.5708 0 0",
                    "z = (0 1 0) -1.5708 0 0",
                    {0, 1, 0}},
        // the axis is seen from the frame that the side's rotation has turned
        AxisExample{"revolute",
                    std::string(kTurned) + R"(, "axis": [1, 0, 0])",
                    "z = (0 1 0)",
                    "z = (1 0 0)",
                    {0, 1, 0}},
        AxisExample{"prismatic",
                    std::string(kTurned),
                    "x = (0 1 0) 0 0 1.5708",
                    "x = (1 0 0)",
                    {0, 1, 0},
                    false},
        AxisExample{"prismatic",
                    R"(}, "to": {"body": "b"}, "axis": [0, 0, 1])",
                    "x = (0 0 1)",
                    "x = (0 0 1)",
                    {0, 0, 1},
                    false},
        AxisExample{"pin-in-slot",
                    R"(}, "to": {"body": "b"}, "axis": [0, 1, 0])",
                    "z = (0 0 1), x = (0 1 0)",
                    "z = (0 0 1)",
                    {0, 0, 1}},
        AxisExample{"cylindrical",
                    R"(}, "to": {"body": "b"}, "axis": [1, 0, 0])",
                    "z = (1 0 0)",
                    "z = (1 0 0)",
                    {1, 0, 0}},
        AxisExample{"planar",
                    R"(}, "to": {"body": "b"}, "axis": [1, 0, 0])",
                    "z = (1 0 0)",
                    "z = (1 0 0)",
                    {1, 0, 0}},
        AxisExample{"helical",
                    R"(}, "to": {"body": "b"}, "axis": [0, 1, 0], "pitch": 0)",
                    "z = (0 1 0)",
                    "z = (0 1 0)",
                    {0, 1, 0}},
        AxisExample{"translation",
                    R"(}, "to": {"body": "b"})",
                    "x = (1 0 0), y = (0 1 0), z = (0 0 1)",
                    "x = (1 0 0), y = (0 1 0), z = (0 0 1)",
                    {1, 0, 0},
                    false},
        AxisExample{"schoenflies",
                    R"(}, "to": {"body": "b"}, "axis": [1, 0, 0])",
                    "z = (1 0 0)",
                    "z = (1 0 0)",
                    {1, 0, 0}},
        // about x of F first, then about y of M
        AxisExample{
            "universal", R"(}, "to": {"body": "b"})", "x = (1 0 0)", "y = (0 1 0)", {1, 0, 0}},
        AxisExample{"universal",
                    std::string(kTurned),
                    "x = (0 1 0) 0 0 1.5708",
                    "y = (0 1 0)",
                    {0, 1, 0}}));

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
  EXPECT_EQ(brief.text.find("b60"), std::string::npos);
  ExpectEnding(whole, 0, {"b60", "j60"});
  EXPECT_EQ(whole.text.find("more rows"), std::string::npos);
  for (std::size_t at = 0; at < brief.text.size();) {
    const std::size_t end = std::min(brief.text.find('\n', at), brief.text.size());
    EXPECT_LE(end - at, 100u) << brief.text.substr(at, end - at);
    at = end + 1;
  }
}

TEST_F(ExplainTest, AnglesOfMoreThanATurnAreQuestionedAndNotRefused) {
  EditMechanism("\"OA\": -1.0", "\"OA\": 11.566370614359172");  // two turns on: it closes
  const std::string words =
      "more than a turn: OA = 11.5664 rad; angles are in rad, and 11.5664 degrees would be "
      "0.201871 "
      "rad";
  ExpectEnding(Call("check four-bar.json"), 0, {"warning: four-bar.json: four-bar: " + words});
  ExpectEnding(Call("check tiny.json"), 0, {"warning: tiny.json: four-bar: " + words});
  ExpectEnding(Call("explain four-bar.json"), 0, {words});
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
  EXPECT_EQ(Call("explain lever.json").text.find("Reactions at rest"), std::string::npos);
  const Ending wrong = Call("explain lever.json --range J1");
  EXPECT_EQ(wrong.code, 2);
  EXPECT_NE(wrong.text.find("found \"J1\", expected a joint (did you mean \"J:1\"?)"),
            std::string::npos)
      << wrong.text;
}

TEST_F(ExplainTest, UnexpectedFreedomEndsWithTwo) {
  Write("right.json", LeverFile(R"(, "expect": {"degrees_of_freedom": 1})"));
  Write("wrong.json", LeverFile(R"(, "expect": {"degrees_of_freedom": 0})"));
  for (const char* command : {"explain", "explain --json", "check"}) {
    EXPECT_EQ(Call(std::string(command) + " right.json").code, 0) << command;
    const Ending ending = Call(std::string(command) + " wrong.json");
    EXPECT_EQ(ending.code, 2) << command;
    EXPECT_NE(ending.text.find("wrong.json:4: /expect/degrees_of_freedom: found 1, expected 0"),
              std::string::npos)
        << ending.text;
  }
}

}  // namespace explain_test
}  // namespace loopbench::harness
