// Actuators of MJCF under a control that stays.
#include "tests/harness/import_texts.h"

namespace loopbench::harness::import_mjcf_actuators_test {

using namespace import_mjcf_texts;

TEST(ImportMjcf, MotorsUnderAConstantControlAreTorques) {
  const std::string motor = "<actuator><motor joint='j' gear='2'/></actuator>";
  const Imported on = Two(motor + "<keyframe><key ctrl='3'/></keyframe>");
  EXPECT_EQ(std::get<Polynomial>(ForcesOf<JointTorque>(on)[0].value).coefficients[0], 6.0);
  const std::string general =
      "<actuator><general joint='j' gear='2' gainprm='5' biastype='affine' biasprm='";
  const Imported biased = Two(general + "0.5 0 0'/></actuator>");  // 2 (5 0 + 0.5)
  EXPECT_EQ(std::get<Polynomial>(ForcesOf<JointTorque>(biased)[0].value).coefficients[0], 1.0);
  ExpectNote(Two(general + "0.5 1 0'/></actuator>"), "<general>", "is negative");
  const Imported off = Two(motor);
  EXPECT_TRUE(ForcesOf<JointTorque>(off).empty());
  ExpectNote(off, "<motor>", "control is 0");
  ExpectNote(Two("<actuator><muscle joint='j'/></actuator>"), "<muscle>", "only motors");
}

/// force = gain ctrl + bias, effort = gear force, length = gear qpos (MuJoCo, "Actuation model").
TEST(ImportMjcf, ServosUnderAConstantControlAreSpringsAndDampers) {
  const auto with = [](const std::string& actuator, const std::string& ctrl) {
    // qpos = coordinate + 0.5
    return Read(
        "<joint name='j' ref='0.5' range='-1 2'/>", "<compiler angle='radian'/>",
        "<actuator>" + actuator + "</actuator><keyframe><key ctrl='" + ctrl + "'/></keyframe>");
  };
  const Imported position = with("<position joint='j' kp='8' kv='3' gear='2'/>", "1.5");
  ASSERT_EQ(ForcesOf<JointSpring>(position).size(), 1u);
  const JointSpring spring = ForcesOf<JointSpring>(position)[0];
  EXPECT_EQ(spring.stiffness, 32.0);   // 8 2^2
  EXPECT_EQ(spring.rest, 0.75 - 0.5);  // ctrl / gear, less the reference
  EXPECT_EQ(ForcesOf<JointDamper>(position)[0].damping, 12.0);
  EXPECT_TRUE(ForcesOf<JointTorque>(position).empty());
  // without a control the target is qpos = 0
  EXPECT_EQ(ForcesOf<JointSpring>(with("<position joint='j'/>", "0"))[0].rest, -0.5);
  const Imported inherited = with("<position joint='j' inheritrange='0.5'/>", "9");
  EXPECT_EQ(ForcesOf<JointSpring>(inherited)[0].rest, 1.25 - 0.5);

  const Imported velocity = with("<velocity joint='j' kv='4' gear='3'/>", "2");
  EXPECT_EQ(ForcesOf<JointDamper>(velocity)[0].damping, 36.0);
  EXPECT_EQ(std::get<Polynomial>(ForcesOf<JointTorque>(velocity)[0].value).coefficients[0], 24.0);
  const Imported damper = with("<damper joint='j' kv='4' ctrlrange='0 1'/>", "7");
  EXPECT_EQ(ForcesOf<JointDamper>(damper)[0].damping, 4.0);

  const Imported limited = with("<position joint='j' forcerange='-1 1'/>", "1");
  ExpectNote(limited, "<position> forcerange", "no largest effort");
  const Imported both = with("<position joint='j'/><motor joint='j'/>", "2 3");
  EXPECT_EQ(ForcesOf<JointSpring>(both)[0].rest, 2.0 - 0.5 + 3.0);
  ExpectNote(with("<position joint='j' dampratio='1'/>", "1"), "<position>", "damping ratio");
}

/// The efforts on joint "j", which stands alone.
std::vector<double> Efforts(const std::string& before, const std::string& actuators,
                            const std::string& ctrl, const std::string& joint = "") {
  const Imported imported =
      Read("<joint name='j' " + joint + "/>", before,
           "<actuator>" + actuators + "</actuator><keyframe><key ctrl='" + ctrl + "'/></keyframe>");
  std::vector<double> efforts;
  for (const JointTorque& torque : ForcesOf<JointTorque>(imported)) {
    efforts.push_back(std::get<Polynomial>(torque.value).coefficients[0]);
  }
  return efforts;
}
using Values = std::vector<double>;

TEST(ImportMjcf, EffortsEndWhereControlsAndForcesDo) {
  const auto motor = [](const std::string& attributes, const std::string& ctrl,
                        const std::string& before = "", const std::string& joint = "") {
    return Efforts(before, "<motor joint='j' gear='3' " + attributes + "/>", ctrl, joint);
  };
  EXPECT_EQ(motor("ctrlrange='-2 2'", "9"), Values{6});
  EXPECT_EQ(motor("ctrlrange='-2 2' ctrllimited='false'", "9"), Values{27});
  EXPECT_EQ(motor("ctrlrange='0 0'", "9"), Values{27});  // no range, for MuJoCo
  // under a control of 0 too
  EXPECT_EQ(motor("ctrlrange='1 2'", "0"), Values{3});
  // the force is that before the gear; as MuJoCo 2.2.2 has it
  EXPECT_EQ(motor("ctrlrange='-2 2' forcerange='-1 1'", "9"), Values{3});
  EXPECT_EQ(motor("forcerange='-1 1'", "-9"), Values{-3});
  const std::string no_limits = "<compiler autolimits='false'/>";
  EXPECT_EQ(motor("ctrlrange='-2 2'", "9", no_limits), Values{27});
  EXPECT_EQ(motor("ctrlrange='-2 2' ctrllimited='true'", "9", no_limits), Values{6});
  EXPECT_EQ(motor("ctrlrange='-2 2'", "9", "<option><flag clampctrl='disable'/></option>"),
            Values{27});
  // the joint's range is behind the gear, and of all of its actuators together
  EXPECT_EQ(motor("", "9", "", "actuatorfrcrange='-5 5'"), Values{5});
  EXPECT_EQ(motor("", "9", "", "actuatorfrcrange='-5 5' actuatorfrclimited='false'"), Values{27});
  EXPECT_EQ(Efforts("", "<motor joint='j'/><motor joint='j'/>", "3 4", "actuatorfrcrange='-5 5'"),
            Values{5});
  EXPECT_EQ(Efforts("", "<motor joint='j'/><motor joint='j'/>", "9 -5", "actuatorfrcrange='-5 5'"),
            Values{4});
}

TEST(ImportMjcf, ActuatorsThatAreSwitchedOffGiveNothing) {
  const std::string motors = "<motor joint='j' group='1'/><motor joint='j'/>";
  EXPECT_EQ(Efforts("", motors, "1 10"), Values{11});
  EXPECT_EQ(Efforts("<option actuatorgroupdisable='1 3'/>", motors, "1 10"), Values{10});
  EXPECT_EQ(Efforts("<option actuatorgroupdisable='0'/>", motors, "1 10"), Values{1});
  const std::string off = "<option><flag actuation='disable'/></option>";
  EXPECT_EQ(Efforts(off, motors, "1 10"), Values{});
  const Imported imported = Two(
      off + "<actuator><motor name='m' joint='j'/></actuator><keyframe><key ctrl='1'/></keyframe>");
  ExpectNote(imported, "<motor name='m'>", "switched off");
  // weight that actuators carry ends with them
  const Imported lifted =
      Read("<joint name='j' actuatorgravcomp='true'/>", off, "", "gravcomp='1'");
  ExpectNote(lifted, "<joint name='j'> actuatorgravcomp", "dropped");
}

TEST(ImportMjcf, WhatActuatorsSayAndNobodyReadsHasANote) {
  const Imported imported =
      Two("<actuator><motor name='m' joint='j' group='2' user='1' "
          "strange='4'/></actuator><keyframe><key ctrl='1'/></keyframe>");
  ExpectNote(imported, "<motor name='m'> strange", "not known");
  EXPECT_FALSE(HasNote(imported, "<motor name='m'> group", ""));
  EXPECT_FALSE(HasNote(imported, "<motor name='m'> user", ""));
}

TEST(ImportMjcf, ActuatorsOfAllKindsHaveOneDefault) {
  // efforts of MuJoCo 2.2.2 for the same model
  const std::string classes =
      "<default><motor gear='2' ctrlrange='-1 1'/><general gainprm='5'/><default "
      "class='x'><position kp='7'/></default><default class='y'><motor/></default></default>";
  EXPECT_EQ(Efforts(classes, "<motor joint='j'/>", "3"), Values{2});
  EXPECT_EQ(Efforts(classes, "<general joint='j'/>", "3"), Values{10});
  EXPECT_EQ(Efforts(classes, "<motor joint='j' class='x'/>", "3"), Values{2});
  EXPECT_EQ(Efforts(classes, "<general joint='j' class='y'/>", "3"), Values{2});
  // a spring with the gain of the class
  EXPECT_EQ(Efforts(classes, "<general joint='j' class='x'/>", "3"), Values{});
  const Imported kept =
      Two(classes +
          "<actuator><motor joint='j' class='x'/></actuator><keyframe><key ctrl='1'/></keyframe>");
  EXPECT_FALSE(HasNote(kept, "<position>", ""));
}

TEST(ImportMjcf, ServosKeepTheGainsOfTheLayersBelow) {
  struct Row {
    std::string below, actuator;
    double stiffness, damping;
  };
  // at control 0.8; values of MuJoCo 3.14
  const std::string affine = "<general gainprm='4' biastype='affine' biasprm='0.3 -2 -0.6'/>",
                    damper = "<damper kv='3' ctrlrange='0 1'/>";
  for (const auto& [below, actuator, k, c] :
       std::vector<Row>{{"<position kp='7'/>", "position", 7, 0},
                        {"<position kp='7'/>", "position kv='0.4'", 7, 0.4},
                        {"<position kp='7' kv='0.7'/>", "position kp='2'", 2, 0.7},
                        {"<position kp='7' dampratio='1'/>", "position kv='0.5'", 7, 0.5},
                        {"<position timeconst='1'/>", "position timeconst='0'", 1, 0},
                        {"<general dyntype='filter'/>", "position", 0, 0},
                        {"<position kp='7'/>", "velocity", 0, 7},
                        {"<velocity kv='5'/>", "velocity", 0, 5},
                        {"<velocity kv='5'/>", "position kp='2'", 2, 5},
                        {"<general gainprm='4'/>", "position", 4, 0},
                        {affine, "position kp='2'", 2, 0.6},
                        {affine, "velocity", 0, 4},
                        {affine + "<motor/>", "position kp='3'", 3, 0.6},
                        {damper, "damper ctrlrange='0 1'", 0, 2.4},
                        {damper, "position kp='2'", 2, 0},
                        {"<position kp='7' kv='1'/>", "damper ctrlrange='0 1'", 0, 0},
                        {"", "damper ctrlrange='0 1'", 0, 0}}) {
    SCOPED_TRACE(below + " " + actuator);
    const Imported imported = Read(
        "<joint name='j'/>", "<default>" + below + "</default>",
        "<actuator><" + actuator + " joint='j'/></actuator><keyframe><key ctrl='0.8'/></keyframe>");
    const auto springs = ForcesOf<JointSpring>(imported);
    const auto dampers = ForcesOf<JointDamper>(imported);
    EXPECT_NEAR(springs.empty() ? 0.0 : springs[0].stiffness, k, kEps);
    EXPECT_NEAR(dampers.empty() ? 0.0 : dampers[0].damping, c, kEps);
  }
  // a motor does not inherit the range of the joint
  EXPECT_EQ(Efforts("<default><position inheritrange='1'/></default>",
                    "<motor joint='j' ctrlrange='-1 1'/>", "3", "range='-90 90'"),
            Values{1});
}

}  // namespace loopbench::harness::import_mjcf_actuators_test
