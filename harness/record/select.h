// Choosing and ordering records: the filters of the command line, of claims and of tables.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

/// How a condition holds a value against its own: "=" and "!=" any value, the others numbers.
enum class Operator { kEqual, kUnequal, kLess, kAtMost, kGreater, kAtLeast };
/// "=", "!=", "<", "<=", ">", ">=".
std::string_view ToString(Operator op);

/// "The value under `key` is one of `values`", or with another operator: none of them, less than
/// the one of them, ... A numeric value is compared as a number, so "1e-6" and "1e-06" are the
/// same; every other value is compared as text ("true", "four-bar"), and has no order.
struct Condition {
  std::string key;
  std::vector<std::string> values;
  Operator op = Operator::kEqual;

  friend bool operator==(const Condition&, const Condition&) = default;
};

/// All conditions hold. The empty selection matches every record.
using Selection = std::vector<Condition>;

/// Reads "key=value", "key=value,value", "key!=value,value", "key<number", "key<=number" and so on.
/// Throws ConfigError when the key or the value is missing, or an order is asked of what is no
/// number.
Condition ParseCondition(std::string_view text);

/// Whether the record meets every condition. A record without the key, or with NaN under it, meets
/// none about it, not even "!=".
bool Matches(const Record& record, const Selection& selection);

/// The records that match, in their order.
std::vector<Record> Filter(std::span<const Record> records, const Selection& selection);

/// The selection as a person would type it: "mechanism=four-bar rtol<=1e-06".
std::string ToText(const Selection& selection);

/// Order of rows in every table: by mechanism (chain-3 before chain-10), horizon, formulation,
/// coordinates, solver, rtol from coarse to fine, then by all other keys of the case as they stand
/// in the record: which run ended first leaves no trace. Cases of equal keys and different content
/// stay in the order of the files of their command, then in that of the store. A missing number
/// comes last.
void SortRows(std::vector<Record>* records);

/// Stable order by one key: numbers by size, anything else by its text, texts after numbers.
/// Records without the key, or with NaN, come last in both directions.
void SortRowsBy(std::vector<Record>* records, const std::string& key, bool descending);

}  // namespace loopbench::harness
