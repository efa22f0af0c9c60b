// MJCF as a whole: classes of defaults, what is dropped, what is refused.
#include "tests/harness/import_texts.h"

namespace loopbench::harness::import_mjcf_test {

using namespace import_mjcf_texts;

TEST(ImportMjcf, ClassesOfDefaultsAreNestedAndInherited) {
  const Imported imported = ImportOf(TestData("classes.xml"));
  const auto dampers = ForcesOf<JointDamper>(imported);
  const auto springs = ForcesOf<JointSpring>(imported);
  ASSERT_EQ(dampers.size(), 3u);
  EXPECT_EQ(dampers[0].damping, 1.0);
  EXPECT_EQ(dampers[1].damping, 1.0);
  EXPECT_EQ(dampers[2].damping, 3.0);
  ASSERT_EQ(springs.size(), 2u);
  EXPECT_EQ(springs[0].stiffness, 5.0);
  EXPECT_EQ(springs[1].stiffness, 7.0);
}

TEST(ImportMjcf, PlanarMechanismsHaveGravityAlongMinusY) {
  const ImportOptions options{.planar = true};
  const Imported imported = ImportOf(TestData("planar.xml"), options);
  const MechanismDescription& planar = imported.description;
  EXPECT_EQ(planar.space, SpaceKind::kPlanar);
  ExpectNear(planar.gravity, {0, -9.81, 0}, 1e-14);
  // z is the ground's y, y its z, and so x its -x
  const Eigen::Vector3d& w = planar.bodies[kGround].points.at("w");
  ExpectNear(w, {-1, 0.5, 0}, 10 * kEps);
  EXPECT_LE((ForcesOf<SpringDamper>(imported)[0].from.at - w).norm(), 10 * kEps);
  EXPECT_EQ(planar.joints.back().type, JointType::kRevolute);
  EXPECT_TRUE(planar.joints.back().cut);
  EXPECT_EQ(planar.initial.coordinates[0].values[0], 0.5);
  // a joint about the other way turns as seen from the other body
  EXPECT_EQ(planar.initial.coordinates[1].values[0], -0.5);
  EXPECT_EQ(planar.joints[1].to.body, kGround);
}

TEST(ImportMjcf, EveryKindOfDroppedElementHasItsNote) {
  const Imported imported = ImportOf(TestData("dropped-elements.xml"));
  ExpectNote(imported, "<option> timestep", "their own steps");
  ExpectNote(imported, "<option> density", "no medium");
  ExpectNote(imported, "<option> integrator", "their own integrator");
  ExpectNote(imported, "<asset>", "only masses of meshes");
  ExpectNote(imported, "<geom name='floor'>", "no contact");
  ExpectNote(imported, "<body name='b'> mocap", "stays where");
  ExpectNote(imported, "<body name='b'> strange", "not known");
  ExpectNote(imported, "<joint name='l'> armature", "rotors");
  EXPECT_EQ(imported.description.joints[0].rotor_inertia, 0.1);
  ExpectNote(imported, "<joint name='j'> frictionloss", "dry friction");
  ExpectNote(imported, "<joint name='j'> range", "without ends");
  ExpectNote(imported, "<joint name='j'> springdamper", "by frequency");
  ExpectNote(imported, "<geom name='g'>", "only its mass");
  ExpectNote(imported, "<unknown>", "not known");
  ExpectNote(imported, "<joint name='l'> damping", "one coordinate");
  ExpectNote(imported, "<joint name='l'> stiffness", "one coordinate");
  ExpectNote(imported, "<contact>", "no contact");
  ExpectNote(imported, "<sensor>", "no sensors");
  ExpectNote(imported, "<extension>", "no plugins");
  ExpectNote(imported, "<deformable>", "rigid");
  ExpectNote(imported, "<flex>", "no constraint of this kind");
  ExpectNote(imported, "<fixed name='f'> damping", "straight between two sites");
  ExpectNote(imported, "<general>", "control is 0");
  ExpectNote(imported, "<key name='later'>", "first <key>");
  ExpectNote(imported, "<surprise>", "not known");
  // in the order of the file, each with its line
  EXPECT_TRUE(std::ranges::is_sorted(imported.notes, {}, &ImportNote::line));
  EXPECT_EQ(imported.notes.front().line, 2);
}

TEST(ImportMjcf, DefaultsOfMeshesWithoutUseHaveNoNote) {
  const Imported imported = ImportOf(
      "<mujoco><default><mesh scale='0.1 0.1 0.1'/></default><asset><mesh "
      "file='m.stl'/></asset><worldbody><body><joint/>" +
      std::string(kInertial) + "<geom type='mesh' mesh='m'/></body></worldbody></mujoco>");
  EXPECT_FALSE(HasNote(imported, "<mesh>", ""));
}

TEST(ImportMjcf, DefaultsAtTheTopAreThoseOfAllWhateverTheirName) {
  // MuJoCo before 3.2; later ones refuse other names than main
  const auto forces = [](const std::string& defaults, const std::string& attributes = "") {
    return Read("<joint " + attributes + "/>", defaults).description.forces.size();
  };
  const std::string base = "<default class='base'><joint damping='3'/></default>";
  EXPECT_EQ(forces(base), 1u);
  EXPECT_EQ(forces(base, "class='base'"), 1u);
  EXPECT_EQ(forces(base, "class='main'"), 1u);
  EXPECT_EQ(forces("<default class='main'><joint damping='3'/></default>"), 1u);
  EXPECT_EQ(forces(base + "<default class='more'><joint stiffness='4'/></default>"), 2u);
  EXPECT_EQ(forces("<default class='base'><joint damping='3'/><default class='x'><joint "
                   "stiffness='4'/></default></default>",
                   "class='x'"),
            2u);
}

TEST(ImportMjcf, GravityInThePlaneIsAlongYToTheLastBit) {
  const ImportOptions options{.planar = true};
  for (const char* axis : {"0 1 0", "1 1 0", "0.3 0.7 0", "0.36 0.48 0.8", "-1 2 0", "0 0 1"}) {
    for (const char* turn : {"0 0 0", "10 20 30", "0 0 77"}) {
      const Imported imported = ImportOf(Model("<joint axis='" + std::string(axis) + "'/>", "", "",
                                               "euler='" + std::string(turn) + "'"),
                                         options);
      EXPECT_EQ(imported.description.gravity.x(), 0.0) << axis << " turned by " << turn;
      EXPECT_LE(imported.description.gravity.y(), 0.0);
    }
  }
}

TEST(ImportMjcf, PartsThatAreDisabledDoNotChangeTheMotion) {
  const auto flagged = [](const std::string& option) {
    const Imported imported =
        Two(option +
            "<default><joint range='-1 1' frictionloss='1' springdamper='1 "
            "1'/></default><tendon><fixed stiffness='3' damping='1' frictionloss='2' range='0 "
            "1'><joint joint='j' coef='1'/></fixed></tendon>");
    std::set<std::string> parts;
    for (const ImportNote& note : imported.notes) {
      if (note.changes_motion) parts.insert(note.element.substr(note.element.rfind(' ') + 1));
    }
    return parts;
  };
  const auto flag = [](const std::string& name) {
    return "<option density='1'><flag " + name + "='disable'/></option>";
  };
  using Parts = std::set<std::string>;
  const Parts passive = {"density", "springdamper", "stiffness", "damping"};
  Parts all = passive;
  all.insert({"range", "frictionloss"});
  EXPECT_EQ(flagged(flag("contact")), all);
  EXPECT_EQ(flagged(flag("constraint")), passive);
  EXPECT_EQ(flagged(flag("passive")), (Parts{"range", "frictionloss"}));
  for (const char* name : {"limit", "frictionloss", "spring", "damper"}) {
    const std::string key = name;
    Parts left = all;
    left.erase(key == "limit"    ? "range"
               : key == "spring" ? "stiffness"
               : key == "damper" ? "damping"
                                 : key);
    EXPECT_EQ(flagged(flag(name)), left) << name;
  }
  // wind needs a medium
  all.erase("density");
  EXPECT_EQ(flagged("<option wind='1 0 0'/>"), all);
  all.insert({"viscosity", "wind"});
  EXPECT_EQ(flagged("<option wind='1 0 0' viscosity='1'/>"), all);
}

}  // namespace loopbench::harness::import_mjcf_test
