// What becomes of each element of URDF, and of a sidecar.
#include "tests/harness/import_texts.h"

namespace loopbench::harness::import_urdf_test {

const std::string kMass =
    "<inertial><mass value='2'/><inertia ixx='1' iyy='1' izz='1'/></inertial>";

std::string Link(const std::string& name, const std::string& inside = kMass) {
  return "<link name='" + name + "'>" + inside + "</link>";
}

std::string Joint(const std::string& name, const std::string& type, const std::string& parent,
                  const std::string& child, const std::string& inside = "") {
  return "<joint name='" + name + "' type='" + type + "'><parent link='" + parent +
         "'/><child link='" + child + "'/>" + inside + "</joint>";
}

std::string Robot(const std::string& inside) { return "<robot name='r'>\n" + inside + "</robot>"; }

TEST(ImportUrdf, JointsAreTheKindsOfOurs) {
  const std::vector<std::pair<std::string, std::string>> kinds = {
      {"revolute", "revolute"}, {"continuous", "revolute"}, {"prismatic", "prismatic"},
      {"fixed", "weld"},        {"floating", "free"},       {"planar", "planar"}};
  for (const auto& [theirs, ours] : kinds) {
    const Imported imported =
        ImportOf(Robot(Link("world", "") + Link("a") +
                       Joint("j", theirs, "world", "a",
                             "<origin xyz='1 2 3' rpy='0 0 0.5'/><axis xyz='0 0 2'/>")));
    const JointDescription& joint = JointNamed(imported, "j");
    EXPECT_EQ(ToString(joint.type), ours);
    EXPECT_EQ(joint.from.position, Eigen::Vector3d(1, 2, 3));
    EXPECT_NEAR(joint.from.rotation.z(), 0.5, 1e-15);
    EXPECT_EQ(joint.from.body, kGround);
    const bool has_axis = TraitsOf(joint.type).own_axis != '-';
    EXPECT_EQ(joint.axis, has_axis ? Eigen::Vector3d(0, 0, 2) : Eigen::Vector3d(0, 0, 0));
  }
  // the axis that URDF takes where none is said
  const Imported plain =
      ImportOf(Robot(Link("world", "") + Link("a") + Joint("j", "continuous", "world", "a")));
  EXPECT_EQ(JointNamed(plain, "j").axis, Eigen::Vector3d::UnitX());
}

TEST(ImportUrdf, RollPitchYawAreAboutFixedAxes) {
  const Imported imported =
      ImportOf(Robot(Link("world", "") + Link("a") +
                     Joint("j", "fixed", "world", "a", "<origin rpy='0.3 0.4 0.5'/>")));
  const Eigen::Matrix3d expected = (Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()) *
                                    Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()))
                                       .toRotationMatrix();
  EXPECT_LE((PoseOf(JointNamed(imported, "j").from).R - expected).norm(), 1e-15);
}

TEST(ImportUrdf, InertiaIsTurnedIntoTheAxesOfTheLink) {
  const Imported imported =
      ImportOf(Robot(Link("world", "") +
                     Link("a",
                          "<inertial><origin xyz='1 0 0' rpy='0 0 1.5707963267948966'/><mass "
                          "value='2'/><inertia ixx='1' ixy='0.1' ixz='0' iyy='2' iyz='0' "
                          "izz='2.5'/></inertial>") +
                     Joint("j", "continuous", "world", "a")));
  const BodyDescription& body = imported.description.bodies[1];
  EXPECT_EQ(body.com, Eigen::Vector3d::UnitX());
  EXPECT_NEAR(body.inertia(0, 0), 2.0, 1e-15);
  EXPECT_NEAR(body.inertia(1, 1), 1.0, 1e-15);
  EXPECT_NEAR(body.inertia(0, 1), -0.1, 1e-15);
}

TEST(ImportUrdf, LinksWithoutMassAreMerged) {
  // base - (fixed) - hub - (hinge) - arm - (fixed) - tool, and a sensor frame on a frame on it
  const std::string tree = Link("base", "") + Link("arm") + Link("tool", "") + Link("eye", "") +
                           Joint("shoulder", "continuous", "base", "arm", "<origin xyz='0 0 1'/>") +
                           Joint("wrist", "fixed", "arm", "tool", "<origin xyz='1 0 0'/>") +
                           Joint("mount", "fixed", "tool", "eye", "<origin xyz='0 1 0'/>");
  const Imported imported = ImportOf(Robot(tree));
  ASSERT_EQ(imported.description.bodies.size(), 2u);
  EXPECT_EQ(imported.description.bodies[1].name, "arm");
  EXPECT_EQ(imported.description.joints.size(), 1u);
  EXPECT_EQ(JointNamed(imported, "shoulder").from.body, kGround);
  EXPECT_EQ(JointNamed(imported, "shoulder").from.position, Eigen::Vector3d(0, 0, 1));
  ExpectNote(imported, "<link name='tool'>", "merged with 'arm'");
  ExpectNote(imported, "<link name='base'>", "merged with 'ground'");
  // a moving one that carries the mass behind a fixed joint is that mass
  const Imported carried =
      ImportOf(Robot(Link("world", "") + Link("hub", "") + Link("load") +
                     Joint("turn", "continuous", "world", "hub", "<axis xyz='0 0 1'/>") +
                     Joint("bolt", "fixed", "hub", "load", "<origin xyz='0 2 0'/>")));
  ASSERT_EQ(carried.description.bodies.size(), 2u);
  EXPECT_EQ(JointNamed(carried, "turn").to.position, Eigen::Vector3d(0, -2, 0));
}

TEST(ImportUrdf, TheRootIsFixedUnlessItFloats) {
  const std::string robot = Robot(Link("a") + Link("b") + Joint("j", "continuous", "a", "b"));
  const Imported fixed = ImportOf(robot);
  EXPECT_EQ(JointNamed(fixed, "a to ground").type, JointType::kWeld);
  ExpectNote(fixed, "<link name='a'>", "--floating");
  const ImportOptions options{.floats = true};
  const Imported floating = ImportOf(robot, options);
  EXPECT_EQ(JointNamed(floating, "a").type, JointType::kFree);
  EXPECT_EQ(floating.description.bodies.size(), 3u);
  const std::string reverse = Robot(Link("b") + Link("a") + Joint("j", "continuous", "a", "b"));
  const Imported root = ImportOf(reverse, options);
  EXPECT_EQ(JointNamed(root, "a").type, JointType::kFree);
}

TEST(ImportUrdf, LimitsAndDynamicsMatterOnlyOnJointsThatHaveThem) {
  const auto changes = [](const std::string& type, const std::string& inside) {
    const Imported imported = ImportOf(Robot(Link("world", "") + Link("a") + Link("b") +
                                             Joint("i", "continuous", "world", "a") +
                                             Joint("j", type, "a", "b", inside)));
    return std::ranges::count(imported.notes, true, &ImportNote::changes_motion);
  };
  const std::string limit = "<limit lower='0' upper='0' effort='1' velocity='2'/>",
                    dynamics = "<dynamics damping='0.1' friction='0.2'/>";
  EXPECT_EQ(changes("revolute", limit + dynamics), 2);
  EXPECT_EQ(changes("continuous", limit), 0);
  EXPECT_EQ(changes("fixed", limit + dynamics), 0);
}

TEST(ImportUrdf, GravityIsSaidByTheOption) {
  const std::string robot =
      Robot(Link("world", "") + Link("a") + Joint("j", "continuous", "world", "a"));
  const Imported standard = ImportOf(robot);
  EXPECT_EQ(standard.description.gravity, Eigen::Vector3d(0, 0, -9.81));
  ExpectNote(standard, "<robot name='r'>", "--gravity");
  const ImportOptions moon{.gravity = Eigen::Vector3d(0, 0, -1.62)};
  const Imported there = ImportOf(robot, moon);
  EXPECT_EQ(there.description.gravity, *moon.gravity);
  EXPECT_FALSE(HasNote(there, "<robot", "--gravity"));
}

TEST(ImportUrdf, EveryKindOfDroppedElementHasItsNote) {
  const Imported imported = ImportOf(
      Robot(Link("world", "") +
            Link("a", kMass + "<visual><geometry/></visual><collision/><odd/>") + Link("b") +
            Joint("j", "revolute", "world", "a",
                  "<limit effort='1'/><dynamics damping='0.5' "
                  "friction='0.1'/><calibration/><safety_controller/>") +
            Joint("k", "floating", "a", "b", "<dynamics damping='1'/><mimic joint='j'/>") +
            "<transmission/><gazebo/><material name='m'/><sensor/>"));
  EXPECT_FALSE(HasNote(imported, "<visual>", ""));
  ExpectNote(imported, "<collision>", "no contact");
  ExpectNote(imported, "<odd>", "not known");
  ExpectNote(imported, "<limit>", "without ends");
  ExpectNote(imported, "<dynamics> friction", "dry friction");
  ExpectNote(imported, "<calibration>", "sensor's zero");
  ExpectNote(imported, "<safety_controller>", "no controller");
  ExpectNote(imported, "<dynamics> damping", "one coordinate");
  ExpectNote(imported, "<mimic>", "a freedom more");
  ExpectNote(imported, "<transmission>", "no actuators");
  ExpectNote(imported, "<gazebo>", "another program");
  ExpectNote(imported, "<sensor>", "no sensors");
  ASSERT_EQ(ForcesOf<JointDamper>(imported).size(), 1u);
  EXPECT_EQ(ForcesOf<JointDamper>(imported)[0].damping, 0.5);
}

TEST(ImportUrdf, PartsOfOtherProgramsChangeTheMotionIfTheyAct) {
  const auto changes = [](const std::string& part) {
    const Imported imported = ImportOf(
        Robot(Link("world", "") + Link("a") + Joint("j", "continuous", "world", "a") + part));
    return std::ranges::any_of(imported.notes, &ImportNote::changes_motion);
  };
  EXPECT_FALSE(changes("<ros2_control name='x'><joint name='j'/></ros2_control>"));
  EXPECT_TRUE(changes("<gazebo><plugin name='c'/></gazebo>"));
  EXPECT_FALSE(
      changes("<gazebo reference='j'><preserveFixedJoint>true</preserveFixedJoint></gazebo>"));
  EXPECT_TRUE(
      changes("<gazebo reference='a'><mu1>1</mu1><turnGravityOff>1</turnGravityOff></gazebo>"));
}

TEST(ImportUrdf, RotorsOfTransmissionsMoveWithTheirJoints) {
  const auto robot = [](const std::string& type, const std::string& joint = "j") {
    return Robot(Link("world", "") + Link("a") + Joint("j", type, "world", "a") + Link("b") +
                 Joint("k", "continuous", "a", "b") + "<transmission><joint name='" + joint +
                 "'/><actuator><drake:rotor_inertia value='0.5'/><drake:gear_ratio "
                 "value='4'/></actuator></transmission>");
  };
  const Imported geared = ImportOf(robot("continuous"));
  EXPECT_EQ(JointNamed(geared, "j").rotor_inertia, 8.0);
  EXPECT_EQ(JointNamed(geared, "k").rotor_inertia, 0.0);
  ExpectNote(geared, "<transmission>", "only its rotor_inertia");
  ExpectNote(ImportOf(robot("floating")), "<transmission> drake:rotor_inertia",
             "only joints with one coordinate");
  EXPECT_FALSE(HasNote(ImportOf(robot("fixed")), "rotor_inertia", ""));
}

TEST(ImportUrdf, LinksThatAreFixedNeedNoInertia) {
  const auto robot = [](const std::string& type) {
    return Robot(Link("world", "") + Link("a", "<inertial><mass value='5'/></inertial>") +
                 Link("b") + Joint("i", type, "world", "a") + Joint("j", "continuous", "a", "b"));
  };
  EXPECT_EQ(Refusal(robot("fixed")), "");
}

TEST(ImportUrdf, MimicsAreCouplings) {
  const auto robot = [](const std::string& mimic) {
    // the leader may follow in the file
    return Robot(Link("world", "") + Link("a") + Link("b") +
                 Joint("k", "prismatic", "world", "a", mimic) +
                 Joint("j", "continuous", "world", "b"));
  };
  const Imported imported = ImportOf(robot("<mimic joint='j' multiplier='0.25' offset='0.1'/>"));
  ExpectCoupling(imported, "k mimic", {{"k", 1.0}, {"j", -0.25}}, 0.1);
  // the leader starts at zero
  ASSERT_EQ(imported.description.initial.coordinates.size(), 1u);
  EXPECT_EQ(imported.description.initial.coordinates[0].joint, 0);
  EXPECT_EQ(imported.description.initial.coordinates[0].values, std::vector<double>{0.1});
  EXPECT_FALSE(HasNote(imported, "<mimic>", ""));
  EXPECT_EQ(ImportOf(robot("<mimic joint='j'/>")).description.couplings[0].parts[1].ratio, -1.0);
  const Imported fixed = ImportOf(Robot(Link("world", "") + Link("a") + Link("b") +
                                        Joint("j", "continuous", "world", "a") +
                                        Joint("k", "fixed", "a", "b", "<mimic joint='j'/>")));
  ExpectNote(fixed, "<mimic>", "does not move");
  EXPECT_TRUE(std::ranges::none_of(fixed.notes, &ImportNote::changes_motion));
}

TEST(ImportUrdf, AnotherFormatIsRefused) {
  ExpectRefusal(Robot(Link("a")), {"found urdf, expected sdf"}, {.format = "sdf"});
}

/// A sidecar beside a chain of two links of 1 m along x at rest.
class Sidecar : public ModelFolder {
 protected:
  Imported Read(const std::string& json) const {
    Write("loops.json", json);
    return ImportOf(
        Robot(Link("world", "") + Link("a") + Link("b") +
              Joint("j", "continuous", "world", "a", "<axis xyz='0 0 1'/>") +
              Joint("k", "continuous", "a", "b",
                    "<origin xyz='1 0 0' rpy='0 0 1.5707963267948966'/><axis xyz='0 0 1'/>")),
        {.sidecar = model_ / "loops.json"});
  }
};

TEST_F(Sidecar, LoopsCloseWhereTheFileDrawsThem) {
  const Imported imported = Read(
      R"({"loops": [{"name": "l", "type": "revolute", "from": "b", "to": "ground", "at": [2, 0, 0],
                     "axis": [0, 0, 1]}]})");
  const JointDescription& loop = JointNamed(imported, "l");
  EXPECT_TRUE(loop.cut);
  // b stands at (1, 0, 0), turned by a quarter
  ExpectNear(loop.to.position, {1, 2, 0}, 1e-15);
  EXPECT_NEAR(loop.to.rotation.z(), 1.5707963267948966, 1e-15);
}

TEST_F(Sidecar, JointsForcesAndStartAreThoseOfMechanismFiles) {
  const Imported imported = Read(R"({
    "gravity": [0, -1, 0],
    "joints": [{"name": "r", "type": "rod", "length": 3, "from": {"body": "b"}, "to": {"body": "ground"}}],
    "forces": [{"type": "joint_torque", "joint": "j", "value": 2}],
    "initial": {"coordinates": {"j": 0.5}, "speeds": {"k": 1}, "fixed": ["j"]},
    "known_solution": {"length": 2}})");
  EXPECT_EQ(imported.description.gravity.y(), -1.0);
  EXPECT_EQ(JointNamed(imported, "r").parameter, 3.0);
  EXPECT_EQ(ForcesOf<JointTorque>(imported).size(), 1u);
  EXPECT_EQ(imported.description.initial.held.size(), 1u);
  EXPECT_EQ(imported.observe.length, 2.0);
}

TEST_F(Sidecar, MistakesHaveTheirPlace) {
  const auto expect = [&](const std::string& json, const std::string& words) {
    ExpectSaid(MessageOf([&] { Read(json); }), {words});
  };
  expect(R"({"loop": []})", "unknown key 'loop'");
  expect(R"({"loop": []})", "did you mean 'loops'");
  expect(R"({"loops": [{"name": "l", "type": "revolute", "from": "c", "to": "a", "at": [0,0,0]}]})",
         "/loops/0/from: found 'c'");
  expect(R"({"loops": [{"name": "j", "type": "revolute", "from": "b", "to": "a", "at": [0,0,0]}]})",
         "/loops/0/name: found 'j'");
  expect(R"({"loops": [{"name": "l", "type": "rod", "from": "b", "to": "a", "at": [0,0,0]}]})",
         "/loops/0/type");
  expect(R"({"loops": [{"name": "l", "type": "revolute", "from": "b", "to": "b", "at": [0,0,0]}]})",
         "/loops/0/to");
  expect(R"({"initial": {"fixed": ["j"]}})", "/initial/fixed/0");
  expect("{", "file");
}

}  // namespace loopbench::harness::import_urdf_test
