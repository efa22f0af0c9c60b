// Exported programs for Simbody, compiled by the command that they name: accelerations to
// round-off, motion to the accuracy asked for, and names that are only names.
#include "harness/exchange/export_simbody.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <sstream>

#include "harness/base/json_document.h"
#include "harness/base/text.h"
#include "harness/exchange/model.h"
#include "mechanism/description/library.h"
#include "tests/peers/at_start.h"
#include "tests/peers/expressible.h"
#include "tests/reference/cases.h"

namespace loopbench::harness {
namespace peers_export_simbody_test {

namespace fs = std::filesystem;
using exchange::Unsupported;
using peers_test::AtStart;
using peers_test::kEps;
using peers_test::LargestDifference;

const exchange::ExportFormat& kSimbody = exchange::ExportFormats().back();

/// A new folder of this test.
fs::path Folder(const std::string& name) {
  const fs::path folder = fs::path(::testing::TempDir()) / ("loopbench-exported-" + name);
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder;
}

/// By the command in the program's comment, but for optimisation, which takes long. Its messages.
std::string CompileProgram(const fs::path& source, const fs::path& program) {
  const ProgramResult result =
      RunProgram({LOOPBENCH_CXX, "-std=c++17", "-O0", "-Wall", "-Wextra", "-Werror", "-isystem",
                  "/usr/include/simbody", source.string(), "-o", program.string(), "-lSimTKsimbody",
                  "-lSimTKmath", "-lSimTKcommon"});
  return result.Failure("compiler") + result.messages;
}

std::size_t Size(const VectorX<double>& v) { return static_cast<std::size_t>(v.size()); }

std::vector<double> Numbers(const Json& array) { return array.get<std::vector<double>>(); }

/// Programs by name, in one translation unit: reading Simbody's headers takes seconds each time.
class Programs {
 public:
  explicit Programs(const std::map<std::string, std::string>& texts) : folder_(Folder("programs")) {
    std::ostringstream source, choice;
    source << "#include <Simbody.h>\n#include <cmath>\n#include <cstdio>\n#include <cstdlib>\n"
              "#include <cstring>\n#include <exception>\n#include <initializer_list>\n"
              "#include <vector>\n";
    int count = 0;
    for (const auto& [name, text] : texts) {
      WriteFileAtomically(folder_ / (name + ".cpp"), text);
      const std::string space = "n" + std::to_string(count++);
      source << "namespace " << space << " {\n#define main Main\n#include \"" << name
             << ".cpp\"\n#undef main\n}\n";
      choice << "  if (std::strcmp(argv[1], \"" << name << "\") == 0) return " << space
             << "::Main(argc - 1, argv + 1);\n";
    }
    source << "int main(int argc, char** argv) {\n" << choice.str() << "  return 3;\n}\n";
    WriteFileAtomically(folder_ / "all.cpp", source.str());
    EXPECT_EQ(CompileProgram(folder_ / "all.cpp", folder_ / "all"), "");
  }
  ~Programs() { fs::remove_all(folder_); }
  Programs(const Programs&) = delete;
  Programs& operator=(const Programs&) = delete;

  Json Run(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), (folder_ / "all").string());
    const ProgramResult result = RunProgram(arguments);
    EXPECT_EQ(result.Failure("program"), "") << result.messages;
    return ParseDocument(result.output, "output");
  }

 private:
  fs::path folder_;
};

/// Returns the largest difference of accelerations, over their scale.
double ExpectStart(const AtStart& ours, const Json& theirs) {
  double largest = 0.0;
  EXPECT_EQ(theirs["joints"].size(), ours.joints.size());
  for (const Json& joint : theirs["joints"]) {
    const peers_test::JointAtStart& one = ours.joints.at(joint["name"].get<std::string>());
    // two assemblies, of the same loops with and without redundant constraints
    EXPECT_LE(LargestDifference(Numbers(joint["q"]), one.q), 1e-14) << joint;
    EXPECT_LE(LargestDifference(Numbers(joint["u"]), one.u), 1e-13) << joint;
    const double difference = LargestDifference(Numbers(joint["udot"]), one.udot);
    EXPECT_LE(difference, ours.bound) << joint;
    largest = std::max(largest, difference);
  }
  EXPECT_EQ(theirs["bodies"].size(), ours.origins.size());
  for (const Json& body : theirs["bodies"]) {
    const Eigen::Vector3d& at = ours.origins.at(body["name"].get<std::string>());
    // some ten products of rounded frames from Ground to the body
    EXPECT_LE(LargestDifference(Numbers(body["at"]), {at.data(), 3}),
              100 * kEps * std::max(ours.length, at.cwiseAbs().maxCoeff()))
        << body;
  }
  return largest / ours.Scale();
}

/// Time of a run [s]. Andrews' squeezer turns a thousand times as fast as the others; two have
/// stiff springs, with thousands of steps in a tenth of a second; the three others pass positions
/// with bars in line, where a run of either forgets digits, at 0.32, 0.71 and 0.81 s (rcond_min of
/// their records 1e-5 and less).
double Horizon(const std::string& name) {
  if (name == "andrews-squeezer") return 0.005;
  if (name == "elastic-crank" || name == "flyball-governor") return 0.1;
  if (name == "peaucellier") return 0.3;
  return name == "n-four-bar" || name == "toggle" ? 0.5 : 1.0;
}

/// Largest difference of a body's place and axes.
double DifferenceAtEnd(const Record& ours, const Json& start, const Json& end) {
  double largest = 0.0;
  for (std::size_t i = 0; i < end["bodies"].size(); ++i) {
    const Json& body = end["bodies"][i];
    const std::string key = "series.final." + body["name"].get<std::string>();
    const std::vector<double> at = Numbers(body["at"]), R = Numbers(body["axes"]);
    if (!reference::IsSet(ours, key)) {  // it cannot move
      largest = std::max(largest, LargestDifference(at, Numbers(start["bodies"][i]["at"])));
      continue;
    }
    std::vector<double> own = ours.Numbers(key);
    std::vector<double> same = {at[0], at[1], at[2], R[0], R[3], R[6], R[1], R[4], R[7]};
    if (own.size() == 3) {
      own = {own[0], own[1], std::cos(own[2]), std::sin(own[2])};
      same = {at[0], at[1], R[0], R[3]};
    }
    largest = std::max(largest, LargestDifference(own, same));
  }
  return largest;
}

TEST(ExportedSimbody, HasOurAccelerationsAndMotion) {
  constexpr double kTolerance = 1e-10;
  std::map<std::string, std::string> texts;
  for (const std::string& name : reference::ShippedNames()) {
    try {
      texts[name] = exchange::Export(reference::Shipped(name).description, kSimbody).text;
    } catch (const Unsupported&) {
      // the command says so (tests/harness/export_test.cpp)
      EXPECT_TRUE(name == "driven-four-bar" || name == "screw-jack") << name;
    }
  }
  const Programs programs(texts);
  for (const auto& [name, text] : texts) {
    SCOPED_TRACE(name);
    const AtStart ours = peers_test::LoopbenchInitialState(reference::Shipped(name).description);
    const Json start = programs.Run({name});
    const double accelerations = ExpectStart(ours, start);
    const double horizon = Horizon(name);
    const Json end = programs.Run({name, std::to_string(horizon), "1e-10"});
    EXPECT_EQ(end["time"].get<double>(), horizon);
    const Record run =
        reference::RunShipped(name, {"odca", Enforcement::kPosition}, kTolerance, horizon);
    ASSERT_EQ(run.Text("outcome"), "finished") << run.Text("message");
    // some 100 steps with errors of the tolerance each, in both runs; a second magnifies them
    // little
    const double difference = DifferenceAtEnd(run, start, end);
    EXPECT_LE(difference, 100 * kTolerance);
    // for results/peers/exports.md
    RecordProperty(name, fmt::format("{:.1e} {:.1e}", accelerations, difference));
  }
}

/// A random mechanism at a state that its loops allow, and the oracle's accelerations there.
struct Drawn {
  exchange::Model model;
  VectorX<double> udot;
  double bound = 0.0;  ///< of the largest
};

template <class Space>
Drawn Draw(MechanismDescription description, std::uint64_t seed) {
  testing::KeepExpressible(description);
  const bool is_tree = BuildTopology(description, Coordinates::kJoint).constraints.empty();
  if (is_tree) testing::AddConstantForces(description, false);
  const testing::Sample<Space> sample(description, seed);
  const auto& state = sample.state(Coordinates::kJoint);
  Drawn drawn{exchange::MakeModel(description), {}, sample.Bound()};
  drawn.model.q.assign(state.q.begin(), state.q.end());
  drawn.model.u.assign(state.u.begin(), state.u.end());
  drawn.udot = sample.udot(Coordinates::kJoint).template cast<double>();
  return drawn;
}

TEST(ExportedSimbody, OfJointsOfEveryKindHasTheOraclesAccelerations) {
  std::map<std::string, Drawn> drawn;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    for (const SpaceKind space : {SpaceKind::kPlanar, SpaceKind::kSpatial}) {
      for (const MechanismDescription& one :
           {testing::AnyMechanism(6, 0, 0, space, seed), testing::MixedGraph(2, space, seed)}) {
        const bool planar = space == SpaceKind::kPlanar;
        drawn.emplace("m" + std::to_string(drawn.size()),
                      planar ? Draw<Planar>(one, seed) : Draw<Spatial>(one, seed));
      }
    }
  }
  const AtStart gripper = peers_test::LoopbenchInitialState(peers_test::GripperWithRotors());
  Drawn& coupled = drawn["coupled"];
  coupled.model = exchange::MakeModelAtStart(peers_test::GripperWithRotors());
  coupled.udot = Eigen::Map<const VectorX<double>>(gripper.udot.data(),
                                                   static_cast<Eigen::Index>(gripper.udot.size()));
  coupled.bound = gripper.bound / peers_test::Largest(gripper.udot);
  std::map<std::string, std::string> texts;
  for (const auto& [name, one] : drawn) {
    try {
      texts[name] = exchange::WriteSimbodyProgram(one.model).text;
    } catch (const Unsupported& missing) {
      EXPECT_NE(std::string(missing.what()).find("helical"), std::string::npos) << missing.what();
    }
  }
  EXPECT_GE(texts.size(), 17u);
  EXPECT_TRUE(texts.contains("coupled"));
  const Programs programs(texts);
  for (const auto& [name, text] : texts) {
    const Drawn& one = drawn.at(name);
    const Json document = programs.Run({name});
    std::size_t index = 0;
    for (const Json& joint : document["joints"]) {
      const exchange::Joint& ours = one.model.tree.at(index++);
      EXPECT_EQ(joint["name"], ours.name);
      const VectorX<double> own = one.udot.segment(ours.u, ours.num_u);
      EXPECT_LE(LargestDifference(Numbers(joint["udot"]), {own.data(), Size(own)}),
                one.bound * one.udot.cwiseAbs().maxCoeff())
          << joint;
    }
  }
}

TEST(ExportedSimbody, HasNamesThatAreOnlyNames) {
  std::vector<std::string> names;
  const MechanismDescription mechanism =
      peers_test::HostileLadder("-->\n*/ \?\?/\n#error harmed \\", &names);
  const fs::path folder = Folder("hostile");
  WriteFileAtomically(folder / "named.cpp", exchange::Export(mechanism, kSimbody).text);
  ASSERT_EQ(CompileProgram(folder / "named.cpp", folder / "named"), "");
  const fs::path here = fs::current_path();
  fs::current_path(folder);
  const ProgramResult result = RunProgram({"./named"});
  fs::current_path(here);
  ASSERT_EQ(result.Failure("program"), "") << result.messages;
  EXPECT_FALSE(fs::exists(folder / "harmed"));
  const Json document = ParseDocument(result.output, "output");
  std::size_t bodies = 0;
  for (const Json& body : document["bodies"]) EXPECT_EQ(body["name"], names[bodies++]);
  EXPECT_EQ(bodies, mechanism.bodies.size() - 1);
  const AtStart ours = peers_test::LoopbenchInitialState(mechanism);
  ExpectStart(ours, document);
  fs::remove_all(folder);
}

}  // namespace peers_export_simbody_test
}  // namespace loopbench::harness
