#include "harness/text/files.h"

#include <fcntl.h>
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

/// The temporary file of a text, all of it on the disk.
std::filesystem::path WriteTemporary(
    const std::filesystem::path& path,
    const std::function<void(const std::function<void(std::string_view)>& write)>& fill) {
  MakeFolderOf(path);
  std::filesystem::path temporary = TemporaryBeside(path);
  constexpr int kMode = 0644;
  const int descriptor = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, kMode);
  if (descriptor < 0) FailOn("write", path);
  try {
    fill([descriptor, &path](std::string_view text) { WriteAll(descriptor, text, path); });
    if (::fsync(descriptor) != 0) FailOn("write", path);
  } catch (...) {
    ::close(descriptor);
    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    throw;
  }
  ::close(descriptor);
  return temporary;
}

}  // namespace

void FailOn(std::string_view verb, const std::filesystem::path& path) {
  throw std::runtime_error(
      fmt::format("cannot {} '{}': {}", verb, path.string(), std::strerror(errno)));
}

void MakeFolderOf(const std::filesystem::path& path) {
  if (!path.has_parent_path()) return;
  std::error_code error;
  std::filesystem::create_directories(path.parent_path(), error);
  if (!error) return;
  std::string reason = error.message();
  std::error_code ignored;
  for (auto folder = path.parent_path(); folder.has_filename(); folder = folder.parent_path()) {
    const auto kind = std::filesystem::symlink_status(folder, ignored).type();
    if (kind != std::filesystem::file_type::symlink || std::filesystem::exists(folder, ignored)) {
      continue;
    }
    reason = fmt::format("'{}' is a symbolic link to '{}', which is not there", folder.string(),
                         std::filesystem::read_symlink(folder, ignored).string());
  }
  throw std::runtime_error(
      fmt::format("cannot make folder '{}': {}", path.parent_path().string(), reason));
}

void WriteFileAtomically(const std::filesystem::path& path, std::string_view text) {
  WriteFileAtomically(path, [text](const auto& write) { write(text); });
}

void WriteFileAtomically(
    const std::filesystem::path& path,
    const std::function<void(const std::function<void(std::string_view)>& write)>& fill) {
  const std::filesystem::path temporary = WriteTemporary(path, fill);
  std::error_code error;
  std::filesystem::rename(temporary, path, error);
  if (error) {
    errno = error.value();
    std::filesystem::remove(temporary, error);
    FailOn("write", path);
  }
  SyncFolderOf(path);
}

bool WriteNewFile(const std::filesystem::path& path, std::string_view text) {
  const auto temporary = WriteTemporary(path, [text](const auto& write) { write(text); });
  int failure = ::link(temporary.c_str(), path.c_str()) == 0 ? 0 : errno;
  if (failure == EPERM || failure == EOPNOTSUPP) {  // a file has one name there
    const bool done =
        ::renameat2(AT_FDCWD, temporary.c_str(), AT_FDCWD, path.c_str(), RENAME_NOREPLACE) == 0;
    failure = done ? 0 : errno;
  }
  std::error_code ignored;
  std::filesystem::remove(temporary, ignored);
  if (failure == EEXIST) return false;
  errno = failure;
  if (failure != 0) FailOn("write", path);
  SyncFolderOf(path);
  return true;
}

void SyncFolderOf(const std::filesystem::path& path) {
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

void WriteAll(int descriptor, std::string_view text, const std::filesystem::path& path) {
  while (!text.empty()) {
    const ssize_t written = ::write(descriptor, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) FailOn("write", path);
    text.remove_prefix(static_cast<std::size_t>(written));
  }
}

std::string ReadFile(const std::filesystem::path& path) {
  std::error_code error;
  const auto kind = std::filesystem::status(path, error).type();
  if (kind != std::filesystem::file_type::regular &&
      (std::filesystem::exists(path, error) && kind != std::filesystem::file_type::directory)) {
    throw std::runtime_error(
        fmt::format("cannot read '{}': expected a regular file", path.string()));
  }
  errno = 0;
  std::ifstream in(path, std::ios::binary);
  if (!in) FailOn("read", path);
  std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (in.bad()) FailOn("read", path);
  return text;
}

}  // namespace loopbench::harness
