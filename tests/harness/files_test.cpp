// Files that are there whole or not at all.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <string>

#include "harness/base/text.h"

namespace loopbench::harness {
namespace files_test {

TEST(Files, ANewFileOfAKilledWriterIsNotThere) {
  const TemporaryFolder folder("loopbench-files");
  const std::filesystem::path path = folder.path() / "new";
  const std::string text(1 << 16, 'x');
  const auto write_and_be_killed = [&] {
    const rlimit half = {text.size() / 2, text.size() / 2};
    ::setrlimit(RLIMIT_FSIZE, &half);
    std::signal(SIGXFSZ, SIG_DFL);
    WriteNewFile(path, text);
  };
  EXPECT_EXIT(write_and_be_killed(), ::testing::KilledBySignal(SIGXFSZ), "");
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_TRUE(WriteNewFile(path, text));
  EXPECT_EQ(ReadFile(path), text);
  EXPECT_FALSE(WriteNewFile(path, "another"));
  EXPECT_EQ(ReadFile(path), text);
}

TEST(Files, ANewFileLeavesNothingBesideIt) {
  const TemporaryFolder folder("loopbench-files");
  for (const char* text : {"first", "second"}) WriteNewFile(folder.path() / "new", text);
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    EXPECT_EQ(entry.path().filename(), "new");
  }
}

}  // namespace files_test
}  // namespace loopbench::harness
