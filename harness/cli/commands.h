// What several subcommands call.
//
// Subcommands return an exit code: 0 done, 1 a gate failed, 2 could not measure or bad input. Bad
// input throws ConfigError or std::runtime_error, which Main() (program.h) turns into a message
// and 2.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "harness/config/experiment_reader.h"
#include "harness/figures/figure_recipes.h"
#include "harness/figures/free_figure.h"
#include "harness/history/git.h"
#include "harness/judge/compare.h"
#include "harness/record/record.h"
#include "harness/record/select.h"
#include "harness/store/record_lines.h"
#include "harness/suite/suite.h"
#include "harness/tables/table.h"
#include "harness/tables/table_view.h"

namespace loopbench::harness {

/// The records of a store, the last of each case, in the order of tables, with their doubts as they
/// stand beside each other; warnings about it go to standard error.
/// `watch` as for ReadRecords(). Throws ConfigError where the machine has no room for them.
std::vector<Record> LoadRecords(const std::filesystem::path& store, const Selection& where = {},
                                const ReadWatch& watch = {});

/// What LoadRecords() makes of all records of some scenes.
std::vector<Record> Prepared(std::vector<Record> records);

/// drift.csv, drift.md and so on of precision and timing in the folder of a store, or beside a
/// store that is a file, named after it; their short forms on the terminal.
void WriteTables(const std::vector<Record>& records, const std::filesystem::path& store,
                 const std::string& typed);

/// 1 when an accuracy run among `rows` did not finish or has doubts, and says how many; else 0.
/// @throws ConfigError when there is none: such a gate could not fail.
int DoubtGate(const std::vector<Record>& rows);

struct RunCommand {
  std::vector<std::filesystem::path> experiments;
  std::filesystem::path out;  ///< folder; default results/runs/<name of the first experiment>
  std::vector<Setting> settings;
  SuiteOptions suite;
  int threads = 0;    ///< as of ExperimentFiles
  std::string gate;   ///< "doubts" or ""
  bool wait = false;  ///< while another process writes to the store
  std::string again;  ///< the command as a shell takes it, for who goes on later
};
/// Runs what the store does not have yet, then writes its tables. Interrupted, it says what is
/// kept, and returns 128 + the signal's number: 130 for Ctrl-C.
int RunExperiments(const RunCommand& command, const std::string& typed);

struct MergeCommand {
  std::vector<std::filesystem::path> stores;
  std::filesystem::path out;  ///< a new store
  /// "id"s of an experiment in its order, which their records shall have; others come behind them.
  std::vector<std::string> order = {};
};
/// Shards into one store: every case once. Throws when two stores disagree about a case. Ends with
/// 1, and merges nothing, when no store has a case of `order`.
int Merge(const MergeCommand& command);

/// Limits of work on one mechanism file; experiments have their own.
inline constexpr ProcessLimits kFileLimits = {.cpu_s = 60.0, .memory_mb = 2048.0};

struct TableCommand {
  std::filesystem::path store;
  TableView view;
  std::string format = "text";  ///< text, csv, markdown, json or latex
  std::filesystem::path out;    ///< standard output when empty
  std::string gate;             ///< "doubts" or "": of the rows shown
};

void AppendProvenance(Table& table, const std::string& typed);

/// A table for a file. CSV goes without the date of printing: the same records and command give the
/// same bytes.
std::string RenderKept(Table table, const std::string& format);

/// Draws those that can be drawn into a folder, as svg or pdf; the reasons of the others are
/// printed, and the exit code is 2.
int DrawAll(const std::vector<NamedFigure>& figures, const std::filesystem::path& folder,
            const std::string& format, FigureSize size);

/// By name: "one-column", "two-column".
const std::map<std::string, FigureSize>& FigureSizes();

/// Records of more than a page of anybody's: of runs of a few hundred steps, some 400 MB of memory.
inline constexpr std::size_t kMostHeld = 50'000;

/// CSV or JSON, to standard output or `command.out`, scenes in the order of the store, the rows of
/// each in the usual order, columns as of a table of all. Throws ConfigError for what needs all
/// rows at once.
int WriteLongTable(const TableCommand& command, const SceneReader& reader,
                   const std::string& typed);

/// What LoadRecords() makes of a store, or where these are more than kMostHeld, or than the machine
/// has room for, the store scene by scene.
struct Loaded {
  std::vector<Record> records;
  std::optional<SceneReader> many;
};
Loaded LoadOrScan(const std::filesystem::path& store, const Selection& where);

/// The memory that this process may still take [bytes], by the machine and by its own limit, or
/// with the part that it has already; 0 if it is not known.
double FreeMemory(bool with_own = false);

/// The memory that a store's records may take.
class Room {
 public:
  /// What is free now.
  explicit Room(std::filesystem::path store);
  bool Has(std::uint64_t bytes) const;  ///< for records with lines of so many bytes
  /// Throws ConfigError where it has not; `found`: what they are.
  void Require(const std::string& found, std::uint64_t bytes) const;

 private:
  std::filesystem::path store_;
  double free_ = 0.0;  ///< 0 where that is not known
};

struct CompareCommand {
  std::filesystem::path base, fresh;
  std::string format = "text";  ///< text, csv or markdown
  CompareOptions options;
  Selection where = {};  ///< only such records of both sides
  bool json = false;     ///< one document on standard output, with every measure
  /// The base instead: the last good state of a history.
  std::filesystem::path history = {};
  std::string branch = {};
  std::filesystem::path markdown = {}, junit = {};  ///< files besides; none when empty
};
/// 0 the same or better, 1 something is worse or different, 2 could not measure.
int PrintComparison(const CompareCommand& command, const std::string& typed);

/// The last good state for new measurements of a machine, as the base of a comparison; `name` says
/// which one it is. Throws ConfigError when there is none.
std::vector<Record> LastGoodRecords(const HistoryPlace& place, const std::string& machine,
                                    bool only_times, std::string* name);

}  // namespace loopbench::harness
