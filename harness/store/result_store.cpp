#include "harness/store/result_store.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string_view>

#include "harness/store/files.h"

namespace loopbench::harness {
namespace {

std::filesystem::path FileOf(const std::filesystem::path& path) {
  return path.extension() == ".jsonl" ? path : path / "results.jsonl";
}

[[noreturn]] void Fail(std::string_view verb, const std::filesystem::path& file) {
  throw std::runtime_error(
      fmt::format("cannot {} '{}': {}", verb, file.string(), std::strerror(errno)));
}

// One write(2) in the usual case; more only if the system accepted a part or was interrupted.
void WriteAll(int descriptor, std::string_view text, const std::filesystem::path& file) {
  while (!text.empty()) {
    const ssize_t written = ::write(descriptor, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) Fail("append to", file);
    text.remove_prefix(static_cast<std::size_t>(written));
  }
}

bool IsRecord(std::string_view line) {
  try {
    FromJsonLine(line);
    return true;
  } catch (const std::runtime_error&) {
    return false;
  }
}

// Ends the file with a line end: a complete record gets its own, a torn one goes.
void MendLastLine(const std::filesystem::path& file, int descriptor) {
  const std::string text = ReadFile(file);
  if (text.empty() || text.back() == '\n') return;
  const std::size_t line_end = text.rfind('\n');
  const std::size_t start = line_end == std::string::npos ? 0 : line_end + 1;
  if (IsRecord(std::string_view(text).substr(start))) {
    WriteAll(descriptor, "\n", file);
  } else if (::ftruncate(descriptor, static_cast<off_t>(start)) != 0) {
    Fail("mend the last line of", file);
  }
}

}  // namespace

ResultStore::ResultStore(const std::filesystem::path& path) : file_(FileOf(path)) {
  std::error_code error;
  if (file_.has_parent_path()) std::filesystem::create_directories(file_.parent_path(), error);
  constexpr int kMode = 0644;
  descriptor_ = ::open(file_.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, kMode);
  if (descriptor_ < 0) Fail("open", file_);
  try {
    MendLastLine(file_, descriptor_);
  } catch (...) {
    ::close(descriptor_);
    throw;
  }
}

ResultStore::~ResultStore() { ::close(descriptor_); }

void ResultStore::Append(const Record& record) {
  const std::string line = ToJsonLine(record) + '\n';
  const std::lock_guard lock(mutex_);
  WriteAll(descriptor_, line, file_);
}

std::vector<Record> ReadRecords(const std::filesystem::path& path,
                                std::vector<std::string>* warnings) {
  const std::filesystem::path file = FileOf(path);
  const std::string text = ReadFile(file);
  std::vector<Record> records;
  int number = 0;
  for (std::size_t start = 0; start < text.size();) {
    const std::size_t end = text.find('\n', start);
    const bool ended = end != std::string::npos;
    const std::string_view line =
        std::string_view(text).substr(start, ended ? end - start : std::string::npos);
    start = ended ? end + 1 : text.size();
    ++number;
    if (line.empty()) continue;
    try {
      records.push_back(FromJsonLine(line));
    } catch (const std::runtime_error& error) {
      constexpr std::size_t kShown = 80;
      const std::string message = fmt::format("{}:{}: {}: '{}'", file.string(), number,
                                              error.what(), line.substr(0, kShown));
      if (ended) throw std::runtime_error(message);
      if (warnings != nullptr) warnings->push_back(message + " (torn last line, skipped)");
    }
  }
  return records;
}

}  // namespace loopbench::harness
