#include "harness/text/files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "harness/text/output_file.h"

namespace loopbench::harness {

void FailOn(std::string_view verb, const std::filesystem::path& path) {
  throw SystemFault(fmt::format("cannot {} '{}': {}", verb, path.string(), std::strerror(errno)));
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
  OutputFile file(path);
  fill([&file](std::string_view text) { file.Write(text); });
  file.Finish();
}

bool WriteNewFile(const std::filesystem::path& path, std::string_view text) {
  if (std::filesystem::exists(std::filesystem::symlink_status(path))) return false;
  OutputFile file(path);
  file.Write(text);
  return file.FinishIfNew();
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
  const auto status = std::filesystem::status(path, error);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    throw std::runtime_error(fmt::format(
        "cannot read '{}': found {}, expected a regular file", path.string(),
        std::filesystem::is_directory(status) ? "a folder" : "a device, a pipe or a socket"));
  }
  NoteInput(path);
  errno = 0;
  std::ifstream in(path, std::ios::binary);
  if (!in) FailOn("read", path);
  std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (in.bad()) FailOn("read", path);
  return text;
}

}  // namespace loopbench::harness
