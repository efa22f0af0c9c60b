// Documents: their commands print the output that they show, and reference pages are complete.
#include "harness/judge/analysis.h"
#include "harness/judge/judge.h"
#include "tests/harness/cli_fixture.h"

namespace loopbench::harness::documents_test {

using DocumentsTest = CommandLineTest;

/// Returns the text between the first fence after `words` and the next one.
std::string BlockAfter(const std::string& text, const std::string& words) {
  const std::size_t at = text.find(words);
  if (at == std::string::npos) return "";
  const std::size_t begin = text.find('\n', text.find("\n```", at) + 1) + 1;
  return text.substr(begin, text.find("\n```", begin) - begin + 1);
}

/// A line of output without numbers, which differ between machines, and without widths of columns.
std::string Shape(const std::string& line) {
  static const std::regex number("[-+]?[0-9][0-9.e+-]*"), blanks("[ -]+");
  return std::regex_replace(std::regex_replace(line, number, "#"), blanks, " ");
}

/// Lines as a terminal ends up showing them: progress is overwritten.
std::vector<std::string> Lines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    std::erase(line, '\r');
    const std::size_t shown = line.rfind("\x1b[K");
    lines.push_back(shown == std::string::npos ? line : line.substr(shown + 3));
  }
  return lines;
}

/// A command of a document, with the lines that it shows below it, up to "...".
struct Shown {
  std::string command;
  std::vector<std::string> lines;
};

std::vector<Shown> ShownCommands(const std::string& text) {
  std::vector<Shown> all;
  bool in_code = false, in_output = false;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    if (line.starts_with("```")) {
      in_code = !in_code;
      in_output = false;
    } else if (in_code && line.starts_with("$ ")) {
      all.push_back({line.substr(2, line.find("  #") - 2), {}});
      in_output = true;
    } else if (in_output && line != "..." && !line.empty()) {
      all.back().lines.push_back(line);
    }
  }
  return all;
}

/// Documents whose commands run in a folder with configs/ and the JSON files that they show.
class ShownOutput : public DocumentsTest, public testing::WithParamInterface<const char*> {};

TEST_P(ShownOutput, IsThatOfItsCommands) {
  const std::string text = ReadFile(kRoot / GetParam());
  for (const std::string file : {"slider-crank.json", "my-drift.json", "my-claims.json"}) {
    const std::string block = BlockAfter(text, "Write `" + file + "`");
    if (block.starts_with("{")) Write(file, block);
  }
  fs::create_symlink(kRoot / "configs", folder_ / "configs");
  const std::string folder = fs::path(LOOPBENCH_BINARY).parent_path().string();
  const std::vector<Shown> all = ShownCommands(text);
  ASSERT_FALSE(all.empty());
  for (const auto& [command, lines] : all) {
    SCOPED_TRACE(command);
    Write("command.sh", "export PATH='" + folder + "':$PATH NO_COLOR=1\nstty cols 120\n" + command);
    const Ending ending =
        Call("--version >/dev/null; script -qec 'sh command.sh' /dev/null </dev/null");
    EXPECT_EQ(ending.code, 0) << ending.text;
    const std::vector<std::string> output = Lines(ending.text);
    std::size_t at = 0;
    for (const std::string& line : lines) {
      const auto same = [&](const std::string& found) { return Shape(found) == Shape(line); };
      const auto place =
          std::find_if(output.begin() + static_cast<std::ptrdiff_t>(at), output.end(), same);
      ASSERT_NE(place, output.end()) << "not printed: " << line << "\n" << ending.text;
      at = static_cast<std::size_t>(place - output.begin()) + 1;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Documents, ShownOutput,
                         testing::Values("README.md", "docs/quick-start.md",
                                         "docs/operation-counts.md", "docs/generated-code.md"));

TEST_F(DocumentsTest, AMissingFileIsSaidWithTheFolderItWasLookedForIn) {
  Expect("check-claims out --claims configs/claims.json", 2, {"out"});
  Expect("check configs/claims.json", 2,
         {"configs/claims.json: cannot be read: no such file, seen from " + folder_.string()});
}

TEST(Documents, EveryOutcomeAndWarningHasASection) {
  const std::string text = ReadFile(kRoot / "docs/reference/outcomes-and-warnings.md");
  std::vector<std::string> names = {kEnergyWarning,       kSingularWarning, kRegularizedWarning,
                                    kDriftWarning,        kMembersWarning,  kExponentWarning,
                                    kDisagreementWarning, kErrorWarning,    kRefinementWarning,
                                    kDriveWarning,        kSpringWarning,   kStepsWarning};
  for (const RunEnding& ending : kRunEndings) names.emplace_back(ending.word);
  for (const std::string& name : names) {
    EXPECT_NE(text.find("\n### `" + name + "`\n"), std::string::npos) << name;
  }
}

TEST(Documents, EveryKeyOfRecordsIsDescribed) {
  const std::string text = ReadFile(kRoot / "docs/reference/records.md");
  for (const Measure& measure : BuiltInMeasures()) {
    // reserved keys, families of keys ("rank_*"), and a key of Google Benchmark's files
    const std::string key(measure.key);
    if (measure.type == ValueType::kAny || key == "load_average" || key.ends_with("_*")) continue;
    const std::string name = key.substr(0, key.find('*'));
    EXPECT_NE(text.find('`' + name), std::string::npos) << key;
  }
}

/// Commits in the provenance of the tables of a folder: "commit: 821824c71881".
std::set<std::string> CommitsOf(const fs::path& folder) {
  static const std::regex line("(^|\n)(# )?(measured: )?commit:? ([0-9a-f]{12})");
  std::set<std::string> commits;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string ending = entry.path().extension().string();
    if (ending != ".md" && ending != ".csv") continue;
    const std::string text = ReadFile(entry.path());
    for (std::sregex_iterator at(text.begin(), text.end(), line), end; at != end; ++at) {
      commits.insert((*at)[4]);
    }
  }
  return commits;
}

/// All tables of a folder, and results/README.md names it.
TEST(Results, TablesAreOfNamedPrograms) {
  const std::string text = ReadFile(kRoot / "results/README.md");
  for (const auto& entry : fs::directory_iterator(kRoot / "results")) {
    const std::string folder = entry.path().filename().string();
    if (!entry.is_directory() || folder == "baselines" || folder == "runs") continue;
    const std::set<std::string> commits = CommitsOf(entry.path());
    ASSERT_EQ(commits.size(), 1u) << folder;
    EXPECT_NE(text.find(commits.begin()->substr(0, 8)), std::string::npos) << folder;
  }
}

}  // namespace loopbench::harness::documents_test
