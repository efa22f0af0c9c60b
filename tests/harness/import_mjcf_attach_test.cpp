// <attach> of MJCF: models of other files, and copies of bodies, with prefixed names.
#include "harness/config/mechanism_reader.h"
#include "tests/harness/import_texts.h"

namespace loopbench::harness::import_mjcf_attach_test {

using ImportMjcfAttach = ModelFolder;

std::string TextOf(const Imported& imported) {
  return MechanismText(imported.description, imported.observe);
}

const std::string kMass = R"(<inertial pos="0 0 0.1" mass="2" diaginertia="1 1 1"/>)";

/// A base with a hinge and a tip with a hinge of another class; a spring of the tip's hinge to the
/// base, a motor, and a constraint; `p` precedes all names, `class_of` is the text of a class.
std::string Arm(const std::string& p, const std::string& class_of_hinge,
                const std::string& class_of_soft) {
  return fmt::format(
      R"(<body name="{0}base" pos="0 0 1">{1}<joint name="{0}j" {2}/><site name="{0}s" pos="0 0 0.5"/>
           <body name="{0}tip" pos="0 0 0.5">{1}<joint name="{0}k" {3}/><site name="{0}e" pos="0.2 0 0"/></body>
         </body>)",
      p, kMass, class_of_hinge, class_of_soft);
}
std::string ArmParts(const std::string& p) {
  return fmt::format(
      R"(<tendon><spatial name="{0}t" stiffness="30" springlength="0.1"><site site="{0}s"/><site site="{0}e"/></spatial></tendon>
         <actuator><motor name="{0}m" joint="{0}k" gear="3"/></actuator>
         <equality><joint joint1="{0}j" joint2="{0}k" polycoef="0 2 0 0 0"/></equality>
         <keyframe><key ctrl="1"/></keyframe>)",
      p);
}
const std::string kDefaults = R"(<default class="arm"><joint axis="0 1 0" damping="0.5"/>
  <default class="soft"><joint axis="1 0 0" stiffness="7"/></default></default>)";

TEST_F(ImportMjcfAttach, IsTheSameAsTheModelWrittenOut) {
  Write("parts/arm.xml", "<mujoco model='arm'><compiler angle='radian'/>" + kDefaults +
                             "<worldbody>" + Arm("", "", "class='soft'") + "</worldbody>" +
                             ArmParts("") + "</mujoco>");
  // a class of the main model must not reach the arms, which have their own
  const std::string before =
      "<compiler angle='radian'/><default><joint axis='0 0 1' damping='9'/></default>";
  const auto main = [&](const std::string& left, const std::string& right,
                        const std::string& rest) {
    return "<mujoco model='m'>" + before + "<worldbody><body name='cart'>" + kMass +
           "<joint name='c'/><frame pos='1 0 0'>" + left +
           "</frame></body><body name='post' pos='0 3 0' euler='0 0 1'>" + right +
           "</body></worldbody>" + rest + "</mujoco>";
  };
  Write("main.xml",
        main("<attach model='arm' body='base' prefix='l_'/>", "<attach model='arm' prefix='r_'/>",
             "<asset><model name='arm' file='parts/arm.xml'/></asset>"));
  const std::string hinge = "axis='0 1 0' damping='0.5'",
                    soft = "axis='1 0 0' damping='0.5' stiffness='7'";
  const auto parts = [](const std::string& p) {
    std::string text = ArmParts(p);
    return text.substr(0, text.find("<keyframe>"));
  };
  const std::string whole =
      main(Arm("l_", hinge, soft), Arm("r_", hinge, soft), parts("l_") + parts("r_"));
  EXPECT_EQ(TextOf(Read()), TextOf(ImportOf(whole)));
  EXPECT_EQ(Read().description.bodies.size(), 6u);  // the ground and the post are one
}

TEST_F(ImportMjcfAttach, ModelsAttachModels) {
  Write("parts/tip.xml", "<mujoco><worldbody><body name='tip'>" + kMass +
                             "<joint name='j'/></body></worldbody></mujoco>");
  Write("parts/arm.xml",
        "<mujoco><asset><model name='tip' file='tip.xml'/></asset><worldbody><body name='arm'>" +
            kMass +
            "<joint name='j'/><attach model='tip' prefix='t_'/></body></worldbody></mujoco>");
  Write("main.xml",
        "<mujoco><asset><model name='arm' file='parts/arm.xml'/></asset><worldbody><attach "
        "model='arm' body='world' prefix='a_'/></worldbody></mujoco>");
  const Imported imported = Read();
  ASSERT_EQ(imported.description.joints.size(), 2u);
  EXPECT_EQ(imported.description.joints[0].name, "a_j");
  EXPECT_EQ(imported.description.joints[1].name, "a_t_j");
  EXPECT_EQ(imported.description.bodies[2].name, "a_t_tip");
  // a frame of the world, with what is in it
  Write("parts/tip.xml",
        "<mujoco model='Tip'><worldbody><frame name='f' pos='0 0 2'><body name='tip'>" + kMass +
            "<joint name='j'/></body></frame><body name='other'/></worldbody></mujoco>");
  Write("main.xml",
        "<mujoco><asset><model file='parts/tip.xml'/></asset><worldbody><attach model='Tip' "
        "frame='f'/></worldbody></mujoco>");
  ASSERT_EQ(Read().description.bodies.size(), 2u);
  EXPECT_EQ(Read().description.joints[0].from.position.z(), 2.0);
}

TEST_F(ImportMjcfAttach, PartsThatReferToTheRestOfAModelStayThere) {
  Write("arm.xml",
        "<mujoco><worldbody>" + Arm("", "", "") + "<body name='other'>" + kMass +
            "<joint name='o'/></body></worldbody><actuator><motor joint='o'/><motor "
            "joint='k'/></actuator><equality><joint joint1='o' joint2='j'/></equality></mujoco>");
  Write("main.xml",
        "<mujoco><asset><model name='arm' file='arm.xml'/></asset><worldbody><attach model='arm' "
        "body='tip' prefix='x'/></worldbody></mujoco>");
  const Imported imported = Read();
  ASSERT_EQ(imported.description.bodies.size(), 2u);
  EXPECT_EQ(imported.description.joints[0].name, "xk");
  EXPECT_TRUE(imported.description.couplings.empty());
}

TEST_F(ImportMjcfAttach, CopiesAreTheSameAsWrittenOut) {
  // classes apply as where the original is: soft by childclass, and arm, the main class
  const std::string arm = "class='arm'", soft = "class='soft'";
  const auto main = [&](const std::string& copy, const std::string& rest) {
    return "<mujoco model='m'><compiler angle='radian'/>" + kDefaults +
           "<worldbody><body name='post' childclass='soft'>" + kMass +
           "<joint name='p'/><frame pos='0 0 9'>" + Arm("", "", arm) +
           "</frame></body><body name='cart' pos='1 0 0'>" + kMass +
           "<joint name='c'/><frame pos='0 1 0'>" + copy + "</frame></body></worldbody>" + rest +
           "</mujoco>";
  };
  const auto parts = [](const std::string& p) {
    const std::string text = ArmParts(p);
    return text.substr(0, text.find("<keyframe>"));
  };
  // not copied: a reference to p; and to the world, as in MuJoCo
  const std::string others =
      "<equality><joint joint1='p' joint2='j'/><connect body1='tip' body2='world' anchor='0 0 "
      "0'/></equality>";
  Write("main.xml", main("<attach body='base' prefix='l_'/>", parts("") + others));
  const std::string whole = main(Arm("l_", soft, arm), parts("") + others + parts("l_"));
  EXPECT_EQ(TextOf(Read()), TextOf(ImportOf(whole)));
  const MechanismDescription read = Read().description;
  ASSERT_EQ(read.bodies.size(), 7u);
  EXPECT_EQ(read.bodies[6].name, "l_tip");
  EXPECT_EQ(read.bodies[6].mass, 2.0);
  EXPECT_EQ(read.couplings.size(), 3u);
}

TEST_F(ImportMjcfAttach, CopiesContainCopies) {
  const std::string hinge = kMass + "<joint name='j' frictionloss='1'/>";
  Write("main.xml", "<mujoco><worldbody>\n<frame name='f' pos='0 0 2'><body name='a'>" + hinge +
                        "</body></frame><body name='b'>" + kMass +
                        "<joint name='k'/><attach frame='f' prefix='x_'/></body>\n<attach body='b' "
                        "prefix='y_'/></worldbody></mujoco>");
  const Imported imported = Read();
  std::vector<std::string> names;
  for (const JointDescription& joint : imported.description.joints) names.push_back(joint.name);
  EXPECT_EQ(names, (std::vector<std::string>{"j", "k", "x_j", "y_k", "y_x_j"}));
  EXPECT_EQ(imported.description.bodies[5].name, "y_x_a");
  EXPECT_EQ(imported.description.joints[4].from.position.z(), 2.0);
  // at the line of the original
  EXPECT_TRUE(std::ranges::any_of(imported.notes, [](const ImportNote& note) {
    return note.element.find("y_x_j") != std::string::npos && note.line == 2;
  }));
}

TEST_F(ImportMjcfAttach, CopiesAreAttachedToo) {
  Write("arm.xml",
        "<mujoco><worldbody><body name='a'>" + kMass + "<joint name='j'/></body><body name='b'>" +
            kMass +
            "<joint name='k'/><attach body='a' prefix='x_'/></body></worldbody><actuator><damper "
            "joint='j' kv='2' ctrlrange='0 1'/></actuator></mujoco>");
  Write("main.xml",
        "<mujoco><asset><model name='arm' file='arm.xml'/></asset><worldbody><attach model='arm' "
        "body='b' prefix='m_'/></worldbody><keyframe><key ctrl='1'/></keyframe></mujoco>");
  const Imported imported = Read();
  ASSERT_EQ(imported.description.joints.size(), 2u);
  EXPECT_EQ(imported.description.joints[1].name, "m_x_j");
  const auto dampers = ForcesOf<JointDamper>(imported);
  ASSERT_EQ(dampers.size(), 1u);
  EXPECT_EQ(dampers[0].joint, 1);
  EXPECT_EQ(dampers[0].damping, 2.0);
}

TEST_F(ImportMjcfAttach, ManyModelsTakeTimeInProportion) {
  Write("arm.xml", "<mujoco model='arm'>" + kDefaults + "<worldbody>" +
                       Arm("", "", "class='soft'") + "</worldbody>" + ArmParts("") + "</mujoco>");
  const auto seconds = [&](int count) {
    std::string models;
    for (int i = 0; i < count; ++i) models += fmt::format("<attach model='arm' prefix='p{}_'/>", i);
    Write("main.xml", "<mujoco><asset><model name='arm' file='arm.xml'/></asset><worldbody>" +
                          models + "</worldbody></mujoco>");
    const std::clock_t begin = std::clock();
    EXPECT_EQ(Read().description.bodies.size(), 2u * static_cast<std::size_t>(count) + 1u);
    return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  };
  const double few = seconds(2000);
  EXPECT_LT(seconds(16000), 16.0 * few + 0.1);  // 8 times as many; quadratic work: 25 times as long
}

TEST_F(ImportMjcfAttach, FaultsOfCopiesAreNamed) {
  const auto world = [&](const std::string& text) {
    Write("main.xml", "<mujoco><worldbody>\n" + text + "</worldbody></mujoco>");
  };
  const std::string arm = Arm("", "", "");
  world(arm + "<attach body='no' prefix='p'/>");
  ExpectMessage({"<attach> body: found 'no'", "the name of a body before this <attach>"});
  world("<attach body='base' prefix='p'/>" + arm);
  ExpectMessage({"main.xml:2: <attach> body: found 'base'", "before this <attach>"});
  world(arm + "<attach body='base'/>");
  ExpectMessage({"<attach>: found no 'prefix'"});
  world(arm + "<attach body='base' prefix=''/>");
  ExpectMessage({"<attach> prefix: found ''", "there is a body base"});
  world(arm + "<body name='x'><site name='ps'/></body><attach body='base' prefix='p'/>");
  ExpectMessage({"<attach> prefix: found 'p'", "there is a site ps"});
  world("<body name='a'><body name='b'><attach body='a' prefix='p'/></body></body>");
  ExpectMessage({"<attach> body: found 'a'", "no cycle: this body contains the <attach>"});
  world("<frame name='a'><attach frame='a' prefix='p'/></frame>");
  ExpectMessage({"<attach> frame: found 'a'", "no cycle: this frame contains the <attach>"});
  world("<replicate count='2'>" + arm + "</replicate><attach body='tip' prefix='p'/>");
  ExpectMessage({"a body that is not in a <replicate>"});
  // each body contains the previous one twice
  std::string bodies = "<body name='b0'/>";
  for (int i = 1; i < 30; ++i) {
    bodies += fmt::format(
        "<body name='b{0}'><attach body='b{1}' prefix='x{0}'/><attach body='b{1}' "
        "prefix='y{0}'/></body>",
        i, i - 1);
  }
  world(bodies);
  ExpectMessage({"<attach>: found more than 100000 elements of copies"});
  // each body is one deeper than the previous one
  bodies = "<body name='b0'/>";
  for (int i = 1; i < 300; ++i) {
    bodies += fmt::format("<body name='b{0}'><attach body='b{1}' prefix='x'/></body>", i, i - 1);
  }
  world(bodies);
  ExpectMessage({"<attach>: found a copy with more than", "elements within each other"});
}

TEST_F(ImportMjcfAttach, MeshesAreFoundBesideTheirModel) {
  // a cube of 1 m
  std::string cube;
  for (const int i : {0, 1, 2, 3, 4, 5, 6, 7}) {
    cube += fmt::format("v {} {} {}\n", i & 1, (i >> 1) & 1, i >> 2);
  }
  for (const char* face : {"1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"}) {
    cube += fmt::format("f {}\n", face);
  }
  Write("parts/meshes/cube.obj", cube);
  Write(
      "parts/box.xml",
      "<mujoco><compiler meshdir='meshes'/><asset><mesh file='cube.obj'/></asset><worldbody><body "
      "name='b'><joint/><geom type='mesh' mesh='cube' density='10'/></body></worldbody></mujoco>");
  Write("main.xml",
        "<mujoco><asset><model name='box' file='parts/box.xml'/></asset><worldbody><attach "
        "model='box' prefix='p_'/></worldbody></mujoco>");
  EXPECT_NEAR(Read().description.bodies[1].mass, 10.0, 1e-13);
  Write("main.xml",
        "<mujoco><compiler meshdir='parts/meshes' strippath='true'/><asset><mesh name='m' "
        "file='away/cube.obj'/></asset><worldbody><body><joint/><geom type='mesh' mesh='m' "
        "density='10'/></body></worldbody></mujoco>");
  EXPECT_NEAR(Read().description.bodies[1].mass, 10.0, 1e-13);
}

TEST_F(ImportMjcfAttach, FaultsAreNamed) {
  const auto attach = [&](const std::string& attributes,
                          const std::string& asset = "<model name='a' file='a.xml'/>") {
    Write("main.xml", "<mujoco><asset>" + asset + "</asset><worldbody>\n<attach " + attributes +
                          "/></worldbody></mujoco>");
  };
  Write("a.xml", "<mujoco><worldbody>" + Arm("", "", "") + "</worldbody></mujoco>");
  attach("prefix='p'");
  ExpectMessage({"main.xml:2: <attach>: found no 'model', 'body' or 'frame'",
                 "a <model> of <asset>, or a body"});
  attach("model='a' pos='1 0 0'");
  ExpectMessage({"main.xml:2: <attach>: found 'pos'", "a <frame> around it moves it"});
  attach("body='a' frame='b' prefix='p'");
  ExpectMessage({"main.xml:2: <attach>: found 'body' and 'frame', expected one of them"});
  attach("model='b'");
  ExpectMessage({"main.xml:2: <attach> model: found 'b'", "the name of a <model> in <asset>"});
  attach("model='a' body='no'");
  ExpectMessage({"main.xml:2: <attach> body: found 'no'", "the name of a body of", "a.xml"});
  attach("model='a'", "<model name='a' file='../a.xml'/>");
  ExpectMessage({"main.xml:1: <model name='a'> file: found '../a.xml'"});
  attach("model='a'", "<model name='a' file='main.xml'/>");
  ExpectMessage({"no cycle of files (main.xml > main.xml)"});
  Write("a.xml", "<mujoco><compiler angle='radian'/><worldbody/></mujoco>");
  attach("model='a'");
  ExpectMessage({"<attach> model: found 'a'", "a model with angle='degree' in its <compiler>"});
  // each model attaches the next twice
  for (int i = 0; i < 20; ++i) {
    const std::string next = fmt::format("<attach model='n' prefix='{}'/>", "a");
    Write(fmt::format("bomb{}.xml", i),
          fmt::format("<mujoco><asset><model name='n' "
                      "file='bomb{}.xml'/></asset><worldbody>{}{}</worldbody></mujoco>",
                      i + 1, next, next));
  }
  Write("bomb20.xml", "<mujoco><worldbody/></mujoco>");
  attach("model='a'", "<model name='a' file='bomb0.xml'/>");
  ExpectMessage({"at most 16 nested files"});
}

}  // namespace loopbench::harness::import_mjcf_attach_test
