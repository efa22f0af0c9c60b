// A folder with a mechanism, an experiment and claims, and the program called in it as users call
// it.
#pragma once

#include <sys/wait.h>

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

/// Returns a text with its first `from` replaced.
inline std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t place = text.find(from);
  if (place == std::string::npos) throw std::runtime_error("no <" + from + "> in " + text);
  return text.replace(place, from.size(), to);
}

/// Returns kTinyExperiment with further sections.
inline std::string TinyWith(const std::string& sections) {
  return Replaced(kTinyExperiment, "\"timing\"", sections + ", \"timing\"");
}

inline std::size_t CountOf(const std::string& text, const std::string& word) {
  std::size_t count = 0;
  for (std::size_t at = 0; (at = text.find(word, at)) != std::string::npos; ++at) ++count;
  return count;
}

inline void ExpectEnding(const Ending& ending, int code, const std::vector<std::string>& words) {
  EXPECT_EQ(ending.code, code) << ending.text;
  ExpectWords(ending.text, words);
}

/// Returns the names in a folder, in order; none if it is missing.
inline std::vector<std::string> NamesIn(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code missing;
  for (const auto& entry : fs::directory_iterator(folder, missing)) {
    names.push_back(entry.path().filename().string());
  }
  std::ranges::sort(names);
  return names;
}

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
    WriteFileAtomically(folder_ / name, text, Onto::kAnyFile);
  }

  /// Writes four-bar.json with its first `from` replaced.
  void EditMechanism(const std::string& from, const std::string& to) const {
    Write("four-bar.json", Replaced(mechanism_, from, to));
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

  /// Calls the program; checks its exit code and words of its output.
  void Expect(const std::string& arguments, int code, const std::vector<std::string>& words = {},
              const std::string& before = "") const {
    SCOPED_TRACE(before + " " + arguments);
    ExpectEnding(Call(arguments, before), code, words);
  }

  fs::path folder_;
  std::string mechanism_;
};

}  // namespace loopbench::harness
