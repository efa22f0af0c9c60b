#include "harness/store/files.h"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace loopbench::harness {
namespace {

// Unique among the threads and processes that write into the same folder.
std::filesystem::path TemporaryBeside(const std::filesystem::path& path) {
  static std::atomic<int> counter{0};
  std::filesystem::path temporary = path;
  temporary += fmt::format(".{}-{}.tmp", ::getpid(), counter++);
  return temporary;
}

}  // namespace

void FailOn(std::string_view verb, const std::filesystem::path& path) {
  throw std::runtime_error(
      fmt::format("cannot {} '{}': {}", verb, path.string(), std::strerror(errno)));
}

void WriteFileAtomically(const std::filesystem::path& path, std::string_view text) {
  std::error_code error;
  if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path(), error);
  const std::filesystem::path temporary = TemporaryBeside(path);
  errno = 0;
  std::ofstream out(temporary, std::ios::binary | std::ios::trunc);
  if (!out) FailOn("write", path);
  out.write(text.data(), static_cast<std::streamsize>(text.size()));
  out.close();
  if (!out) {
    std::filesystem::remove(temporary, error);
    FailOn("write", path);
  }
  std::filesystem::rename(temporary, path, error);
  if (error) {
    errno = error.value();
    std::filesystem::remove(temporary, error);
    FailOn("write", path);
  }
}

std::string ReadFile(const std::filesystem::path& path) {
  errno = 0;
  std::ifstream in(path, std::ios::binary);
  if (!in) FailOn("read", path);
  std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (in.bad()) FailOn("read", path);
  return text;
}

}  // namespace loopbench::harness
