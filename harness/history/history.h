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
};

/// Throws ConfigError when there is no history in the folder, std::runtime_error as ReadRecords().
History ReadHistory(const std::filesystem::path& folder);

/// Adds what was measured of a commit; makes the folder. Waits while another process adds. Throws
/// ConfigError when the commit is there for this machine (unless `replaces`), when its date is
/// none, when records come from several machines, or when there is none with a measure to follow.
/// @param entry  commit and date; the rest comes from the records
HistoryEntry AddToHistory(const std::filesystem::path& folder, HistoryEntry entry,
                          const std::vector<Record>& records, bool replaces);

/// Marks a commit on all machines; `commit` may be its beginning. Throws ConfigError when no
/// commit, or several, begin so.
std::string MarkInHistory(const std::filesystem::path& folder, const std::string& commit,
                          const std::string& mark, const std::string& note);

/// The state that new measurements are held against: the last entry marked good or accepted, else
/// the last one that is not marked bad; of `machine` where it has any, else of all.
std::optional<HistoryEntry> LastGood(const History& history, const std::string& machine);

}  // namespace loopbench::harness
