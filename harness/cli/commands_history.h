// The subcommand history: measurements of one commit after the other. As commands.h.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "harness/history/history_place.h"
#include "harness/record/record.h"

namespace loopbench::harness {

struct HistoryAddCommand {
  HistoryPlace place;
  std::filesystem::path results;
  std::string commit, date;  ///< "": those that are checked out
  bool replaces = false;
};
int HistoryAdd(const HistoryAddCommand& command);

struct HistoryShowCommand {
  HistoryPlace place;
  std::string one, measure;  ///< parts of the names of cases and measures; "": all
  std::string format = "text";
  bool json = false;
};
/// Steps, newest first, and the commits. 0.
int HistoryShow(const HistoryShowCommand& command, const std::string& typed);

struct HistoryReportCommand {
  HistoryPlace place;
  std::filesystem::path out;
  std::string title;
};
int HistoryReport(const HistoryReportCommand& command, const std::string& typed);

struct HistoryMarkCommand {
  HistoryPlace place;
  std::string commit, mark, note;
  bool keeps_accepted = false;
};
int HistoryMark(const HistoryMarkCommand& command);

/// The last good state for new measurements of a machine, as the base of a comparison; `name` says
/// which one it is. Throws ConfigError when there is none.
std::vector<Record> LastGoodRecords(const HistoryPlace& place, const std::string& machine,
                                    bool only_times, std::string* name);

}  // namespace loopbench::harness
