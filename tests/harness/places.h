// Where the repository lies that the tests were built from, helpers for its files, and expected
// messages.
#pragma once

#include "harness/base/text.h"
#include "harness/config/mechanism_reader.h"
#include "tests/standard.h"

namespace loopbench::harness {

inline const std::filesystem::path kRoot = LOOPBENCH_SOURCE_DIR;
inline const std::filesystem::path kConfigs = kRoot / "configs";

/// The JSON files below a folder, sorted.
inline std::vector<std::filesystem::path> JsonFilesIn(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().extension() == ".json") files.push_back(entry.path());
  }
  std::ranges::sort(files);
  return files;
}

/// The text of a file of tests/data.
inline std::string TestData(const std::string& name) {
  return ReadFile(kRoot / "tests/data" / name);
}

/// A mechanism of configs/mechanisms/.
inline MechanismFile Shipped(const std::string& name) {
  return ReadMechanism(kConfigs / "mechanisms" / (name + ".json"));
}

/// Names of the shipped mechanisms, sorted.
inline std::vector<std::string> ShippedNames() {
  std::vector<std::string> names;
  for (const auto& file : JsonFilesIn(kConfigs / "mechanisms")) names.push_back(file.stem());
  return names;
}

/// The message of the Error that `call` throws, "" if none. Other errors pass through.
template <class Error = ConfigError>
std::string MessageOf(const auto& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

inline void ExpectWords(const std::string& text, const std::vector<std::string>& words) {
  for (const std::string& word : words) {
    EXPECT_NE(text.find(word), std::string::npos) << "no <" << word << "> in\n" << text;
  }
}
inline void ExpectNone(const std::string& text, const std::vector<std::string>& words) {
  for (const std::string& word : words) {
    EXPECT_EQ(text.find(word), std::string::npos) << "<" << word << "> in\n" << text;
  }
}

}  // namespace loopbench::harness
