// The subcommands of the program, apart from their option parsing (program_*).
//
// Each returns an exit code: 0 done, 1 a gate failed, 2 could not measure or bad input. Bad input
// throws ConfigError or std::runtime_error, which Main() (program.h) turns into a message and 2.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "harness/config/experiment_reader.h"
#include "harness/figures/free_figure.h"
#include "harness/suite/suite.h"
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
int Run(const RunCommand& command, const std::string& typed);

struct MergeCommand {
  std::vector<std::filesystem::path> stores;
  std::filesystem::path out;  ///< a new store
  /// "id"s of an experiment in its order, which their records shall have; others come behind them.
  std::vector<std::string> order = {};
};
/// Shards into one store: every case once. Throws when two stores disagree about a case. Ends with
/// 1, and merges nothing, when no store has a case of `order`.
int Merge(const MergeCommand& command);

/// `json`, here and below: one document on standard output (docs/using.md has its keys).
int List(const ExperimentFiles& files, bool json);

/// Limits of work on one mechanism file; experiments have their own.
inline constexpr ProcessLimits kFileLimits = {.cpu_s = 60.0, .memory_mb = 2048.0};

struct CheckCommand {
  ExperimentFiles files;
  bool assembly = true;  ///< assemble the starts of mechanisms and scenes
  ProcessLimits limits = kFileLimits;
  bool json = false;
};
int CheckFiles(const CheckCommand& command);

struct PlanCommand {
  ExperimentFiles files;
  std::filesystem::path from;  ///< store of earlier results; times of cases it has come from there
  bool timing = true;          ///< timings too
  bool json = false;
};
int PrintPlans(const PlanCommand& command);

/// What experiments run and measure, and what mechanisms are made of, by the kind of each file.
/// Mechanisms are analysed in a child process under `limits`; 2 for one that they cut off. `all`:
/// every row of long tables.
int Explain(const ExperimentFiles& files, bool all, bool json, const ProcessLimits& limits);

struct TableCommand {
  std::filesystem::path store;
  TableView view;
  std::string format = "text";  ///< text, csv, markdown, json or latex
  std::filesystem::path out;    ///< standard output when empty
  std::string gate;             ///< "doubts" or "": of the rows shown
};
int PrintTable(const TableCommand& command, const std::string& typed);

struct PlotCommand {
  std::filesystem::path store;
  std::filesystem::path out;        ///< folder, or for a free figure a file
  std::string format;               ///< svg or pdf; "" for the file's ending, else svg
  std::string size = "two-column";  ///< a name of a FigureSize
  Selection where;
  FreeFigure free;  ///< without x and y the standard figures
};
int Plot(const PlotCommand& command);

struct VerdictCommand {
  std::filesystem::path store, claims, out;
};
int PrintVerdicts(const VerdictCommand& command, const std::string& typed);

struct MapCommand {
  std::filesystem::path store, rules;
  std::filesystem::path out;        ///< folder; nothing is written when empty
  std::string format = "svg";       ///< of the picture: svg or pdf
  std::string size = "two-column";  ///< a name of a FigureSize
  bool gate = false;                ///< 1 if a cell that must hold does not
};
int PrintMap(const MapCommand& command, const std::string& typed);

}  // namespace loopbench::harness
