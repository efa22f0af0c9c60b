// The start of MJCF: keys.
#include <gtest/gtest.h>

#include <numbers>

#include "tests/harness/import_mjcf_texts.h"

namespace loopbench::harness {
namespace import_mjcf_start_test {

using namespace import_mjcf_texts;

constexpr double kPi = std::numbers::pi;

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
  const std::string x = "<joint type=\"slide\" axis=\"1 0 0\"/>",
                    y = "<joint type=\"slide\" axis=\"0 1 0\"/>",
                    z = "<joint type=\"slide\" axis=\"0 0 1\"/>", ball = "<joint type=\"ball\"/>";
  const auto shift = Start(x + y + z, "qpos=\"1 2 3\" qvel=\"4 5 6\"");
  EXPECT_EQ(shift.coordinates[0].values, (std::vector<double>{1, 2, 3}));
  EXPECT_EQ(shift.speeds[0].values, (std::vector<double>{4, 5, 6}));
  // slides after the hinge turn with it, the one before does not
  const auto scara = Start(x + "<joint axis=\"0 0 1\"/>" + y + z,
                           "qpos=\"5 1.5707963267948966 2 3\" qvel=\"0 1 0 4\"");
  const double scara_q[] = {kPi / 2, 3, 0, 3}, scara_u[] = {1, 0, -2, 4};
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(scara.coordinates[0].values[i], scara_q[i], 10 * kEps) << i;
    EXPECT_NEAR(scara.speeds[0].values[i], scara_u[i], 10 * kEps) << i;
  }
  // half a turn about z; angular velocity in body axes, and in axes of the joint
  const auto on_line = Start(x + ball, "qpos=\"2 0 0 0 1\" qvel=\"3 0 7 0\"");
  EXPECT_EQ(on_line.coordinates[0].values, (std::vector<double>{0, 0, 0, 1, 2}));
  EXPECT_EQ(on_line.speeds[0].values, (std::vector<double>{0, -7, 0, 3}));
  // the plane is on the body: seen from there, the parent turns and shifts the other way
  const auto in_plane = Start(ball + x + y, "qpos=\"0 0 0 1 2 4\" qvel=\"0 0 7 3 5\"");
  const double plane_q[] = {-2, -4}, plane_u[] = {0, 0, -7};
  EXPECT_EQ(std::abs(in_plane.coordinates[0].values[3]), 1.0);
  for (int i = 0; i < 2; ++i) EXPECT_EQ(in_plane.coordinates[0].values[4 + i], plane_q[i]);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(in_plane.speeds[0].values[i], plane_u[i]);
  EXPECT_EQ(in_plane.speeds[0].values[3], -3.0);
  EXPECT_EQ(in_plane.speeds[0].values[4], -5.0);
  const auto universal =
      Start("<joint axis=\"1 0 0\"/><joint axis=\"0 1 0\"/>", "qpos=\"0.5 0.25\" qvel=\"2 3\"");
  EXPECT_NEAR(universal.coordinates[0].values[1], 0.25, kEps);
  EXPECT_NEAR(universal.speeds[0].values[0], 2.0, 10 * kEps);
  EXPECT_NEAR(universal.speeds[0].values[1], 3.0, 10 * kEps);
}

/// MuJoCo's default of qpos is qpos0, the drawn position.
TEST(ImportMjcf, KeysOfSpeedsAloneStartWhereTheFileDrawsTheModel) {
  const auto same = [](const std::string& joints, const std::string& drawn,
                       const std::string& speeds, const std::string& attributes = "") {
    const auto start = [&](const std::string& key) {
      return Read(joints, "", "<keyframe><key " + key + "/></keyframe>", attributes)
          .description.initial;
    };
    const auto alone = start("qvel=\"" + speeds + "\""),
               both = start("qpos=\"" + drawn + "\" qvel=\"" + speeds + "\"");
    ASSERT_EQ(alone.coordinates.size(), 1u);
    ASSERT_EQ(alone.speeds.size(), 1u);
    EXPECT_EQ(alone.coordinates[0].values, both.coordinates[0].values) << joints;
    EXPECT_EQ(alone.speeds[0].values, both.speeds[0].values) << joints;
  };
  same("<joint type=\"slide\" ref=\"0.25\"/>", "0.25", "3");
  same("<joint type=\"ball\"/>", "1 0 0 0", "1 2 3");
  same("<freejoint/>", "1 2 3 0 1 0 0", "4 5 6 7 8 9", "pos=\"1 2 3\" quat=\"0 1 0 0\"");
  same("<joint axis=\"1 0 0\" ref=\"90\"/><joint axis=\"0 1 0\"/>", "1.5707963267948966 0", "2 3");
  const auto hinge = Start("<joint ref=\"0.25\"/>", "qvel=\"1.5\"");
  EXPECT_EQ(hinge.coordinates[0].values[0], 0.0);
  EXPECT_EQ(hinge.speeds[0].values[0], 1.5);
  ExpectRefusal(Model("<joint/>", "", "\n<keyframe><key qvel=\"1 2\"/></keyframe>"),
                {"file.xml:2: <key> qvel: found \"1 2\"", "1 number"});
  // an <equality> holds the joint: only the speed contradicts it
  const Imported held =
      Two("<equality><joint joint1=\"j\" polycoef=\"0.5 0 0 0 0\"/></equality>"
          "<keyframe><key qvel=\"3 4\"/></keyframe>");
  EXPECT_FALSE(HasNote(held, "<key> qpos", ""));
  ExpectNote(held, "<key> qvel", "\"j\" dropped");
}

TEST(ImportMjcf, JointsThatAnEqualityHoldsStartWhereItHoldsThem) {
  const std::string held = "<equality><joint joint1=\"j\" polycoef=\"0.5 0 0 0 0\"/></equality>";
  const Imported away = Two(held + "<keyframe><key qpos=\"1 2\" qvel=\"3 4\"/></keyframe>");
  ASSERT_EQ(away.description.initial.coordinates.size(), 1u);
  EXPECT_EQ(away.description.initial.coordinates[0].joint, 1);
  EXPECT_EQ(away.description.initial.coordinates[0].values[0], 2.0);
  ASSERT_EQ(away.description.initial.speeds.size(), 1u);
  EXPECT_EQ(away.description.initial.speeds[0].values[0], 4.0);
  ExpectNote(away, "<key> qpos", "\"j\" dropped: an <equality> holds it at 0.5");
  ExpectNote(away, "<key> qvel", "\"j\" dropped: an <equality> holds it at 0.5");
  const Imported there = Two(held + "<keyframe><key qpos=\"0.5 2\" qvel=\"0 4\"/></keyframe>");
  EXPECT_FALSE(HasNote(there, "<key>", ""));
}

TEST(ImportMjcf, KeysHaveAsManyNumbersAsTheModel) {
  const std::string motors =
      "\n<actuator><motor joint=\"j\"/><position joint=\"k\"/></actuator>\n<keyframe>";
  const std::string two = "<mujoco>" + std::string(kTwoBodies) + motors;
  const std::string end = "</keyframe></mujoco>";
  for (const char* ctrl : {"1", "1 2 3"}) {
    ExpectRefusal(two + "<key ctrl=\"" + ctrl + "\"/>" + end,
                  {"file.xml:9: <key> ctrl: found \"" + std::string(ctrl) + '"', "2 numbers"});
  }
  EXPECT_EQ(ForcesOf<JointTorque>(ImportText(two + "<key ctrl=\"1 2\"/>" + end, "f.xml")).size(),
            1u);
  ExpectRefusal(two + "<key qpos=\"1\"/>" + end, {"file.xml:9: <key> qpos: found \"1\"", "2 numb"});
  for (const char* joint : {"<freejoint/>", "<joint type=\"ball\"/>"}) {
    const std::string zeros = joint[1] == 'f' ? "0 0 0 0 0 0 0" : "0 0 0 0";
    ExpectRefusal(Model(joint, "", "\n<keyframe><key qpos=\"" + zeros + "\"/></keyframe>"),
                  {"file.xml:2: <key> qpos: found \"" + zeros, "quaternion", "not zero"});
  }
}

/// A free body whose inertial frame is at 1 0 0, with z along x of the body.
Imported Aligned(const std::string& before, const std::string& joint, const std::string& inertia,
                 const std::string& after) {
  return ImportText("<mujoco>" + before + "<worldbody><body name=\"b\">" + joint +
                        "<inertial pos=\"1 0 0\" mass=\"1\" " + inertia + "/></body></worldbody>" +
                        after + "</mujoco>",
                    "file.xml");
}

TEST(ImportMjcf, KeysOfAlignedBodiesAreOfTheirInertialFrames) {
  const std::string align = "<freejoint align=\"true\"/>",
                    compiler = "<compiler alignfree=\"true\"/>",
                    axes = "zaxis=\"1 0 0\" diaginertia=\"1 1 1\"",
                    full = "fullinertia=\"1 1 1 0.1 0 0\"",
                    key = "<keyframe><key qpos=\"0 0 2 1 0 0 0\" qvel=\"1 2 3 0 0 4\"/></keyframe>";
  for (const Imported& imported :
       {Aligned("", align, axes, key), Aligned(compiler, "<freejoint/>", axes, key),
        Aligned(compiler, "<joint type=\"free\"/>", axes, key)}) {
    const auto& initial = imported.description.initial;
    const std::vector<double>&q = initial.coordinates[0].values, &u = initial.speeds[0].values;
    const Eigen::Quaterniond R(q[0], q[1], q[2], q[3]);
    const Eigen::Vector3d centre = R * Eigen::Vector3d::UnitX(), w(u[0], u[1], u[2]);
    EXPECT_LE((centre - Eigen::Vector3d::UnitZ()).norm(), 10 * kEps);
    EXPECT_LE((Eigen::Vector3d(q[4], q[5], q[6]) + centre - Eigen::Vector3d(0, 0, 2)).norm(),
              10 * kEps);
    EXPECT_LE((w - Eigen::Vector3d(0, 0, 4)).norm(), 10 * kEps);
    EXPECT_LE(
        (Eigen::Vector3d(u[3], u[4], u[5]) + w.cross(centre) - Eigen::Vector3d(1, 2, 3)).norm(),
        10 * kEps);
    EXPECT_FALSE(HasNote(imported, "<key", "principal axes"));
  }
  const Imported off = Aligned(compiler, "<freejoint align=\"false\"/>", axes, key);
  EXPECT_EQ(off.description.initial.coordinates[0].values,
            (std::vector<double>{1, 0, 0, 0, 0, 0, 2}));
  // the velocity of the centre of mass needs no axes
  ExpectNote(Aligned("", align, full, key), "<key", "principal axes");
  const Imported moved =
      Aligned("", align, full, "<keyframe><key qvel=\"1 2 3 0 0 0\"/></keyframe>");
  EXPECT_EQ(moved.description.initial.speeds[0].values, (std::vector<double>{0, 0, 0, 1, 2, 3}));
  EXPECT_FALSE(HasNote(moved, "<key", "principal axes"));
  // anchors are in MuJoCo's frame of the body too
  const std::string connect = "<equality><connect body1=\"b\" anchor=\"0 0 1\"/></equality>";
  const Imported anchored = Aligned("", align, axes, connect);
  EXPECT_LE((anchored.description.joints.back().from.position - Eigen::Vector3d(2, 0, 0)).norm(),
            10 * kEps);
  ExpectNote(Aligned("", align, full, connect), "<connect>", "principal axes");
}

}  // namespace import_mjcf_start_test
}  // namespace loopbench::harness
