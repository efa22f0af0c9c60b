// What becomes of each element of SDF, by version.
#include "tests/harness/import_texts.h"

namespace loopbench::harness::import_sdf_test {

const std::string kInertial =
    "<inertial><mass>2</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial>";

std::string Sdf(const std::string& inside, const std::string& version = "1.9") {
  return "<sdf version='" + version + "'>\n<model name='m'>\n" + inside + "</model></sdf>";
}

std::string Link(const std::string& name, const std::string& pose = "0 0 0 0 0 0") {
  return "<link name='" + name + "'><pose>" + pose + "</pose>" + kInertial + "</link>\n";
}

Imported Read(const std::string& inside, const std::string& version = "1.9") {
  return ImportOf(Sdf(inside, version));
}

/// The axis of a joint in axes of its child.
Eigen::Vector3d AxisOnChild(const JointDescription& joint) {
  return PoseOf(joint.to).R * AxisAlignment(joint) *
         (joint.type == JointType::kPrismatic ? Eigen::Vector3d::UnitX()
                                              : Eigen::Vector3d::UnitZ());
}

TEST(ImportSdf, JointsAreTheKindsOfOurs) {
  const std::string axis2 = "<axis><xyz>1 0 0</xyz></axis><axis2><xyz>0 1 0</xyz></axis2>";
  const std::vector<std::array<std::string, 3>> kinds = {
      {"revolute", "revolute", "<axis/>"},
      {"continuous", "revolute", "<axis/>"},
      {"prismatic", "prismatic", "<axis/>"},
      {"ball", "spherical", ""},
      {"fixed", "weld", ""},
      {"universal", "universal", axis2},
      {"revolute2", "universal", axis2},
      {"screw", "helical", "<axis/><screw_thread_pitch>1</screw_thread_pitch>"}};
  for (const auto& [theirs, ours, inside] : kinds) {
    const Imported imported = Read(Link("a") + SdfJoint("j", theirs, "world", "a", inside));
    EXPECT_EQ(ToString(JointNamed(imported, "j").type), ours);
  }
}

TEST(ImportSdf, UniversalJointsOfOtherAxesAreTwoHinges) {
  const Imported imported =
      Read(Link("a", "1 0 0 0 0 0") +
               SdfJoint("j", "universal", "world", "a",
                        "<pose>0 1 0 0 0 0</pose><axis><xyz>1 0 "
                        "0</xyz><initial_position>0.5</initial_position></axis><axis2><xyz>1 1 "
                        "0</xyz><dynamics><damping>2</damping></dynamics></axis2>"),
           "1.6");
  ASSERT_EQ(imported.description.bodies.size(), 3u);
  ASSERT_EQ(imported.description.joints.size(), 2u);
  const JointDescription &inner = JointNamed(imported, "j"),
                         &outer = imported.description.joints[0];
  EXPECT_EQ(inner.type, JointType::kRevolute);
  EXPECT_EQ(inner.from.body, kGround);
  EXPECT_EQ(inner.from.position, Eigen::Vector3d(1, 1, 0));
  EXPECT_EQ(inner.axis, Eigen::Vector3d(1, 0, 0));
  EXPECT_EQ(outer.type, JointType::kRevolute);
  EXPECT_EQ(outer.from.body, inner.to.body);
  EXPECT_EQ(imported.description.bodies[static_cast<std::size_t>(outer.to.body)].name, "a");
  EXPECT_EQ(outer.to.position, Eigen::Vector3d(0, 1, 0));
  EXPECT_EQ(outer.axis, Eigen::Vector3d(1, 1, 0));
  ASSERT_EQ(ForcesOf<JointDamper>(imported).size(), 1u);
  EXPECT_EQ(ForcesOf<JointDamper>(imported)[0].joint, 0);
  ASSERT_EQ(imported.description.initial.coordinates.size(), 1u);
  EXPECT_EQ(imported.description.initial.coordinates[0].joint, 1);
  ExpectNote(imported, "<joint name='j'>", "a link without mass");
}

TEST(ImportSdf, PosesOfModelsAreOfTheirPlacementFrame) {
  const Imported imported =
      ImportOf("<sdf version='1.9'><model name='m' placement_frame='f'><pose>1 2 3 0 0 0</pose>" +
               Link("a", "0.5 0 0 0 0 0") +
               "<frame name='f' attached_to='a'><pose>0 0 1 0 0 1.5707963267948966</pose></frame>" +
               SdfJoint("j", "fixed", "world", "a", "") + "</model></sdf>");
  // f stands at (0.5, 0, 1) in the model, turned by a quarter, and at (1, 2, 3) in the world
  const JointDescription& joint = JointNamed(imported, "j");
  ExpectNear(joint.from.position, {1, 2, 2}, 1e-15);
  EXPECT_NEAR(joint.from.rotation.z(), -kPi / 2, 1e-15);
}

TEST(ImportSdf, GravityIsInPhysicsBeforeItIsInTheWorld) {
  const auto world = [](const std::string& version, const std::string& inside) {
    return ImportOf("<sdf version='" + version + "'><world name='w'>" + inside +
                    "<model name='m'>" + Link("a") + "</model></world></sdf>");
  };
  const std::string moon = "<physics><gravity>0 0 -1.62</gravity></physics>";
  for (const char* version : {"1.4", "1.5"}) {
    const Imported imported = world(version, moon);
    EXPECT_EQ(imported.description.gravity.z(), -1.62);
    EXPECT_FALSE(HasNote(imported, "<world", "gravity"));
  }
  // the first one counts
  EXPECT_EQ(
      world("1.5", moon + "<physics><gravity>0 0 -1</gravity></physics>").description.gravity.z(),
      -1.62);
  EXPECT_EQ(world("1.5", moon + "<gravity>0 0 -2</gravity>").description.gravity.z(), -2.0);
  const Imported later = world("1.6", moon);
  EXPECT_EQ(later.description.gravity.z(), -9.8);
  ExpectNote(later, "<gravity>", "from 1.6 on");
}

TEST(ImportSdf, AutomaticMassesAreScaledToTheGivenOne) {
  const auto body = [](const std::string& mass) {
    return Read("<link name='a'><inertial auto='true'>" + mass +
                "</inertial><collision name='c'><geometry><box><size>1 1 "
                "1</size></box></geometry></collision></link>")
        .description.bodies[1];
  };
  EXPECT_EQ(body("").mass, 1000.0);
  EXPECT_EQ(body("<mass>5</mass>").mass, 5.0);
  EXPECT_NEAR(body("<mass>5</mass>").inertia(0, 0), 5.0 / 6.0, 1e-15);
}

TEST(ImportSdf, DecayOfVelocitiesChangesTheMotionUnlessItIsZero) {
  const auto read = [](const std::string& linear) {
    return Read("<link name='a'><velocity_decay><linear>" + linear +
                "</linear><angular>0</angular></velocity_decay>" + kInertial + "</link>");
  };
  EXPECT_FALSE(HasNote(read("0"), "<velocity_decay>", ""));
  ExpectNote(read("0.1"), "<velocity_decay>", "no medium");
}

TEST(ImportSdf, PosesAreRelativeToWhatTheyName) {
  const Imported imported =
      Read("<pose>10 0 0 0 0 1.5707963267948966</pose>" + Link("a", "1 0 0 0 0 0") +
           "<frame name='f' attached_to='a'><pose>0 2 0 0 0 0</pose></frame><link name='b'><pose "
           "relative_to='f' degrees='true'>0 0 3 0 0 90</pose>" +
           kInertial + "</link>" + SdfJoint("w", "fixed", "world", "a", "") +
           SdfJoint("j", "revolute", "f", "b", "<pose>0 0 1 0 0 0</pose><axis/>"));
  // the model is turned by a quarter and stands at (10, 0, 0): a is 1 along its x, the ground's y
  const JointDescription& w = JointNamed(imported, "w");
  ExpectNear(w.from.position, {10, 1, 0}, 1e-14);
  EXPECT_NEAR(w.from.rotation.z(), kPi / 2, 1e-15);
  const JointDescription& j = JointNamed(imported, "j");
  EXPECT_EQ(imported.description.bodies[static_cast<std::size_t>(j.from.body)].name, "a");
  ExpectNear(j.from.position, {0, 2, 4}, 1e-14);
  EXPECT_EQ(j.to.position, Eigen::Vector3d(0, 0, 1));
  EXPECT_NEAR(j.from.rotation.z(), kPi / 2, 1e-15);
}

TEST(ImportSdf, QuaternionsOfPosesHaveTheirScalarLast) {
  const Imported imported =
      Read("<link name='a'><pose rotation_format='quat_xyzw'>0 0 0 0 0 1 1</pose>" + kInertial +
           "</link>" + SdfJoint("w", "fixed", "world", "a", ""));
  EXPECT_NEAR(JointNamed(imported, "w").from.rotation.z(), kPi / 2, 1e-15);
}

TEST(ImportSdf, AxesAreInTheFrameThatTheVersionSays) {
  const auto axis = [](const std::string& version, const std::string& inside) {
    const Imported imported =
        Read(Link("a", "0 0 0 1.5707963267948966 0 0") +
                 SdfJoint("j", "revolute", "world", "a", "<axis><xyz" + inside + "</axis>"),
             version);
    return AxisOnChild(JointNamed(imported, "j"));
  };
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ(), minus_y(0, -1, 0), y(0, 1, 0);
  // the child is turned about x by a quarter: the model's z is its y
  EXPECT_LE((axis("1.4", ">0 0 1</xyz>") - y).norm(), 1e-15);
  EXPECT_LE((axis("1.5", ">0 0 1</xyz>") - z).norm(), 1e-15);
  EXPECT_LE(
      (axis("1.6", ">0 0 1</xyz><use_parent_model_frame>1</use_parent_model_frame>") - y).norm(),
      1e-15);
  EXPECT_LE((axis("1.7", " expressed_in='__model__'>0 0 1</xyz>") - y).norm(), 1e-15);
  EXPECT_LE((axis("1.7", " expressed_in='a'>0 -1 0</xyz>") - minus_y).norm(), 1e-15);
}

/// Where a joint whose parent is the world stands, and its axis there.
void ExpectAt(const Imported& imported, const std::string& name, const Eigen::Vector3d& place,
              const Eigen::Vector3d& axis) {
  const JointDescription& joint = JointNamed(imported, name);
  // a few units of rounding: lengths of order one, two turns by a quarter
  EXPECT_LE((joint.from.position - place).norm(), 1e-15);
  const Eigen::Matrix3d R = PoseOf(joint.from).R * AxisAlignment(joint);
  EXPECT_LE((R * Eigen::Vector3d::UnitZ() - axis).norm(), 1e-15);
}

TEST(ImportSdf, JointsStandAtTheirChildBeItAFrameOrAModel) {
  const std::string x = "<axis><xyz>1 0 0</xyz></axis>", turned = " 0 0 1.5707963267948966";
  const std::string link = Link("a", "0 0 1 0 0 0");
  const Imported frame = Read(link + "<frame name='f' attached_to='a'><pose>0.5 0 0" + turned +
                              "</pose></frame>" + SdfJoint("j", "revolute", "world", "f", x));
  ExpectAt(frame, "j", {0.5, 0, 1}, Eigen::Vector3d::UnitY());
  EXPECT_EQ(JointNamed(frame, "j").to.position, Eigen::Vector3d(0.5, 0, 0));
  const std::string arm =
      "<model name='arm'><pose>1 0 0 0 0 0</pose>" + Link("a", "0 2 0" + turned) + "</model>";
  const Imported model = Read(arm + SdfJoint("j", "revolute", "world", "arm", x));
  ExpectAt(model, "j", {1, 0, 0}, Eigen::Vector3d::UnitX());
  // the link stands at (1, 2, 0) and is turned: 2 m behind it, which is its -x
  ExpectNear(JointNamed(model, "j").to.position, {-2, 0, 0}, 1e-15);
  const Imported within = Read(arm + SdfJoint("j", "revolute", "world", "arm::a", x));
  ExpectAt(within, "j", {1, 2, 0}, Eigen::Vector3d::UnitY());
}

TEST(ImportSdf, PitchesOfScrewsHaveTheirSignByName) {
  const auto pitch = [](const std::string& inside) {
    return JointNamed(Read(Link("a") + SdfJoint("j", "screw", "world", "a", "<axis/>" + inside)),
                      "j")
        .parameter;
  };
  // the two of sdformat's own test: 0.5 m per turn, right-handed, is -12.566 rad/m
  EXPECT_NEAR(pitch("<screw_thread_pitch>0.5</screw_thread_pitch>"), 0.5 / (2 * kPi), 1e-15);
  EXPECT_NEAR(pitch("<thread_pitch>-12.566370614359172</thread_pitch>"), 0.5 / (2 * kPi), 1e-15);
}

TEST(ImportSdf, BodiesWithTwoParentsCloseLoops) {
  const Imported imported = Read(
      Link("a") + Link("b") + SdfJoint("j", "revolute", "world", "a") +
      SdfJoint("k", "revolute", "a", "b") + SdfJoint("l", "revolute", "world", "b") +
      SdfJoint(
          "n", "ball", "world", "b",
          "<physics><simbody><must_be_loop_joint>true</must_be_loop_joint></simbody></physics>"));
  EXPECT_EQ(imported.description.joints.size(), 4u);
  EXPECT_TRUE(JointNamed(imported, "n").cut);
}

TEST(ImportSdf, SpringsDampersAndTheStartAreThoseOfTheAxis) {
  const Imported imported = Read(
      Link("a") + SdfJoint("j", "revolute", "world", "a",
                           "<axis><initial_position>0.5</initial_position><dynamics><damping>1</"
                           "damping><spring_stiffness>2</spring_stiffness><spring_reference>3</"
                           "spring_reference><friction>4</friction></dynamics></axis>"),
      "1.6");
  EXPECT_EQ(ForcesOf<JointDamper>(imported)[0].damping, 1.0);
  EXPECT_EQ(ForcesOf<JointSpring>(imported)[0].stiffness, 2.0);
  EXPECT_EQ(ForcesOf<JointSpring>(imported)[0].rest, 3.0);
  EXPECT_EQ(imported.description.initial.coordinates[0].values[0], 0.5);
  ExpectNote(imported, "<dynamics> friction", "dry friction");
}

TEST(ImportSdf, JointsOfTwoAxesStartWhereBothSay) {
  const std::string axes =
      "<axis><xyz>1 0 0</xyz><initial_position>0.5</initial_position></axis><axis2><xyz>0 1 "
      "0</xyz><initial_position>0.25</initial_position></axis2>";
  const Imported imported = Read(Link("a") + SdfJoint("j", "universal", "world", "a", axes), "1.6");
  ASSERT_EQ(imported.description.initial.coordinates.size(), 1u);
  EXPECT_EQ(imported.description.initial.coordinates[0].values, (std::vector<double>{0.5, 0.25}));
  const Imported ball = Read(Link("a") + SdfJoint("j", "ball", "world", "a", axes), "1.6");
  EXPECT_TRUE(ball.description.initial.coordinates.empty());
  ExpectNote(ball, "<axis>", "no axis");
  // a second axis that is none of the joint's takes nothing from the first
  const Imported revolute = Read(Link("a") + SdfJoint("j", "revolute", "world", "a", axes), "1.6");
  ASSERT_EQ(revolute.description.initial.coordinates.size(), 1u);
  EXPECT_EQ(revolute.description.initial.coordinates[0].values, (std::vector<double>{0.5}));
  ExpectNote(revolute, "<initial_position>", "no coordinate of this axis");
}

TEST(ImportSdf, FloatingStaticAndWeightlessBodies) {
  const Imported floating = Read("<link name='a'><pose>1 2 3 0 0 0</pose><gravity>false</gravity>" +
                                 kInertial + "</link>");
  EXPECT_EQ(JointNamed(floating, "a").type, JointType::kFree);
  EXPECT_EQ(floating.description.initial.coordinates[0].values,
            (std::vector<double>{1, 0, 0, 0, 1, 2, 3}));
  EXPECT_NEAR(ForcesOf<PointForce>(floating)[0].force.z(), 2 * 9.8, 1e-14);
  const Imported base = ImportOf(
      "<sdf version='1.9'><world name='w'><gravity>0 0 -1</gravity><model "
      "name='table'><static>true</static><link name='top'><pose>0 0 1 0 0 "
      "0</pose></link></model><model name='arm'><pose relative_to='table'>0 0 2 0 0 0</pose>" +
      Link("a") + "</model>" + SdfJoint("j", "revolute", "table::top", "arm::a") +
      "</world></sdf>");
  ASSERT_EQ(base.description.bodies.size(), 2u);
  EXPECT_EQ(base.description.bodies[1].name, "arm::a");
  EXPECT_EQ(base.description.gravity.z(), -1.0);
  EXPECT_EQ(JointNamed(base, "j").from.position, Eigen::Vector3d(0, 0, 2));
}

TEST(ImportSdf, NestedModelsHaveTheirNames) {
  const Imported imported =
      Read(Link("a") + "<model name='hand'><pose>1 0 0 0 0 0</pose>" + Link("palm") + Link("tip") +
           SdfJoint("bend", "revolute", "palm", "tip") + "</model>" +
           SdfJoint("j", "revolute", "world", "a") + SdfJoint("k", "fixed", "a", "hand::palm", ""));
  EXPECT_EQ(imported.description.bodies[2].name, "hand::palm");
  EXPECT_EQ(JointNamed(imported, "hand::bend").type, JointType::kRevolute);
  EXPECT_EQ(JointNamed(imported, "k").from.position, Eigen::Vector3d(1, 0, 0));
}

TEST(ImportSdf, JointsMayHaveNamesOfLinksBeforeTheyAreFrames) {
  const std::string same = Link("a", "1 0 0 0 0 0") + SdfJoint("a", "revolute", "world", "a");
  const Imported imported = Read(same, "1.6");
  EXPECT_EQ(JointNamed(imported, "a").from.position, Eigen::Vector3d::UnitX());
}

TEST(ImportSdf, ACanonicalLinkIsNoNews) {
  const Imported imported = ImportOf("<sdf version='1.9'><model name='m' canonical_link='a'>" +
                                     Link("a") + "</model></sdf>");
  EXPECT_FALSE(HasNote(imported, "canonical_link", ""));
}

TEST(ImportSdf, EveryKindOfDroppedElementHasItsNote) {
  const Imported imported = ImportOf(
      "<sdf version='1.6'><world "
      "name='w'><physics/><problem/><state/><plugin/><wind/><strange/><model "
      "name='m'><self_collide>0</self_collide><plugin/><link "
      "name='a'><kinematic>true</kinematic><velocity_decay><linear>1</linear></"
      "velocity_decay><visual name='v'/><collision name='c'/><sensor name='s'/></link>" +
      SdfJoint("j", "revolute", "world", "a",
               "<axis><limit><lower>-1</lower><upper>inf</upper></limit><odd/></axis>") +
      "</model></world></sdf>");
  ExpectNote(imported, "<physics>", "their own integrator");
  ExpectNote(imported, "<state>", "the start is");
  ExpectNote(imported, "<plugin>", "no plugins");
  ExpectNote(imported, "<wind>", "no medium");
  ExpectNote(imported, "<strange>", "not known");
  ExpectNote(imported, "<kinematic>", "as forces make them");
  ExpectNote(imported, "<velocity_decay>", "no medium");
  EXPECT_FALSE(HasNote(imported, "<visual", ""));
  ExpectNote(imported, "<collision name='c'>", "no contact");
  ExpectNote(imported, "<sensor name='s'>", "no sensors");
  ExpectNote(imported, "<limit>", "without ends");
  ExpectNote(imported, "<odd>", "not known");
  ExpectNote(imported, "<link name='a'>", "defaults of SDF");
  ExpectNote(imported, "<world name='w'>", "9.8");
  // limits that are none are no news
  EXPECT_FALSE(
      HasNote(Read(Link("a") +
                   SdfJoint("j", "revolute", "world", "a",
                            "<axis><limit><lower>-1e16</lower><upper>inf</upper></limit></axis>")),
              "<limit>", ""));
}

TEST(ImportSdf, AxesOfBallsAndFixedJointsDoNotChangeTheMotion) {
  for (const std::string type : {"ball", "fixed"}) {
    const Imported imported =
        Read(Link("a") + Link("b") + SdfJoint("i", "revolute", "world", "a") +
             SdfJoint("j", type, "a", "b",
                      "<axis><limit><lower>0</lower><upper>0</upper></limit><dynamics><damping>1</"
                      "damping><friction>1</friction></dynamics></axis>"));
    ExpectNote(imported, "<axis>", "no axis");
    EXPECT_EQ(std::ranges::count(imported.notes, true, &ImportNote::changes_motion), 0) << type;
  }
}

}  // namespace loopbench::harness::import_sdf_test
