// Documents: their commands print the output that they show, and their links lead to files.
#include <algorithm>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "tests/harness/cli_fixture.h"
#include "tests/harness/places.h"

namespace loopbench::harness {
namespace documents_test {

using DocumentsTest = CommandLineTest;

/// What stands between the first fence after `words` and the next one.
std::string BlockAfter(const std::string& text, const std::string& words) {
  const std::size_t at = text.find(words);
  if (at == std::string::npos) return "";
  const std::size_t begin = text.find('\n', text.find("\n```", at) + 1) + 1;
  return text.substr(begin, text.find("\n```", begin) - begin + 1);
}

/// The documents that people write: those of the root, of docs/, of the rooms and of
/// examples/.
std::vector<fs::path> Documents() {
  std::vector<fs::path> documents;
  for (const char* folder :
       {".", "docs", "mechanism", "odca", "lagrange", "reduction", "examples"}) {
    for (const auto& entry : fs::directory_iterator(kRoot / folder)) {
      if (entry.path().extension() == ".md") documents.push_back(entry.path());
    }
  }
  std::ranges::sort(documents);
  return documents;
}

/// Without blocks of code, in which brackets and parentheses are no links.
std::string WithoutCode(const std::string& text) {
  std::istringstream lines(text);
  std::string prose;
  bool code = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("```")) code = !code;
    if (!code) prose += line + '\n';
  }
  return prose;
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
                         testing::Values("docs/quick-start.md", "docs/operation-counts.md",
                                         "docs/generated-code.md"));

TEST_F(DocumentsTest, AMissingFileIsSaidWithTheFolderItWasLookedForIn) {
  ExpectEnding(Call("verdict out --claims configs/claims.json"), 2, {"out"});
  ExpectEnding(
      Call("check configs/claims.json"), 2,
      {"configs/claims.json: cannot be read: no such file, seen from " + folder_.string()});
}

TEST(Documents, LinksAndPicturesLeadToFilesOfTheRepository) {
  const std::regex link(R"(\]\(([^)#]+)[^)]*\))");
  std::size_t links = 0;
  for (const fs::path& document : Documents()) {
    const std::string text = WithoutCode(ReadFile(document));
    for (std::sregex_iterator at(text.begin(), text.end(), link), end; at != end; ++at) {
      const std::string target = (*at)[1];
      if (target.find("://") != std::string::npos) continue;
      EXPECT_TRUE(fs::exists(document.parent_path() / target)) << document << ": " << target;
      ++links;
    }
  }
  EXPECT_GE(links, 20u);
}

}  // namespace documents_test
}  // namespace loopbench::harness
