// Bodies of MJCF: where they stand, their joints, masses and weights.
#include "tests/harness/import_texts.h"

namespace loopbench::harness::import_mjcf_bodies_test {

using namespace import_mjcf_texts;

TEST(ImportMjcf, AnglesAreDegreesUnlessTheCompilerSaysRadians) {
  for (const bool degrees : {true, false}) {
    const std::string compiler = degrees ? "" : "<compiler angle='radian'/>";
    const std::string quarter = degrees ? "90" : "1.5707963267948966";
    const Imported imported =
        Read("<joint ref='" + quarter + "' springref='" + quarter + "' stiffness='2'/>", compiler,
             "", "euler='0 0 " + quarter + "'");
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
  for (const char* form :
       {"quat='1 1 1 1'", "axisangle='1 1 1 120'", "xyaxes='0 1 0 0 0 1'", "euler='90 0 90'"}) {
    const Imported imported = Read("<joint/>", "<compiler eulerseq='XYZ'/>", "", form);
    const Frame F = PoseOf(imported.description.joints[0].from);
    Eigen::Matrix3d expected;
    expected << 0, 0, 1, 1, 0, 0, 0, 1, 0;
    EXPECT_LE((F.R - expected).norm(), 10 * kEps) << form;
  }
  const Imported z = Read("<joint/>", "", "", "zaxis='1 0 0'");
  ExpectNear(PoseOf(z.description.joints[0].from).R.col(2), Eigen::Vector3d::UnitX(), 10 * kEps);
}

/// The types that joints on one body become, from the outermost.
std::string TypeOfChain(const std::string& joints) {
  std::string types;
  for (const JointDescription& joint : Read(joints).description.joints) {
    types += (types.empty() ? "" : " ") + std::string(ToString(joint.type));
  }
  return types;
}

TEST(ImportMjcf, JointsOnOneBodyBecomeJointsOfMechanisms) {
  const std::string x = "<joint type='slide' axis='1 0 0'/>",
                    y = "<joint type='slide' axis='0 1 0'/>",
                    z = "<joint type='slide' axis='0 0 1'/>", a = "<joint axis='1 0 0'/>",
                    b = "<joint axis='0 1 0'/>", c = "<joint axis='0 0 1'/>",
                    ball = "<joint type='ball'/>", skew = "<joint axis='0 1 1'/>",
                    away = "<joint axis='0 1 0' pos='0 0 1'/>";
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
  EXPECT_EQ(TypeOfChain(x + y + z), "translation");
  EXPECT_EQ(TypeOfChain(x + c + y + z), "schoenflies");
  EXPECT_EQ(TypeOfChain(x + ball), "point-on-line");
  EXPECT_EQ(TypeOfChain(a + b + c + x), "point-on-line");
  EXPECT_EQ(TypeOfChain(x + y + ball), "point-in-plane");
  EXPECT_EQ(TypeOfChain(""), "weld");
  EXPECT_EQ(TypeOfChain(x + y), "planar");  // its angle is kept
  // axes that are not perpendicular or do not meet: two joints and a link
  EXPECT_EQ(TypeOfChain(b + skew), "revolute revolute");
  EXPECT_EQ(TypeOfChain(a + away), "revolute revolute");
  EXPECT_EQ(TypeOfChain(x + ball + y), "prismatic point-on-line");
  EXPECT_EQ(TypeOfChain(x + y + z + a + b), "translation universal");
  EXPECT_EQ(TypeOfChain(c + skew + away + a + b + c), "revolute revolute revolute spherical");
  EXPECT_EQ(Read(x + y + z + a + b).description.bodies[2].name, "b link");
}

TEST(ImportMjcf, ShapesHaveTheMassesOfSolids) {
  const auto body = [](const std::string& geom) {
    return ImportOf("<mujoco><worldbody><body><joint/>" + geom + "</body></worldbody></mujoco>")
        .description.bodies[1];
  };
  const BodyDescription sphere = body("<geom size='0.1'/>");
  EXPECT_NEAR(sphere.mass, 4.0 / 3.0 * kPi * 1e-3 * 1000, 1e-14);
  EXPECT_NEAR(sphere.inertia(0, 0), 0.4 * sphere.mass * 0.01, 1e-16);
  const BodyDescription box = body("<geom type='box' size='0.1 0.2 0.3' mass='3'/>");
  EXPECT_NEAR(box.inertia(0, 0), 3.0 / 3.0 * (0.04 + 0.09), 1e-15);
  const BodyDescription cylinder =
      body("<geom type='cylinder' size='0.1' fromto='0 0 0 1 0 0' density='500'/>");
  EXPECT_NEAR(cylinder.mass, 500 * kPi * 0.01, 1e-14);
  EXPECT_NEAR(cylinder.com.x(), 0.5, kEps);
  EXPECT_NEAR(cylinder.inertia(0, 0), cylinder.mass * 0.005, 1e-14);
  EXPECT_NEAR(cylinder.inertia(1, 1), cylinder.mass * (0.01 / 4 + 1.0 / 12), 1e-14);
  const BodyDescription ellipsoid = body("<geom type='ellipsoid' size='0.1 0.2 0.3' mass='5'/>");
  EXPECT_NEAR(ellipsoid.inertia(2, 2), 0.01 + 0.04, 1e-15);
  // two geoms: parallel axes
  const BodyDescription two =
      body("<geom size='0.1' mass='1' pos='1 0 0'/><geom size='0.1' mass='1' pos='-1 0 0'/>");
  EXPECT_EQ(two.mass, 2.0);
  EXPECT_NEAR(two.inertia(2, 2), 2 * (0.4 * 0.01 + 1.0), 1e-14);
}

TEST(ImportMjcf, CapsulesAreWhatSumsOfDiscsSay) {
  const BodyDescription capsule = ImportOf(
                                      "<mujoco><worldbody><body><joint/><geom type='capsule' "
                                      "size='0.2 0.5'/></body></worldbody></mujoco>")
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
  const Imported total = Read("<joint/>", "<compiler settotalmass='10'/>");
  EXPECT_EQ(total.description.bodies[1].mass, 10.0);
  EXPECT_EQ(total.description.bodies[1].inertia(0, 0), 10.0);
  const Imported bound = Read("<joint/>", "<compiler boundmass='3' boundinertia='2'/>");
  EXPECT_EQ(bound.description.bodies[1].mass, 3.0);
  EXPECT_NEAR(bound.description.bodies[1].inertia(1, 1), 2.0, kEps);
  const std::string flat =
      "<worldbody><body><joint/><inertial pos='0 0 0' mass='1' diaginertia='1 1 "
      "4'/></body></worldbody></mujoco>";
  const Imported balanced = ImportOf("<mujoco><compiler balanceinertia='true'/>" + flat);
  EXPECT_NEAR(balanced.description.bodies[1].inertia(2, 2), 2.0, kEps);
}

TEST(ImportMjcf, GravityIsThatOfTheOptionAndOfFlags) {
  EXPECT_EQ(Read("<joint/>").description.gravity.z(), -9.81);
  EXPECT_EQ(Read("<joint/>", "<option gravity='1 2 3'/>").description.gravity.y(), 2.0);
  EXPECT_TRUE(
      Read("<joint/>", "<option><flag gravity='disable'/></option>").description.gravity.isZero());
  // the last value of a flag counts, whatever gravity follows
  EXPECT_TRUE(
      Read("<joint/>", "<option><flag gravity='disable'/></option><option gravity='0 0 -3'/>")
          .description.gravity.isZero());
  const auto flags = [](const std::string& first, const std::string& second) {
    return Read("<joint name='j'/>",
                "<option><flag " + first + "/></option><option><flag " + second + "/></option>",
                "<equality><joint joint1='j'/></equality>")
        .description;
  };
  EXPECT_EQ(flags("gravity='disable'", "gravity='enable'").gravity.z(), -9.81);
  EXPECT_TRUE(flags("constraint='disable'", "equality='enable'").joints[0].motions.empty());
  EXPECT_EQ(flags("equality='disable'", "equality='enable'").joints[0].motions.size(), 1u);
  // a body without weight is pushed up by it
  const Imported light = Read("<joint/>", "", "", "gravcomp='0.5'");
  EXPECT_NEAR(ForcesOf<PointForce>(light)[0].force.z(), 0.5 * 9.81, 1e-15);
}

TEST(ImportMjcf, ShellsThatAreFixedAreAccepted) {
  const auto model = [](const std::string& joint) {
    return "<mujoco><worldbody><body>" + joint +
           "<geom size='0.1' shellinertia='true'/><body><joint/>" + std::string(kInertial) +
           "</body></body></worldbody></mujoco>";
  };
  EXPECT_EQ(Refusal(model("")), "");
}

/// Where a joint stands in the body that it moves, which the file draws at the origin, and its
/// axis.
void ExpectAt(const JointDescription& joint, const Eigen::Vector3d& place,
              const Eigen::Vector3d& axis) {
  EXPECT_LE((joint.to.position - place).norm(), 10 * kEps);
  const Eigen::Matrix3d R = PoseOf(joint.to).R * AxisAlignment(joint);
  EXPECT_LE((R * Eigen::Vector3d::UnitZ() - axis).norm(), 10 * kEps);
}

TEST(ImportMjcf, JointsWithinFramesStandAndTurnWithThem) {
  const std::string hinge = "<joint axis='1 0 0' pos='0 0 3'/>";
  const std::string turned = "<frame pos='1 2 0' euler='0 0 90'>";
  const auto joint = [](const std::string& inside) { return Read(inside).description.joints[0]; };
  ExpectAt(joint(turned + hinge + "</frame>"), {1, 2, 3}, Eigen::Vector3d::UnitY());
  // (1, 2, 3) of the inner frame, a quarter further: (1 - 2, 2 + 1, 3), and -x
  ExpectAt(joint(turned + turned + hinge + "</frame></frame>"), {-1, 3, 3},
           -Eigen::Vector3d::UnitX());
  EXPECT_EQ(joint(turned + "<joint type='ball' pos='0 0 3'/></frame>").to.position,
            Eigen::Vector3d(1, 2, 3));
  // and so does <inertial>
  const Imported heavy =
      ImportOf("<mujoco><worldbody><body><joint/>" + turned +
               R"(<inertial pos="0 1 0" mass="7" diaginertia="1 2 3"/></frame></body></worldbody>)"
               "</mujoco>");
  EXPECT_EQ(heavy.description.bodies[1].mass, 7.0);
  ExpectNear(heavy.description.bodies[1].com, {0, 2, 0}, kEps);
  EXPECT_NEAR(heavy.description.bodies[1].inertia(0, 0), 2.0, 10 * kEps);
  // a free joint is that of the body, wherever it stands in the file
  const Imported free = Read(turned + "<freejoint/></frame>", "", "", "pos='4 5 6'");
  EXPECT_EQ(free.description.joints[0].to.position, Eigen::Vector3d::Zero());
  EXPECT_EQ(free.description.initial.coordinates[0].values,
            (std::vector<double>{1, 0, 0, 0, 4, 5, 6}));
}

TEST(ImportMjcf, FramesLeaveBodiesAndJointsInTheOrderOfTheFile) {
  const auto body = [](const std::string& name) {
    return "<body name='" + name + "'>" + kInertial + "<joint name='" + name + "'/></body>";
  };
  const Imported bodies = ImportOf(
      "<mujoco><compiler angle='radian'/><worldbody><frame><frame>" + body("a") + "</frame>" +
      body("b") + "</frame>" + body("c") + "<frame>" + body("d") +
      "</frame></worldbody><keyframe><key qpos='1 2 3 4' qvel='5 6 7 8'/></keyframe></mujoco>");
  ASSERT_EQ(bodies.description.joints.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(bodies.description.joints[i].name, std::string(1, static_cast<char>('a' + i)));
    EXPECT_EQ(bodies.description.initial.coordinates[i].values[0], 1.0 + static_cast<double>(i));
    EXPECT_EQ(bodies.description.initial.speeds[i].values[0], 5.0 + static_cast<double>(i));
  }
  // the slide comes first, so that the slot is on the parent
  const Imported slot =
      Read("<frame><joint type='slide' axis='1 0 0'/></frame><joint axis='0 0 1'/><unknown/>",
           "<compiler angle='radian'/>", "<keyframe><key qpos='2 0.5'/></keyframe>");
  EXPECT_EQ(slot.description.joints[0].from.body, kGround);
  EXPECT_NEAR(slot.description.initial.coordinates[0].values[0], 0.5, kEps);
  EXPECT_NEAR(slot.description.initial.coordinates[0].values[1], 2.0, 10 * kEps);
  ExpectNote(slot, "<unknown>", "not known");
}

TEST(ImportMjcf, WeightIsCarriedWhilePassiveForcesAct) {
  const auto lifts = [](const std::string& flags) {
    const Imported imported =
        Read("<joint/>", "<option><flag " + flags + "/></option>", "", "gravcomp='1'");
    return ForcesOf<PointForce>(imported).size();
  };
  EXPECT_EQ(lifts("spring='disable'"), 1u);
  EXPECT_EQ(lifts("damper='disable'"), 1u);
  // MuJoCo's mj_passive returns before all passive forces, of which gravcomp is one
  EXPECT_EQ(lifts("passive='disable'"), 0u);
  EXPECT_EQ(lifts("spring='disable' damper='disable'"), 0u);
}

TEST(ImportMjcf, BodiesThatHaveOnlyABoundedMassHaveItAtTheirOwnPosition) {
  // body_ipos of MuJoCo 2.2.2 to 3.14: the position, without frames around the body
  const Imported imported = ImportOf(
      "<mujoco><compiler boundmass='0.2' boundinertia='0.01'/><worldbody><frame pos='1 1 1'><body "
      "name='b' pos='0.3 0.2 0.1'><joint/></body></frame></worldbody></mujoco>");
  EXPECT_EQ(imported.description.bodies[1].mass, 0.2);
  EXPECT_EQ(imported.description.bodies[1].com, Eigen::Vector3d(0.3, 0.2, 0.1));
}

TEST(ImportMjcf, QuaternionsDoNotReplaceOtherOrientationsOfAClass) {
  const auto com = [](const std::string& below, const std::string& own) {
    return ImportOf("<mujoco><default><site " + below +
                    "/></default><worldbody><body name='b'><joint/>" + kInertial +
                    "<site name='s' " + own +
                    "/></body></worldbody><equality><weld site1='s' "
                    "site2='w'/></equality><worldbody><site name='w' quat='1 0 0 "
                    "0'/></worldbody></mujoco>")
        .description.joints.back()
        .from.rotation;
  };
  const Eigen::Vector3d x = kPi / 2 * Eigen::Vector3d::UnitX(),
                        y = kPi / 2 * Eigen::Vector3d::UnitY();
  const std::string turn_x = "euler='90 0 0'", turn_y = "axisangle='0 1 0 90'",
                    quat_y = "quat='1 0 1 0'";
  EXPECT_LE((com(turn_x, quat_y) - x).norm(), 10 * kEps);
  EXPECT_LE((com(turn_x, turn_y) - y).norm(), 10 * kEps);
  EXPECT_LE((com("quat='1 1 0 0'", quat_y) - y).norm(), 10 * kEps);
  EXPECT_LE((com(quat_y, turn_x) - x).norm(), 10 * kEps);
}

TEST(ImportMjcf, SitesWithEndsAreBetweenThem) {
  const Imported imported = Read("<joint/><site name='s' fromto='0 0 0 0.4 0.2 0.6'/>");
  ExpectNear(imported.description.bodies[1].points.at("s"), {0.2, 0.1, 0.3}, kEps);
}

TEST(ImportMjcf, NegativeGravityCompensationNeedsAPositiveOne) {
  EXPECT_TRUE(ForcesOf<PointForce>(Read("<joint/>", "", "", "gravcomp='-0.5'")).empty());
  const Imported both =
      Read("<joint/><body gravcomp='0.5'><joint/>" + std::string(kInertial) + "</body>", "", "",
           "gravcomp='-0.5'");
  EXPECT_EQ(ForcesOf<PointForce>(both).size(), 2u);
}

TEST(ImportMjcf, MeshesAreExactIfTheCompilerSaysSo) {
  // two tetrahedra at one point: their pyramids from the centroid overlap
  const auto mass = [](const std::string& compiler) {
    return ImportOf("<mujoco>" + compiler +
                    "<asset><mesh name='m' vertex='0 0 0 1 0 0 0 1 0 0 0 1 9 0 0 10 0 0 9 1 "
                    "0 9 0 1' face='0 2 1 0 1 3 0 3 2 1 2 3 4 6 5 4 5 7 4 7 6 5 6 "
                    "7'/></asset><worldbody><body><joint/><geom type='mesh' mesh='m' "
                    "density='1'/></body></worldbody></mujoco>")
        .description.bodies[1]
        .mass;
  };
  EXPECT_NEAR(mass("<compiler exactmeshinertia='true'/>"), 1.0 / 3.0, kEps);
  EXPECT_GT(mass(""), 0.5);
}

}  // namespace loopbench::harness::import_mjcf_bodies_test
