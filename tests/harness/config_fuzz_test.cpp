// The short form of the fuzzers (tests/fuzz): seeds, broken files and shipped ones, whole, cut
// short and changed in single places, through the same functions.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "tests/fuzz/readers.h"
#include "tests/harness/places.h"

namespace loopbench::fuzz {
namespace config_fuzz_test {

namespace fs = std::filesystem;
using harness::kConfigs;
using harness::kRoot;

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

/// Stores of a few lines each.
std::vector<std::string> Stores() {
  std::vector<std::string> stores;
  const std::vector<std::string> lines = RecordLines();
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (i % 8 == 0) stores.emplace_back();
    stores.back() += lines[i] + '\n';
  }
  return stores;
}

/// What loopbench_bench writes, in small: repetitions, an aggregate, a complexity, an error.
std::vector<std::string> Measurements() {
  return {R"({
  "context": {"machine": "M", "compiler": "C", "flags": "F", "libm": "L", "commit": "c", "load_avg": [0.5, 1, 2]},
  "benchmarks": [
    {"name": "a/3", "run_name": "a/3", "run_type": "iteration", "repetitions": 3, "repetition_index": 0,
     "threads": 1, "iterations": 10, "real_time": 1.5, "cpu_time": 1.0, "time_unit": "us", "label": "00ff",
     "bodies": 3, "allocations": 0},
    {"name": "a/3", "run_name": "a/3", "run_type": "iteration", "iterations": 10, "real_time": 2.5,
     "cpu_time": 3.0, "time_unit": "us", "label": "00ff", "bodies": 3, "allocations": 0},
    {"name": "a/3_mean", "run_name": "a/3", "run_type": "aggregate", "aggregate_name": "mean",
     "real_time": 2.0, "cpu_time": 2.0, "time_unit": "us"},
    {"name": "a_BigO", "run_name": "a", "run_type": "aggregate", "aggregate_name": "BigO",
     "cpu_coefficient": 1.0, "real_coefficient": 1.0, "big_o": "N", "time_unit": "ns"},
    {"name": "b", "run_name": "b", "run_type": "iteration", "error_occurred": true,
     "error_message": "singular", "iterations": 0, "real_time": 0.0, "cpu_time": 0.0, "time_unit": "ns"}
  ]})",
          R"({"context": {}, "benchmarks": []})"};
}

/// Trajectories as they are written for other programs.
std::vector<std::string> Trajectories() {
  return {
      "# loopbench\nt [s],body:rod:x [m],body:rod:y [m],body:rod:angle [rad]\n"
      "0,0,1,0\n0.1,1e-3,1,nan\n",
      "t [s],joint:A:angle [rad],\"energy:kinetic [J]\",note\r\n0,0.5,,\r\n# "
      "later\r\n1,-0.5,2,\r\n",
      "t [s]\n0\n1\n2\n"};
}

std::vector<std::string> Inputs(const std::string& kind) {
  if (kind == "record") return RecordLines();
  if (kind == "store") return Stores();
  if (kind == "measurement") return Measurements();
  if (kind == "trajectory") return Trajectories();
  const std::string folder_name = kind == "sidecar"  ? "imports"
                                  : kind == "series" ? "references"
                                                     : kind + "s";
  std::vector<fs::path> files;
  for (const fs::path& folder :
       {kRoot / "tests/fuzz/seeds" / kind, kRoot / "tests/broken" / (kind + "s"),
        kRoot / "tests/broken" / kind, kConfigs / folder_name}) {
    if (!fs::exists(folder)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      const std::string extension = entry.path().extension();
      if (!entry.is_regular_file() || extension == ".expected") continue;
      const bool is_json = extension == ".json";  // beside an import, it is a sidecar
      if (folder_name == "imports" && is_json != (kind == "sidecar")) continue;
      files.push_back(entry.path());
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

/// Changes of each input: few here; LOOPBENCH_MUTATIONS in the environment asks for more of each
/// kind, for long runs under sanitizers (tests/fuzz/README.md).
int ChangesPerInput(std::size_t inputs) {
  const char* wanted = std::getenv("LOOPBENCH_MUTATIONS");
  return wanted == nullptr ? 12 : 1 + std::atoi(wanted) / static_cast<int>(inputs);
}

class Readers : public testing::TestWithParam<std::string_view> {
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
  const std::vector<std::string> inputs = Inputs(std::string(GetParam()));
  EXPECT_GE(inputs.size(), GetParam() == "measurement" ? 2u : 3u);
  for (const std::string& input : inputs) EXPECT_NO_THROW(CallReader(GetParam(), input)) << input;
}

TEST_P(Readers, AcceptOrRefuseChangedSeeds) {
  // pieces that turn one kind of value into another, and bytes that are no text
  const std::array<std::string, 16> pieces = {"",       "{}", "[]",  "null",        "-1", "1e308",
                                              "\"\"",   "\"", "\\u", "\xC3",        ",",  "[[[",
                                              "1e-400", "/",  "*",   "\xEF\xBB\xBF"};
  std::mt19937 generator(1);  // the same changes each time
  std::vector<std::string> inputs = Inputs(std::string(GetParam()));
  std::erase_if(inputs, [](const std::string& input) { return input.size() > 20'000; });
  const int changes = ChangesPerInput(inputs.size());
  for (const std::string& input : inputs) {
    for (int change = 0; change < changes; ++change) {
      std::string changed = input;
      const std::size_t at = generator() % (changed.size() + 1);
      const std::size_t length = generator() % 12;
      changed.replace(at, std::min(length, changed.size() - at),
                      pieces[generator() % pieces.size()]);
      if (change % 4 == 3) changed.resize(at);
      EXPECT_NO_THROW(CallReader(GetParam(), changed)) << changed;
    }
  }
  std::cout << inputs.size() * static_cast<std::size_t>(changes) << " inputs\n";
}

INSTANTIATE_TEST_SUITE_P(Kinds, Readers, testing::ValuesIn(kKinds),
                         [](const auto& kind) { return std::string(kind.param); });

}  // namespace config_fuzz_test
}  // namespace loopbench::fuzz
