// A private folder as testing::TempDir() of each test process, removed at its end: tests that run
// side by side use the same names of files.
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>

namespace loopbench {
namespace {

class Scratch {
 public:
  Scratch() {
    if (::getenv("TEST_TMPDIR") != nullptr)
      return;  // also of death tests, whose ends skip ~Scratch
    std::string path = (std::filesystem::temp_directory_path() / "loopbench-test-XXXXXX").string();
    if (::mkdtemp(path.data()) == nullptr) return;
    path_ = path;
    ::setenv("TEST_TMPDIR", (path_ / "").c_str(), 1);
  }
  ~Scratch() {
    std::error_code ignored;
    if (!path_.empty() && ::getpid() == owner_) std::filesystem::remove_all(path_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;

 private:
  const ::pid_t owner_ = ::getpid();  // not of forked processes
  std::filesystem::path path_;
};

const Scratch kScratch;

}  // namespace
}  // namespace loopbench
