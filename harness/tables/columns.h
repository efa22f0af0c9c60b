// Columns of tables of records, and keys that distinguish records.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "harness/record/select.h"
#include "harness/tables/table.h"

namespace loopbench::harness {

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
const std::vector<KindOfTable>& KindsOfTables();

/// Returns the columns of a kind (docs/reference/records.md), of drift for any other word. Compact
/// columns have short words that differ in their first letters.
std::vector<TableColumn> ColumnsOfKind(std::string_view name, bool compact);

/// Returns the compact column of a key that identifies cases, if tables for a terminal have one.
std::optional<TableColumn> CompactCaseColumn(std::string_view key);

/// Column of a key that has words in the table of measures (harness/record/measures.h).
std::optional<TableColumn> KnownColumn(std::string_view key);

/// Column of any key: header, unit and format as in the tables if they contain it. Otherwise the
/// key is the header, and the type of its first value in `rows` decides the format.
TableColumn ColumnOf(const std::string& key, std::span<const Record> rows);

/// Returns the unit in the brackets that end the header, "" without brackets.
std::string UnitOf(const TableColumn& column);

/// Returns the words with the unit of a key in brackets, if it has one: "error [m]".
std::string WithUnit(const std::string& words, const std::string& key);

/// Returns the keys that identify cases: those before "case_id" or "outcome", each once.
std::vector<std::string> CaseKeysOf(std::span<const Record> rows);

/// Returns true if no row has an absolute tolerance of its own.
bool AtolFollowsRtol(std::span<const Record> rows);

/// Returns all keys of the records, each once, in order of first appearance.
std::vector<std::string> KeysOf(std::span<const Record> rows);

/// Throws ConfigError, with `option`, the key, the nearest spelling and all keys, if neither a
/// record nor a table has the key.
void RequireKey(const std::string& option, const std::string& key, std::span<const Record> rows);

/// Checks the keys of all conditions in this way. Also throws for an order condition on a key
/// without a number in any record.
void RequireConditions(const std::string& option, const Selection& selection,
                       std::span<const Record> rows);

/// Returns `columns` with the keys of records that no table has (parameters of a sweep), before
/// "outcome". Without them rows could not be distinguished.
std::vector<TableColumn> WithParameters(std::vector<TableColumn> columns,
                                        std::span<const Record> rows);

/// Returns `columns` with further keys of cases before "outcome", such as integrator or experiment,
/// if rows that look equal differ in them.
std::vector<TableColumn> TellingApart(std::vector<TableColumn> columns,
                                      std::span<const Record> rows);

}  // namespace loopbench::harness
