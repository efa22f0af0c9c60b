// Which groups of a long sweep are done, beside the store: so that a run that goes on need not read
// a million combinations to find that it has them.
//
// A mark is a line of results.groups: what is run (Workload::content()), the kind, the group, how
// many records, how many of runs that did not finish, and what the store was when it was made: its
// length and a hash of its last bytes. A store that is not what it was then, in front of that
// length, has no such mark: the store is the truth, and whoever deletes the marks loses only time.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>

namespace loopbench::harness {

struct GroupMark {
  std::size_t records = 0, failed = 0;
};

class GroupMarks {
 public:
  /// Reads the marks of this content that hold for the store.
  /// @param store  its file
  GroupMarks(const std::filesystem::path& store, std::string content);

  std::optional<GroupMark> Find(const std::string& kind, std::size_t group) const;

  /// Says that all records of the group are in the store. A mark that cannot be written is
  /// forgotten.
  void Add(const std::string& kind, std::size_t group, const GroupMark& mark);

 private:
  std::filesystem::path store_, file_;
  std::string content_;
  std::map<std::pair<std::string, std::size_t>, GroupMark> marks_;
};

}  // namespace loopbench::harness
