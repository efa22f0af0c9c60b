#include "harness/suite/group_marks.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "harness/text/hash.h"

namespace loopbench::harness {
namespace {

constexpr std::uintmax_t kLast = 512;  ///< bytes, of a record with its checksum

/// Of the bytes before `end`, "" when they cannot be read.
std::string HashBefore(std::ifstream& store, std::uintmax_t end) {
  const std::uintmax_t begin = end - std::min(end, kLast);
  std::string bytes(static_cast<std::size_t>(end - begin), '\0');
  store.clear();
  store.seekg(static_cast<std::streamoff>(begin));
  store.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return store.gcount() == static_cast<std::streamsize>(bytes.size()) ? Fnv1a(bytes) : "";
}

}  // namespace

GroupMarks::GroupMarks(const std::filesystem::path& store, std::string content)
    : store_(store),
      file_(std::filesystem::path(store).replace_extension(".groups")),
      content_(std::move(content)) {
  std::ifstream lines(file_), bytes(store_, std::ios::binary);
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(store_, error);
  if (error) return;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string of, kind, hash, end;
    std::size_t group = 0;
    std::uintmax_t length = 0;
    GroupMark mark;
    words >> of >> kind >> group >> mark.records >> mark.failed >> length >> hash >> end;
    // a torn line has no end
    if (of != content_ || end != "." || length > size) continue;
    if (HashBefore(bytes, length) == hash) marks_[{kind, group}] = mark;
  }
}

std::optional<GroupMark> GroupMarks::Find(const std::string& kind, std::size_t group) const {
  const auto mark = marks_.find({kind, group});
  return mark == marks_.end() ? std::nullopt : std::optional(mark->second);
}

void GroupMarks::Add(const std::string& kind, std::size_t group, const GroupMark& mark) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(store_, error);
  std::ifstream bytes(store_, std::ios::binary);
  if (error || size == 0) return;
  marks_[{kind, group}] = mark;
  std::ofstream(file_, std::ios::app)
      << fmt::format("{} {} {} {} {} {} {} .\n", content_, kind, group, mark.records, mark.failed,
                     size, HashBefore(bytes, size));
}

}  // namespace loopbench::harness
