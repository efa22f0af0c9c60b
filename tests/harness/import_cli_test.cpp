// `loopbench import` as users call it.
#include <gtest/gtest.h>

#include "harness/config/mechanism_reader.h"
#include "tests/harness/cli_fixture.h"

namespace loopbench::harness {
namespace import_cli_test {

const std::string kImports = (kConfigs / "imports").string();

class ImportCommandLine : public CommandLineTest {};

TEST_F(ImportCommandLine, WritesAMechanismAndSaysWhatIsNotThere) {
  ExpectEnding(Call("import '" + kImports + "/pendulum.xml'"), 0,
               {"pendulum.xml:14: <geom name=\"floor\">: dropped: there is no contact",
                "wrote pendulum.json: spatial, 1 bodies, 1 joints, 0 forces"});
  EXPECT_EQ(ReadMechanism(folder_ / "pendulum.json").description.bodies[1].name, "pole");
  ExpectEnding(Call("check pendulum.json"), 0, {});
}

TEST_F(ImportCommandLine, TakesLoopsFromASidecarAndGoesToThePlane) {
  ExpectEnding(Call("import '" + kImports + "/one-four-bar.urdf' --loops '" + kImports +
                    "/one-four-bar-loop.json' --planar --out bars.json"),
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

TEST_F(ImportCommandLine, WritesNothingWhenItRefuses) {
  Write("bad.xml",
        "<mujoco>\n<worldbody>\n<body name=\"b\"><joint damping=\"x\"/></body>\n"
        "</worldbody></mujoco>");
  ExpectEnding(Call("import bad.xml"), 2,
               {"bad.xml:3: <joint> damping: found \"x\", expected finite numbers only"});
  EXPECT_FALSE(fs::exists(folder_ / "bad.json"));
  ExpectEnding(Call("import missing.xml"), 2, {"missing.xml"});
  ExpectEnding(Call("import '" + kImports + "/acrobot.xml' --gravity 1,2"), 2,
               {"--gravity 1,2", "three numbers"});
  ExpectEnding(Call("import '" + kImports + "/acrobot.xml' --format sdf"), 2,
               {"found mjcf, expected sdf"});
  ExpectEnding(Call("import '" + kImports + "/acrobot.xml' --floating"), 2, {"--floating"});
  ExpectEnding(Call("import '" + kImports + "/bennett.urdf' --planar --loops '" + kImports +
                    "/bennett-loop.json'"),
               2, {"--planar: found that joint \"J4\" leaves the plane"});
  ExpectEnding(Call("import bad.xml --out bad.xml"), 2, {"a file that is read"});
  for (const auto& entry : fs::directory_iterator(folder_)) {
    EXPECT_EQ(entry.path().string().find("acrobot"), std::string::npos) << entry.path();
  }
}

}  // namespace import_cli_test
}  // namespace loopbench::harness
