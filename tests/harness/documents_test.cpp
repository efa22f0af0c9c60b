// What the documents promise: the mechanism of docs/using.md, as a stranger types it, in a folder
// of his own outside the repository; and that links and pictures lead to files that are there.
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

TEST_F(DocumentsTest, CommandsWorkInAFolderOutsideTheRepository) {
  const std::string text = ReadFile(kRoot / "docs/using.md");
  const std::string own = text.substr(text.find("## Your own mechanism"));
  for (const std::string file : {"slider-crank.json", "my-drift.json", "my-claims.json"}) {
    const std::string block = BlockAfter(own, "`" + file + "`");
    ASSERT_EQ(block.substr(0, 1), "{") << file;
    Write(file, block);
  }
  std::istringstream commands(BlockAfter(own, "Then, with `loopbench`"));
  std::size_t count = 0;
  for (std::string line; std::getline(commands, line); ++count) {
    line = line.substr(0, line.find('#'));
    ASSERT_EQ(line.rfind("loopbench ", 0), 0u) << line;
    // timings say nothing here and take long
    if (line.find(" run ") != std::string::npos) line += " --no-timing";
    const Ending ending = Call(line.substr(10));
    EXPECT_EQ(ending.code, 0) << line << '\n' << ending.text;
    if (line.find(" verdict ") == std::string::npos) continue;
    EXPECT_NE(ending.text.find("reproduced"), std::string::npos) << ending.text;
    EXPECT_EQ(ending.text.find("not measured"), std::string::npos) << ending.text;
  }
  EXPECT_GE(count, 9u);
}

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
