// The short form of the fuzzers (tests/fuzz): seeds, broken files and shipped ones, whole, cut
// short and changed in single places, through the same functions.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "tests/fuzz/readers.h"

namespace loopbench::fuzz {
namespace {

namespace fs = std::filesystem;

const fs::path kRoot = LOOPBENCH_SOURCE_DIR;

/// The lines of the stored baseline, as they are and without their checksums.
std::vector<std::string> RecordLines() {
  std::ifstream store(kRoot / "results/baselines/results.jsonl");
  std::vector<std::string> lines;
  for (std::string line; std::getline(store, line);) {
    lines.push_back(line);
    if (const std::size_t checksum = line.find(",\"checksum\""); checksum != std::string::npos) {
      lines.push_back(line.substr(0, checksum) + "}");
    }
  }
  return lines;
}

std::vector<std::string> Inputs(const std::string& kind) {
  if (kind == "record") return RecordLines();
  std::vector<fs::path> files;
  for (const fs::path& folder :
       {kRoot / "tests/fuzz/seeds" / kind, kRoot / "tests/broken" / (kind + "s"),
        kRoot / "configs" / (kind + "s")}) {
    if (!fs::exists(folder)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      if (entry.is_regular_file() && entry.path().extension() != ".expected") {
        files.push_back(entry.path());
      }
    }
  }
  std::sort(files.begin(), files.end());
  std::vector<std::string> inputs;
  for (const fs::path& file : files) {
    std::ostringstream text;
    text << std::ifstream(file, std::ios::binary).rdbuf();
    inputs.push_back(text.str());
  }
  return inputs;
}

void Call(const std::string& kind, const std::string& bytes) {
  if (kind == "mechanism") CallMechanismReader(bytes);
  if (kind == "experiment") CallExperimentReader(bytes);
  if (kind == "claim") CallClaimsReader(bytes);
  if (kind == "map") CallMapReader(bytes);
  if (kind == "record") CallRecordReader(bytes);
}

class Readers : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    folder_ = fs::current_path();
    fs::current_path(kRoot);  // seeds name mechanism files from there
  }
  void TearDown() override { fs::current_path(folder_); }

 private:
  fs::path folder_;
};

TEST_P(Readers, AcceptOrRefuseEverySeed) {
  const std::vector<std::string> inputs = Inputs(GetParam());
  EXPECT_GE(inputs.size(), 30u);
  for (const std::string& input : inputs) EXPECT_NO_THROW(Call(GetParam(), input)) << input;
}

TEST_P(Readers, AcceptOrRefuseChangedSeeds) {
  // pieces that turn one kind of value into another, and bytes that are no text
  const std::array<std::string, 16> pieces = {"",       "{}", "[]",  "null",        "-1", "1e308",
                                              "\"\"",   "\"", "\\u", "\xC3",        ",",  "[[[",
                                              "1e-400", "/",  "*",   "\xEF\xBB\xBF"};
  std::mt19937 generator(1);  // the same changes each time
  for (const std::string& input : Inputs(GetParam())) {
    if (input.size() > 20'000) continue;
    for (int change = 0; change < 12; ++change) {
      std::string changed = input;
      const std::size_t at = generator() % (changed.size() + 1);
      const std::size_t length = generator() % 12;
      changed.replace(at, std::min(length, changed.size() - at),
                      pieces[generator() % pieces.size()]);
      if (change % 4 == 3) changed.resize(at);
      EXPECT_NO_THROW(Call(GetParam(), changed)) << changed;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, Readers,
                         testing::Values("mechanism", "experiment", "claim", "map", "record"),
                         [](const auto& kind) { return kind.param; });

}  // namespace
}  // namespace loopbench::fuzz
