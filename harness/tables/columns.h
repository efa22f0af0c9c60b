// Columns of tables of records, and the keys that tell records apart.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "harness/record/select.h"
#include "harness/tables/table.h"

namespace loopbench::harness {

// Which columns the tables have, and in which order.

/// What was run and how it ended, for a terminal: words that differ in their first letters are
/// short.
const std::vector<TableColumn>& CompactCaseColumns();

/// The columns of drift.csv (docs/reference/records.md): what was run, how it ended, drift at
/// position [m and rad, never mixed], velocity and acceleration level, energy, growth, counters,
/// conditioning, then what observers of other programs measure.
/// `loop_closure_max` differs from the drift in absolute coordinates only, where every joint can
/// open and mismatches may cancel around a loop.
const std::vector<TableColumn>& DriftColumns();

/// The columns of timing.csv: what was run and how it ended, the size of the mechanism, then times.
const std::vector<TableColumn>& TimingColumns();

/// The columns of precision.csv: what was run in which scalar and how it ended, error and drift
/// with what rules them, counters.
const std::vector<TableColumn>& PrecisionColumns();

/// The part of PrecisionColumns() that fits a terminal.
const std::vector<TableColumn>& CompactPrecisionColumns();

/// What simpler models of a mechanism cause and take (harness/cli/models.h), and the part of
/// it that fits a terminal.
const std::vector<TableColumn>& ModelColumns();
const std::vector<TableColumn>& CompactModelColumns();
/// The columns of certified and published references.
const std::vector<TableColumn>& ReferenceColumns();
const std::vector<TableColumn>& CompactReferenceColumns();

/// The part of DriftColumns() that fits a terminal of some 100 columns, with shortened words.
const std::vector<TableColumn>& CompactDriftColumns();

/// The part of TimingColumns() that fits a terminal of some 100 columns, with shortened words.
const std::vector<TableColumn>& CompactTimingColumns();

/// The column of a key that has words in the table of measures (harness/record/measures.h).
std::optional<TableColumn> KnownColumn(std::string_view key);

/// The column of any key: header, unit and format as in the tables where they have it; else the key
/// is the header, and the type of its first value in `rows` decides the format.
TableColumn ColumnOf(const std::string& key, std::span<const Record> rows);

/// The unit in the brackets that end the header, "" without.
std::string UnitOf(const TableColumn& column);

/// The keys that name cases: those before "case_id" or "outcome", each once.
std::vector<std::string> CaseKeysOf(std::span<const Record> rows);

/// All keys of the records, each once, in order of first appearance.
std::vector<std::string> KeysOf(std::span<const Record> rows);

/// Throws ConfigError, with `option`, the key, the nearest spelling and all keys, when neither a
/// record nor a table has the key.
void RequireKey(const std::string& option, const std::string& key, std::span<const Record> rows);

/// The same for the keys of all conditions; and throws for one that asks for an order of a key
/// under which no record has a number.
void RequireConditions(const std::string& option, const Selection& selection,
                       std::span<const Record> rows);

/// `columns` with the keys that records have and no table knows, before "outcome": the parameters
/// of a sweep, without which rows could not be told apart.
std::vector<TableColumn> WithParameters(std::vector<TableColumn> columns,
                                        std::span<const Record> rows);

/// `columns` with, before "outcome", those further keys of cases in which rows differ that would
/// look alike without: the integrator, the experiment, whatever a short table leaves out.
std::vector<TableColumn> TellingApart(std::vector<TableColumn> columns,
                                      std::span<const Record> rows);

}  // namespace loopbench::harness
