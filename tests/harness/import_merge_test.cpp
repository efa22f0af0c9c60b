// Parts fixed together are one body: the sum has mass and inertia, the parts need not.
#include "harness/exchange/export_names.h"
#include "tests/harness/import_texts.h"

namespace loopbench::harness::import_merge_test {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Sums of a few products of numbers of order one, each rounded once.
constexpr double kRounding = 32.0 * 2.2e-16;

std::string Inertial(double mass, const std::string& moments, const std::string& at = "0 0 0") {
  const auto space = moments.find(' '), second = moments.rfind(' ');
  return "<inertial><origin xyz='" + at + "'/><mass value='" + std::to_string(mass) +
         "'/><inertia ixx='" + moments.substr(0, space) + "' iyy='" +
         moments.substr(space + 1, second - space - 1) + "' izz='" + moments.substr(second + 1) +
         "'/></inertial>";
}

std::string Link(const std::string& name, const std::string& inside = "") {
  return "<link name='" + name + "'>" + inside + "</link>\n";
}

std::string Joint(const std::string& name, const std::string& type, const std::string& parent,
                  const std::string& child, const std::string& at = "0 0 0") {
  return "<joint name='" + name + "' type='" + type + "'><origin xyz='" + at + "'/><parent link='" +
         parent + "'/><child link='" + child + "'/><axis xyz='0 1 0'/></joint>\n";
}

/// An arm of 2 kg on a pin, and parts fixed to it.
std::string Arm(const std::string& rest) {
  return "<robot name='r'>" + Link("world") + Link("arm", Inertial(2, "0.2 0.2 0.01", "0 0 -0.5")) +
         Joint("pin", "continuous", "world", "arm") + rest + "</robot>";
}

Imported Read(const std::string& text) { return ImportOf(text); }

const BodyDescription& Only(const Imported& imported) {
  EXPECT_EQ(imported.description.bodies.size(), 2u);
  return imported.description.bodies.back();
}

void ExpectBody(const BodyDescription& body, double mass, const Vector3d& com,
                const Vector3d& moments) {
  EXPECT_NEAR(body.mass, mass, kRounding * mass);
  EXPECT_LE((body.com - com).norm(), kRounding);
  const Matrix3d expected = moments.asDiagonal();
  EXPECT_LE((body.inertia - expected).norm(), kRounding * moments.maxCoeff()) << body.inertia;
}

TEST(ImportMerge, FramesWithoutInertiaAreWhatTheyAreFixedTo) {
  const Imported imported = Read(
      Arm(Link("tool", Inertial(1e-6, "0 0 0")) + Joint("t", "fixed", "arm", "tool", "0 0 -1")));
  // a point of 1e-6 kg half a metre below the centre of mass
  ExpectBody(Only(imported), 2.000001, {0, 0, -(1.0 + 1e-6) / 2.000001},
             {0.2 + 2e-6 / 2.000001 * 0.25, 0.2 + 2e-6 / 2.000001 * 0.25, 0.01});
  ExpectNote(imported, "<link name='tool'>",
             "without an inertia of its own and fixed: merged with 'arm'");
}

TEST(ImportMerge, ChainsOfFramesAddUpWhateverTheirOrder) {
  // three points along x, each fixed to the next, before and behind a link without mass
  const std::string chain =
      Link("a", Inertial(1, "0 0 0")) + Link("none") + Link("b", Inertial(2, "0 0 0")) +
      Link("c", Inertial(3, "0 0 0")) + Joint("ja", "fixed", "arm", "a", "1 0 -0.5") +
      Joint("jn", "fixed", "a", "none", "1 0 0") + Joint("jb", "fixed", "none", "b", "1 0 0") +
      Joint("jc", "fixed", "b", "c", "1 0 0");
  // at x = 0, 1, 3, 4 with 2, 1, 2, 3 kg: centre 19/8, sum m x^2 = 67, minus 8 (19/8)^2
  const double across = 67.0 - 8.0 * 19.0 / 8.0 * 19.0 / 8.0;
  ExpectBody(Only(Read(Arm(chain))), 8, {19.0 / 8.0, 0, -0.5}, {0.2, 0.2 + across, 0.01 + across});
}

TEST(ImportMerge, PointsThatAreNotInLineAreABodyWithoutAnyOther) {
  const auto points = [](const std::string& third) {
    return "<robot name='r'>" + Link("world") + Link("hub") + Link("a", Inertial(1, "0 0 0")) +
           Link("b", Inertial(1, "0 0 0")) + Link("c", Inertial(1, "0 0 0")) +
           Joint("pin", "continuous", "world", "hub") + Joint("ja", "fixed", "hub", "a", "1 0 0") +
           Joint("jb", "fixed", "hub", "b", "-1 0 0") + Joint("jc", "fixed", "a", "c", third) +
           "</robot>";
  };
  // at (1, 0), (-1, 0), (0, 3): about their centre (0, 1) Ixx = 1 + 1 + 4, Iyy = 2
  const Imported imported = Read(points("-1 3 0"));
  EXPECT_EQ(imported.notes.size(), 4u);  // gravity, and each part that is merged
  const BodyDescription& body = Only(imported);
  EXPECT_EQ(body.name, "a");
  ExpectBody(body, 3, {-1, 1, 0}, {6, 2, 8});
}

TEST(ImportMerge, MasslessLinksBetweenRealOnesVanish) {
  const Imported imported =
      Read(Arm(Link("mount") + Link("left", Inertial(1, "1 1 1")) +
               Link("right", Inertial(1, "1 1 1")) + Joint("m", "fixed", "arm", "mount", "0 0 -1") +
               Joint("l", "fixed", "mount", "left", "0 1 0") +
               Joint("r", "continuous", "mount", "right", "0 -1 0")));
  // bodies with a mass and an inertia of their own stay, welded
  ASSERT_EQ(imported.description.bodies.size(), 4u);
  const auto& joints = imported.description.joints;
  ASSERT_EQ(joints.size(), 3u);
  EXPECT_EQ(joints[1].type, JointType::kWeld);
  EXPECT_EQ(joints[1].from.body, 1);
  EXPECT_EQ(joints[1].from.position, Vector3d(0, 1, -1));
  EXPECT_EQ(joints[2].from.position, Vector3d(0, -1, -1));
}

TEST(ImportMerge, NotTheSumOfTwoButOfAllDecides) {
  // -0.5 about x with the arm's 0.2 is no inertia yet; with the wheel's it is
  const std::string odd =
      Link("odd", Inertial(1, "-0.5 0.1 0.1")) + Joint("o", "fixed", "arm", "odd", "0 0 -0.5");
  const Imported imported = Read(Arm(odd + Link("wheel", Inertial(1, "1 1 1")) +
                                     Joint("w", "fixed", "arm", "wheel", "0 0 -0.5")));
  ExpectBody(Only(imported), 4, {0, 0, 0}, {0.7, 1.3, 1.11});
  EXPECT_EQ(imported.description.joints[0].to.position, Vector3d(0, 0, 0.5));
  // an inertia without a mass counts as well
  ExpectBody(Only(Read(Arm(Link("rotor", Inertial(0, "0.1 0.1 0.1")) +
                           Joint("o", "fixed", "arm", "rotor")))),
             2, {0, 0, -0.5}, {0.3, 0.3, 0.11});
}

TEST(ImportMerge, MassesOfWhatCannotMoveDoNotMatter) {
  const Imported urdf =
      Read(Arm(Link("base", Inertial(5, "1 0 0")) + Link("post", Inertial(0, "1 1 9")) +
               Joint("b", "fixed", "world", "base") + Joint("p", "fixed", "base", "post")));
  ExpectBody(Only(urdf), 2, {0, 0, -0.5}, {0.2, 0.2, 0.01});
  const std::string arm =
      "<link name='arm'><inertial><pose relative_to='arm'>0 0 -0.5 0 0 "
      "0</pose><mass>2</mass><inertia><ixx>0.2</ixx><iyy>0.2</iyy><izz>0.01</izz></inertia></"
      "inertial></link><joint name='pin' "
      "type='revolute'><parent>wall::plate</parent><child>arm</child><axis/></joint>";
  const std::string plate = "<link name='plate'><inertial auto='true'/></link>";
  const Imported sdf =
      Read("<sdf version='1.9'><model name='m'><model name='wall'><static>true</static>" + plate +
           "</model>" + arm + "</model></sdf>");
  ExpectBody(Only(sdf), 2, {0, 0, -0.5}, {0.2, 0.2, 0.01});
  EXPECT_EQ(sdf.description.joints[0].from.body, kGround);
}

TEST(ImportMerge, MassesOfShapesOfWhatIsFixedToTheWorldAreNotRead) {
  const auto model = [](const std::string& type) {
    const std::string shape = "<inertial auto='true'><density>9</density></inertial>";
    const auto joint = [](const std::string& kind, const std::string& parent,
                          const std::string& child) {
      return "<joint name='j" + child + "' type='" + kind + "'><parent>" + parent +
             "</parent><child>" + child + "</child><axis/></joint>";
    };
    // the world - a plate with a mass - a mesh - an arm
    return "<sdf version='1.9'><model name='m'><link name='plate'/><link name='mesh'>" + shape +
           "</link><link name='arm'/>" + joint("fixed", "world", "plate") +
           joint(type, "plate", "mesh") + joint("revolute", "mesh", "arm") + "</model></sdf>";
  };
  const Imported imported = Read(model("fixed"));
  EXPECT_EQ(imported.description.bodies.back().name, "arm");
  ExpectNote(imported, "<link name='mesh'>", "without mass and fixed");
}

TEST(ImportMerge, LinksWithoutMassAtTheEndAreFixed) {
  const std::string chain = Link("wrist") + Link("tool") +
                            Joint("w", "continuous", "arm", "wrist", "0 0 -1") +
                            Joint("t", "prismatic", "wrist", "tool", "0.1 0 0");
  const Imported imported = Read(Arm(chain));
  ExpectBody(Only(imported), 2, {0, 0, -0.5}, {0.2, 0.2, 0.01});
  ASSERT_EQ(imported.description.joints.size(), 1u);
  ExpectNote(imported, "<link name='tool'>", "without mass at the end of a chain");
  ExpectNote(imported, "<link name='wrist'>", "joint 'w' dropped");
  // links that carry mass have a small one
  const Imported added =
      Read(Arm(Link("wrist") + Link("tool", Inertial(1, "1 1 1")) + Link("palm") +
               Joint("w", "continuous", "arm", "wrist", "0 0 -1") +
               Joint("p", "continuous", "wrist", "palm", "0.1 0 0") +
               Joint("t", "continuous", "palm", "tool", "0.1 0 0")));
  ExpectNote(added, "<link name='wrist'>", "1e-06 kg are added, 1e-06 of the mass of 'tool'");
}

TEST(ImportMerge, LinksWithoutMassThatCoupleOthersStay) {
  const std::string dummy = Link("knob") + Joint("lead", "continuous", "arm", "knob", "0 0 -1");
  const auto finger = [](const std::string& name) {
    std::string joint = Joint("j" + name, "continuous", "arm", name, "0 0 -1");
    joint.insert(joint.find("</joint>"), "<mimic joint='lead'/>");
    return Link(name, Inertial(1, "1 1 1")) + joint;
  };
  // one finger alone is not held by the knob, two are coupled by it
  const Imported one = Read(Arm(dummy + finger("a")));
  EXPECT_TRUE(one.description.couplings.empty());
  ExpectNote(one, "<link name='knob'>", "coupling 'ja mimic' dropped");
}

TEST(ImportMerge, MomentsThatNoBodyHasAreBalancedOnRequest) {
  const std::string hand =
      Link("hand", Inertial(1, "0.1 0.2 0.6")) + Joint("wrist", "continuous", "arm", "hand");
  const ImportOptions options{.balances_inertia = true};
  const Imported imported = ImportOf(Arm(hand), options);
  const BodyDescription& body = imported.description.bodies.back();
  EXPECT_LE((body.inertia - 0.3 * Matrix3d::Identity()).norm(), kRounding);
  EXPECT_EQ(imported.description.bodies[1].inertia.diagonal(), Vector3d(0.2, 0.2, 0.01));
  ExpectNote(imported, "<link name='hand'>", "no body has such moments of inertia");
  ExpectRefusal(Arm(Link("hand", Inertial(1, "0 0 0")) + Joint("w", "continuous", "arm", "hand")),
                {"three that are > 0"}, options);
}

TEST(ImportMerge, JointsBetweenPartsOfTheGroundHaveTheirNote) {
  const Imported imported = Read(
      "<sdf version='1.9'><world name='w'><model name='door'><static>1</static><link "
      "name='a'/><link name='b'/><joint name='h' "
      "type='revolute'><parent>a</parent><child>b</child><axis/></joint></model><model "
      "name='c'><link name='c'/></model></world></sdf>");
  ASSERT_EQ(imported.description.joints.size(), 1u);
  ExpectNote(imported, "<link name='b'>", "joint 'door::h' dropped");
}

TEST(ImportMerge, PartsOfOneFloatingBodyStandWhereTheFileDrawsThem) {
  const std::string zero = "<inertia><ixx>0</ixx><iyy>0</iyy><izz>0</izz></inertia>";
  const Imported imported = Read(
      "<sdf version='1.9'><model name='m'><link name='a'><pose>1 2 3 0 0 "
      "0</pose><inertial><mass>1</mass><inertia/></inertial></link><link name='b'><pose>1 2 5 0 0 "
      "0</pose><inertial><mass>1</mass>" +
      zero +
      "</inertial></link><joint name='j' "
      "type='fixed'><parent>a</parent><child>b</child></joint></model></sdf>");
  ExpectBody(Only(imported), 2, {0, 0, 1}, {3, 3, 1});
  ASSERT_EQ(imported.description.joints.size(), 1u);
  EXPECT_EQ(imported.description.joints[0].type, JointType::kFree);
  EXPECT_EQ(imported.description.initial.coordinates[0].values,
            (std::vector<double>{1, 0, 0, 0, 1, 2, 3}));
}

/// A body of MuJoCo on a pin, and its elements.
std::string Mjcf(const std::string& inside, const std::string& before = "") {
  return "<mujoco>" + before + "<worldbody><body name='arm'><joint axis='0 1 0'/>" + inside +
         "</body></worldbody></mujoco>";
}

const std::string kInertial = "<inertial pos='0 0 -0.5' mass='2' diaginertia='0.2 0.2 0.01'/>";

TEST(ImportMerge, PointLoadsAndStaticChildrenOfMjcfAddUp) {
  const BodyDescription body =
      Only(Read(Mjcf(kInertial + "<body pos='0 0 -1'><inertial pos='0 0 0' mass='3'/></body>")));
  ExpectBody(body, 5, {0, 0, -0.8}, {0.5, 0.5, 0.01});
  // a body without geoms or inertial on a joint is part of its child
  const BodyDescription carried = Only(Read(Mjcf("<body><body>" + kInertial + "</body></body>")));
  ExpectBody(carried, 2, {0, 0, -0.5}, {0.2, 0.2, 0.01});
  // bounds count before the sum
  const Imported bounded = Read(Mjcf(kInertial + "<body><inertial pos='0 0 0' mass='1'/></body>",
                                     "<compiler boundmass='2' boundinertia='0.1'/>"));
  ASSERT_EQ(bounded.description.bodies.size(), 3u);
  ExpectBody(bounded.description.bodies[1], 2, {0, 0, -0.5}, {0.2, 0.2, 0.1});
  ExpectBody(bounded.description.bodies[2], 2, {0, 0, 0}, {0.1, 0.1, 0.1});
}

TEST(ImportMerge, MeshesOfWhatCannotMoveAreNotRead) {
  const std::string mesh = "<geom type='mesh' mesh='m'/>", sphere = "<geom size='0.1' mass='1'/>";
  const auto wall = [&](const std::string& inside, const std::string& before = "") {
    return "<mujoco>" + before + "<worldbody><body name='wall'><body>" + inside +
           "<body name='arm'><joint/>" + kInertial + "</body></body></body></worldbody></mujoco>";
  };
  ExpectBody(Only(Read(wall(mesh))), 2, {0, 0, -0.5}, {0.2, 0.2, 0.01});
  // MuJoCo's total includes parts that cannot move: 1 and 2 kg
  const Imported total = Read(wall(sphere, "<compiler settotalmass='6'/>"));
  EXPECT_NEAR(total.description.bodies.back().mass, 4.0, kRounding);
}

TEST(ImportMerge, InertiaFromGeomKeepsTheInertialWhereNoGeomHasMass) {
  const std::string compiler = "<compiler inertiafromgeom='true'/>";
  for (const std::string geom :
       {"", "<geom size='0.1' mass='0'/>", "<geom size='1e-6' mass='7'/>", "<geom size='1e-6'/>"}) {
    ExpectBody(Only(Read(Mjcf(kInertial + geom, compiler))), 2, {0, 0, -0.5}, {0.2, 0.2, 0.01});
  }
  const Imported from_geom = Read(Mjcf(kInertial + "<geom size='0.1' mass='7'/>", compiler));
  EXPECT_EQ(Only(from_geom).mass, 7.0);
  ExpectNote(from_geom, "<inertial>", "inertiafromgeom");
}

TEST(ImportMerge, ShapesOfHardlyAnyVolumeHaveNoMass) {
  // MuJoCo: a mass counts if the shape has more than 1e-14 m^3; a ball of 1.3e-5 m has 9.2e-15
  const std::string tiny = "<geom size='1.3e-5' mass='5'/>",
                    small = "<geom size='1.4e-5' mass='5'/>";
  const std::string rod = "<geom size='0.1' mass='1'/>";
  const Imported dropped = Read(Mjcf(rod + tiny));
  EXPECT_EQ(Only(dropped).mass, 1.0);
  ExpectNote(dropped, "<geom> mass", "as in MuJoCo");
  EXPECT_EQ(Only(Read(Mjcf(rod + small))).mass, 6.0);
}

TEST(ImportMerge, LimitsNeedNoRange) {
  for (const auto& [joint, has_note] : {std::pair<std::string, bool>{"limited='true'", true},
                                        {"limited='true' range='2 1'", true},
                                        {"range='-1 1'", true},
                                        {"range='0 0'", false},
                                        {"limited='false' range='0 1'", false}}) {
    const Imported imported = Read("<mujoco><worldbody><body><joint name='j' " + joint + "/>" +
                                   kInertial + "</body></worldbody></mujoco>");
    EXPECT_EQ(HasNote(imported, "<joint name='j'>", "without ends"), has_note) << joint;
  }
}

TEST(ImportMerge, ExportersAcceptTheMomentsOfImporters) {
  // the largest moment exceeds the sum by round-off of a sum of rotated inertias
  exchange::Body body;
  body.inertia = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0 + 2e-14};
  EXPECT_EQ(exchange::FaultOfInertia(body, false), "");
  body.inertia[8] = 2.0 + 1e-12;
  EXPECT_NE(exchange::FaultOfInertia(body, false), "");
}

}  // namespace loopbench::harness::import_merge_test
