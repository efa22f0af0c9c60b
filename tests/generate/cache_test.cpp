// The compiler and the folder of compiled code: what is found there is refused unless it is safe.
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "harness/base/text.h"
#include "harness/generate/generated.h"
#include "harness/generate/record.h"
#include "tests/standard.h"

namespace loopbench::generate {
namespace {

namespace fs = std::filesystem;

/// A text of its own for each test: what is loaded stays.
std::string Text(int number) {
  return "void loopbench_use_sines(void (*s)(double, double*, double*)) { (void)s; }\n"
         "const int loopbench_room = " +
         std::to_string(number) +
         ";\nint loopbench_function(const double* x, const double* c, double* y, double* w) "
         "{\n  (void)c, (void)w;\n  y[0] = 2 * x[0];\n  return 1;\n}\n";
}

CompiledBranch CompileText(const std::string& text) {
  return CompileBranch(text, [&] { return text; });
}

class CacheTest : public ::testing::Test {
 protected:
  void SetUp() override {
    ::setenv("XDG_CACHE_HOME", folder_.path().c_str(), 1);
    ::unsetenv("CC");
  }
  void TearDown() override {
    ::unsetenv("XDG_CACHE_HOME");
    ::unsetenv("CC");
  }

  std::vector<fs::path> Kept() const {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(cache_)) files.push_back(entry.path());
    return files;
  }
  static std::string Refusal(const std::string& text) {
    try {
      CompileText(text);
    } catch (const NotCovered& why) {
      return why.what();
    }
    return "compiled";
  }

  harness::TemporaryFolder folder_{"loopbench-cache-test"};
  fs::path cache_ = folder_.path() / "loopbench";
};

TEST_F(CacheTest, KeepsOneFileOfTheUserAlone) {
  EXPECT_EQ(CompileText(Text(1)).room, 1);
  ASSERT_EQ(Kept().size(), 1u);
  struct stat of = {};
  ASSERT_EQ(::stat(cache_.c_str(), &of), 0);
  EXPECT_EQ(of.st_mode & 07777, 0700u);
  ASSERT_EQ(::stat(Kept().front().c_str(), &of), 0);
  EXPECT_EQ(of.st_mode & (S_IWGRP | S_IWOTH), 0u);
}

TEST_F(CacheTest, AFolderThatOthersMayWriteIsRefused) {
  fs::create_directory(cache_);
  fs::permissions(cache_, fs::perms::all);
  EXPECT_NE(Refusal(Text(2)).find("found owner"), std::string::npos);
  fs::remove_all(cache_);
  fs::create_directory_symlink(folder_.path(), cache_);
  EXPECT_NE(Refusal(Text(2)).find("expected a folder"), std::string::npos);
}

TEST_F(CacheTest, TheCompilerIsPartOfTheName) {
  CompileText(Text(3));
  ::setenv("CC", "cc -O1", 1);
  CompileText(Text(3));
  EXPECT_EQ(Kept().size(), 2u);
}

TEST_F(CacheTest, AFileThatOthersMayWriteOrThatIsNoLibraryIsRefused) {
  CompileText(Text(6));
  const fs::path name = Kept().front().filename();
  const fs::path other = folder_.path() / "other";
  fs::create_directories(other / "loopbench");
  fs::permissions(other / "loopbench", fs::perms::owner_all);
  fs::copy_file(cache_ / name, other / "loopbench" / name);
  fs::permissions(other / "loopbench" / name, fs::perms::all);
  ::setenv("XDG_CACHE_HOME", other.c_str(), 1);
  EXPECT_NE(Refusal(Text(6)).find("expected a file of user"), std::string::npos);
  fs::remove(other / "loopbench" / name);
  std::ofstream(other / "loopbench" / name) << "no library";
  fs::permissions(other / "loopbench" / name, fs::perms::owner_all);
  EXPECT_NE(Refusal(Text(6)).find(name.string()), std::string::npos);
  fs::remove(other / "loopbench" / name);
  EXPECT_EQ(Refusal(Text(6)), "compiled");
}

TEST_F(CacheTest, AChangedByteIsRefused) {
  CompileText(Text(7));
  const fs::path name = Kept().front().filename(), changed = folder_.path() / "changed";
  fs::create_directories(changed / "loopbench");
  fs::permissions(changed / "loopbench", fs::perms::owner_all);
  std::string bytes = harness::ReadFile(cache_ / name);
  bytes[bytes.size() / 2] ^= 1;
  std::ofstream(changed / "loopbench" / name) << bytes;
  fs::permissions(changed / "loopbench" / name, fs::perms::owner_all);
  ::setenv("XDG_CACHE_HOME", changed.c_str(), 1);
  EXPECT_NE(Refusal(Text(7)).find("found a wrong checksum"), std::string::npos);
}

TEST_F(CacheTest, WithoutAFolderNothingIsKeptAndTheCodeRuns) {
  std::ofstream(cache_) << "a file in the place of the folder";
  EXPECT_NE(Refusal(Text(4)).find("expected a folder"), std::string::npos);
  ::setenv("XDG_CACHE_HOME", "/proc/none", 1);
  const CompiledBranch branch = CompileText(Text(4));
  const double x = 3.0;
  double y = 0.0;
  EXPECT_EQ(branch.function(&x, nullptr, &y, nullptr), 1);
  EXPECT_EQ(y, 6.0);
}

TEST_F(CacheTest, ACompilerThatIsMissingOrFailsIsNamed) {
  ::setenv("CC", "no-such-compiler", 1);
  EXPECT_NE(Refusal(Text(5)).find("'no-such-compiler' not found (CC names another)"),
            std::string::npos);
  ::setenv("CC", "false", 1);
  EXPECT_NE(Refusal(Text(5)).find("false failed with exit code 1"), std::string::npos);
  ::unsetenv("CC");
  EXPECT_NE(Refusal("this is no C\n").find("failed with exit code 1"), std::string::npos);
}

/// It ignores the polite signal, too.
TEST_F(CacheTest, ACompilerThatHangsIsEndedAndNamed) {
  const fs::path script = folder_.path() / "hangs";
  std::ofstream(script) << "#!/bin/sh\ntrap '' TERM\nwhile :; do sleep 0.1; done\n";
  fs::permissions(script, fs::perms::owner_all);
  ::setenv("CC", script.c_str(), 1);
  try {
    RunCompiler({"--version"}, {}, 1);
    ADD_FAILURE() << "ended by itself";
  } catch (const NotCovered& why) {
    EXPECT_EQ(std::string(why.what()), script.string() + " took more than 1 s");
  }
}

/// The library fits, its checksum behind it does not.
TEST_F(CacheTest, OnAFullDiskNothingIsKeptAndTheCodeRuns) {
  CompileText(Text(10));
  const fs::path kept = Kept().front();
  rlimit before = {};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  rlimit full = before;
  full.rlim_cur = fs::file_size(kept) - 1;
  const auto ignored = std::signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &full), 0);
  const CompiledBranch branch = CompileText(Text(11));
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, ignored);
  EXPECT_EQ(branch.room, 11);
  EXPECT_EQ(Kept(), std::vector{kept});
}

TEST_F(CacheTest, ProcessesThatCompileTheSameAtOnceKeepOneFile) {
  std::vector<pid_t> children;
  for (int i = 0; i < 6; ++i) {
    const pid_t child = ::fork();
    if (child == 0) {
      const CompiledBranch branch = CompileText(Text(12));
      const double x = 3.0;
      double y = 0.0;
      std::_Exit(branch.function(&x, nullptr, &y, nullptr) == 1 && y == 6.0 ? 0 : 1);
    }
    children.push_back(child);
  }
  for (const pid_t child : children) {
    int status = -1;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    EXPECT_EQ(status, 0);
  }
  ASSERT_EQ(Kept().size(), 1u);
  EXPECT_EQ(Kept().front().extension(), ".so");
  EXPECT_EQ(CompileText(Text(12)).room, 12);  // this process finds it whole
}

}  // namespace
}  // namespace loopbench::generate
