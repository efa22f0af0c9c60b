// Measurements of successive commits: a folder that only grows.
//
//   DIR/history.jsonl     a line for each added commit and each mark
//   DIR/results/*.jsonl   measurements, without time series of runs but with samples of run times
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

/// Measurements of a commit on a machine.
struct HistoryEntry {
  std::string commit, date;  ///< date: ISO 8601 in UTC, of the commit
  std::string machine = {};  ///< processor model and number of logical processors
  std::filesystem::path results = {};
  std::string mark = {};  ///< good, accepted, bad, or "" if unmarked
  std::string note = {};
};

/// Returns the first twelve digits of a hash; other names unchanged.
std::string ShortCommit(const std::string& commit);

struct History {
  std::vector<HistoryEntry> entries;  ///< by date; equal dates in order of addition
  std::vector<std::string> warnings;  ///< incomplete lines after a crash
};

/// Throws ConfigError if the folder has no history, std::runtime_error as ReadRecords().
History ReadHistory(const std::filesystem::path& folder);

/// Reads the measurements of an entry, each case once. Throws std::runtime_error as ReadRecords();
/// incomplete lines go to `warnings`.
std::vector<Record> ReadResults(const HistoryEntry& entry, std::vector<std::string>* warnings);

/// Adds the measurements of a commit; creates the folder. Waits while another process adds. Throws
/// ConfigError if this machine already has the commit (unless `replaces`), for an invalid date, for
/// records of several machines, or if no record has an outcome. A replaced entry loses its mark,
/// except `accepted`; its results file remains.
/// @param entry  commit and date; the other members follow from the records
/// @param warnings  as in History
HistoryEntry AddToHistory(const std::filesystem::path& folder, HistoryEntry entry,
                          const std::vector<Record>& records, bool replaces,
                          std::vector<std::string>* warnings = nullptr);

/// A mark to set on a commit.
struct Mark {
  std::string commit;  ///< full name, or a prefix if no commit has that name
  std::string mark, note = {};
  bool keeps_accepted = false;  ///< do not overwrite an existing `accepted` mark
};
/// Marks a commit on all machines; returns its present mark with its full name. Throws ConfigError
/// if the prefix matches no commit or several.
Mark MarkInHistory(const std::filesystem::path& folder, Mark mark,
                   std::vector<std::string>* warnings = nullptr);

/// Returns the baseline for new measurements of `machine`: its last entry marked good or accepted,
/// or a later entry accepted on another machine. Otherwise: the last entry so marked on any
/// machine. Without marks: the last entry that is not bad, on this machine if possible. Prefers
/// measurements of that commit on `machine`.
std::optional<HistoryEntry> LastGood(const History& history, const std::string& machine);

/// Returns the baseline for times, which depend on the machine: entries of this machine come first,
/// marked or not.
std::optional<HistoryEntry> LastGoodOfMachine(const History& history, const std::string& machine);

}  // namespace loopbench::harness
