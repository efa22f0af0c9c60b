// The README's own mechanism, as a stranger types it: in a folder of his own, outside the
// repository.
#include <sstream>

#include "tests/harness/cli_fixture.h"

namespace loopbench::harness {
namespace {

using ReadmeTest = CommandLineTest;

/// What stands between the first fence after `words` and the next one.
std::string BlockAfter(const std::string& text, const std::string& words) {
  const std::size_t at = text.find(words);
  if (at == std::string::npos) return "";
  const std::size_t begin = text.find('\n', text.find("\n```", at) + 1) + 1;
  return text.substr(begin, text.find("\n```", begin) - begin + 1);
}

TEST_F(ReadmeTest, ItsCommandsWorkInAFolderOutsideTheRepository) {
  const std::string readme = ReadFile(fs::path(LOOPBENCH_SOURCE_DIR) / "README.md");
  const std::string own = readme.substr(readme.find("## Your own mechanism"));
  for (const std::string file : {"slider-crank.json", "my-drift.json", "my-claims.json"}) {
    const std::string text = BlockAfter(own, "`" + file + "`");
    ASSERT_EQ(text.substr(0, 1), "{") << file;
    Write(file, text);
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

TEST_F(ReadmeTest, AMissingFileIsSaidWithTheFolderItWasLookedForIn) {
  ExpectEnding(Call("verdict out --claims configs/claims.json"), 2, {"out"});
  ExpectEnding(
      Call("check configs/claims.json"), 2,
      {"configs/claims.json: cannot be read: no such file, seen from " + folder_.string()});
}

}  // namespace
}  // namespace loopbench::harness
