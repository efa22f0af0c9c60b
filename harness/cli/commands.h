// Functions that several subcommands call.
//
// Subcommands return an exit code: 0 done, 1 a gate failed, 2 could not measure or bad input. Bad
// input throws ConfigError or std::runtime_error, which Main() (program.h) turns into a message
// and 2.
#pragma once

#include <cstddef>
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
#include "harness/text/terminal.h"
#include "mechanism/simplify/structure.h"

namespace loopbench::harness {

/// Returns the last record of each case of a store in table order, with warnings from comparing
/// records. Warnings about the store go to standard error. `watch` as for ReadRecords(). Throws
/// ConfigError if the machine has too little memory.
std::vector<Record> LoadRecords(const std::filesystem::path& store, const Selection& where = {},
                                const ReadWatch& watch = {});

/// Processes all records of some problems as LoadRecords() does.
std::vector<Record> LatestWithWarnings(std::vector<Record> records);

/// Writes drift.csv, drift.md, precision and timing tables to the store's folder, or next to a
/// store that is a file, named after it. Prints their short forms.
void WriteTables(const std::vector<Record>& records, const std::filesystem::path& store,
                 const std::string& typed);

/// Returns 1 and prints the number if an accuracy run in `rows` failed or has warnings; else 0.
/// @throws ConfigError if there is no accuracy run: the gate could not fail.
int WarningGate(const std::vector<Record>& rows);

struct MergeCommand {
  std::vector<std::filesystem::path> stores;
  std::filesystem::path out;  ///< a new store
  /// Values of "id" in the experiment's order: their records come first, others after them.
  std::vector<std::string> order = {};
};
/// Merges shards into one store, with every case once. Throws if two stores disagree about a case.
/// Returns 1 and merges nothing if no store has a case of `order`.
int Merge(const MergeCommand& command);

/// Limits of work on one mechanism file; experiments have their own.
inline constexpr ProcessLimits kFileLimits = {.cpu_s = 60.0, .memory_mb = 2048.0};

struct TableCommand {
  std::filesystem::path store;
  TableView view;
  std::string format = "text";  ///< text, csv, markdown, json or latex
  std::filesystem::path out;    ///< file; standard output if empty
  std::string gate;             ///< "warnings" or "": checks the rows shown
};

/// Writes `text` to `out` and says so; prints it if `out` is empty.
void Deliver(const std::string& text, const std::filesystem::path& out);

void AppendProvenance(Table& table, const std::string& typed);

/// Renders a table for a file. CSV omits the date of printing: equal records and commands give
/// equal bytes.
std::string RenderKept(Table table, const std::string& format);

/// Draws the figures into a folder, as svg or pdf. Prints the reason for each figure that cannot be
/// drawn, and then returns 2.
int DrawAll(const std::vector<NamedFigure>& figures, const std::filesystem::path& folder,
            const std::string& format, FigureSize size);

/// Figure sizes by name: "one-column", "two-column".
const std::map<std::string, FigureSize>& FigureSizes();

/// Largest number of records held in memory: about 400 MB for runs of a few hundred steps.
inline constexpr std::size_t kMaxHeld = 50'000;

/// Writes CSV or JSON to standard output or `command.out`. Problems have the order of the store,
/// rows the usual order, and columns cover all records. Throws ConfigError for options that need
/// all rows at once.
int WriteLongTable(const TableCommand& command, const ProblemReader& reader,
                   const std::string& typed);

/// Records of LoadRecords(), or the store problem by problem if there are more than kMaxHeld
/// records or more than memory permits.
struct Loaded {
  std::vector<Record> records;
  std::optional<ProblemReader> many;
};
Loaded LoadOrScan(const std::filesystem::path& store, const Selection& where);

/// Returns the memory that this process may still allocate [bytes], by the machine and
/// the process limit. `with_own` adds the memory in use. 0 if unknown.
double FreeMemory(bool with_own = false);

struct CompareCommand {
  std::filesystem::path base, fresh;
  std::string format = "text";  ///< text, csv or markdown
  CompareOptions options;
  Selection where = {};  ///< filter for the records of both sides
  bool json = false;     ///< print one JSON document with every measure
  /// Replaces the base by the last good state of a history.
  std::filesystem::path history = {};
  std::string branch = {};
  std::filesystem::path markdown = {}, junit = {};  ///< additional output files; none if empty
};
/// Returns 0 for equal or better, 1 if something is worse or different, 2 if it could not measure.
int PrintComparison(const CompareCommand& command, const std::string& typed);

/// Returns the last good state for new measurements of a machine, as base of a comparison, and sets
/// `name` to its description. Throws ConfigError if there is none.
std::vector<Record> LastGoodRecords(const HistoryPlace& place, const std::string& machine,
                                    bool only_times, std::string* name);

// Keys that files of each kind may contain, as JSON Schema and as tables.

/// Names of the kinds, as in the files configs/schema/KIND.schema.json.
std::vector<std::string> SchemaKinds();

/// Returns the JSON Schema (draft 07) of a kind: the contents of its file in configs/schema/.
std::string SchemaOfKind(const std::string& kind);

/// Returns Markdown tables of the keys of files of these kinds: the contents of docs/fields.md.
std::string TablesOfKinds(const std::vector<std::string>& kinds);

// Output of explain, simplify and view: tables that fit the terminal.

/// Amount and width of the output of explain.
struct ExplainView {
  bool all = false;  ///< all rows; else the first rows of long tables and the number of others
  /// Width of the terminal [cells]; 0: unlimited; nullopt: there is no terminal.
  std::optional<std::size_t> width = {};
  /// Document that gets the sections under their keys (--json) instead of the terminal.
  JsonObject* document = nullptr;
  bool statics = false;    ///< forces that hold the start, too
  std::string range = "";  ///< name of a joint: the range of its coordinate, too
};

/// Returns the view of standard output.
ExplainView ViewOfOutput(bool all);

/// Prints a sentence for people, unless there is a document.
template <typename... Values>
void Say(const ExplainView& view, fmt::format_string<internal::PrintedAs<Values>...> format,
         const Values&... values) {
  if (view.document == nullptr) Print<Values...>(format, values...);
}

/// Prints a title and an indented table, as wide as the terminal. Without a terminal, breaks the
/// last column into lines that end at 100 characters. In a document, stores all rows under `key`,
/// if it has one.
void PrintSection(const std::string& title, const Table& table, const ExplainView& view,
                  const char* key = "");

/// Formats a number with six digits; -0 is 0.
std::string ShortNumber(double value);
/// Formats a vector as "1 0.5 -2".
template <class Vector>
std::string Spaced(const Vector& vector) {
  std::string text;
  for (Eigen::Index i = 0; i < vector.size(); ++i) {
    text += (i == 0 ? "" : " ") + ShortNumber(vector[i]);
  }
  return text;
}

/// Prints the model, the start and the structure of a mechanism. Returns 2, after all other output,
/// if the start cannot be assembled, or if what `view` asks for does not exist. Degrees
/// of freedom that the file does not expect are a ConfigError, in a document its "error" and 2.
int ExplainMechanism(const std::filesystem::path& path, const ExplainView& view);

/// Prints the contents of a file: gravity, bodies, joints, their frames, forces.
void PrintModel(const MechanismDescription& description, const Structure& structure,
                const ExplainView& view);

}  // namespace loopbench::harness
