// What closes loops in MJCF, and tendons.
#include "tests/harness/import_texts.h"

namespace loopbench::harness::import_mjcf_loops_test {

using namespace import_mjcf_texts;

TEST(ImportMjcf, EqualitiesCloseLoopsWhereTheFileDrawsThem) {
  const Imported connect =
      Two("<equality><connect name='c' body1='a' body2='b' anchor='1 1 1'/></equality>");
  const JointDescription& ball = connect.description.joints.back();
  EXPECT_EQ(ball.type, JointType::kSpherical);
  EXPECT_TRUE(ball.cut);
  // (2, 1, 1) in ground axes; b stands at (0, 2, 0) and is turned by a quarter
  ExpectNear(ball.to.position, {-1, -2, 1}, 10 * kEps);
  ExpectNote(connect, "<connect name='c'>", "imposed exactly");

  const Imported weld = Two("<equality><weld body1='a' body2='b'/></equality>");
  const JointDescription& fixed = weld.description.joints.back();
  EXPECT_EQ(fixed.type, JointType::kWeld);
  ExpectNear(fixed.from.position, {-1, 2, 0}, 10 * kEps);
  EXPECT_NEAR(fixed.from.rotation.z(), kPi / 2, kEps);
  const Imported posed = Two("<equality><weld body1='a' relpose='1 2 3 1 0 0 0'/></equality>");
  EXPECT_EQ(posed.description.joints.back().from.position, Eigen::Vector3d(1, 2, 3));

  const Imported held =
      Two("<equality><joint name='e' joint1='j' polycoef='0.5 0 0 0 0'/></equality>");
  ExpectNote(held, "<joint name='e'>", "imposed exactly");
  EXPECT_EQ(std::get<Polynomial>(held.description.joints[0].motions[0].value).coefficients[0], 0.5);
  const Imported off = Two("<equality><weld body1='a' active='false'/></equality>");
  ExpectNote(off, "<weld>", "not active");
  EXPECT_EQ(off.description.joints.size(), 2u);
}

TEST(ImportMjcf, WeldsCloseAtAnchorAndRelpose) {
  const auto last = [](const std::string& attributes) {
    return Two("<equality><weld body1='a' body2='b' " + attributes + "/></equality>")
        .description.joints.back();
  };
  // x1 + R1 relpose = x2 + R2 anchor
  const JointDescription posed = last("anchor='-0.5 0 0' relpose='0.25 0 1 1 0 0 1'");
  EXPECT_EQ(posed.type, JointType::kWeld);
  EXPECT_EQ(posed.from.position, Eigen::Vector3d(0.25, 0, 1));
  EXPECT_NEAR(posed.from.rotation.z(), kPi / 2, kEps);
  EXPECT_EQ(posed.to.position, Eigen::Vector3d(-0.5, 0, 0));
  EXPECT_TRUE(posed.to.rotation.isZero(0.0));
  // b is drawn at (-1, 2, 0) in a, turned by a quarter: its x is the y of a
  const Eigen::Vector3d drawn(-1, 1.5, 0);
  EXPECT_LE((last("anchor='-0.5 0 0'").from.position - drawn).norm(), 10 * kEps);
  // without torque, only the points coincide
  const JointDescription ball = last("anchor='-0.5 0 0' torquescale='0'");
  EXPECT_EQ(ball.type, JointType::kSpherical);
  EXPECT_LE((ball.from.position - drawn).norm(), 10 * kEps);
  EXPECT_EQ(ball.to.position, Eigen::Vector3d(-0.5, 0, 0));
  EXPECT_TRUE(ball.from.rotation.isZero(0.0));
  EXPECT_EQ(last("torquescale='0.5'").type, JointType::kWeld);
}

TEST(ImportMjcf, WeldsOfSitesMakeTheirFramesCoincide) {
  const auto model = [](const std::string& equality) {
    return "<mujoco><worldbody><site name='s0' pos='0 0 3'/><body name='a' pos='1 0 0'><joint/>" +
           std::string(kInertial) +
           "<frame pos='0 1 0' euler='0 0 90'><site name='s1' pos='1 0 0'/></frame></body><body "
           "name='b'><joint/>" +
           kInertial + "<site name='s2' euler='90 0 0'/></body></worldbody><equality>\n" +
           equality + "</equality></mujoco>";
  };
  const Imported weld = ImportOf(model("<weld name='w' site1='s1' site2='s2'/>"));
  const JointDescription& joint = weld.description.joints.back();
  EXPECT_EQ(joint.type, JointType::kWeld);
  EXPECT_TRUE(joint.cut);
  EXPECT_EQ(joint.name, "w");
  EXPECT_EQ(joint.from.body, 1);
  EXPECT_EQ(joint.to.body, 2);
  ExpectNear(joint.from.position, {0, 2, 0}, kEps);
  ExpectNear(joint.from.rotation, {0, 0, kPi / 2}, kEps);
  EXPECT_TRUE(joint.to.position.isZero(0.0));
  ExpectNear(joint.to.rotation, {kPi / 2, 0, 0}, kEps);
  ExpectNote(weld, "<weld name='w'>", "imposed exactly");
  // a connect holds the points alone
  const Imported connect = ImportOf(model("<connect site1='s1' site2='s2'/>"));
  EXPECT_TRUE(connect.description.joints.back().to.rotation.isZero(0.0));
}

TEST(ImportMjcf, TendonsBetweenTwoSitesAreSpringsOrRods) {
  const std::string sites = "<site site='s1'/><site site='s2'/>";
  const Imported spring =
      Two("<tendon><spatial name='t' stiffness='3' damping='2' springlength='0.5'>" + sites +
          "</spatial></tendon>");
  const auto springs = ForcesOf<SpringDamper>(spring);
  ASSERT_EQ(springs.size(), 1u);
  EXPECT_EQ(springs[0].stiffness, 3.0);
  EXPECT_EQ(springs[0].damping, 2.0);
  EXPECT_EQ(springs[0].length, 0.5);
  // s1 at (1, 0, 1), s2 at (0, 3, 0): free as the file draws it
  const Imported drawn = Two("<tendon><spatial stiffness='3'>" + sites + "</spatial></tendon>");
  EXPECT_NEAR(ForcesOf<SpringDamper>(drawn)[0].length, std::sqrt(11.0), 10 * kEps);
  const Imported rod = Two("<equality><tendon tendon1='t'/></equality><tendon><spatial name='t'>" +
                           sites + "</spatial></tendon>");
  EXPECT_EQ(rod.description.joints.back().type, JointType::kRod);
  EXPECT_NEAR(rod.description.joints.back().parameter, std::sqrt(11.0), 10 * kEps);
  // classes call both kinds of tendon so
  const Imported of_class = Two("<default><tendon damping='4'/></default><tendon><spatial>" +
                                sites + "</spatial></tendon>");
  EXPECT_EQ(ForcesOf<SpringDamper>(of_class)[0].damping, 4.0);
  const Imported wrapped = Two("<tendon><spatial name='t' stiffness='3'>" + sites +
                               "<site site='s0'/></spatial></tendon>");
  ExpectNote(wrapped, "<spatial name='t'>", "only spatial tendons straight");
}

TEST(ImportMjcf, FixedTendonsOfConstantLengthAreCouplings) {
  const std::string model =
      R"(<mujoco><worldbody><body><joint name="j"/><inertial pos="0 0 0" mass="1"
      diaginertia="1 1 1"/></body><body><joint name="k"/><inertial pos="0 0 0" mass="1"
      diaginertia="1 1 1"/></body><body><joint name="l"/><inertial pos="0 0 0" mass="1"
      diaginertia="1 1 1"/></body></worldbody><tendon><fixed name="t"><joint joint="j" coef="1"/>
      <joint joint="k" coef="2"/><joint joint="l" coef="-3"/></fixed></tendon>)";
  const Imported held =
      ImportOf(model + R"(<equality><tendon tendon1="t" polycoef="0.5"/></equality></mujoco>)");
  ExpectCoupling(held, "t", {{"j", 1.0}, {"k", 2.0}, {"l", -3.0}}, 0.5);
  // a fixed tendon alone has no effect without a force
  const Imported alone = ImportOf(model + "</mujoco>");
  EXPECT_TRUE(alone.description.couplings.empty());
  EXPECT_TRUE(alone.notes.empty());
  const Imported stiff = ImportOf("<mujoco><default><tendon stiffness='1'/></default>" +
                                  model.substr(8) + "</mujoco>");
  ExpectNote(stiff, "<fixed name='t'> stiffness", "only spatial tendons straight");
}

TEST(ImportMjcf, TwoFixedTendonsAreOneCoupling) {
  const auto model = [](const std::string& attributes) {
    return "<mujoco>" + std::string(kTwoBodies) +
           R"(<tendon><fixed name="t"><joint joint="j" coef="2"/></fixed><fixed name="u">
      <joint joint="k" coef="-1"/><joint joint="j" coef="0.5"/></fixed><spatial name="spring"
      stiffness="1"><site site="s1"/><site site="s2"/></spatial></tendon><equality>
      <tendon name="e" )" +
           attributes + "/></equality></mujoco>";
  };
  // 2 j = 0.1 + 3 (0.5 j - k)
  const Imported both = ImportOf(model("tendon1='t' tendon2='u' polycoef='0.1 3'"));
  ExpectCoupling(both, "t", {{"j", 0.5}, {"k", 3.0}}, 0.1);
  ExpectNote(both, "<tendon name='e'>", "imposed exactly");
  EXPECT_EQ(both.notes.size(), 1u);
  const auto drop = [&](const std::string& attributes, const std::string& element,
                        const std::string& reason) {
    const Imported dropped = ImportOf(model(attributes));
    EXPECT_TRUE(dropped.description.couplings.empty());
    ASSERT_EQ(dropped.notes.size(), 1u);
    ExpectNote(dropped, element, reason);
    EXPECT_TRUE(dropped.notes[0].changes_motion);
    EXPECT_EQ(ForcesOf<SpringDamper>(dropped).size(), 1u);
  };
  drop("tendon1='t' tendon2='u' polycoef='0 1 1'", "<tendon name='e'> polycoef", "linear");
  drop("tendon1='t' tendon2='spring'", "<tendon name='e'>", "a freedom more");
  drop("tendon1='spring' tendon2='spring'", "<tendon name='e'>", "a freedom more");
  const Imported same = ImportOf(model("tendon1='t' tendon2='t'"));
  EXPECT_TRUE(same.description.couplings.empty());
  ExpectNote(same, "<tendon name='e'>", "all coefficients are 0");
  EXPECT_EQ(same.notes.size(), 1u);
}

TEST(ImportMjcf, RangesOfSpringsMatterWithAForceOnly) {
  const auto model = [](const std::string& before, const std::string& attributes,
                        const std::string& joint) {
    return "<mujoco>" + before + "<worldbody><site name='s0'/><body pos='1 0 0'>" + joint +
           kInertial + "<site name='s1'/><body><joint/>" + kInertial +
           "</body></body></worldbody><tendon><spatial springlength='0 0.5' " + attributes +
           "><site site='s0'/><site site='s1'/></spatial></tendon></mujoco>";
  };
  const std::string off = "<option><flag spring='disable'/></option>", stiff = "stiffness='1'";
  EXPECT_EQ(Refusal(model("", "damping='1'", "<joint/>")), "");
  EXPECT_EQ(Refusal(model(off, stiff, "<joint/>")), "");
  const Imported fixed = ImportOf(model("", stiff, ""));
  EXPECT_TRUE(fixed.description.forces.empty());
  ExpectNote(fixed, "<spatial>", "fixed together");
  EXPECT_FALSE(fixed.notes[0].changes_motion);
}

TEST(ImportMjcf, CoupledJointsAreLinear) {
  const auto model = [](const std::string& attributes) {
    return Two("<equality><joint joint1='j' joint2='k' " + attributes + "/></equality>");
  };
  const Imported given = model("name='e' polycoef='0.1 -2 0 0 0'");
  ExpectCoupling(given, "e", {{"j", 1.0}, {"k", 2.0}}, 0.1);
  ExpectNote(given, "<joint name='e'>", "imposed exactly");
  // the default of MuJoCo: both alike
  EXPECT_EQ(model("").description.couplings.at(0).parts[1].ratio, -1.0);
  EXPECT_EQ(model("polycoef='0.5'").description.couplings.at(0).parts[1].ratio, -1.0);
  const Imported constant = model("polycoef='0.5 0'");
  EXPECT_EQ(constant.description.couplings.size(), 0u);
  EXPECT_EQ(constant.description.joints[0].motions.size(), 1u);
  const Imported square = model("polycoef='0 1 0.1'");
  ExpectNote(square, "<joint> polycoef", "a freedom more");
  EXPECT_EQ(square.description.couplings.size(), 0u);
  EXPECT_FALSE(HasNote(square, "<joint>", "imposed exactly"));
}

TEST(ImportMjcf, EqualitiesThatAreSwitchedOffSaySo) {
  for (const char* flag : {"equality", "constraint"}) {
    const Imported off = Two("<option><flag " + std::string(flag) +
                             "='disable'/></option><equality><weld body1='a'/></equality>");
    EXPECT_EQ(off.description.joints.size(), 2u);
    ExpectNote(off, "<weld>", "not active");
  }
}

TEST(ImportMjcf, WhatTendonsSayAndNobodyReadsHasANote) {
  const auto tendon = [](const std::string& attributes, const std::string& of_class = "") {
    return Two("<default><tendon width='1' " + of_class +
               "/></default><tendon><spatial name='t' stiffness='3' rgba='1 1 1 1' " + attributes +
               "><site site='s1'/><site site='s2'/></spatial></tendon>");
  };
  ExpectNote(tendon("armature='0.5'"), "<spatial name='t'> armature", "no inertia");
  ExpectNote(tendon("", "armature='0.5'"), "<spatial name='t'> armature", "no inertia");
  ExpectNote(tendon("strange='1'"), "<spatial name='t'> strange", "not known");
  ExpectNote(tendon("range='0 1'"), "<spatial name='t'> range", "do not end");
  EXPECT_TRUE(tendon("armature='0'").notes.empty());
}

}  // namespace loopbench::harness::import_mjcf_loops_test
