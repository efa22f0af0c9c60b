// Functions that several subcommands call.
//
// Subcommands return an exit code: 0 done, 1 a gate failed, 2 could not measure or bad input. Bad
// input throws ConfigError or std::runtime_error, which Main() (program.h) turns into a message
// and 2.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <ranges>
#include <set>

#include "harness/base/store.h"
#include "harness/cli/command_line.h"
#include "harness/config/mechanism_reader.h"
#include "harness/figures/figures.h"
#include "harness/history/history.h"
#include "harness/judge/judge.h"
#include "harness/judge/tables.h"
#include "harness/observers/reference.h"
#include "harness/suite/suite.h"
#include "mechanism/simplify/model.h"
#include "mechanism/simplify/structure.h"

namespace loopbench::harness {

/// Throws an error with a formatted message.
template <class Error = ConfigError, class... Values>
[[noreturn]] void Reject(fmt::format_string<Values...> format, Values&&... values) {
  throw Error(fmt::format(format, std::forward<Values>(values)...));
}

/// Adds a formatted line.
template <class... Values>
void AddNote(std::vector<std::string>& notes, fmt::format_string<Values...> format,
             Values&&... values) {
  notes.push_back(fmt::format(format, std::forward<Values>(values)...));
}

/// True for parts of documents: objects, and lists of objects, records or texts.
template <class T>
constexpr bool kIsPart =
    std::is_same_v<T, JsonObject> || std::is_same_v<T, std::vector<JsonObject>> ||
    std::is_same_v<T, std::vector<std::string>>;

/// Returns records as parts of a document.
inline std::vector<JsonObject> ObjectsOf(const std::vector<Record>& records) {
  return {records.begin(), records.end()};
}

/// Adds key, value, key, value, ... to a document or record; words of enumerations as texts.
template <class Target, class Member, class... Rest>
Target& Put(Target& target, std::string_view key, const Member& value, const Rest&... rest) {
  if constexpr (std::is_same_v<Target, Record>) {
    target.Set(key, AnyValue(value).value);
  } else if constexpr (kIsPart<Member>) {
    target.Add(key, value);
  } else {
    target.Add(key, AnyValue(value).value);
  }
  if constexpr (sizeof...(rest) > 0) Put(target, rest...);
  return target;
}
/// Returns the document with key, value, key, value, ...
template <class... Members>
JsonObject JsonOf(const Members&... members) {
  JsonObject document;
  return Put(document, members...);
}

/// Prints one line, and returns 0.
int PrintJson(const JsonObject& document);

/// Removes those of the columns that are empty in all rows.
void EraseEmptyColumns(const std::vector<std::string>& keys, Table* table);

/// Returns the last record of each case of a store in table order, with warnings from comparing
/// records. Warnings about the store go to standard error. `watch` as for ReadRecords(). Throws
/// ConfigError if the machine has too little memory.
std::vector<Record> LoadRecords(const std::filesystem::path& store, const Selection& where = {},
                                const ReadWatch& watch = {});

/// Processes all records of some problems as LoadRecords() does.
std::vector<Record> LatestWithWarnings(std::vector<Record> records);

/// Writes drift.csv, drift.md, precision and timing tables to the store's folder, or next to a
/// store that is a file. Prints their short forms.
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

  std::vector<Option> Options() {
    return {{"store", "Folders of runs, or .jsonl files", &stores, kRequired},
            {"-o,--out", "Folder of the new store", &out, kRequired}};
  }
};
/// Merges shards into one store, with every case once. Throws if two stores disagree about a case.
/// Returns 1 and merges nothing if no store has a case of `order`.
int Merge(const MergeCommand& command, const Typed& typed = {});

/// Limits of work on one mechanism file; experiments have their own.
inline constexpr ProcessLimits kFileLimits = {.cpu_s = 60.0, .memory_mb = 2048.0};

struct TableCommand {
  std::filesystem::path store, out;
  TableView view;
  std::string format = "text";
  std::string gate;  ///< "warnings" or "": checks the rows shown

  std::vector<Option> Options() {
    return {StoreArgument(&store),
            {"--kind", "Kind of table (default: drift, or the first kind in the store)", &view.kind,
             OneOf({"drift", "precision", "timing", "factorial", "models", "references", "all"})},
            TableFormatOption(&format),
            WhereOption(&view.where),
            {"--columns", "Keys of records, in this order: a,b,c", &view.columns, kSplits},
            {"--group", "One table per value of this key", &view.group},
            {"--sort", "Key to sort by", &view.sort},
            {"--descending", "Sort in descending order", &view.descending, Needs("--sort")},
            OutOption(&out),
            GateOption(&gate),
            WideOption()};
  }
};

/// Reads measurements of any kind; warnings go to standard error.
std::vector<Record> LoadMeasurements(const std::filesystem::path& path);

/// Writes `text` to `out` and says so; prints it if `out` is empty.
void Deliver(const std::string& text, const std::filesystem::path& out);

/// Returns the table with notes on its origin.
Table WithProvenance(Table table, const std::string& typed);

/// Renders a table for a file. CSV omits the date: equal records and commands give equal bytes.
std::string RenderKept(Table table, const std::string& format);

/// Rejects an output that is named like a picture, unless it is an existing folder.
void RejectPictures(const std::filesystem::path& out, const char* expected);

/// Largest number of records held in memory: about 400 MB for runs of a few hundred steps.
inline constexpr std::size_t kMaxHeld = 50'000;

/// Writes CSV or JSON to standard output or `command.out`, problem by problem in the order of the
/// store. Throws ConfigError for options that need all rows at once.
int WriteLongTable(const TableCommand& command, const ProblemReader& reader,
                   const std::string& typed);

/// Records of LoadRecords(), or the store problem by problem if there are more than kMaxHeld
/// records or more than memory permits.
struct Loaded {
  std::vector<Record> records;
  std::optional<ProblemReader> many;
};
Loaded LoadOrScan(const std::filesystem::path& store, const Selection& where);

/// Returns the memory that this process may still allocate [bytes], and with `with_own` the memory
/// in use. 0 if unknown.
double FreeMemory(bool with_own = false);

/// Runs that are no cases, whose ladders are checked. In a long sweep, each combination counts as
/// many as the shown ones.
struct OtherRuns {
  OtherRuns(const Overview& overview, const Selection& filter);
  std::size_t timings = 0, rungs = 0;
};

/// Returns 0 for equal or better, 1 if something is worse or different, 2 if it could not measure.
int PrintComparison(const std::filesystem::path& base, const std::filesystem::path& fresh,
                    const Typed& typed);

/// Returns the last good state for new measurements of a machine, as base of a comparison, and sets
/// `name` to its description. Throws ConfigError if there is none.
std::vector<Record> LastGoodRecords(const HistoryPlace& place, const std::string& machine,
                                    bool only_times, std::string* name);

/// Names of the kinds of files, as in configs/schema/KIND.schema.json.
std::vector<std::string> SchemaKinds();

/// Returns the JSON Schema (draft 07) of a kind: the contents of its file in configs/schema/.
std::string SchemaOfKind(const std::string& kind);

/// Returns Markdown tables of the keys of files of these kinds: the contents of docs/fields.md.
std::string TablesOfKinds(const std::vector<std::string>& kinds);

// Output of explain, simplify and view: tables that fit the terminal.

/// Amount of the output of explain.
struct ExplainView {
  bool all = false;  ///< all rows; else the first rows of long tables and the number of others
  /// Document that gets the sections under their keys (--json) instead of the terminal.
  JsonObject* document = nullptr;
  bool statics = false;    ///< forces that hold the start, too
  std::string range = "";  ///< name of a joint: the range of its coordinate, too

  /// Prints a sentence for people, unless there is a document.
  template <typename... Values>
  void Print(fmt::format_string<internal::PrintedAs<Values>...> format,
             const Values&... values) const {
    if (document == nullptr) harness::Print<Values...>(format, values...);
  }
};

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

/// Prints gravity, bodies, joints, their frames, couplings and forces.
void PrintModel(const MechanismDescription& description, const Structure& structure,
                const ExplainView& view);

// Models of one problem: the full model, one per applicable rule, and all rules combined.

struct ProblemModel {
  std::string name;  ///< "full", a rule's name or "combined"; with a number if it has parts
  bool is_exact = true;
  MechanismDescription description;
  ObservedQuantities observe;
  std::vector<std::string> done, dropped;
  std::string assumption;
  Eigen::Matrix3d R_WC = Eigen::Matrix3d::Identity();
  std::string error;  ///< largest distance from the full model [m], if requested
  std::string worst;  ///< point with this error, or the reason why there is none
  std::int64_t rhs_evaluations = -1;
};

/// Result of each simplification rule on the full model, applicable or not, in rule order.
struct ProblemModels {
  std::vector<std::pair<const SimplificationRule*, Simplified>> ideas;
  /// Full model first, alone if no rule applies; last all rules combined, if several apply.
  std::vector<ProblemModel> models;
};

ProblemModels MakeModels(const MechanismFile& file,
                         const std::vector<const SimplificationRule*>& ideas, const ShortRun& run,
                         const SimplifyOptions& options);

// Certified motion of a mechanism: the reference for advice and models.

struct CertainMotion {
  ReferenceOptions options = {};  ///< an experiment with them makes the same reference
  Reference reference = {};
  double horizon = 0.0;  ///< trust horizon [s], the end of error comparisons; 0: there is none
};

/// Computes a certified motion; each witness run may take `cpu_s`. If certification ends before
/// `horizon`, makes the reference again up to there until it is certified to its end. Throws
/// ConfigError in a program without wide scalars, which `what` needs.
CertainMotion MakeCertainMotion(const MechanismDescription& user, double horizon, double cpu_s,
                                const std::string& what);

/// Largest distance of a model's certified motion from the full model's.
struct CausedError {
  double largest = 0.0;  ///< over the compared points, at times that both certify [m]
  std::string point;     ///< point with the largest distance
  int points = 0;        ///< number of compared points
  double until = 0.0;    ///< [s]
};

/// Compares points in the full model's axes. `names` are BODY.POINT; empty: all named points of the
/// full model that the other has.
CausedError ErrorOfModel(const MechanismDescription& whole, const Reference& whole_reference,
                         const ProblemModel& model, const Reference& reference,
                         const std::vector<std::string>& names);

}  // namespace loopbench::harness
