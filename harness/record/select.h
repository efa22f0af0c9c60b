// Selection and order of records: filters of the command line, of claims and of tables.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

/// Comparison of a value with a condition's value: any value for "=" and "!=", numbers for others.
enum class Operator { kEqual, kUnequal, kLess, kAtMost, kGreater, kAtLeast };
/// Returns "=", "!=", "<", "<=", ">" or ">=".
std::string_view ToString(Operator op);

/// Condition "the value under `key` is one of `values`", or for other operators none of them, less
/// than the single value, ... Numeric values are compared as numbers, so "1e-6" and "1e-06" are
/// equal. All other values are compared as text ("true", "four-bar"), without order.
struct Condition {
  std::string key;
  std::vector<std::string> values;
  Operator op = Operator::kEqual;

  friend bool operator==(const Condition&, const Condition&) = default;
};

/// Conditions that must all hold. The empty selection matches every record.
using Selection = std::vector<Condition>;

/// Reads "key=value", "key=value,value", "key!=value,value", "key<number", "key<=number" and so on.
/// Throws ConfigError if the key or the value is missing, or an order operator has no number.
Condition ParseCondition(std::string_view text);

/// True if the record meets every condition. A record without the key, or with NaN under it, meets
/// no condition on it, not even "!=".
bool Matches(const Record& record, const Selection& selection);

/// Returns the matching records, in their order.
std::vector<Record> Filter(std::span<const Record> records, const Selection& selection);

/// Returns the selection in command line syntax: "mechanism=four-bar rtol<=1e-06".
std::string ToText(const Selection& selection);

/// Sorts rows as in every table: by mechanism (chain-3 before chain-10), horizon, formulation,
/// coordinates, solver, rtol from coarse to fine, then by all other keys of the case in their order
/// in the record. The order in which runs ended has no effect. Cases of equal keys and different
/// content keep the order of the files of their command, then of the store. A missing number comes
/// last.
void SortRows(std::vector<Record>* records);

/// Sorts stably by one key: numbers by size, then texts in text order. Records without the key, or
/// with NaN, come last in both directions.
void SortRowsBy(std::vector<Record>* records, const std::string& key, bool descending);

}  // namespace loopbench::harness
