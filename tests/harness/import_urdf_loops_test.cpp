// Loops within URDF: <loop_joint>, joints of SDF in <gazebo>, and constraints of Drake.
#include "harness/config/mechanism_reader.h"
#include "tests/harness/import_texts.h"

namespace loopbench::harness::import_urdf_loops_test {

/// The four-bar of the sidecar, whose loop from `right` to `coupler` is open.
std::string FourBar(const std::string& inside) {
  std::string text = ReadFile(kConfigs / "imports/one-four-bar.urdf");
  return text.insert(text.rfind("</robot>"), inside);
}

std::string LoopJoint(const std::string& inside, const std::string& type = "continuous") {
  return FourBar("<loop_joint name='B' type='" + type + "'>" + inside + "</loop_joint>");
}

const std::string kSides =
    "<link1 link='right' xyz='0 0 1' rpy='0 0 0'/><link2 link='coupler' xyz='1 0 0'/>";

std::string Gazebo(const std::string& inside, const std::string& name = "B",
                   const std::string& type = "revolute") {
  return FourBar("<gazebo>\n<joint name='" + name + "' type='" + type + "'>" + inside +
                 "</joint></gazebo>");
}

const std::string kEnds = "<parent>right</parent><child>coupler</child><pose>1 0 0 0 0 0</pose>";

std::string Ball(const std::string& a, const std::string& b, const std::string& p = "0 0 1") {
  return FourBar("<drake:ball_constraint><drake:ball_constraint_body_A name='" + a +
                 "'/><drake:ball_constraint_p_AP value='" + p +
                 "'/><drake:ball_constraint_body_B name='" + b +
                 "'/><drake:ball_constraint_p_BQ value='1 0 0'/></drake:ball_constraint>");
}

TEST(ImportUrdfLoops, AllFormsGiveTheMechanismOfTheSidecar) {
  Imported sidecar =
      ImportOf(FourBar(""), {.sidecar = kConfigs / "imports/one-four-bar-loop.json"});
  sidecar.description.initial = {};
  const std::string expected = MechanismText(sidecar.description, sidecar.observe);
  ExpectWords(expected, {"\"cut\": true"});
  for (const std::string& text :
       {LoopJoint(kSides + "<axis xyz='0 1 0'/>"),
        LoopJoint(kSides + "<axis xyz='0 1 0'/>", "revolute"),
        Gazebo(kEnds + "<axis><xyz>0 1 0</xyz></axis>"),
        Gazebo(kEnds + "<axis><xyz expressed_in='__model__'>0 1 0</xyz></axis>")}) {
    const Imported imported = ImportOf(text);
    EXPECT_EQ(MechanismText(imported.description, imported.observe), expected);
  }
}

TEST(ImportUrdfLoops, LoopJointsHaveAFrameOnEachSide) {
  // the axis is in axes of both frames, x by default; Isaac Sim calls both sides link1
  const Imported imported =
      ImportOf(LoopJoint("<link1 link='right' xyz='0 0 1' rpy='0 0 0.5'/><link1 link='coupler' "
                         "xyz='1 2 3' rpy='0 0.25 0'/>"));
  const JointDescription& loop = JointNamed(imported, "B");
  EXPECT_TRUE(loop.cut);
  EXPECT_EQ(loop.axis, Eigen::Vector3d::UnitX());
  EXPECT_EQ(imported.description.bodies[loop.from.body].name, "right");
  EXPECT_EQ(loop.from.position, Eigen::Vector3d(0, 0, 1));
  EXPECT_NEAR(loop.from.rotation.z(), 0.5, 1e-15);
  EXPECT_EQ(imported.description.bodies[loop.to.body].name, "coupler");
  EXPECT_EQ(loop.to.position, Eigen::Vector3d(1, 2, 3));
  EXPECT_NEAR(loop.to.rotation.y(), 0.25, 1e-15);
  const std::vector<std::pair<std::string, JointType>> kinds = {
      {"spherical", JointType::kSpherical},
      {"prismatic", JointType::kPrismatic},
      {"fixed", JointType::kWeld}};
  for (const auto& [theirs, ours] : kinds) {
    EXPECT_EQ(JointNamed(ImportOf(LoopJoint(kSides, theirs)), "B").type, ours);
  }
  EXPECT_EQ(JointNamed(ImportOf(LoopJoint("<link1 link='world'/><link2 link='coupler'/>")), "B")
                .from.body,
            kGround);
}

TEST(ImportUrdfLoops, BallConstraintsOfDrakeAreSphericalJoints) {
  const Imported imported = ImportOf(Ball("right", "coupler"));
  const JointDescription& ball = JointNamed(imported, "ball");
  EXPECT_EQ(ball.type, JointType::kSpherical);
  EXPECT_TRUE(ball.cut);
  EXPECT_EQ(ball.from.position, Eigen::Vector3d(0, 0, 1));
  EXPECT_EQ(ball.to.position, Eigen::Vector3d(1, 0, 0));
  const Imported sdf = ImportOf(
      "<sdf version='1.9'><model name='m'><link name='a'/><link "
      "name='b'/><drake:ball_constraint><drake:ball_constraint_body_A>a</"
      "drake:ball_constraint_body_A><drake:ball_constraint_p_AP>1 2 "
      "3</drake:ball_constraint_p_AP><drake:ball_constraint_body_B>b</"
      "drake:ball_constraint_body_B><drake:ball_constraint_p_BQ>4 5 "
      "6</drake:ball_constraint_p_BQ></drake:ball_constraint></model></sdf>");
  EXPECT_EQ(JointNamed(sdf, "ball").from.position, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(JointNamed(sdf, "ball").to.position, Eigen::Vector3d(4, 5, 6));
}

TEST(ImportUrdfLoops, JointsInGazeboMayCoupleOthers) {
  const Imported imported = ImportOf(
      FourBar("<gazebo><joint name='g' "
              "type='gearbox'><parent>left</parent><child>right</child><axis><xyz>0 1 "
              "0</xyz></axis><axis2><xyz>0 1 "
              "0</xyz></axis2><gearbox_reference_body>world</"
              "gearbox_reference_body><gearbox_ratio>-1</gearbox_ratio></joint></gazebo>"));
  ASSERT_EQ(imported.description.couplings.size(), 1u);
  EXPECT_EQ(imported.description.couplings[0].parts[1].ratio, -1.0);
  EXPECT_EQ(imported.description.joints.size(), 3u);
}

TEST(ImportUrdfLoops, OtherContentsOfGazeboAreDropped) {
  const Imported imported = ImportOf(
      FourBar("<gazebo><static>true</static></gazebo>\n<gazebo><plugin name='p'/><joint name='B' "
              "type='fixed'>" +
              kEnds + "</joint></gazebo>\n<gazebo reference='left'><joint name='C'/></gazebo>"));
  ExpectNote(imported, "<gazebo>", "another program");
  ExpectNote(imported, "<plugin name='p'>", "another program");
  EXPECT_EQ(JointNamed(imported, "B").type, JointType::kWeld);
  EXPECT_EQ(imported.description.joints.size(), 4u);
  EXPECT_EQ(std::ranges::count_if(
                imported.notes, [](const ImportNote& note) { return note.element == "<gazebo>"; }),
            2);
}

TEST(ImportUrdfLoops, AxesInGazeboAreThoseOfTheJoint) {
  const std::string turned =
      "<parent>right</parent><child>coupler</child><pose>1 0 0 0 0 "
      "1.5707963267948966</pose><axis><xyz>1 0 0</xyz></axis>";
  const Imported imported = ImportOf(Gazebo(turned));
  const JointDescription& loop = JointNamed(imported, "B");
  const Eigen::Vector3d axis = PoseOf(loop.to).R * AxisAlignment(loop) * Eigen::Vector3d::UnitZ();
  ExpectNear(axis, Eigen::Vector3d::UnitY(), 1e-15);
  ExpectNote(imported, "<axis>", "in axes of the joint");
  EXPECT_FALSE(HasNote(ImportOf(Gazebo(kEnds + "<axis><xyz>0 1 0</xyz></axis>")), "<axis>", ""));
}

TEST(ImportUrdfLoops, ARootThatAGazeboJointHoldsIsNotFixed) {
  const std::string link =
      "<link name='a'><inertial><mass value='2'/><inertia ixx='1' iyy='1' "
      "izz='1'/></inertial></link>";
  const Imported imported = ImportOf(
      "<robot name='r'>" + link +
      "<gazebo><joint name='j' "
      "type='revolute'><parent>world</parent><child>a</child><axis/></joint></gazebo></robot>");
  ASSERT_EQ(imported.description.joints.size(), 1u);
  EXPECT_EQ(imported.description.joints[0].name, "j");
  EXPECT_FALSE(HasNote(imported, "<link", "--floating"));
}

}  // namespace loopbench::harness::import_urdf_loops_test
