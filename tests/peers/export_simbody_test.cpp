// Exported programs for Simbody, compiled by the command that they name: accelerations to
// round-off, motion to the accuracy asked for, and names that are only names.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <sstream>

#include "harness/exchange/export_mechanism.h"
#include "harness/json/json_document.h"
#include "harness/text/files.h"
#include "harness/text/run_program.h"
#include "mechanism/description/library.h"
#include "tests/peers/at_start.h"
#include "tests/reference/cases.h"

namespace loopbench::harness {
namespace peers_export_simbody_test {

namespace fs = std::filesystem;
using exchange::NotThere;
using peers_test::AtStart;
using peers_test::kEps;
using peers_test::LargestDifference;

const exchange::ExportFormat& kSimbody = exchange::ExportFormats().back();

/// A new folder of this test.
fs::path Folder(const std::string& name) {
  const fs::path folder = fs::path(testing::TempDir()) / ("loopbench-exported-" + name);
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

std::vector<double> Numbers(const Json& array) { return array.get<std::vector<double>>(); }

/// All programs that there are, in one translation unit, which takes a minute less than one each.
class Programs {
 public:
  Programs() : folder_(Folder("programs")) {
    std::ostringstream source, choice;
    source << "#include <Simbody.h>\n#include <cmath>\n#include <cstdio>\n#include <cstdlib>\n"
              "#include <cstring>\n#include <exception>\n#include <initializer_list>\n"
              "#include <vector>\n";
    for (const std::string& name : reference::ShippedNames()) {
      std::string text;
      try {
        text = exchange::Export(reference::Shipped(name).description, kSimbody).text;
      } catch (const NotThere&) {
        continue;
      }
      WriteFileAtomically(folder_ / (name + ".cpp"), text);
      const std::string space = "n" + std::to_string(names_.size());
      source << "namespace " << space << " {\n#define main Main\n#include \"" << name
             << ".cpp\"\n#undef main\n}\n";
      choice << "  if (std::strcmp(argv[1], \"" << name << "\") == 0) return " << space
             << "::Main(argc - 1, argv + 1);\n";
      names_.push_back(name);
    }
    source << "int main(int argc, char** argv) {\n" << choice.str() << "  return 3;\n}\n";
    WriteFileAtomically(folder_ / "all.cpp", source.str());
    EXPECT_EQ(CompileProgram(folder_ / "all.cpp", folder_ / "all"), "");
  }
  ~Programs() { fs::remove_all(folder_); }

  const std::vector<std::string>& names() const { return names_; }

  Json Run(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), (folder_ / "all").string());
    const ProgramResult result = RunProgram(arguments);
    EXPECT_EQ(result.Failure("program"), "") << result.messages;
    return ParseDocument(result.output, "output");
  }

 private:
  fs::path folder_;
  std::vector<std::string> names_;
};

void ExpectStart(const AtStart& ours, const Json& theirs) {
  ASSERT_EQ(theirs["joints"].size(), ours.joints.size());
  for (const Json& joint : theirs["joints"]) {
    const peers_test::JointAtStart& one = ours.joints.at(joint["name"].get<std::string>());
    // two assemblies, of the same loops with and without redundant constraints
    EXPECT_LE(LargestDifference(Numbers(joint["q"]), one.q), 1e-14) << joint;
    EXPECT_LE(LargestDifference(Numbers(joint["u"]), one.u), 1e-13) << joint;
    EXPECT_LE(LargestDifference(Numbers(joint["udot"]), one.udot), ours.bound) << joint;
  }
  ASSERT_EQ(theirs["bodies"].size(), ours.origins.size());
  for (const Json& body : theirs["bodies"]) {
    const Eigen::Vector3d& at = ours.origins.at(body["name"].get<std::string>());
    // some ten products of rounded frames from Ground to the body
    EXPECT_LE(LargestDifference(Numbers(body["at"]), {at.data(), 3}),
              100 * kEps * std::max(ours.length, at.cwiseAbs().maxCoeff()))
        << body;
  }
}

/// Time of a run [s]: Andrews' squeezer turns a thousand times as fast as the others, and
/// Peaucellier's linkage passes a singular position at 0.32 s, where Simbody's energy jumps by 0.3
/// J.
double Horizon(const std::string& name) {
  if (name == "peaucellier") return 0.3;
  return name == "andrews-squeezer" ? 0.005 : 1.0;
}

/// Largest difference of a body's place and axes.
double DifferenceAtEnd(const Record& ours, const Json& theirs) {
  double largest = 0.0;
  for (const Json& body : theirs["bodies"]) {
    const std::vector<double> pose =
        ours.Numbers("series.final." + body["name"].get<std::string>());
    const std::vector<double> at = Numbers(body["at"]), R = Numbers(body["axes"]);
    const std::vector<double> same =
        pose.size() == 3 ? std::vector{at[0], at[1], R[0], R[3]}
                         : std::vector{at[0], at[1], at[2], R[0], R[3], R[6], R[1], R[4], R[7]};
    std::vector<double> own = pose;
    if (pose.size() == 3) own = {pose[0], pose[1], std::cos(pose[2]), std::sin(pose[2])};
    largest = std::max(largest, LargestDifference(own, same));
  }
  return largest;
}

TEST(ExportedSimbody, HasOurAccelerationsAndMotion) {
  constexpr double kTolerance = 1e-10;
  const Programs programs;
  EXPECT_EQ(programs.names().size(), reference::ShippedNames().size() - 2);
  for (const std::string& name : programs.names()) {
    SCOPED_TRACE(name);
    const AtStart ours = peers_test::OursAtStart(reference::Shipped(name).description);
    const Json start = programs.Run({name});
    ExpectStart(ours, start);
    const double horizon = Horizon(name);
    const Json end = programs.Run({name, std::to_string(horizon), "1e-10"});
    EXPECT_EQ(end["time"].get<double>(), horizon);
    const Record run =
        reference::RunShipped(name, {"odca", Enforcement::kPosition}, kTolerance, horizon);
    ASSERT_EQ(run.Text("outcome"), "finished") << run.Text("message");
    const double difference = DifferenceAtEnd(run, end);
    std::printf("TABLE %s end %.2e steps %g\n", name.c_str(), difference, run.Number("steps"));
  }
}

}  // namespace peers_export_simbody_test
}  // namespace loopbench::harness
