// What becomes of each element of MJCF.
#include <gtest/gtest.h>

#include <numbers>

#include "tests/harness/import_texts.h"

namespace loopbench::harness {
namespace import_mjcf_test {

constexpr double kPi = std::numbers::pi;
constexpr double kEps = 1e-15;  // some units of rounding for lengths and angles of order one

const char* const kInertial = R"(<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>)";

/// A body with these joints, and what stands before and behind the world.
std::string Model(const std::string& joints, const std::string& before = "",
                  const std::string& after = "", const std::string& attributes = "") {
  return "<mujoco>" + before + "<worldbody><body name=\"b\" " + attributes + ">" + kInertial +
         joints + "</body></worldbody>" + after + "</mujoco>";
}

Imported Read(const std::string& joints, const std::string& before = "",
              const std::string& after = "", const std::string& attributes = "") {
  return ImportText(Model(joints, before, after, attributes), "file.xml");
}

TEST(ImportMjcf, AnglesAreDegreesUnlessTheCompilerSaysRadians) {
  for (const bool degrees : {true, false}) {
    const std::string compiler = degrees ? "" : "<compiler angle=\"radian\"/>";
    const std::string quarter = degrees ? "90" : "1.5707963267948966";
    const Imported imported =
        Read("<joint ref=\"" + quarter + "\" springref=\"" + quarter + "\" stiffness=\"2\"/>",
             compiler, "", "euler=\"0 0 " + quarter + "\"");
    const JointDescription& joint = imported.description.joints[0];
    EXPECT_NEAR(joint.from.rotation.z(), kPi / 2, kEps);
    EXPECT_EQ(joint.from.rotation.x(), 0.0);
    // where the file draws it, its coordinate is `ref` and ours 0
    EXPECT_NEAR(ForcesOf<JointSpring>(imported)[0].rest, 0.0, kEps);
    EXPECT_EQ(ForcesOf<JointSpring>(imported)[0].stiffness, 2.0);
  }
}

TEST(ImportMjcf, OrientationsAreTheSameInAllForms) {
  // a turn by 120 degrees about (1, 1, 1): x to y, y to z, z to x
  for (const char* form : {"quat=\"1 1 1 1\"", "axisangle=\"1 1 1 120\"", "xyaxes=\"0 1 0 0 0 1\"",
                           "euler=\"90 0 90\""}) {
    const Imported imported = Read("<joint/>", "<compiler eulerseq=\"XYZ\"/>", "", form);
    const Frame F = PoseOf(imported.description.joints[0].from);
    Eigen::Matrix3d expected;
    expected << 0, 0, 1, 1, 0, 0, 0, 1, 0;
    EXPECT_LE((F.R - expected).norm(), 10 * kEps) << form;
  }
  const Imported z = Read("<joint/>", "", "", "zaxis=\"1 0 0\"");
  EXPECT_LE((PoseOf(z.description.joints[0].from).R.col(2) - Eigen::Vector3d::UnitX()).norm(),
            10 * kEps);
  ExpectRefusal(Model("", "", "", "quat=\"1 0 0 0\" euler=\"0 0 0\""), {"one orientation"});
}

TEST(ImportMjcf, ClassesOfDefaultsAreNestedAndInherited) {
  const Imported imported = ImportText(R"(<mujoco>
    <default>
      <joint damping="1"/>
      <default class="stiff"><joint stiffness="5"/>
        <default class="stiffest"><joint damping="3"/></default>
      </default>
    </default>
    <worldbody>
      <body name="a"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><joint name="plain"/></body>
      <body name="b" childclass="stiff"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
        <joint name="child"/>
        <body name="c"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
          <joint name="own" class="stiffest" stiffness="7"/></body>
      </body>
    </worldbody></mujoco>)",
                                       "file.xml");
  const auto dampers = ForcesOf<JointDamper>(imported);
  const auto springs = ForcesOf<JointSpring>(imported);
  ASSERT_EQ(dampers.size(), 3u);
  EXPECT_EQ(dampers[0].damping, 1.0);
  EXPECT_EQ(dampers[1].damping, 1.0);
  EXPECT_EQ(dampers[2].damping, 3.0);
  ASSERT_EQ(springs.size(), 2u);
  EXPECT_EQ(springs[0].stiffness, 5.0);
  EXPECT_EQ(springs[1].stiffness, 7.0);
}

/// The type that joints on one body become; "" when they are refused.
std::string TypeOfChain(const std::string& joints) {
  try {
    return std::string(ToString(Read(joints).description.joints[0].type));
  } catch (const ConfigError&) {
    return "";
  }
}

TEST(ImportMjcf, JointsOnOneBodyAreOneOfOurs) {
  const std::string x = "<joint type=\"slide\" axis=\"1 0 0\"/>",
                    y = "<joint type=\"slide\" axis=\"0 1 0\"/>",
                    z = "<joint type=\"slide\" axis=\"0 0 1\"/>", a = "<joint axis=\"1 0 0\"/>",
                    b = "<joint axis=\"0 1 0\"/>", c = "<joint axis=\"0 0 1\"/>",
                    ball = "<joint type=\"ball\"/>", skew = "<joint axis=\"0 1 1\"/>",
                    away = "<joint axis=\"0 1 0\" pos=\"0 0 1\"/>";
  EXPECT_EQ(TypeOfChain(c), "revolute");
  EXPECT_EQ(TypeOfChain(x), "prismatic");
  EXPECT_EQ(TypeOfChain(ball), "spherical");
  EXPECT_EQ(TypeOfChain("<freejoint/>"), "free");
  EXPECT_EQ(TypeOfChain(c + z), "cylindrical");
  EXPECT_EQ(TypeOfChain(z + c), "cylindrical");
  EXPECT_EQ(TypeOfChain(x + c), "pin-in-slot");
  EXPECT_EQ(TypeOfChain(c + x), "pin-in-slot");
  EXPECT_EQ(TypeOfChain(a + b), "universal");
  EXPECT_EQ(TypeOfChain(x + y + c), "planar");
  EXPECT_EQ(TypeOfChain(c + y + x), "planar");
  EXPECT_EQ(TypeOfChain(a + b + c), "spherical");
  EXPECT_EQ(TypeOfChain(x + y + z + ball), "free");
  EXPECT_EQ(TypeOfChain(x + y + z + a + b + c), "free");
  EXPECT_EQ(TypeOfChain(""), "weld");
  // no kind of ours: axes that are not perpendicular or do not meet, two slides
  EXPECT_EQ(TypeOfChain(b + skew), "");
  EXPECT_EQ(TypeOfChain(a + away), "");
  EXPECT_EQ(TypeOfChain(x + y), "");
  EXPECT_EQ(TypeOfChain("<freejoint/>" + c), "");
  ExpectRefusal(Model(x + y), {"file.xml:1", "2 joints on one body", "slide, slide"});
}

TEST(ImportMjcf, ShapesHaveTheMassesOfSolids) {
  const auto body = [](const std::string& geom) {
    return ImportText("<mujoco><worldbody><body><joint/>" + geom + "</body></worldbody></mujoco>",
                      "file.xml")
        .description.bodies[1];
  };
  const BodyDescription sphere = body("<geom size=\"0.1\"/>");
  EXPECT_NEAR(sphere.mass, 4.0 / 3.0 * kPi * 1e-3 * 1000, 1e-14);
  EXPECT_NEAR(sphere.inertia(0, 0), 0.4 * sphere.mass * 0.01, 1e-16);
  const BodyDescription box = body("<geom type=\"box\" size=\"0.1 0.2 0.3\" mass=\"3\"/>");
  EXPECT_NEAR(box.inertia(0, 0), 3.0 / 3.0 * (0.04 + 0.09), 1e-15);
  const BodyDescription cylinder =
      body("<geom type=\"cylinder\" size=\"0.1\" fromto=\"0 0 0 1 0 0\" density=\"500\"/>");
  EXPECT_NEAR(cylinder.mass, 500 * kPi * 0.01, 1e-14);
  EXPECT_NEAR(cylinder.com.x(), 0.5, kEps);
  EXPECT_NEAR(cylinder.inertia(0, 0), cylinder.mass * 0.005, 1e-14);
  EXPECT_NEAR(cylinder.inertia(1, 1), cylinder.mass * (0.01 / 4 + 1.0 / 12), 1e-14);
  const BodyDescription ellipsoid =
      body("<geom type=\"ellipsoid\" size=\"0.1 0.2 0.3\" mass=\"5\"/>");
  EXPECT_NEAR(ellipsoid.inertia(2, 2), 0.01 + 0.04, 1e-15);
  // two geoms: parallel axes
  const BodyDescription two = body(
      "<geom size=\"0.1\" mass=\"1\" pos=\"1 0 0\"/><geom size=\"0.1\" mass=\"1\" pos=\"-1 0 "
      "0\"/>");
  EXPECT_EQ(two.mass, 2.0);
  EXPECT_NEAR(two.inertia(2, 2), 2 * (0.4 * 0.01 + 1.0), 1e-14);
}

TEST(ImportMjcf, CapsulesAreWhatSumsOfDiscsSay) {
  const BodyDescription capsule =
      ImportText(
          "<mujoco><worldbody><body><joint/><geom type=\"capsule\" size=\"0.2 0.5\"/>"
          "</body></worldbody></mujoco>",
          "file.xml")
          .description.bodies[1];
  // discs of thickness h: errors of the midpoint rule are of h^2 (h^1.5 at the round ends)
  constexpr int kDiscs = 400000;
  const double h = 1.4 / kDiscs;
  double mass = 0.0, along = 0.0, across = 0.0;
  for (int i = 0; i < kDiscs; ++i) {
    const double z = -0.7 + (i + 0.5) * h, beyond = std::max(0.0, std::abs(z) - 0.5);
    const double r2 = 0.04 - beyond * beyond, m = 1000 * kPi * r2 * h;
    mass += m;
    along += m * r2 / 2;
    across += m * (r2 / 4 + z * z);
  }
  EXPECT_NEAR(capsule.mass, mass, 1e-8 * mass);
  EXPECT_NEAR(capsule.inertia(2, 2), along, 1e-8 * along);
  EXPECT_NEAR(capsule.inertia(0, 0), across, 1e-8 * across);
}

TEST(ImportMjcf, TheCompilerChangesMasses) {
  const Imported total = Read("<joint/>", "<compiler settotalmass=\"10\"/>");
  EXPECT_EQ(total.description.bodies[1].mass, 10.0);
  EXPECT_EQ(total.description.bodies[1].inertia(0, 0), 10.0);
  const Imported bound = Read("<joint/>", "<compiler boundmass=\"3\" boundinertia=\"2\"/>");
  EXPECT_EQ(bound.description.bodies[1].mass, 3.0);
  EXPECT_NEAR(bound.description.bodies[1].inertia(1, 1), 2.0, kEps);
  const std::string flat =
      "<worldbody><body><joint/><inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"1 1 4\"/></body>"
      "</worldbody></mujoco>";
  ExpectRefusal("<mujoco>" + flat, {"principal moments 1, 1, 4", "sum of the other two"});
  const Imported balanced =
      ImportText("<mujoco><compiler balanceinertia=\"true\"/>" + flat, "file.xml");
  EXPECT_NEAR(balanced.description.bodies[1].inertia(2, 2), 2.0, kEps);
}

TEST(ImportMjcf, GravityIsThatOfTheOptionAndOfFlags) {
  EXPECT_EQ(Read("<joint/>").description.gravity.z(), -9.81);
  EXPECT_EQ(Read("<joint/>", "<option gravity=\"1 2 3\"/>").description.gravity.y(), 2.0);
  EXPECT_TRUE(Read("<joint/>", "<option><flag gravity=\"disable\"/></option>")
                  .description.gravity.isZero());
  // a body without weight is pushed up by it
  const Imported light = Read("<joint/>", "", "", "gravcomp=\"0.5\"");
  EXPECT_NEAR(ForcesOf<PointForce>(light)[0].force.z(), 0.5 * 9.81, 1e-15);
}

const char* const kTwoBodies = R"(<worldbody>
  <site name="s0" pos="0 0 3"/>
  <body name="a" pos="1 0 0"><joint name="j" axis="0 1 0"/>
    <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><site name="s1" pos="0 0 1"/></body>
  <body name="b" pos="0 2 0" euler="0 0 90"><joint name="k" axis="0 1 0"/>
    <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><site name="s2" pos="1 0 0"/></body>
</worldbody>)";

Imported Two(const std::string& rest) {
  return ImportText("<mujoco>" + std::string(kTwoBodies) + rest + "</mujoco>", "file.xml");
}

TEST(ImportMjcf, EqualitiesCloseLoopsWhereTheFileDrawsThem) {
  const Imported connect =
      Two("<equality><connect name=\"c\" body1=\"a\" body2=\"b\" anchor=\"1 1 1\"/></equality>");
  const JointDescription& ball = connect.description.joints.back();
  EXPECT_EQ(ball.type, JointType::kSpherical);
  EXPECT_TRUE(ball.cut);
  // (2, 1, 1) in ground axes; b stands at (0, 2, 0) and is turned by a quarter
  EXPECT_LE((ball.to.position - Eigen::Vector3d(-1, -2, 1)).norm(), 10 * kEps);
  ExpectNote(connect, "<connect name=\"c\">", "imposed exactly");

  const Imported weld = Two("<equality><weld body1=\"a\" body2=\"b\"/></equality>");
  const JointDescription& fixed = weld.description.joints.back();
  EXPECT_EQ(fixed.type, JointType::kWeld);
  EXPECT_LE((fixed.from.position - Eigen::Vector3d(-1, 2, 0)).norm(), 10 * kEps);
  EXPECT_NEAR(fixed.from.rotation.z(), kPi / 2, kEps);
  const Imported posed = Two("<equality><weld body1=\"a\" relpose=\"1 2 3 1 0 0 0\"/></equality>");
  EXPECT_EQ(posed.description.joints.back().from.position, Eigen::Vector3d(1, 2, 3));

  const Imported held = Two("<equality><joint joint1=\"j\" polycoef=\"0.5 0 0 0 0\"/></equality>");
  EXPECT_EQ(std::get<Polynomial>(held.description.joints[0].motions[0].value).coefficients[0], 0.5);
  const Imported coupled = Two("<equality><joint joint1=\"j\" joint2=\"k\"/></equality>");
  ExpectNote(coupled, "<joint>", "a freedom more");
  const Imported off = Two("<equality><weld body1=\"a\" active=\"false\"/></equality>");
  ExpectNote(off, "<weld>", "not active");
  EXPECT_EQ(off.description.joints.size(), 2u);
}

TEST(ImportMjcf, TendonsBetweenTwoSitesAreSpringsOrRods) {
  const std::string sites = "<site site=\"s1\"/><site site=\"s2\"/>";
  const Imported spring =
      Two("<tendon><spatial name=\"t\" stiffness=\"3\" damping=\"2\" springlength=\"0.5\">" +
          sites + "</spatial></tendon>");
  const auto springs = ForcesOf<SpringDamper>(spring);
  ASSERT_EQ(springs.size(), 1u);
  EXPECT_EQ(springs[0].stiffness, 3.0);
  EXPECT_EQ(springs[0].damping, 2.0);
  EXPECT_EQ(springs[0].length, 0.5);
  // s1 at (1, 0, 1), s2 at (0, 3, 0): free as the file draws it
  const Imported drawn = Two("<tendon><spatial stiffness=\"3\">" + sites + "</spatial></tendon>");
  EXPECT_NEAR(ForcesOf<SpringDamper>(drawn)[0].length, std::sqrt(11.0), 10 * kEps);
  const Imported rod =
      Two("<equality><tendon tendon1=\"t\"/></equality><tendon><spatial name=\"t\">" + sites +
          "</spatial></tendon>");
  EXPECT_EQ(rod.description.joints.back().type, JointType::kRod);
  EXPECT_NEAR(rod.description.joints.back().parameter, std::sqrt(11.0), 10 * kEps);
  // classes call both kinds of tendon so
  const Imported of_class = Two("<default><tendon damping=\"4\"/></default><tendon><spatial>" +
                                sites + "</spatial></tendon>");
  EXPECT_EQ(ForcesOf<SpringDamper>(of_class)[0].damping, 4.0);
  const Imported wrapped = Two("<tendon><spatial name=\"t\" stiffness=\"3\">" + sites +
                               "<site site=\"s0\"/></spatial></tendon>");
  ExpectNote(wrapped, "<spatial name=\"t\">", "only spatial tendons straight");
}

/// The start that a key gives to the joints of one body.
InitialDescription Start(const std::string& joints, const std::string& key) {
  return Read(joints, "<compiler angle=\"radian\"/>", "<keyframe><key " + key + "/></keyframe>")
      .description.initial;
}

TEST(ImportMjcf, KeysBecomeTheStartOfJointsOfOurs) {
  const auto hinge = Start("<joint ref=\"0.25\"/>", "qpos=\"1\" qvel=\"3\"");
  EXPECT_EQ(hinge.coordinates[0].values[0], 0.75);
  EXPECT_EQ(hinge.speeds[0].values[0], 3.0);
  const auto free = Start("<freejoint/>", "qpos=\"1 2 3 0 1 0 0\" qvel=\"4 5 6 0 7 0\"");
  EXPECT_EQ(free.coordinates[0].values, (std::vector<double>{0, 1, 0, 0, 1, 2, 3}));
  // half a turn about x: the body's y is the ground's -y
  EXPECT_EQ(free.speeds[0].values, (std::vector<double>{0, -7, 0, 4, 5, 6}));
  const auto planar = Start(
      "<joint axis=\"0 0 1\"/><joint type=\"slide\" axis=\"1 0 0\"/><joint type=\"slide\" axis=\"0 "
      "1 "
      "0\"/>",
      "qpos=\"1.5707963267948966 2 3\" qvel=\"1 0 0\"");
  // the slides turn with the hinge before them: x of the body is y of the ground
  const std::vector<double>& p = planar.coordinates[0].values;
  EXPECT_NEAR(p[0], kPi / 2, kEps);
  EXPECT_NEAR(p[1], -3.0, 10 * kEps);
  EXPECT_NEAR(p[2], 2.0, 10 * kEps);
  EXPECT_NEAR(planar.speeds[0].values[1], -2.0, 10 * kEps);
  EXPECT_NEAR(planar.speeds[0].values[2], -3.0, 10 * kEps);
  const auto slot = Start("<joint axis=\"0 0 1\"/><joint type=\"slide\" axis=\"1 0 0\"/>",
                          "qpos=\"0.5 2\" qvel=\"0.25 -1\"");
  // the slot is on the body: seen from there, the parent turns and slides the other way
  EXPECT_NEAR(slot.coordinates[0].values[0], -0.5, kEps);
  EXPECT_NEAR(slot.coordinates[0].values[1], -2.0, 10 * kEps);
  EXPECT_NEAR(slot.speeds[0].values[0], -0.25, kEps);
  EXPECT_NEAR(slot.speeds[0].values[1], 1.0, 10 * kEps);
  const auto universal =
      Start("<joint axis=\"1 0 0\"/><joint axis=\"0 1 0\"/>", "qpos=\"0.5 0.25\" qvel=\"2 3\"");
  EXPECT_NEAR(universal.coordinates[0].values[1], 0.25, kEps);
  EXPECT_NEAR(universal.speeds[0].values[0], 2.0, 10 * kEps);
  EXPECT_NEAR(universal.speeds[0].values[1], 3.0, 10 * kEps);
}

TEST(ImportMjcf, MotorsUnderAConstantControlAreTorques) {
  const std::string motor = "<actuator><motor joint=\"j\" gear=\"2\"/></actuator>";
  const Imported on = Two(motor + "<keyframe><key ctrl=\"3\"/></keyframe>");
  EXPECT_EQ(std::get<Polynomial>(ForcesOf<JointTorque>(on)[0].value).coefficients[0], 6.0);
  const std::string general =
      "<actuator><general joint=\"j\" gear=\"2\" gainprm=\"5\" biastype=\"affine\" biasprm=\"";
  const Imported biased = Two(general + "0.5 0 0\"/></actuator>");  // 2 (5 0 + 0.5)
  EXPECT_EQ(std::get<Polynomial>(ForcesOf<JointTorque>(biased)[0].value).coefficients[0], 1.0);
  ExpectNote(Two(general + "0.5 1 0\"/></actuator>"), "<general>", "no constant");
  const Imported off = Two(motor);
  EXPECT_TRUE(ForcesOf<JointTorque>(off).empty());
  ExpectNote(off, "<motor>", "control is 0");
  ExpectNote(Two("<actuator><position joint=\"j\"/></actuator>"), "<position>", "no actuators");
}

TEST(ImportMjcf, PlanarMechanismsHaveGravityAlongMinusY) {
  ImportOptions options;
  options.planar = true;
  const Imported imported = ImportText(R"(<mujoco><worldbody>
      <site name="w" pos="1 0 0.5"/>
      <body name="b" pos="0 0.25 0"><joint name="j" axis="0 1 0" stiffness="1" springref="30"/>
        <geom size="0.1" pos="0 0 1"/><site name="s" pos="0 -0.25 1"/></body>
      <body name="c" pos="2 0 0"><joint name="k" axis="0 -1 0"/><geom size="0.1" pos="0 0 1"/></body>
    </worldbody>
    <equality><connect body1="b" body2="c" anchor="0 0 1"/></equality>
    <tendon><spatial stiffness="2"><site site="w"/><site site="s"/></spatial></tendon>
    <keyframe><key qpos="0.5 -0.5"/></keyframe></mujoco>)",
                                       "file.xml", options);
  const MechanismDescription& planar = imported.description;
  EXPECT_EQ(planar.space, SpaceKind::kPlanar);
  EXPECT_LE((planar.gravity - Eigen::Vector3d(0, -9.81, 0)).norm(), 1e-14);
  // z is the ground's y, y its z, and so x its -x
  const Eigen::Vector3d& w = planar.bodies[kGround].points.at("w");
  EXPECT_LE((w - Eigen::Vector3d(-1, 0.5, 0)).norm(), 10 * kEps);
  EXPECT_LE((ForcesOf<SpringDamper>(imported)[0].from.at - w).norm(), 10 * kEps);
  EXPECT_EQ(planar.joints.back().type, JointType::kRevolute);
  EXPECT_TRUE(planar.joints.back().cut);
  EXPECT_EQ(planar.initial.coordinates[0].values[0], 0.5);
  // a joint about the other way turns as seen from the other body
  EXPECT_EQ(planar.initial.coordinates[1].values[0], -0.5);
  EXPECT_EQ(planar.joints[1].to.body, kGround);
}

TEST(ImportMjcf, EveryKindOfDroppedElementHasItsNote) {
  const Imported imported = ImportText(R"(<mujoco>
  <option timestep="0.1" density="1.2" integrator="RK4"/>
  <asset><mesh name="m" file="m.stl"/></asset>
  <default><joint frictionloss="0.2"/></default>
  <worldbody>
    <light pos="0 0 1"/>
    <geom name="floor" type="plane" size="1 1 1"/>
    <body name="b" mocap="true" strange="1">
      <joint name="j" armature="0.1" range="-1 1" springdamper="1 1"/>
      <geom name="g" size="0.1"/>
      <camera name="c"/>
      <unknown/>
    </body>
    <body name="w"><joint name="l" type="ball" damping="1" stiffness="1"/><geom size="0.1"/></body>
  </worldbody>
  <contact><exclude body1="b" body2="w"/></contact>
  <sensor><gyro site="s"/></sensor>
  <extension><plugin plugin="p"/></extension>
  <deformable/>
  <equality><flex flex="f"/></equality>
  <tendon><fixed name="f"><joint joint="l" coef="1"/></fixed></tendon>
  <actuator><general joint="j"/></actuator>
  <keyframe><key/><key name="later"/></keyframe>
  <surprise/>
</mujoco>)",
                                       "file.xml");
  ExpectNote(imported, "<option> timestep", "their own steps");
  ExpectNote(imported, "<option> density", "no medium");
  ExpectNote(imported, "<option> integrator", "their own integrator");
  ExpectNote(imported, "<asset>", "meshes");
  ExpectNote(imported, "<geom name=\"floor\">", "no contact");
  ExpectNote(imported, "<body name=\"b\"> mocap", "stays where");
  ExpectNote(imported, "<body name=\"b\"> strange", "not known");
  ExpectNote(imported, "<joint name=\"j\"> armature", "rotors");
  ExpectNote(imported, "<joint name=\"j\"> frictionloss", "dry friction");
  ExpectNote(imported, "<joint name=\"j\"> range", "without ends");
  ExpectNote(imported, "<joint name=\"j\"> springdamper", "by frequency");
  ExpectNote(imported, "<geom name=\"g\">", "only its mass");
  ExpectNote(imported, "<unknown>", "not known");
  ExpectNote(imported, "<joint name=\"l\"> damping", "one coordinate");
  ExpectNote(imported, "<joint name=\"l\"> stiffness", "one coordinate");
  ExpectNote(imported, "<contact>", "no contact");
  ExpectNote(imported, "<sensor>", "no sensors");
  ExpectNote(imported, "<extension>", "no plugins");
  ExpectNote(imported, "<deformable>", "rigid");
  ExpectNote(imported, "<flex>", "no constraint of this kind");
  ExpectNote(imported, "<fixed name=\"f\">", "straight between two sites");
  ExpectNote(imported, "<general>", "control is 0");
  ExpectNote(imported, "<key name=\"later\">", "first <key>");
  ExpectNote(imported, "<surprise>", "not known");
  // in the order of the file, each with its line
  EXPECT_TRUE(std::ranges::is_sorted(imported.notes, {}, &ImportNote::line));
  EXPECT_EQ(imported.notes.front().line, 2);
}

TEST(ImportMjcf, WhatCannotBeSaidIsRefusedWithItsLine) {
  ExpectRefusal("<mujoco>\n<include file=\"x.xml\"/>\n<worldbody/></mujoco>",
                {"file.xml:2: <include>", "the whole model in one file"});
  ExpectRefusal("<mujoco>\n<compiler coordinate=\"global\"/><worldbody/></mujoco>",
                {"file.xml:2: <compiler> coordinate: found \"global\"", "local"});
  ExpectRefusal("<mujoco/>", {"file.xml:1: <mujoco>: found no <worldbody>"});
  ExpectRefusal("<mujoco><worldbody/></mujoco>", {"found no body"});
  ExpectRefusal("<mujoco><worldbody><body name=\"b\"><joint/></body></worldbody></mujoco>",
                {"<body name=\"b\">: found a body without mass that moves"});
  ExpectRefusal(Model("<joint axis=\"0 0 0\"/>"), {"<joint> axis", "not zero"});
  ExpectRefusal(Model("<joint type=\"screw\"/>"), {"hinge, slide, ball, free"});
  ExpectRefusal(Model("<joint class=\"none\"/>"), {"\"none\"", "described in <default>"});
  ExpectRefusal(Model("<joint name=\"j\"/><joint name=\"j\" axis=\"1 0 0\"/>"), {"second joint"});
  ExpectRefusal(
      Model("<joint/>", "", "<equality><connect body1=\"x\" anchor=\"0 0 0\"/></equality>"),
      {"<connect> body1: found \"x\"", "name of a body"});
  ExpectRefusal(Model("<joint/>", "", "<keyframe><key qpos=\"1 2\"/></keyframe>"),
                {"<key> qpos", "1 number"});
  ExpectRefusal(
      "<mujoco><worldbody><body><joint/><geom type=\"mesh\" "
      "mesh=\"m\"/></body></worldbody></mujoco>",
      {"mass of a mesh"});
  for (const char* number : {"nan", "inf", "1e999", "1,0", "0x10", "1e", "", "1 2"}) {
    ExpectRefusal(Model("<joint damping=\"" + std::string(number) + "\"/>"), {"damping: found"});
  }
  ExpectRefusal(Model("<joint damping=\"-1\"/>"), {"a number >= 0"});
}

}  // namespace import_mjcf_test
}  // namespace loopbench::harness
