// A folder with a mechanism, an experiment and claims, and the program called in it as users call
// it.
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "harness/base/store.h"
#include "harness/base/text.h"
#include "tests/harness/places.h"

namespace loopbench::harness {
namespace fs = std::filesystem;

struct Ending {
  int code = -1;
  std::string text;  ///< standard output and standard error together
};

inline constexpr const char* kTinyExperiment = R"({
  "name": "tiny", "comment": "two cases", "tolerances": [1e-6],
  "problems": [{"mechanism": "four-bar.json", "horizon": 0.5}],
  "methods": [{"formulation": ["odca", "lagrange"], "enforcement": "acceleration"}],
  "timing": {"repeats": 0}
})";

inline constexpr const char* kTinyClaims = R"({"claims": [{
  "id": "small", "claim": "Drift is small.", "where": "here",
  "checks": [{"label": "all", "select": {"formulation": "odca"}, "measure": "drift_position_max",
              "statistic": "max", "compare": "<=", "threshold": 1e-3}],
  "wording": {"reproduced": "It is.", "not_reproduced": "It is not.", "partially_reproduced": "In part."}
}]})";

/// A folder with a mechanism, an experiment and claims; the program runs in it.
class CommandLineTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / (std::string("loopbench-cli-") + test->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    mechanism_ = ReadFile(kConfigs / "mechanisms/four-bar.json");
    Write("four-bar.json", mechanism_);
    Write("tiny.json", kTinyExperiment);
    Write("claims.json", kTinyClaims);
  }
  void TearDown() override { fs::remove_all(folder_); }

  void Write(const std::string& name, const std::string& text) const {
    WriteFileAtomically(folder_ / name, text);
  }

  /// Writes four-bar.json with its first `from` replaced.
  void EditMechanism(const std::string& from, const std::string& to) const {
    std::string text = mechanism_;
    const std::size_t place = text.find(from);
    ASSERT_NE(place, std::string::npos) << from;
    Write("four-bar.json", text.replace(place, from.size(), to));
  }

  Ending Call(const std::string& arguments, const std::string& before = "") const {
    const std::string command = "cd '" + folder_.string() + "' && " + before +
                                " '" LOOPBENCH_BINARY "' " + arguments + " 2>&1";
    std::FILE* pipe = ::popen(command.c_str(), "r");
    Ending ending;
    if (pipe == nullptr) return ending;
    for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) {
      ending.text += static_cast<char>(c);
    }
    const int status = ::pclose(pipe);
    ending.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    return ending;
  }

  fs::path folder_;
  std::string mechanism_;
};

/// The message of the std::runtime_error that `action` throws.
inline std::string ErrorOf(const auto& action) {
  try {
    action();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "no error";
}

inline void ExpectEnding(const Ending& ending, int code, const std::vector<std::string>& words) {
  EXPECT_EQ(ending.code, code) << ending.text;
  for (const std::string& word : words) {
    EXPECT_NE(ending.text.find(word), std::string::npos) << "no <" << word << "> in\n"
                                                         << ending.text;
  }
}

}  // namespace loopbench::harness
