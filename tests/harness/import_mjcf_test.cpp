// MJCF as a whole: classes of defaults, what is dropped, what is refused.
#include <gtest/gtest.h>

#include <set>

#include "tests/harness/import_texts.h"

namespace loopbench::harness {
namespace import_mjcf_test {

using namespace import_mjcf_texts;

TEST(ImportMjcf, ClassesOfDefaultsAreNestedAndInherited) {
  const Imported imported = ImportOf(R"(<mujoco>
    <default>
      <joint damping="1"/>
      <default class="stiff"><joint stiffness="5"/>
        <default class="stiffest"><joint damping="3"/></default>
      </default>
    </default>
    <worldbody>
      <body name="a"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><joint name="plain"/></body>
      <body name="b" childclass="stiff"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
        <joint name="child"/>
        <body name="c"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
          <joint name="own" class="stiffest" stiffness="7"/></body>
      </body>
    </worldbody></mujoco>)");
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
  const Imported imported = ImportOf(R"(<mujoco><worldbody>
      <site name="w" pos="1 0 0.5"/>
      <body name="b" pos="0 0.25 0"><joint name="j" axis="0 1 0" stiffness="1" springref="30"/>
        <geom size="0.1" pos="0 0 1"/><site name="s" pos="0 -0.25 1"/></body>
      <body name="c" pos="2 0 0"><joint name="k" axis="0 -1 0"/><geom size="0.1" pos="0 0 1"/></body>
    </worldbody>
    <equality><connect body1="b" body2="c" anchor="0 0 1"/></equality>
    <tendon><spatial stiffness="2"><site site="w"/><site site="s"/></spatial></tendon>
    <keyframe><key qpos="0.5 -0.5"/></keyframe></mujoco>)",
                                     options);
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
  const Imported imported = ImportOf(R"(<mujoco>
  <option timestep="0.1" density="1.2" integrator="RK4"/>
  <asset><mesh name="m" file="m.stl"/></asset>
  <default><joint frictionloss="0.2"/></default>
  <worldbody>
    <light pos="0 0 1"/>
    <geom name="floor" type="plane" size="1 1 1"/>
    <body name="b" mocap="true" strange="1">
      <joint name="j" armature="0.1" range="-1 1" springdamper="1 1"/>
      <geom name="g" size="0.1"/>
      <camera name="c"/>
      <unknown/>
    </body>
    <body name="w"><joint name="l" type="ball" damping="1" stiffness="1" armature="0.2"/><geom size="0.1"/></body>
  </worldbody>
  <contact><exclude body1="b" body2="w"/></contact>
  <sensor><gyro site="s"/></sensor>
  <extension><plugin plugin="p"/></extension>
  <deformable/>
  <equality><flex flex="f"/></equality>
  <tendon><fixed name="f" damping="1"><joint joint="l" coef="1"/></fixed></tendon>
  <actuator><general joint="j"/></actuator>
  <keyframe><key/><key name="later"/></keyframe>
  <surprise/>
</mujoco>)");
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

TEST(ImportMjcf, WhatCannotBeSaidIsRefusedWithItsLine) {
  ExpectRefusal("<mujoco>\n<include file='x.xml'/>\n<worldbody/></mujoco>",
                {"file.xml:2: <include>", "the whole model in one file"});
  ExpectRefusal("<mujoco>\n<compiler coordinate='global'/><worldbody/></mujoco>",
                {"file.xml:2: <compiler> coordinate: found 'global'", "local"});
  ExpectRefusal("<mujoco/>", {"file.xml:1: <mujoco>: found no <worldbody>"});
  ExpectRefusal("<mujoco><worldbody/></mujoco>", {"found no body"});
  ExpectRefusal("<mujoco><worldbody><body name='b'><joint/></body></worldbody></mujoco>",
                {"<body name='b'>: found a body without mass that moves"});
  ExpectRefusal(Model("<joint axis='0 0 0'/>"), {"<joint> axis", "not zero"});
  ExpectRefusal(Model("<joint type='screw'/>"), {"hinge, slide, ball, free"});
  ExpectRefusal(Model("<joint class='none'/>"), {"'none'", "described in <default>"});
  ExpectRefusal(Model("<joint name='j'/><joint name='j' axis='1 0 0'/>"), {"second joint"});
  ExpectRefusal(Model("<joint/>", "", "<equality><connect body1='x' anchor='0 0 0'/></equality>"),
                {"<connect> body1: found 'x'", "name of a body"});
  ExpectRefusal(Model("<joint/>", "", "<keyframe><key qpos='1 2'/></keyframe>"),
                {"<key> qpos", "1 number"});
  ExpectRefusal(
      "<mujoco><worldbody><body><joint/><geom type='mesh' mesh='m'/></body></worldbody></mujoco>",
      {"mesh: found 'm'", "the name of a mesh"});
  for (const char* number : {"nan", "inf", "1e999", "1,0", "0x10", "1e", "", "1 2"}) {
    ExpectRefusal(Model("<joint damping='" + std::string(number) + "'/>"), {"damping: found"});
  }
  ExpectRefusal(Model("<joint damping='-1'/>"), {"a number >= 0"});
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
  ExpectRefusal(Model("<joint/>", "<default class='base'>\n<default class='base'/></default>"),
                {"file.xml:2: <default> class: found 'base'", "not described yet"});
  ExpectRefusal(
      Model("<joint/>", "<default><default class='base'/></default>\n<default class='base'/>"),
      {"file.xml:2: <default> class: found 'base'", "not described yet"});
}

TEST(ImportMjcf, OtherFilesAreRefusedWhereverTheyAreIncluded) {
  const std::string include = "\n<include file='x.xml'/>";
  const auto refused = [](const std::string& before, const std::string& after = "") {
    ExpectRefusal(Model("<joint/>", before, after),
                  {"file.xml:2: <include>", "the whole model in one file"});
  };
  refused("<compiler>" + include + "</compiler>");
  refused("<option>" + include + "</option>");
  refused("<option><flag>" + include + "</flag></option>");
  refused("<default>" + include + "</default>");
  refused("<default><default class='x'><joint>" + include + "</joint></default></default>");
  for (const char* tag : {"equality", "tendon", "actuator", "keyframe", "worldbody"}) {
    refused("", "<" + std::string(tag) + ">" + include + "</" + tag + ">");
  }
  refused("", "<tendon><spatial>" + include + "</spatial></tendon>");
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

}  // namespace import_mjcf_test
}  // namespace loopbench::harness
