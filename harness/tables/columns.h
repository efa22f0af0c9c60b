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

// Columns of the tables and their order.

/// Columns of the case and its outcome for a terminal, with short words that differ in their first
/// letters.
const std::vector<TableColumn>& CompactCaseColumns();

/// Columns of drift.csv (docs/reference/records.md): case, outcome, drift at position [m and rad,
/// never mixed], velocity and acceleration level, energy, growth, counters, conditioning, measures
/// of user-defined observers. `loop_closure_max` differs from the drift only in absolute
/// coordinates, in which every joint can open and errors may cancel around a loop.
const std::vector<TableColumn>& DriftColumns();

/// Columns of timing.csv: case and outcome, size of the mechanism, times.
const std::vector<TableColumn>& TimingColumns();

/// Columns of precision.csv: case with its scalar, outcome, error and drift with the dominant
/// error, counters.
const std::vector<TableColumn>& PrecisionColumns();

/// Part of PrecisionColumns() that fits a terminal.
const std::vector<TableColumn>& CompactPrecisionColumns();

/// Errors and costs of simpler models of a mechanism (harness/cli/models.h), and the columns that
/// fit a terminal.
const std::vector<TableColumn>& ModelColumns();
const std::vector<TableColumn>& CompactModelColumns();
/// Columns of certified and published references.
const std::vector<TableColumn>& ReferenceColumns();
const std::vector<TableColumn>& CompactReferenceColumns();

/// Part of DriftColumns() that fits a terminal of about 100 columns, with shortened words.
const std::vector<TableColumn>& CompactDriftColumns();

/// Part of TimingColumns() that fits a terminal of about 100 columns, with shortened words.
const std::vector<TableColumn>& CompactTimingColumns();

/// Column of a key that has words in the table of measures (harness/record/measures.h).
std::optional<TableColumn> KnownColumn(std::string_view key);

/// Column of any key: header, unit and format as in the tables if they contain it. Otherwise the
/// key is the header, and the type of its first value in `rows` decides the format.
TableColumn ColumnOf(const std::string& key, std::span<const Record> rows);

/// Returns the unit in the brackets that end the header, "" without brackets.
std::string UnitOf(const TableColumn& column);

/// Returns the keys that identify cases: those before "case_id" or "outcome", each once.
std::vector<std::string> CaseKeysOf(std::span<const Record> rows);

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
