// Texts for users do not contain these earlier names, most of which `loopbench migrate` replaces.
#include "tests/harness/cli_fixture.h"

namespace loopbench::harness::old_names_test {

constexpr std::array<std::string_view, 45> kOldNames = {
    "as-published",   "trust_horizon",     "scene_id",
    "softened_steps", "softened_eval",     "singularity_passages",
    "yardstick_",     "disturbed_rounds",  "error_shape_max",
    "_ruled_by",      "error_over_accur",  "reference_witnesses",
    "members-failed", "singular-passage",  "inexpressible",
    "bad-answer",     "must_hold",         "only_under",
    "failure-map",    "failure map",       "several_scalars",
    "\"scenes\":",    "\"columns\":",      "\"observe\":",
    "\"held\":",      "\"decides\":",      "\"doubts\":",
    "--gate",         "COULD NOT MEASURE", "loopbench convert",
    "loopbench map",  "loopbench verdict", "loopbench tradeoff",
    "loopbench fit ", "loopbench plan",    "loopbench export ",
    "--classes",      "--short-run",       "--again",
    "column doubts",  "`doubts`",          ",doubts,",
    "level position", "`--from`",          "plan --from"};

void ExpectNone(std::string text, const std::string& place) {
  std::ranges::replace(text, '\n', ' ');
  for (const std::string_view name : kOldNames) {
    const std::size_t found = text.find(name);
    EXPECT_EQ(found, std::string::npos)
        << place << ": " << text.substr(found - std::min<std::size_t>(found, 60), 120);
  }
}

TEST(OldNames, StandInNoFileThatUsersRead) {
  int files = 0;
  const auto read = [&files](const fs::path& file) {
    ++files;
    ExpectNone(ReadFile(file), fs::relative(file, kRoot).string());
  };
  for (const char* name : {"README.md", "CHANGELOG.md", "CONTRIBUTING.md", "reproduce"}) {
    read(kRoot / name);
  }
  for (const char* folder : {"configs", "docs", "examples", "peers", "results"}) {
    fs::recursive_directory_iterator each(kRoot / folder);
    for (const fs::directory_entry& entry : each) {
      if (entry.path() == kRoot / "results/runs") each.disable_recursion_pending();
      const std::string type = entry.path().extension().string();
      for (const char* wanted : {".json", ".jsonl", ".md", ".csv", ".yml", ".yaml", ".sh"}) {
        if (entry.is_regular_file() && type == wanted) read(entry.path());
      }
    }
  }
  EXPECT_GT(files, 200);
}

class OldNamesOfCommands : public CommandLineTest {};

TEST_F(OldNamesOfCommands, StandInNoHelpText) {
  const Ending manual = Call("manual");
  EXPECT_EQ(manual.code, 0);
  EXPECT_GT(manual.text.size(), 10000u);
  ExpectNone(manual.text, "manual");
}

TEST_F(OldNamesOfCommands, OptionsInDocumentsExist) {
  std::string known = std::regex_replace(Call("manual").text, std::regex(R"(\\f[BR])"), " ");
  std::erase(known, '\\');  // of roff
  known += " --requeue ";   // of sbatch
  for (const char* file :
       {"reproduce", "check", "harness/run/bench.cpp", "harness/cli/cluster.cpp"}) {
    known += ReadFile(kRoot / file);
  }
  for (const auto& tool : fs::directory_iterator(kRoot / "tools")) known += ReadFile(tool.path());
  const std::regex typed("`(--[a-z][a-z-]+)|loopbench [a-z][^`\n]*"), option(" (--[a-z][a-z-]+)");
  int options = 0;
  const auto expect = [&](const std::string& name, const fs::path& file) {
    ++options;
    EXPECT_TRUE(std::regex_search(known, std::regex(name + "(?![a-z-])"))) << file << ": " << name;
  };
  for (const auto& entry : fs::recursive_directory_iterator(kRoot / "docs")) {
    if (entry.path().extension() != ".md") continue;
    const std::string text = ReadFile(entry.path());
    for (std::sregex_iterator it(text.begin(), text.end(), typed), end; it != end; ++it) {
      if ((*it)[1].matched) expect((*it)[1], entry.path());
      std::string line = it->str();
      line.resize(std::min(line.find_first_of("|#&"), line.size()));  // other commands, comments
      for (std::sregex_iterator at(line.begin(), line.end(), option); at != end; ++at) {
        expect((*at)[1], entry.path());
      }
    }
  }
  EXPECT_GT(options, 200);
}

}  // namespace loopbench::harness::old_names_test
