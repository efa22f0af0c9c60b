// Metadata of record keys, one row each: heading, type, rule for merging the parts of a mechanism,
// comparison rule. Tables, the store, `compare` and sweeps all read this list.
#pragma once

#include <deque>
#include <span>
#include <string_view>
#include <vector>

namespace loopbench::harness {

enum class ValueType {
  kAny,      ///< keys without a row: parameters of sweeps, keys of other programs
  kNumber,   ///< or null, "not measured"
  kText,     ///< or null
  kFlag,     ///< true or false, or null
  kNumbers,  ///< an array of numbers and nulls
};

/// Returns "a number or null": the expected type in messages.
std::string_view Describe(ValueType type);

/// Format of a value in text and Markdown. CSV ignores it and keeps every digit.
enum class Format {
  kText,        ///< unchanged; left-aligned, all others right-aligned
  kInteger,     ///< 1234
  kShortest,    ///< 1e-06, 10, 0.25; four digits of a number that has more than six: 0.006325
  kScientific,  ///< three digits: 2.05e-03
  kExponent,    ///< two decimals: 1.97
  kFixed,       ///< one decimal: 113.2
  kSeconds,     ///< four significant digits: 0.4213
};

/// Heading of a column. Without words it is the key, and the value decides the format.
struct Heading {
  std::string_view words = {};  ///< "*": replaced by the part of the key that matches "*"
  std::string_view unit = {};   ///< in brackets after the words, and in comparisons
  Format format = Format::kText;
};

/// Rule to merge values of parts connected only through the ground (harness/run/merge_parts).
enum class Merge {
  kLost,        ///< no merged value: belongs to one sequence of steps
  kSum,         ///< sum over the parts that have it
  kSumOfAll,    ///< sum, only if every part was started
  kLargest,     ///< largest over the parts that have it
  kSmallest,    ///< smallest over the parts that have it
  kWith,        ///< value of the part that was selected for another key
  kOfEnding,    ///< value of the first part that failed, or else of the first part
  kOfEachPart,  ///< keys that name bodies or joints: each part has its own
  kHashOfAll,   ///< hash of the values of all parts in sequence, if every part was started
};
struct Merging {
  Merge how = Merge::kLost;
  std::string_view with = {};  ///< the other key, for kWith
};

/// Rule to compare two values.
enum class Rule {
  kNone,          ///< no comparison
  kOutcome,       ///< "finished" must stay "finished"
  kWarnings,      ///< warnings of a run's own record: no new code may appear (warnings.h)
  kEqual,         ///< number that identifies the measurement: any change is a difference
  kCount,         ///< exact count of work: more is worse, fewer is better
  kHash,          ///< equal bits
  kError,         ///< drift, energy error, ...: compared by ratio
  kInstructions,  ///< executed instructions: compared by ratio
  kTime,          ///< sample of times: compared by a statistical test
};

/// Conditions under which a repeated case gives the same value.
enum class Repeats {
  kAlways,
  /// Depends on the last bits of floating-point numbers or on compiled code (alignment of memory):
  /// comparable under one arithmetic only (provenance.h).
  kUnderOneArithmetic,
  /// Depends on the clock, the machine and its load, or the typed command: two runs of one case by
  /// one program may differ in it.
  kNever,
};

struct Measure {
  std::string_view key = {};  ///< with a "*" at its end: all keys with this beginning
  ValueType type = ValueType::kAny;
  Heading heading = {};
  Merging merging = {};
  Rule rule = Rule::kNone;
  Repeats repeats = Repeats::kAlways;
};

/// Returns all rows, rows with a rule in the order of comparisons: the built-in ones
/// (measures.cpp), then the added ones. Their addresses are stable.
const std::deque<Measure>& Measures();
std::span<const Measure> BuiltInMeasures();
std::vector<const Measure*> AddedMeasures();

/// Adds rows of a user program, which calls RegisterObserver() for this
/// (harness/observers/registry.h); copies their words. Throws std::invalid_argument, and adds no
/// row, if a key is invalid, exists or has no type, or is merged with a key that selects no part.
void AddMeasures(std::span<const Measure> fresh);

/// Returns the row of a key: its own, else the longest matching "*" row; null if there is none.
const Measure* FindMeasure(std::string_view key);

/// Returns the type of a key, kAny if there is no row.
ValueType TypeOf(std::string_view key);

/// True if a run may write a value of this name to a record: no parameter of a sweep may have it.
bool IsReserved(std::string_view name);

}  // namespace loopbench::harness
