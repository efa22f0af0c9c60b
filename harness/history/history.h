// The measurements of one commit after the other: a folder that only grows.
//
//   DIR/history.jsonl     a line for each commit that was added, and for each mark
//   DIR/results/*.jsonl   what was measured, without the series of a run but with samples of times
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

/// What was measured of a commit on a machine.
struct HistoryEntry {
  std::string commit, date;  ///< date: ISO 8601 in UTC, of the commit
  std::string machine = {};  ///< processor model and number of logical processors
  std::filesystem::path results = {};
  std::string mark = {};  ///< good, accepted, bad, or "" when nobody said
  std::string note = {};
};

/// The first twelve digits of a hash; other names as they are.
std::string ShortCommit(const std::string& commit);

struct History {
  std::vector<HistoryEntry> entries;  ///< in the order of their dates, of equal ones as added
  std::vector<std::string> warnings;  ///< torn lines, which a crash leaves
};

/// Throws ConfigError when there is no history in the folder, std::runtime_error as ReadRecords().
History ReadHistory(const std::filesystem::path& folder);

/// What was measured of an entry, each case once. Throws std::runtime_error as ReadRecords(); torn
/// lines go to `warnings`.
std::vector<Record> ReadResults(const HistoryEntry& entry, std::vector<std::string>* warnings);

/// Adds what was measured of a commit; makes the folder. Waits while another process adds. Throws
/// ConfigError when the commit is there for this machine (unless `replaces`), when its date is
/// none, when records come from several machines, or when none says how its case ended. What is
/// replaced loses its mark, unless somebody accepted it; its file of results stays.
/// @param entry  commit and date; the rest comes from the records
/// @param warnings  as those of a History
HistoryEntry AddToHistory(const std::filesystem::path& folder, HistoryEntry entry,
                          const std::vector<Record>& records, bool replaces,
                          std::vector<std::string>* warnings = nullptr);

/// What to say of a commit.
struct Mark {
  std::string commit;  ///< or its beginning, where no commit is called so
  std::string mark, note = {};
  bool keeps_accepted = false;  ///< what somebody accepted stays accepted
};
/// Marks a commit on all machines; the result is the mark it has now, with its whole name. Throws
/// ConfigError when no commit, or several, begin so.
Mark MarkInHistory(const std::filesystem::path& folder, Mark mark,
                   std::vector<std::string>* warnings = nullptr);

/// The state that new measurements of `machine` are held against: its last entry marked good or
/// accepted, or what was accepted behind that on another machine; else the last entry so marked of
/// any machine; where there is no mark the last that is not bad, of this machine if it has any.
/// Where the machine measured that commit too, its own measurements.
std::optional<HistoryEntry> LastGood(const History& history, const std::string& machine);

/// The same for times, which say nothing about another machine: entries of this one come first,
/// marked or not.
std::optional<HistoryEntry> LastGoodOfMachine(const History& history, const std::string& machine);

}  // namespace loopbench::harness
