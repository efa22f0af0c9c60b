// Ranges of driven coordinates against closed forms of triangles.
#include "harness/config/mechanism_reader.h"
#include "harness/judge/analysis.h"
#include "tests/harness/places.h"

namespace loopbench::harness::coordinate_range_test {

/// Accepted gaps are 1e-11 of the size; at a limit the gap grows with the way beyond it, divided by
/// the sine of an angle of the triangle.
constexpr double kSlack = 1e-9;

MechanismDescription FourBar(double ground, double a, double b, double c, double angle,
                             double folded, const std::string& more = "") {
  return ParseMechanism(fmt::format(R"({{"name": "four-bar", "gravity": [0, -9.81],
    "bodies": [{{"name": "crank", "mass": 1, "inertia": 0.1, "com": [0.5, 0]}},
               {{"name": "coupler", "mass": 1, "inertia": 0.1, "com": [0.5, 0]}},
               {{"name": "rocker", "mass": 1, "inertia": 0.1, "com": [0.5, 0]}}],
    "joints": [{{"name": "O", "type": "revolute", "from": {{"body": "ground"}},
                 "to": {{"body": "crank"}}{}}},
               {{"name": "Q", "type": "revolute", "from": {{"body": "ground", "at": [{}, 0]}},
                 "to": {{"body": "rocker"}}}},
               {{"name": "A", "type": "revolute", "from": {{"body": "crank", "at": [{}, 0]}},
                 "to": {{"body": "coupler"}}}},
               {{"name": "B", "type": "revolute", "from": {{"body": "coupler", "at": [{}, 0]}},
                 "to": {{"body": "rocker", "at": [{}, 0]}}, "cut": true}}],
    "initial": {{"coordinates": {{{}"Q": {}}}{}}}}})",
                                    more, ground, a, b, c,
                                    more.empty() ? fmt::format("\"O\": {}, ", angle) : "", folded,
                                    more.empty() ? R"(, "fixed": ["O"])" : ""),
                        "four-bar.json")
      .description;
}

/// The angle between sides x and y of a triangle whose third side is z.
double Angle(double x, double y, double z) {
  return std::acos((x * x + y * y - z * z) / (2 * x * y));
}

using Names = std::vector<std::string>;

TEST(CoordinateRangeTest, ANonGrashofCrankBindsWithCouplerAndRockerInLine) {
  const double g = 4.0, a = 3.0, b = 2.0, c = 2.5, limit = Angle(a, g, b + c);
  const CoordinateRange range = FindRange(FourBar(g, a, b, c, 0.4, 1.6), 0);
  ASSERT_EQ(range.why, "");
  EXPECT_DOUBLE_EQ(range.start, 0.4);
  EXPECT_TRUE(range.low.binds);
  EXPECT_TRUE(range.high.binds);
  EXPECT_NEAR(range.high.value, limit, kSlack);
  EXPECT_NEAR(range.low.value, -limit, kSlack);
  EXPECT_EQ(range.high.in_line, Names{"coupler and rocker at B"});
  EXPECT_EQ(range.low.in_line, Names{"coupler and rocker at B"});
}

TEST(CoordinateRangeTest, ACrankThatTurnsOverDoesNotBind) {
  const double g = 4.0, a = 1.0, b = 3.5, c = 3.0;
  MechanismDescription crank_rocker = FourBar(g, a, b, c, 0.4, 1.6);
  const CoordinateRange crank = FindRange(crank_rocker, 0);
  crank_rocker.initial.held.clear();
  const CoordinateRange rocker = FindRange(crank_rocker, 1);
  ASSERT_EQ(crank.why + rocker.why, "");
  EXPECT_FALSE(crank.low.binds);
  EXPECT_FALSE(crank.high.binds);
  EXPECT_DOUBLE_EQ(crank.high.value, 0.4 + 2 * std::numbers::pi);
  EXPECT_DOUBLE_EQ(crank.low.value, 0.4 - 2 * std::numbers::pi);
  // the rocker's limits have crank and coupler in line, folded and stretched
  EXPECT_NEAR(rocker.high.value, std::numbers::pi - Angle(g, c, b - a), kSlack);
  EXPECT_NEAR(rocker.low.value, std::numbers::pi - Angle(g, c, b + a), kSlack);
  EXPECT_EQ(rocker.low.in_line, Names{"crank and coupler at A"});
  EXPECT_EQ(rocker.high.in_line, Names{"crank and coupler at A"});
}

TEST(CoordinateRangeTest, SpaceHasTheSameLimits) {
  MechanismDescription description = FourBar(4, 3, 2, 2.5, 0.4, 1.6);
  description.space = SpaceKind::kSpatial;
  for (BodyDescription& body : description.bodies) body.inertia.setIdentity();
  const CoordinateRange range = FindRange(description, 0);
  ASSERT_EQ(range.why, "");
  EXPECT_NEAR(range.high.value, Angle(3, 4, 4.5), kSlack);
  EXPECT_EQ(range.low.in_line, Names{"coupler and rocker at B"});
}

TEST(CoordinateRangeTest, MotionsAndScaleDoNotMatter) {
  const double limit = Angle(3.0, 4.0, 4.5);
  for (const double scale : {1e-4, 1e4}) {
    const CoordinateRange range =
        FindRange(FourBar(4 * scale, 3 * scale, 2 * scale, 2.5 * scale, 0.4, 1.6,
                          R"(, "motion": {"type": "polynomial", "coefficients": [0.4, 2]})"),
                  0);
    ASSERT_EQ(range.why, "");
    // the assembly accepts gaps of some 1e-12 m, however small the mechanism is
    EXPECT_NEAR(range.high.value, limit, kSlack * std::max(1.0, 1e-2 / scale)) << scale;
  }
}

TEST(CoordinateRangeTest, AFixedJointThatHoldsAllIsFixedAtTheStartOnly) {
  MechanismDescription four_bar = FourBar(4, 3, 2, 2.5, 0.4, 1.6);
  four_bar.initial.held = {0};
  const CoordinateRange fixed = FindRange(four_bar, 1);
  four_bar.initial.held.clear();
  ASSERT_EQ(fixed.why, "");
  EXPECT_GT(fixed.high.value - fixed.low.value, 0.1);
  EXPECT_NEAR(fixed.high.value, FindRange(four_bar, 1).high.value, kSlack);
}

TEST(CoordinateRangeTest, WhatHasNoRangeIsNamed) {
  const MechanismDescription four_bar = FourBar(4, 3, 2, 2.5, 0.4, 1.6);
  ExpectWords(FindRange(four_bar, 3).why, {"closes a loop"});
  MechanismDescription seven_bar =
      ReadMechanism(kConfigs / "mechanisms/seven-bar.json").description;
  seven_bar.initial.held.clear();
  ExpectWords(FindRange(seven_bar, 0).why, {"other motion"});
  // a pose fixes the start, not the motion
  seven_bar.initial.poses = {{.body = 1, .rotation = Eigen::Vector3d::Zero(), .fixed = true},
                             {.body = 4, .rotation = Eigen::Vector3d::Zero(), .fixed = true}};
  ExpectWords(FindRange(seven_bar, 0).why, {"other motion"});
  const MechanismDescription platform =
      ReadMechanism(kConfigs / "mechanisms/stewart-platform.json").description;
  ExpectWords(FindRange(platform, 0).why, {"expected a joint with one coordinate"});
}

}  // namespace loopbench::harness::coordinate_range_test
