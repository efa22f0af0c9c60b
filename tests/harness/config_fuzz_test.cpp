// The short form of the fuzzers (tests/fuzz): seeds, broken files and shipped ones, whole, cut
// short and changed in single places, through the same functions.
#include "tests/fuzz/readers.h"
#include "tests/harness/places.h"

namespace loopbench::fuzz::config_fuzz_test {

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

std::vector<std::string> Inputs(const std::string& kind) {
  if (kind == "record") return RecordLines();
  if (kind == "store") return Stores();
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
  for (const fs::path& file : files) inputs.push_back(harness::ReadFile(file));
  return inputs;
}

/// Changes of each input: few here, if there are many inputs; LOOPBENCH_MUTATIONS in the
/// environment asks for more of each kind, for long runs under sanitizers (tests/fuzz/README.md).
int ChangesPerInput(std::size_t inputs) {
  const char* wanted = std::getenv("LOOPBENCH_MUTATIONS");
  if (wanted != nullptr) return 1 + std::atoi(wanted) / static_cast<int>(inputs);
  return inputs < 10 ? 2000 : 12;
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
  std::size_t refused = 0;  // a reader that accepts everything reads nothing
  for (const std::string& input : inputs) {
    for (int change = 0; change < changes; ++change) {
      std::string changed = input;
      const std::size_t at = generator() % (changed.size() + 1);
      const std::size_t length = generator() % 12;
      changed.replace(at, std::min(length, changed.size() - at),
                      pieces[generator() % pieces.size()]);
      if (change % 4 == 3) changed.resize(at);
      EXPECT_NO_THROW(refused += CallReader(GetParam(), changed) ? 0 : 1) << changed;
    }
  }
  EXPECT_GT(10 * refused, inputs.size() * static_cast<std::size_t>(changes));
  std::cout << inputs.size() * static_cast<std::size_t>(changes) << " inputs\n";
}

INSTANTIATE_TEST_SUITE_P(Kinds, Readers, testing::ValuesIn(kKinds),
                         [](const auto& kind) { return std::string(kind.param); });

}  // namespace loopbench::fuzz::config_fuzz_test
