// Joints of SDF that follow others: <mimic>, and joints of type gearbox and screw.
#include "tests/harness/import_texts.h"

namespace loopbench::harness::import_sdf_couplings_test {

std::string Sdf(const std::string& inside) {
  return "<sdf version='1.11'>\n<model name='m'>\n" + inside + "</model></sdf>";
}

std::string Link(const std::string& name, const std::string& pose = "0 0 0 0 0 0") {
  return "<link name='" + name + "'><pose>" + pose + "</pose></link>\n";
}

/// A joint "f" of the link "b" that follows the joint "j" of the link "a".
std::string Follower(const std::string& mimic, const std::string& type = "revolute",
                     const std::string& leader = "revolute") {
  return Sdf(Link("a") + Link("b") +
             SdfJoint("f", type, "world", "b", "<axis>" + mimic + "</axis>") +
             SdfJoint("j", leader, "world", "a"));
}

Imported Read(const std::string& inside) { return ImportOf(Sdf(inside)); }

TEST(ImportSdfCouplings, AMimicFollowsFromItsReference) {
  // position = 0.25 (leader - 3) + 2
  const Imported imported =
      ImportOf(Follower("<mimic "
                        "joint='j'><multiplier>0.25</multiplier><offset>2</"
                        "offset><reference>3</reference></mimic>"));
  ExpectCoupling(imported, "f mimic", {{"f", 1.0}, {"j", -0.25}}, 1.25);
  EXPECT_FALSE(HasNote(imported, "<mimic>", ""));
  const Imported plain = ImportOf(Follower("<mimic joint='j' axis='axis'/>", "prismatic"));
  ExpectCoupling(plain, "f mimic", {{"f", 1.0}, {"j", -1.0}}, 0.0);
  // constant without a leader
  const Imported held =
      ImportOf(Follower("<mimic joint='j'><multiplier>0</multiplier><offset>2</offset></mimic>"));
  EXPECT_TRUE(held.description.couplings.empty());
  EXPECT_EQ(held.description.joints[0].motions.size(), 1u);
}

TEST(ImportSdfCouplings, LeadersAreNamedInTheModelOfTheFollower) {
  const std::string mimic = "<axis><mimic joint='j'/></axis>";
  const std::string hand = "<model name='hand'>" + Link("p") + Link("q") +
                           SdfJoint("j", "revolute", "world", "p") +
                           SdfJoint("f", "revolute", "p", "q", mimic) + "</model>";
  const Imported imported = Read(Link("a") + SdfJoint("j", "revolute", "world", "a") + hand);
  ExpectCoupling(imported, "hand::f mimic", {{"hand::f", 1.0}, {"hand::j", -1.0}}, 0.0);
}

TEST(ImportSdfCouplings, MimicsOfSeveralCoordinatesAreDropped) {
  const std::string axes = "<axis><xyz>1 0 0</xyz></axis><axis2><xyz>0 1 0</xyz></axis2>";
  const auto follower = [&](const std::string& mimic) {
    return Read(Link("a") + Link("b") + SdfJoint("j", "universal", "world", "a", axes) +
                SdfJoint("f", "revolute", "world", "b", mimic));
  };
  for (const char* axis : {"axis", "axis2"}) {
    ExpectNote(follower(std::string("<axis><mimic joint='j' axis='") + axis + "'/></axis>"),
               "<mimic>", "a freedom more");
  }
  ExpectNote(follower("<axis/><axis2><mimic joint='j'/></axis2>"), "<mimic>", "no such axis");
}

TEST(ImportSdfCouplings, MimicsMayFollowEachOtherInAnyOrder) {
  std::string links, joints;
  for (int i = 0; i < 5; ++i) {
    const std::string n = std::to_string(i), leader = std::to_string((i + 3) % 5);
    links += Link("l" + n);
    joints += SdfJoint("j" + n, "revolute", "world", "l" + n,
                       i == 4 ? "<axis/>" : "<axis><mimic joint='j" + leader + "'/></axis>");
  }
  // 0 follows 3, 1 follows 4, 2 follows 0, 3 follows 1
  EXPECT_EQ(Read(links + joints).description.couplings.size(), 4u);
}

/// Two shafts on a moving base; `b` is turned by a quarter about y, and the base carries a mount.
std::string Shafts(const std::string& gearbox, const std::string& axis_of_b = "<xyz>0 0 1</xyz>") {
  return Link("base") + Link("mount", "0 0 1 0 0 0") + Link("a") +
         Link("b", "1 0 0 0 1.5707963267948966 0") +
         SdfJoint("bolt", "fixed", "base", "mount", "") + SdfJoint("ja", "revolute", "base", "a") +
         SdfJoint("jb", "revolute", "mount", "b", "<axis>" + axis_of_b + "</axis>") + gearbox;
}

/// Its axes are in axes of `b`, whose z is the base's x and whose -x is the base's z.
std::string Gearbox(const std::string& inside, const std::string& reference = "base",
                    const std::string& axes = "<axis><xyz>-1 0 0</xyz></axis><axis2/>") {
  return SdfJoint(
      "g", "gearbox", "a", "b",
      axes + "<gearbox_reference_body>" + reference + "</gearbox_reference_body>" + inside);
}

TEST(ImportSdfCouplings, AGearboxCouplesTheJointsOfItsReferenceBody) {
  const std::string three = "<gearbox_ratio>3</gearbox_ratio>";
  // theta_b = -3 theta_a
  for (const char* reference : {"base", "mount"}) {
    const Imported imported = Read(Shafts(Gearbox(three, reference)));
    ExpectCoupling(imported, "g", {{"jb", 1.0}, {"ja", 3.0}}, 0.0);
    EXPECT_FALSE(HasNote(imported, "gearbox", ""));
  }
  ExpectCoupling(Read(Shafts(Gearbox(""))), "g", {{"jb", 1.0}, {"ja", 1.0}}, 0.0);
  // axes of the gearbox or of a joint may point the other way, each with a change of sign
  ExpectCoupling(Read(Shafts(Gearbox(three, "base", "<axis><xyz>1 0 0</xyz></axis><axis2/>"))), "g",
                 {{"jb", 1.0}, {"ja", -3.0}}, 0.0);
  ExpectCoupling(Read(Shafts(Gearbox(three), "<xyz>0 0 -1</xyz>")), "g",
                 {{"jb", 1.0}, {"ja", -3.0}}, 0.0);
  ExpectCoupling(Read(Shafts(Gearbox(three, "base",
                                     "<axis><xyz expressed_in='a'>0 0 1</xyz></axis><axis2><xyz "
                                     "expressed_in='base'>1 0 0</xyz></axis2>"))),
                 "g", {{"jb", 1.0}, {"ja", 3.0}}, 0.0);
}

TEST(ImportSdfCouplings, JointsToTheReferenceBodyTurnItTheOtherWay) {
  const std::string gearbox =
      SdfJoint("g", "gearbox", "a", "b",
               "<axis/><gearbox_reference_body>r</gearbox_reference_body><gearbox_ratio>2</"
               "gearbox_ratio><physics><ode/></physics>");
  const Imported imported =
      Read(Link("a") + Link("r") + Link("b") + SdfJoint("p", "revolute", "a", "r") +
           SdfJoint("q", "continuous", "r", "b") + gearbox);
  // the angle of `a` from `r` is -p
  ExpectCoupling(imported, "g", {{"q", 1.0}, {"p", -2.0}}, 0.0);
  ExpectNote(imported, "<joint name='g'>", "no <axis2>");
}

TEST(ImportSdfCouplings, ThreadsOfScrews) {
  const auto screw = [](const std::string& inside) {
    return Link("a") + SdfJoint("j", "screw", "world", "a", "<axis/>" + inside);
  };
  // the newer pitch counts, as in libsdformat
  const Imported both =
      Read(screw("<thread_pitch>7</thread_pitch><screw_thread_pitch>0.5</screw_thread_pitch>"));
  EXPECT_EQ(both.description.joints[0].parameter, 0.5 / (2 * kPi));
}

TEST(ImportSdfCouplings, FollowersStartWhereLeadersPlaceThem) {
  const auto start = [](const std::string& own) {
    return Read(
        Link("a") + Link("b") +
        SdfJoint("f", "revolute", "world", "b",
                 "<axis><mimic joint='j'><multiplier>2</multiplier><offset>0.5</offset></mimic>" +
                     own + "</axis>") +
        SdfJoint("j", "revolute", "world", "a",
                 "<axis><initial_position>0.25</initial_position></axis>"));
  };
  const auto value = [](const Imported& imported, int joint) {
    const auto& all = imported.description.initial.coordinates;
    return std::ranges::find(all, joint, &JointValues::joint)->values[0];
  };
  const Imported placed = start("");
  EXPECT_EQ(value(placed, 0), 1.0);
  EXPECT_EQ(value(placed, 1), 0.25);
  const Imported moved = start("<initial_position>3</initial_position>");
  EXPECT_EQ(value(moved, 0), 1.0);
  ExpectNote(moved, "<link name='b'>", "starts at 1");
}

}  // namespace loopbench::harness::import_sdf_couplings_test
