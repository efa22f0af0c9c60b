// Records by keys and groups, statistics of samples, and tables: columns, rows, formats, notes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "harness/base/record.h"
#include "harness/base/text.h"

namespace loopbench::harness {

// Keys and groups.

/// Groups items by `key_of` (a function or a member): pairs of key and items, in order of first
/// appearance.
template <class List, class KeyOf>
auto GroupBy(const List& items, const KeyOf& key_of) {
  using Item = std::remove_cvref_t<decltype(*std::begin(items))>;
  using Key = std::remove_cvref_t<std::invoke_result_t<KeyOf, const Item&>>;
  std::vector<std::pair<Key, std::vector<Item>>> groups;
  std::map<Key, std::size_t> places;
  for (const Item& item : items) {
    const auto [place, is_new] = places.try_emplace(std::invoke(key_of, item), groups.size());
    if (is_new) groups.emplace_back(place->first, std::vector<Item>());
    groups[place->second].second.push_back(item);
  }
  return groups;
}

/// Returns the values of these keys, one per line: the key of a group.
template <class Keys>
std::string ValuesOf(const Record& record, const Keys& keys) {
  return Joined(keys, "", [&](const auto& key) { return record.Text(key) + '\n'; });
}

/// Returns "odca, rtol 1e-08": texts unchanged, which are clear without a key, numbers with theirs.
std::string NameBy(const Record& record, const std::vector<std::string>& keys,
                   std::string_view separator);

/// Returns the first `most` texts; `more` has the number of the others: " and {} more".
std::string FirstOf(std::span<const std::string> texts, std::size_t most,
                    std::string_view separator, std::string_view more);

/// Returns the keys that identify cases: those before "case_id" or "outcome", each once.
std::vector<std::string> CaseKeysOf(std::span<const Record> rows);

/// Returns all keys of the records, each once, in order of first appearance.
std::vector<std::string> KeysOf(std::span<const Record> rows);

/// Returns true if all rows have the same text under the key.
bool IsAlike(std::span<const Record> rows, const std::string& key);

/// Returns the case keys in which rows differ. Absolute tolerances go with relative ones.
std::vector<std::string> DistinguishingKeys(std::span<const Record> rows);

/// Returns true if no row has an absolute tolerance of its own.
bool AtolFollowsRtol(std::span<const Record> rows);

/// Returns the keys of cases that no table has: parameters of a sweep.
std::vector<std::string> ParametersOf(std::span<const Record> rows);

/// Throws ConfigError, with `option`, the key, the nearest spelling and all keys, if neither a
/// record nor a table has the key.
void RequireKey(const std::string& option, const std::string& key, std::span<const Record> rows);

/// Checks the keys of all conditions in this way. Also throws for an order condition on a key
/// without a number in any record.
void RequireConditions(const std::string& option, const Selection& selection,
                       std::span<const Record> rows);

/// True if the run of a row did not end with its expected outcome.
bool HasFailed(const Record& row);

// Statistics of samples.

/// Returns the median; NaN for an empty sample or a sample with NaN.
double Median(std::span<const double> sample);

/// Result of the Mann-Whitney test of two independent samples.
struct MannWhitneyResult {
  double u = 0.0;        ///< number of pairs (a, b) with a > b; equal pairs count one half
  double p_greater = 1;  ///< probability of at least this u under equal distributions
  bool exact = false;    ///< p from the exact distribution, otherwise normal approximation
};

/// H1: values of `a` tend to be larger than those of `b` (H. B. Mann, D. R. Whitney, 1947). Exact
/// without ties and up to 40 values in a sample; otherwise normal with corrections for ties and
/// continuity. p = 1 when a sample is empty. The samples are finite numbers.
MannWhitneyResult MannWhitney(std::span<const double> a, std::span<const double> b);

/// Returns the smallest possible p_greater for these sample sizes.
double SmallestP(std::size_t a, std::size_t b);

/// Returns p-values adjusted by Holm's step-down method (S. Holm, 1979), in the given order.
/// Rejecting values up to alpha keeps the probability of any false rejection below alpha, for any
/// dependence.
std::vector<double> HolmAdjusted(std::span<const double> p);

/// Returns exponents of time over size, one row per family of right-hand sides. A family is a set
/// of benchmarks whose names differ in one number ("rhs/chain/10/odca/...",
/// "rhs/chain/30/odca/..."), or timings of equal methods with mechanisms "chain-10" and "chain-30".
/// Sizes are numbers of bodies (counter "bodies"), or the numeric part without this counter. Keys:
/// "family", "sizes", "bodies_min", "bodies_max", "exponent", "standard_error", "slope_min",
/// "slope_max", "ns_per_body" at the largest size, "failed" (members of the family that ended with
/// an error, of any size). Names without a numeric part and families with one member are left out;
/// families with fewer than two measured sizes have no exponent. Sizes below `from` are ignored.
std::vector<Record> FitFamilies(const std::vector<Record>& measured, double from);

// One table, five writers: terminal text, CSV, Markdown, JSON and LaTeX. Each escapes texts with
// the function of its medium in harness/base/text.h.

/// One column of a table.
struct TableColumn {
  std::string key;     ///< key in the record, and the column's name in CSV
  std::string header;  ///< heading for people, with the unit in brackets
  Format format = Format::kText;
  /// Shorter words for terminal columns: (value, replacement). Empty in tables for files.
  std::vector<std::pair<std::string, std::string>> abbreviations = {};
  /// Columns of least importance are dropped first on narrow terminals, the rightmost of equals.
  int importance = 0;
  std::size_t most_cells = 0;   ///< width at which a text is broken into lines; 0: never
  bool marks_warnings = false;  ///< '*' after the cells of runs with warnings
};

/// Returns columns from "key=header:format:importance, ...". Without a header, the key is the
/// header; without a format, the column is a text. The other formats are integer, shortest,
/// scientific, exponent, fixed and seconds.
std::vector<TableColumn> Columns(std::string_view rows);

/// Returns red for the outcome of a failed run, yellow for an outcome with warnings.
std::string OutcomeColour(const Record& row, const TableColumn& column);

/// Rows of records under columns. A failed run is an ordinary row with its outcome and empty cells
/// for missing values; nothing removes it.
struct Table {
  std::string title = "";
  std::vector<TableColumn> columns = {};
  std::vector<Record> rows = {};
  std::vector<std::string> notes = {};  ///< provenance and remarks, one line each, below the table
  /// Key whose values divide the rows ("" for one undivided table). Text, Markdown and LaTeX write
  /// one table per value under a heading. CSV and JSON keep one list with the key as a column.
  std::string group = "";
  /// Colour of a cell on a terminal, as its SGR number ("31" is red), "" for none.
  std::string (*colour)(const Record& row, const TableColumn& column) = &OutcomeColour;

  /// Appends further notes.
  void AddNotes(const std::vector<std::string>& more) {
    notes.insert(notes.end(), more.begin(), more.end());
  }
};

/// Value of a cell: a text of any type, a number, a count, a word of an enumeration, or a value.
struct AnyValue {
  template <class T>
  AnyValue(const T& any) {
    if constexpr (std::is_convertible_v<const T&, std::string_view>) {
      value = std::string(std::string_view(any));
    } else if constexpr (std::is_same_v<T, bool> || std::is_convertible_v<const T*, const Value*>) {
      value = any;
    } else if constexpr (std::is_integral_v<T>) {
      value = static_cast<std::int64_t>(any);
    } else if constexpr (requires { any.string(); }) {
      value = any.string();
    } else if constexpr (requires { ToString(any); }) {
      value = std::string(ToString(any));
    } else {
      value = Value(any);
    }
  }
  Value value;
};

/// Adds a row of `values` under the table's columns, in their order; fewer values leave the last
/// columns empty.
Record& AddRow(std::initializer_list<AnyValue> values, Table* table);

/// True if the value of `key` is unreliable: the outcome of a finished run with `warnings`, or an
/// unresolved exponent or law of growth. Exponents of energy and corrections come from one run,
/// which resolves none.
bool IsFlagged(const Record& row, const std::string& key);

/// Returns the cell for text, Markdown and LaTeX, with '?' after a flagged value. Absent and NaN
/// values are empty, never zero. A value that is not a number is printed unchanged in every format;
/// a series joins its numbers with ';'.
std::string Cell(const Record& row, const TableColumn& column);

/// Formats a number for people (Format::kShortest).
std::string NumberCell(double number);

/// Writes aligned text: title, heading, rule, rows, notes. Columns are as wide as their widest
/// cell, two spaces apart, counted in cells of a terminal (harness/base/text.h). With `colour`
/// cells have the table's colours; escape sequences have no width.
std::string ToText(const Table& table, bool colour = false);

/// Writes RFC 4180: a header of the column keys, then one line per row, quoted if necessary.
/// Numbers have the shortest form that reads back to the same bits. Line ends are "\n". There is no
/// title. Notes follow as lines that begin with "# ", which RFC 4180 does not define. Readers can
/// skip them (pandas: comment="#", R: comment.char="#"; gnuplot by default). Cells with '#' are
/// quoted.
std::string ToCsv(const Table& table);

/// Writes a Markdown table with title and notes.
std::string ToMarkdown(const Table& table);

/// Writes a JSON array of row objects, one per line, for pandas.read_json or jq '.[]'. Numbers have
/// every digit; null means not measured. The notes, for which an array has no other place, are the
/// last value of every row: "provenance", a text with one line per note.
std::string ToJson(const Table& table);

/// Writes a LaTeX table (array, booktabs, longtable): a longtable per group, numbers in math mode,
/// 2.05e-03 as 2.05 x 10^-3, notes below it; from "command: " on they are comments.
std::string ToLatex(const Table& table);

/// Writes the format with this name: "text", "csv", "markdown", "json" or "latex".
/// @throws std::invalid_argument for any other name.
std::string Render(const Table& table, const std::string& format);

inline constexpr std::size_t kColumnGap = 2;  ///< [cells]

/// Returns the width of a column of text [cells].
std::size_t TextWidth(const TableColumn& column, const std::vector<Record>& rows);

/// Fits the table into `width` cells (0: unchanged). Breaks texts into lines of at least 24 cells;
/// if that is not enough, drops columns, which the first note names. Constant columns go first,
/// then the least important (TableColumn::importance), the rightmost of equals. Columns up to the
/// outcome, which identify a row, go after measured values. The first column stays.
Table FitWidth(Table table, std::size_t width);

/// Returns the table as text for standard output, with the width and colour of its screen
/// (harness/base/text.h); for a file or a pipe the text of ToText().
std::string ToScreen(const Table& table);

// Columns of tables of records.

/// Table of the records of one kind.
struct KindOfTable {
  std::string_view name, records, title;
  /// Keys in order, for files and for a terminal of about 100 columns. CASE: the keys of the case
  /// and its outcome; ADDED: measures of user-defined observers. Drift is in m and rad, never
  /// mixed. `loop_closure_max` differs from it only in absolute coordinates, in which every joint
  /// can open and errors may cancel around a loop.
  std::string_view columns, compact;
};

/// Kinds in order of preference: by default the first with records in the store.
std::span<const KindOfTable> KindsOfTables();

/// Returns the columns of a kind (docs/reference/records.md), of drift for any other word. Compact
/// columns have short words that differ in their first letters.
std::vector<TableColumn> ColumnsOfKind(std::string_view name, bool compact);

/// Returns the compact column of a key that identifies cases, if tables for a terminal have one.
std::optional<TableColumn> CompactCaseColumn(std::string_view key);

/// Column of a key that has words in the table of measures (harness/base/record.h).
std::optional<TableColumn> KnownColumn(std::string_view key);

/// Column of any key: header, unit and format as in the tables if they contain it. Otherwise the
/// key is the header, and the type of its first value in `rows` decides the format.
TableColumn ColumnOf(const std::string& key, std::span<const Record> rows);
/// Returns the columns of these keys.
std::vector<TableColumn> ColumnsOf(const std::vector<std::string>& keys,
                                   std::span<const Record> rows);

/// Returns the unit in the brackets that end the header, "" without brackets.
std::string UnitOf(const TableColumn& column);

/// Returns the words with the unit of a key in brackets, if it has one: "error [m]".
std::string WithUnit(const std::string& words, const std::string& key);
inline std::string WithUnit(const std::string& key) { return WithUnit(key, key); }

/// Returns `columns` with the parameters of the records before "outcome". Without them rows could
/// not be distinguished.
std::vector<TableColumn> WithParameters(std::vector<TableColumn> columns,
                                        std::span<const Record> rows);

/// Returns `columns` with further keys of cases before "outcome", such as integrator or experiment,
/// if rows that look equal differ in them.
std::vector<TableColumn> TellingApart(std::vector<TableColumn> columns,
                                      std::span<const Record> rows);

// Tables of records: factorial effects, runs in several scalars, any columns.

/// Returns factorial effects on drift at one tolerance and horizon [s], which affect drift most:
/// one row per change of one factor (formulation, coordinates, enforcement level, geometry) and
/// setting of the factor with most interaction. `within` is the geometry, for the factor geometry
/// itself the coordinates; "all" is every pair together. The geometries of a problem are square
/// (the closure is a linear invariant of the relative coordinates) and general. Problems without
/// counterpart have no factor geometry, but all other factors.
///
/// Pairs are records equal, except for the factor, in mechanism, formulation, enforcement,
/// coordinates, solver, integrator and the parameters of a sweep. If also the case_id is equal, the
/// last record counts. The ratio is drift_position_max of `to` divided by drift_position_max of
/// `from`: geometric mean, smallest and largest. Drift below the unit round-off (2.2e-16 m) counts
/// as the unit round-off. exponent_difference is the mean of growth_exponent(to) -
/// growth_exponent(from) over the pairs that have both. Pairs with a failed run or a drift that is
/// not finite have no ratio: `left_out` counts them, and they keep their row.
///
/// @throws ConfigError if records equal in all of these are different cases.
Table FactorialTable(std::span<const Record> records, double rtol = 1e-8, double horizon = 10.0);

/// Keys, in addition to parameters, whose values are equal on all rungs of a ladder: runs in
/// several scalars and tolerances (kind "precision").
inline constexpr const char* kLadderKeys[] = {"mechanism",   "formulation", "enforcement",
                                              "coordinates", "solver",      "horizon",
                                              "experiment",  "config_hash"};

/// Returns a text that identifies the ladder of a record.
std::string LadderOf(const Record& record);

/// True for the rung with which the others are compared.
bool IsReferenceRung(const Record& record);

/// Sorts ladder by ladder, within it by tolerance from the largest, then by scalar from the
/// narrowest. The reference comes last.
void SortSweepLevels(std::vector<Record>* records);

/// Selection and order of the rows and columns of a table.
struct TableView {
  /// "drift", "timing", "factorial", "all" (records of every kind), or "" for the first of drift,
  /// timing and all that has records in the store.
  std::string kind = "";
  bool compact = false;  ///< few columns and short words, for a terminal of about 100 columns
  Selection where = {};
  std::string group = "";                 ///< key whose values divide the table, "" for none
  std::vector<std::string> columns = {};  ///< keys in order; empty for the columns of the kind
  std::string sort = "";    ///< first key of the order, before the usual order (SortRows)
  bool descending = false;  ///< largest first; missing values stay last
};

/// Returns the table of a view, without provenance. If no row matches, the table has no rows. Keys
/// of the records that no table has (parameters of a sweep) are added, unless columns were chosen.
///
/// @throws ConfigError if `where`, `group`, `columns` or `sort` name a key that no record has.
Table MakeTable(std::span<const Record> records, const TableView& view);

/// Returns the kind that the view shows for these records: its own, else the first with records.
std::string KindOf(const TableView& view, std::span<const Record> records);

/// Returns the rows of the table before `sort` and `group`: records of its kind that match.
std::vector<Record> RowsOf(std::span<const Record> records, const TableView& view);

/// Returns notes ("warning: ...") if timings among the rows come from a noisy machine: their
/// number, the worst A/A spread, load and governor (thresholds: harness/base/record.h).
std::vector<std::string> NoiseWarnings(std::span<const Record> rows);

/// Returns "odca/velocity/joint rtol 1e-08": texts unchanged, numbers with their key; the mechanism
/// if `row` has none of `keys`.
std::string NameOfRow(const Record& row, const std::vector<std::string>& keys);

/// Returns all warning codes with their meanings.
std::vector<std::pair<std::string, std::string>> MeaningsOfWarnings();

/// Returns a line per kind of warning among the rows, with its numbers. A line per problem whose
/// runs end differently names the runs that agree. Long lists are cut, with the number of omitted
/// items. `records` are all records of the store, including runs that the table omits.
std::vector<std::string> WarningNotes(std::span<const Record> rows,
                                      std::span<const Record> records);

}  // namespace loopbench::harness
