// The start of MJCF: keys.
#include "tests/harness/import_texts.h"

namespace loopbench::harness::import_mjcf_start_test {

using namespace import_mjcf_texts;

/// The start that a key gives to the joints of one body.
InitialDescription Start(const std::string& joints, const std::string& key) {
  return Read(joints, "<compiler angle='radian'/>", "<keyframe><key " + key + "/></keyframe>")
      .description.initial;
}

TEST(ImportMjcf, KeysBecomeTheStartOfJointsOfOurs) {
  const auto hinge = Start("<joint ref='0.25'/>", "qpos='1' qvel='3'");
  EXPECT_EQ(hinge.coordinates[0].values[0], 0.75);
  EXPECT_EQ(hinge.speeds[0].values[0], 3.0);
  const auto free = Start("<freejoint/>", "qpos='1 2 3 0 1 0 0' qvel='4 5 6 0 7 0'");
  EXPECT_EQ(free.coordinates[0].values, (std::vector<double>{0, 1, 0, 0, 1, 2, 3}));
  // half a turn about x: the body's y is the ground's -y
  EXPECT_EQ(free.speeds[0].values, (std::vector<double>{0, -7, 0, 4, 5, 6}));
}

/// MuJoCo's default of qpos is qpos0, the drawn position.
TEST(ImportMjcf, KeysOfSpeedsAloneStartWhereTheFileDrawsTheModel) {
  const auto same = [](const std::string& joints, const std::string& drawn,
                       const std::string& speeds, const std::string& attributes = "") {
    const auto start = [&](const std::string& key) {
      return Read(joints, "", "<keyframe><key " + key + "/></keyframe>", attributes)
          .description.initial;
    };
    const auto alone = start("qvel='" + speeds + "'"),
               both = start("qpos='" + drawn + "' qvel='" + speeds + "'");
    ASSERT_EQ(alone.coordinates.size(), 1u);
    ASSERT_EQ(alone.speeds.size(), 1u);
    EXPECT_EQ(alone.coordinates[0].values, both.coordinates[0].values) << joints;
    EXPECT_EQ(alone.speeds[0].values, both.speeds[0].values) << joints;
  };
  same("<joint type='slide' ref='0.25'/>", "0.25", "3");
  same("<joint type='ball'/>", "1 0 0 0", "1 2 3");
  same("<freejoint/>", "1 2 3 0 1 0 0", "4 5 6 7 8 9", "pos='1 2 3' quat='0 1 0 0'");
  same("<joint axis='1 0 0' ref='90'/><joint axis='0 1 0'/>", "1.5707963267948966 0", "2 3");
  const auto hinge = Start("<joint ref='0.25'/>", "qvel='1.5'");
  EXPECT_EQ(hinge.coordinates[0].values[0], 0.0);
  EXPECT_EQ(hinge.speeds[0].values[0], 1.5);
  // an <equality> holds the joint: only the speed contradicts it
  const Imported held =
      Two("<equality><joint joint1='j' polycoef='0.5 0 0 0 0'/></equality><keyframe><key qvel='3 "
          "4'/></keyframe>");
  EXPECT_FALSE(HasNote(held, "<key> qpos", ""));
  ExpectNote(held, "<key> qvel", "'j' dropped");
}

TEST(ImportMjcf, JointsThatAnEqualityHoldsStartWhereItHoldsThem) {
  const std::string held = "<equality><joint joint1='j' polycoef='0.5 0 0 0 0'/></equality>";
  const Imported away = Two(held + "<keyframe><key qpos='1 2' qvel='3 4'/></keyframe>");
  ASSERT_EQ(away.description.initial.coordinates.size(), 1u);
  EXPECT_EQ(away.description.initial.coordinates[0].joint, 1);
  EXPECT_EQ(away.description.initial.coordinates[0].values[0], 2.0);
  ASSERT_EQ(away.description.initial.speeds.size(), 1u);
  EXPECT_EQ(away.description.initial.speeds[0].values[0], 4.0);
  ExpectNote(away, "<key> qpos", "'j' dropped: an <equality> holds it at 0.5");
  ExpectNote(away, "<key> qvel", "'j' dropped: an <equality> holds it at 0.5");
  const Imported there = Two(held + "<keyframe><key qpos='0.5 2' qvel='0 4'/></keyframe>");
  EXPECT_FALSE(HasNote(there, "<key>", ""));
}

TEST(ImportMjcf, KeysGiveTheControlsOfActuators) {
  const Imported imported =
      Two("<actuator><motor joint='j'/><position joint='k'/></actuator>"
          "<keyframe><key ctrl='1 2'/></keyframe>");
  EXPECT_EQ(ForcesOf<JointTorque>(imported).size(), 1u);
}

/// A free body whose inertial frame is at 1 0 0, with z along x of the body.
Imported Aligned(const std::string& before, const std::string& joint, const std::string& inertia,
                 const std::string& after) {
  return ImportOf("<mujoco>" + before + "<worldbody><body name='b'>" + joint +
                  "<inertial pos='1 0 0' mass='1' " + inertia + "/></body></worldbody>" + after +
                  "</mujoco>");
}

TEST(ImportMjcf, KeysOfAlignedBodiesAreOfTheirInertialFrames) {
  const std::string align = "<freejoint align='true'/>", compiler = "<compiler alignfree='true'/>",
                    axes = "zaxis='1 0 0' diaginertia='1 1 1'",
                    full = "fullinertia='1 1 1 0.1 0 0'",
                    key = "<keyframe><key qpos='0 0 2 1 0 0 0' qvel='1 2 3 0 0 4'/></keyframe>";
  for (const Imported& imported :
       {Aligned("", align, axes, key), Aligned(compiler, "<freejoint/>", axes, key),
        Aligned(compiler, "<joint type='free'/>", axes, key)}) {
    const auto& initial = imported.description.initial;
    const std::vector<double>&q = initial.coordinates[0].values, &u = initial.speeds[0].values;
    const Eigen::Quaterniond R(q[0], q[1], q[2], q[3]);
    const Eigen::Vector3d centre = R * Eigen::Vector3d::UnitX(), w(u[0], u[1], u[2]);
    ExpectNear(centre, Eigen::Vector3d::UnitZ(), 10 * kEps);
    ExpectNear(Eigen::Vector3d(q[4], q[5], q[6]) + centre, {0, 0, 2}, 10 * kEps);
    ExpectNear(w, {0, 0, 4}, 10 * kEps);
    EXPECT_LE(
        (Eigen::Vector3d(u[3], u[4], u[5]) + w.cross(centre) - Eigen::Vector3d(1, 2, 3)).norm(),
        10 * kEps);
    EXPECT_FALSE(HasNote(imported, "<key", "principal axes"));
  }
  const Imported off = Aligned(compiler, "<freejoint align='false'/>", axes, key);
  EXPECT_EQ(off.description.initial.coordinates[0].values,
            (std::vector<double>{1, 0, 0, 0, 0, 0, 2}));
  // the velocity of the centre of mass needs no axes
  ExpectNote(Aligned("", align, full, key), "<key", "principal axes");
  const Imported moved = Aligned("", align, full, "<keyframe><key qvel='1 2 3 0 0 0'/></keyframe>");
  EXPECT_EQ(moved.description.initial.speeds[0].values, (std::vector<double>{0, 0, 0, 1, 2, 3}));
  EXPECT_FALSE(HasNote(moved, "<key", "principal axes"));
  // anchors are in MuJoCo's frame of the body too
  const std::string connect = "<equality><connect body1='b' anchor='0 0 1'/></equality>";
  const Imported anchored = Aligned("", align, axes, connect);
  ExpectNear(anchored.description.joints.back().from.position, {2, 0, 0}, 10 * kEps);
  ExpectNote(Aligned("", align, full, connect), "<connect>", "principal axes");
}

}  // namespace loopbench::harness::import_mjcf_start_test
