#include "harness/store/finished_runs.h"

#include <charconv>
#include <fstream>
#include <string_view>

#include "harness/record/record.h"
#include "harness/store/result_store.h"
#include "harness/text/files.h"

namespace loopbench::harness {
namespace {

/// The sixteen digits as a number.
std::optional<std::uint64_t> NumberOfId(std::string_view id) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(id.data(), id.data() + id.size(), number, 16);
  const bool is_whole = error == std::errc() && end == id.data() + id.size() && id.size() == 16;
  return is_whole ? std::optional(number) : std::nullopt;
}

}  // namespace

std::string_view TextUnder(std::string_view quoted_key, std::string_view line) {
  const std::size_t key = line.find(quoted_key);
  if (key == std::string_view::npos) return {};
  const std::size_t begin = key + quoted_key.size(), end = line.find('"', begin);
  return end == std::string_view::npos ? std::string_view() : line.substr(begin, end - begin);
}

std::optional<bool> FinishedRuns::Find(const std::string& id) {
  if (!is_read_) Read();
  is_read_ = true;
  const auto number = NumberOfId(id);
  const auto run = number ? finished_.find(*number) : finished_.end();
  return run == finished_.end() ? std::nullopt : std::optional(run->second);
}

void FinishedRuns::Read() {
  const std::filesystem::path file = StoreFile(path_);
  if (!IsLarge(file)) {
    for (const Record& record : ReadRecords(path_)) {
      if (const auto id = NumberOfId(record.Text("id"))) {
        finished_[*id] = record.Text("outcome") == "finished";
      }
    }
    return;
  }
  std::ifstream lines(file, std::ios::binary);
  std::string line;
  while (std::getline(lines, line)) {
    if (const auto id = NumberOfId(TextUnder("\"id\":\"", line))) {
      finished_[*id] = TextUnder("\"outcome\":\"", line) == "finished";
    }
  }
  if (lines.bad()) FailOn("read", file);
}

}  // namespace loopbench::harness
