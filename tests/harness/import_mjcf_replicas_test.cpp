// <replicate> of MJCF: copies in place, their names, and the elements that refer to them.
#include "harness/config/mechanism_reader.h"
#include "tests/harness/import_texts.h"

namespace loopbench::harness::import_mjcf_replicas_test {

const std::string kMass = "<inertial pos='0 0 0' mass='2' diaginertia='1 1 1'/>";

std::string Mujoco(const std::string& world, const std::string& rest = "") {
  return "<mujoco>\n<worldbody>" + world + "</worldbody>\n" + rest + "</mujoco>";
}

Imported Read(const std::string& world, const std::string& rest = "") {
  return ImportOf(Mujoco(world, rest));
}

std::string Written(const Imported& imported) {
  return MechanismText(imported.description, imported.observe);
}

std::string Body(const std::string& name, const std::string& inside,
                 const std::string& attributes = "") {
  return "<body name='" + name + "' " + attributes + ">" + kMass + inside + "</body>";
}

/// The pose in the ground of a body with a joint to it.
Frame PoseOfBody(const Imported& imported, const std::string& name) {
  for (const JointDescription& joint : imported.description.joints) {
    if (imported.description.bodies[joint.to.body].name != name) continue;
    return PoseOf(joint.from) * PoseOf(joint.to).Inverse();
  }
  ADD_FAILURE() << "no " << name;
  return {};
}

TEST(ImportMjcfReplicas, CopiesStandWhereMuJoCoPutsThem) {
  // the example of MuJoCo's XML reference, with bodies for geoms
  const Imported imported = Read(
      "<replicate count='2' offset='0 1 0' euler='90 0 0'><replicate count='2' sep='-' offset='1 0 "
      "0' euler='0 90 0'>" +
      Body("Alice", "<joint/>") + "</replicate></replicate>");
  const double h = std::sqrt(0.5);
  const std::vector<std::tuple<std::string, Eigen::Vector3d, Eigen::Quaterniond>> expected = {
      {"Alice-00", {0, 0, 0}, {1, 0, 0, 0}},
      {"Alice-10", {1, 0, 0}, {h, 0, h, 0}},
      {"Alice-01", {0, 1, 0}, {h, h, 0, 0}},
      {"Alice-11", {1, 1, 0}, {0.5, 0.5, 0.5, 0.5}}};
  ASSERT_EQ(imported.description.bodies.size(), 5u);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const auto& [name, p, q] = expected[i];
    EXPECT_EQ(imported.description.bodies[i + 1].name, name);  // the order of MuJoCo
    const Frame X = PoseOfBody(imported, name);
    EXPECT_LE((X.p - p).norm(), 1e-15) << name;
    EXPECT_LE((X.R - q.toRotationMatrix()).norm(), 1e-15) << name;
  }
}

TEST(ImportMjcfReplicas, OffsetsAreInAxesOfThePreviousCopy) {
  // MuJoCo's test ParseReplicate
  const Imported imported = Read("<replicate count='101' offset='3 0 .1' euler='0 0 1.8'>" +
                                 Body("b", "<joint/>", "pos='0 -1 0'") + "</replicate>");
  EXPECT_EQ(imported.description.bodies[1].name, "b000");
  double x = 0.0, y = 0.0;
  for (int i = 0; i <= 100; ++i) {
    const double theta = 1.8 * i * std::numbers::pi / 180.0;
    const Frame X =
        PoseOfBody(imported, imported.description.bodies[static_cast<std::size_t>(i) + 1].name);
    // a sum of 100 shifts of 3 m
    ExpectNear(X.p, {x + std::sin(theta), y - std::cos(theta), 0.1 * i}, 1e-13 * (1 + i));
    x += 3.0 * std::cos(theta);
    y += 3.0 * std::sin(theta);
  }
}

TEST(ImportMjcfReplicas, SuffixesHaveTheDigitsOfTheCount) {
  const auto last = [](const std::string& attributes) {
    return Read("<replicate " + attributes + ">" + Body("b", "<joint/>") + "</replicate>")
        .description.bodies.back()
        .name;
  };
  EXPECT_EQ(last("count='1'"), "b0");
  EXPECT_EQ(last("count='9'"), "b8");
  EXPECT_EQ(last("count='10' sep='_'"), "b_09");
  EXPECT_EQ(last("count='12' sep=''"), "b11");
}

TEST(ImportMjcfReplicas, ReferencesAreCopiedToo) {
  // names outside of <replicate> stay
  const std::string body = Body("arm", "<joint name='j'/><site name='s'/>" +
                                           Body("hand", "<joint name='k'/>", "pos='1 0 0'"));
  const auto rest = [](const std::vector<std::string>& suffixes) {
    const auto all = [&](const char* part) {
      return Joined(suffixes, "",
                    [&](const auto& i) { return fmt::format(fmt::runtime(part), i); });
    };
    return "<equality>" + all("<joint name='e{0}' joint1='j{0}' joint2='k{0}' polycoef='0 2'/>") +
           all("<connect name='c{0}' body1='hand{0}' body2='base' anchor='0 0 0'/>") +
           "</equality><tendon>" +
           all("<spatial stiffness='3' springlength='1'><site site='s{0}'/><site site='wall'/>"
               "</spatial>") +
           "</tendon><actuator>" + all("<damper joint='k{0}' kv='2' ctrlrange='0 1'/>") +
           "</actuator>";
  };
  const std::string base = "<site name='wall' pos='0 0 9'/>" + Body("base", "<joint name='b'/>");
  const Imported replicated =
      Read(base + "<replicate count='2' offset='0 0 1'>" + body + "</replicate>", rest({""}));
  std::string all;
  for (const std::string i : {"0", "1"}) {
    all += Body("arm" + i,
                "<joint name='j" + i + "'/><site name='s" + i + "'/>" +
                    Body("hand" + i, "<joint name='k" + i + "'/>", "pos='1 0 0'"),
                i == "0" ? "" : "pos='0 0 1'");
  }
  EXPECT_EQ(Written(replicated), Written(Read(base + all, rest({"0", "1"}))));
  EXPECT_EQ(replicated.description.couplings.size(), 2u);
}

TEST(ImportMjcfReplicas, ReferencesIntoNestedReplicatesFollowBoth) {
  const Imported imported =
      Read("<replicate count='2' sep='o' offset='5 0 0'>" + Body("a", "<joint name='j'/>") +
               "<replicate count='3' sep='i' offset='0 1 0'>" + Body("b", "<joint name='k'/>") +
               "</replicate></replicate>",
           "<equality><joint joint1='k' joint2='j' name='e'/></equality>");
  ASSERT_EQ(imported.description.couplings.size(), 6u);
  const auto& joints = imported.description.joints;
  for (const CouplingDescription& coupling : imported.description.couplings) {
    const std::string inner = joints[coupling.parts[0].joint].name;
    EXPECT_EQ(joints[coupling.parts[1].joint].name, "j" + inner.substr(inner.find('o')));
    EXPECT_EQ(coupling.name, "e" + inner.substr(1));
  }
}

TEST(ImportMjcfReplicas, NotesCountOnce) {
  const Imported imported =
      Read("<replicate count='20' offset='1 0 0'>" +
               Body("b", "<joint frictionloss='1'/>\n<geom size='1'/>") + "</replicate>",
           "<keyframe><key qpos='1'/></keyframe>");
  EXPECT_EQ(imported.notes.size(), 3u);
  ExpectNote(imported, "<key>", "one replica");
}

}  // namespace loopbench::harness::import_mjcf_replicas_test
