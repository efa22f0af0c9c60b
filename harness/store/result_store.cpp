#include "harness/store/result_store.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string_view>

#include "harness/store/contents.h"
#include "harness/store/files.h"

namespace loopbench::harness {
namespace {

std::filesystem::path FileOf(const std::filesystem::path& path) {
  return path.extension() == ".jsonl" ? path : path / "results.jsonl";
}

// Locks of POSIX belong to the process: children do not inherit them, and they end with it.
int Lock(const std::filesystem::path& file) {
  const std::filesystem::path path = file.string() + ".lock";
  constexpr int kMode = 0644;
  const int lock = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, kMode);
  if (lock < 0) FailOn("open", path);
  struct flock whole = {};
  whole.l_type = F_WRLCK;
  whole.l_whence = SEEK_SET;
  if (::fcntl(lock, F_SETLK, &whole) == 0) return lock;
  const int reason = errno;
  whole.l_type = F_WRLCK;
  const bool known = ::fcntl(lock, F_GETLK, &whole) == 0 && whole.l_type != F_UNLCK;
  ::close(lock);
  if (reason != EACCES && reason != EAGAIN) {
    errno = reason;
    FailOn("lock", path);
  }
  throw std::runtime_error(
      fmt::format("'{}' is in use by process {}; wait for it, or write to another --out",
                  file.string(), known ? std::to_string(whole.l_pid) : "?"));
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
    FailOn("mend the last line of", file);
  }
}

}  // namespace

ResultStore::ResultStore(const std::filesystem::path& path) : file_(FileOf(path)) {
  MakeFolderOf(file_);
  lock_ = Lock(file_);
  constexpr int kMode = 0644;
  descriptor_ = ::open(file_.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, kMode);
  try {
    if (descriptor_ < 0) FailOn("open", file_);
    MendLastLine(file_, descriptor_);
    SyncFolderOf(file_);
  } catch (...) {
    if (descriptor_ >= 0) ::close(descriptor_);
    ::close(lock_);
    throw;
  }
}

ResultStore::~ResultStore() {
  ::close(descriptor_);
  ::close(lock_);
}

void ResultStore::Append(const Record& record) {
  const std::string line = ToJsonLine(record) + '\n';
  const std::lock_guard lock(mutex_);
  const off_t before = ::lseek(descriptor_, 0, SEEK_END);
  try {
    WriteAll(descriptor_, line, file_);
    if (::fsync(descriptor_) != 0) FailOn("write to the disk", file_);
  } catch (...) {
    // what cannot be kept whole is not kept: the next run finds complete records only
    [[maybe_unused]] const int failed = ::ftruncate(descriptor_, before);
    throw;
  }
}

std::vector<Record> LatestRecords(const std::vector<Record>& records) {
  std::vector<Record> latest;
  std::map<std::string, std::size_t> place;
  for (const Record& record : records) {
    const std::string id = record.Text("case_id");
    const auto [at, is_new] = place.try_emplace(id, latest.size());
    if (id.empty() || is_new) {
      latest.push_back(record);
    } else {
      latest[at->second] = record;
    }
  }
  return WithContents(std::move(latest));
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
