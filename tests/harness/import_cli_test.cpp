// `loopbench import` as users call it.
#include "harness/config/mechanism_reader.h"
#include "tests/harness/cli_fixture.h"

namespace loopbench::harness::import_cli_test {

const std::string kImports = (kConfigs / "imports").string();

class ImportCommandLine : public CommandLineTest {};

TEST_F(ImportCommandLine, WritesAMechanismAndSaysWhatIsNotThere) {
  Expect("import '" + kImports + "/pendulum.xml'", 0,
         {"pendulum.xml:14: <geom name=\"floor\">: dropped: there is no contact",
          "wrote pendulum.json: spatial, 1 body, 1 joint, 0 forces"});
  EXPECT_EQ(ReadMechanism(folder_ / "pendulum.json").description.bodies[1].name, "pole");
  Expect("check pendulum.json", 0);
}

TEST_F(ImportCommandLine, TakesLoopsFromASidecarAndGoesToThePlane) {
  Expect("import '" + kImports + "/one-four-bar.urdf' --loops '" + kImports +
             "/one-four-bar-loop.json' --planar --out bars.json",
         0, {"<limit>", "[changes the motion]", "wrote bars.json: planar, 3 bodies"});
  const MechanismDescription bars = ReadMechanism(folder_ / "bars.json").description;
  EXPECT_EQ(bars.space, SpaceKind::kPlanar);
  EXPECT_EQ(bars.joints.size(), 4u);
}

TEST_F(ImportCommandLine, PrintsJsonForPrograms) {
  const Ending ending = Call("import '" + kImports + "/acrobot.xml' --json --gravity 0,0,-1.62");
  ExpectEnding(ending, 0, {"\"format\":\"mjcf\"", "\"mechanism\":\"acrobot.json\"", "\"notes\":["});
  EXPECT_EQ(ReadMechanism(folder_ / "acrobot.json").description.gravity.z(), -1.62);
}

TEST_F(ImportCommandLine, KeepsRoundedAnglesWhereAsked) {
  Write("turned.urdf",
        "<robot name=\"r\"><link name=\"world\"/><link name=\"a\"><inertial><mass "
        "value=\"1\"/><inertia "
        "ixx=\"1\" iyy=\"1\" izz=\"1\"/></inertial></link><joint name=\"j\" "
        "type=\"continuous\"><parent "
        "link=\"world\"/><child link=\"a\"/><origin rpy=\"1.5708 0 0\"/></joint></robot>");
  const auto angle = [&] {
    return ReadMechanism(folder_ / "turned.json").description.joints[0].from.rotation.x();
  };
  Expect("import turned.urdf", 0, {"1.5708 is taken as 1.5707963267948966", "--keep-digits"});
  EXPECT_NEAR(angle(), 1.5707963267948966, 1e-15);
  Expect("import turned.urdf --keep-digits", 0, {"1 note,"});
  EXPECT_NEAR(angle(), 1.5708, 1e-15);
}

TEST_F(ImportCommandLine, RoundedQuarterTurnsLeaveAFourBarItsFreedom) {
  const auto link = [](const std::string& name, const std::string& com, const std::string& mass) {
    return "<link name=\"" + name + "\"><inertial><origin xyz=\"" + com + "\"/><mass value=\"" +
           mass + "\"/><inertia ixx=\"0.08\" iyy=\"0.08\" izz=\"0.08\"/></inertial></link>";
  };
  const auto joint = [](const std::string& name, const std::string& parent,
                        const std::string& child, const std::string& origin,
                        const std::string& axis) {
    return "<joint name=\"" + name + "\" type=\"continuous\"><parent link=\"" + parent +
           "\"/><child link=\"" + child + "\"/><origin " + origin + "/><axis xyz=\"" + axis +
           "\"/></joint>";
  };
  // a planar four-bar in the plane of x and z; the crank's side is turned into it, the rocker's is
  // not
  Write("bars.urdf",
        "<robot name=\"bars\"><link name=\"world\"/>" + link("crank", "0 0.15 0", "1") +
            link("coupler", "0.4 0 0", "1.5") + link("rocker", "0 0 0.25", "1.2") +
            joint("A", "world", "crank", "rpy=\"1.5708 0 0\"", "0 0 1") +
            joint("B", "crank", "coupler", "xyz=\"0 0.3 0\"", "0 0 1") +
            joint("D", "world", "rocker", "xyz=\"0.8 0 -0.2\"", "0 -1 0") + "</robot>");
  Write("loop.json",
        R"({"loops": [{"name": "C", "type": "revolute", "from": "coupler", "to": "rocker",
                         "at": [0.8, 0, 0], "axis": [0, 0, 1]}], "initial": {"speeds": {"A": 1.0}}})");
  Expect("import bars.urdf --loops loop.json", 0, {"values with rounded angles"});
  // to round-off: one freedom is left, and 3 of its 5 constraints are redundant
  Expect("explain bars.json", 0, {"1 by rank", "Redundant constraints: 3"});
}

TEST_F(ImportCommandLine, WritesNothingWhenItRefuses) {
  Write("bad.xml",
        "<mujoco>\n<worldbody>\n<body name=\"b\"><joint damping=\"x\"/></body>\n"
        "</worldbody></mujoco>");
  Expect("import bad.xml", 2,
         {"bad.xml:3: <joint> damping: found \"x\", expected finite numbers only"});
  EXPECT_FALSE(fs::exists(folder_ / "bad.json"));
  Expect("import missing.xml", 2, {"missing.xml"});
  Expect("import '" + kImports + "/acrobot.xml' --gravity 1,2", 2,
         {"--gravity 1,2", "three numbers"});
  Expect("import '" + kImports + "/acrobot.xml' --input-format sdf", 2,
         {"found mjcf, expected sdf"});
  Expect("import '" + kImports + "/acrobot.xml' --floating", 2, {"--floating"});
  Expect("import '" + kImports + "/bennett.urdf' --planar --loops '" + kImports +
             "/bennett-loop.json'",
         2, {"--planar: found that joint \"J4\" leaves the plane"});
  Expect("import bad.xml --out bad.xml", 2, {"a file that is read"});
  for (const auto& entry : fs::directory_iterator(folder_)) {
    EXPECT_EQ(entry.path().string().find("acrobot"), std::string::npos) << entry.path();
  }
}

}  // namespace loopbench::harness::import_cli_test
