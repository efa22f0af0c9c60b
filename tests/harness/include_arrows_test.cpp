// The include arrows of the repository, and of planted files that break each rule.
#include "tests/harness/include_arrows.h"

#include "tests/harness/places.h"

namespace loopbench::architecture::include_arrows_test {

namespace fs = std::filesystem;
using harness::kRoot;

/// Violations of a file at `path` whose only line includes `header`.
std::vector<std::string> Planted(const std::string& path, const std::string& header) {
  return Violations(path, "#include " + header + "\n");
}

void ExpectAllowed(const std::string& path, const std::string& header) {
  EXPECT_TRUE(Planted(path, header).empty()) << Planted(path, header).front();
}

void ExpectRefused(const std::string& path, const std::string& header, const std::string& why) {
  const std::vector<std::string> violations = Planted(path, header);
  ASSERT_EQ(violations.size(), 1u) << path << " " << header;
  EXPECT_EQ(violations.front().find(path + ": #include " + header), 0u) << violations.front();
  harness::ExpectWords(violations.front(), {why});
}

TEST(IncludeArrows, OfTheRepositoryAllPointTheRightWay) {
  std::map<std::string, int> includes;
  for (const std::string module :
       {"mechanism", "odca", "lagrange", "reduction", "harness", "peers", "tests"}) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(kRoot / module)) {
      const std::string extension = entry.path().extension().string();
      if (extension != ".h" && extension != ".cpp" && extension != ".in") continue;
      const std::string text = harness::ReadFile(entry.path());
      const std::string path = entry.path().lexically_relative(kRoot).generic_string();
      includes[module] += static_cast<int>(Includes(text).size());
      for (const std::string& violation : Violations(path, text)) ADD_FAILURE() << violation;
    }
    EXPECT_GT(includes[module], 0) << "nothing read in " << module;
  }
}

TEST(IncludeArrows, LeadFromTestsOverHarnessAndFormulationsToMechanism) {
  for (const std::string formulation : {"odca", "lagrange", "reduction"}) {
    const std::string header = "\"" + formulation + "/" + formulation + ".h\"";
    const std::string source = formulation + "/" + formulation + ".cpp";
    ExpectAllowed(source, "\"mechanism/model/joint.h\"");
    ExpectAllowed(source, header);
    ExpectAllowed("harness/run/run_case.cpp", header);
    ExpectAllowed("tests/contract/contract_test.cpp", header);
    ExpectRefused("mechanism/model/joint.cpp", header, "the other way");
    ExpectRefused(source, "\"harness/base/record.h\"", "the other way");
    ExpectRefused(source, "\"tests/contract/oracle.h\"", "the other way");
  }
  ExpectAllowed("harness/base/record.cpp", "\"mechanism/description/outcome.h\"");
  ExpectAllowed("tests/harness/store_test.cpp", "\"harness/base/text.h\"");
  ExpectRefused("mechanism/model/joint.h", "\"harness/base/record.h\"", "the other way");
  ExpectRefused("harness/base/record.cpp", "\"tests/contract/oracle.h\"", "the other way");
}

TEST(IncludeArrows, OfModulesLeadDownOnly) {
  const auto expect_above = [](const std::string& upper, const std::string& lower) {
    ExpectAllowed(upper + "/a.cpp", "\"" + lower + "/b.h\"");
    ExpectRefused(lower + "/a.cpp", "\"" + upper + "/b.h\"", "the other way");
  };
  expect_above("mechanism/model", "mechanism/description");
  expect_above("mechanism/simplify", "mechanism/start");
  expect_above("odca", "mechanism/formulation");
  expect_above("harness/run", "reduction");
  expect_above("harness/suite", "harness/judge");
  expect_above("harness/cli", "harness/suite");
  expect_above("peers", "harness/cli");
  ExpectRefused("harness/new/a.cpp", "\"harness/base/record.h\"", "no module");
  ExpectRefused("harness/run/a.cpp", "\"harness/build_info.h\"", "from the root");
  ExpectAllowed("harness/base/provenance.cpp", "\"harness/build_info.h\"");
}

TEST(IncludeArrows, NeverLeadFromOneFormulationToAnother) {
  for (const std::string from : {"odca", "lagrange", "reduction"}) {
    for (const std::string to : {"odca", "lagrange", "reduction"}) {
      if (from == to) continue;
      ExpectRefused(from + "/a.cpp", "\"" + to + "/b.h\"", "the other way");
    }
  }
}

TEST(IncludeArrows, OfSundialsEndBehindTheIntegrator) {
  for (const std::string header :
       {"<arkode/arkode_erkstep.h>", "<nvector/nvector_serial.h>", "<sundials/sundials_context.h>",
        "<sunmatrix/sunmatrix_dense.h>", "<sunadaptcontroller/sunadaptcontroller_soderlind.h>"}) {
    ExpectAllowed("harness/integrator/arkode.cpp", header);
    ExpectAllowed("harness/config/arkode_tables.cpp", header);
    for (const char* path : {"harness/integrator/arkode.h", "harness/run/run_case.cpp",
                             "tests/harness/integrator_test.cpp"}) {
      ExpectRefused(path, header, "SUNDIALS");
    }
    ExpectRefused("odca/sweep.cpp", header, "Eigen");
  }
}

TEST(IncludeArrows, OfOtherLibrariesEndWhereTheyBelong) {
  ExpectAllowed("harness/base/json_reader.h", "<nlohmann/json.hpp>");
  ExpectAllowed("harness/base/record.cpp", "<nlohmann/json.hpp>");
  ExpectAllowed("tests/harness/store_test.cpp", "<nlohmann/json.hpp>");
  ExpectRefused("harness/judge/table.cpp", "<nlohmann/json.hpp>", "nlohmann");
  ExpectRefused("tests/contract/oracle.cpp", "<nlohmann/json.hpp>", "nlohmann");
  ExpectAllowed("harness/run/bench.cpp", "<benchmark/benchmark.h>");
  ExpectRefused("harness/suite/suite.cpp", "<benchmark/benchmark.h>", "Benchmark");
  ExpectAllowed("tests/odca/plan_test.cpp", "<gtest/gtest.h>");
  ExpectRefused("harness/suite/suite.cpp", "<gtest/gtest.h>", "GoogleTest");
  ExpectAllowed("peers/simbody_program.cpp", "<Simbody.h>");
  ExpectAllowed("peers/mujoco_program.cpp", "<mujoco/mujoco.h>");
  ExpectRefused("harness/run/peers.cpp", "<Simbody.h>", "peers");
  ExpectRefused("peers/register.cpp", "<mujoco/mujoco.h>", "peers");
  ExpectAllowed("harness/observers/built_in.cpp", "<boost/math/special_functions/ellint_1.hpp>");
  ExpectRefused("harness/observers/observers.cpp", "<boost/math/tools/roots.hpp>", "Boost");
  ExpectRefused("tests/reference/pendulum_test.cpp", "<boost/math/tools/roots.hpp>", "Boost");
}

TEST(IncludeArrows, OfTheCoreReachEigenAndTheStandardLibraryOnly) {
  for (const std::string path :
       {"mechanism/model/a.h", "odca/a.cpp", "lagrange/a.cpp", "reduction/a.h"}) {
    ExpectAllowed(path, "<Eigen/Core>");
    ExpectAllowed(path, "<vector>");
    for (const char* header : {"<fmt/format.h>", "<nlohmann/json.hpp>", "<unistd.h>",
                               "<gtest/gtest.h>", "<boost/math/tools/roots.hpp>"}) {
      ExpectRefused(path, header, "Eigen");
    }
  }
}

TEST(IncludeArrows, CannotBeHidden) {
  ExpectRefused("odca/a.cpp", "\"../lagrange/lagrange.h\"", "from the root");
  ExpectRefused("odca/a.cpp", "\"plan.h\"", "from the root");
  ExpectRefused("odca/a.cpp", "\"odca/../harness/base/record.h\"", "from the root");
  ExpectRefused("odca/a.cpp", "<lagrange/lagrange.h>", "in quotes");
  ExpectRefused("harness/run/a.cpp", "\"nlohmann/json.hpp\"", "from the root");
  ExpectRefused("odca/a.cpp", "HEADER", "named");
  EXPECT_EQ(Violations("odca/a.cpp", "  #  include\t\"harness/base/record.h\"  // why\r\n").size(),
            1u);
  EXPECT_EQ(Violations("odca/a.cpp", "/* */ #include \"harness/base/record.h\"\n").size(), 1u);
  EXPECT_EQ(Violations("odca/a.cpp", "const char* s = \"/*\";\n#include <fmt/core.h>").size(), 1u);
}

TEST(Includes, AreReadInOrderAndNotFromComments) {
  EXPECT_EQ(Includes("// #include <a>\n#include <b>\n/* x\n#include <c>\n*/\n#include \"d/e.h\"\n"
                     "#define F 1\n#include <f>"),
            (std::vector<std::string>{"<b>", "\"d/e.h\"", "<f>"}));
  EXPECT_TRUE(Includes("").empty());
  EXPECT_TRUE(Includes("/* never closed\n#include <a>").empty());
}

}  // namespace loopbench::architecture::include_arrows_test
