// Everything that is known of the keys of records, one row each: what tables call a key, what
// stands under it, what becomes of it where a mechanism has several parts, and by which rule two
// values of it are compared. Tables, the store, `compare` and sweeps all read this one list.
#pragma once

#include <deque>
#include <span>
#include <string_view>
#include <vector>

namespace loopbench::harness {

enum class ValueType {
  kAny,      ///< of keys that this program does not know: parameters of sweeps, other programs'
  kNumber,   ///< or null, "not measured"
  kText,     ///< or null
  kFlag,     ///< true or false, or null
  kNumbers,  ///< an array of numbers and nulls
};

/// "a number or null": what a message says was expected.
std::string_view Describe(ValueType type);

/// How the text and Markdown writers print a value. CSV ignores it and keeps every digit.
enum class Format {
  kText,        ///< as it is; left-aligned, all others right-aligned
  kInteger,     ///< 1234
  kShortest,    ///< 1e-06, 10, 0.25; four digits of a number that has more than six: 0.006325
  kScientific,  ///< three digits: 2.05e-03
  kExponent,    ///< two decimals: 1.97
  kFixed,       ///< one decimal: 113.2
  kSeconds,     ///< four significant digits: 0.4213
};

/// What a table says above a column. Without words it is the key, and the value decides the format.
struct Heading {
  std::string_view words = {};  ///< "*": what the key has in place of the "*"
  std::string_view unit = {};   ///< in brackets behind the words, and in comparisons
  Format format = Format::kText;
};

/// How the values of parts that share nothing but the ground become one (harness/run/merge_parts).
enum class Merge {
  kLost,        ///< belongs to one sequence of steps
  kSum,         ///< of the parts that have it
  kSumOfAll,    ///< only where every part was started
  kLargest,     ///< of the parts that have it
  kSmallest,    ///< of the parts that have it
  kWith,        ///< that of the part whose value of another key was taken
  kOfEnding,    ///< that of the first part that failed, or of the first
  kOfEachPart,  ///< keys that name bodies or joints: each part has its own
  kHashOfAll,   ///< of all parts' one after the other, where every part was started
};
struct Merging {
  Merge how = Merge::kLost;
  std::string_view with = {};  ///< for kWith: the other key
};

/// How two values are held against each other.
enum class Rule {
  kNone,          ///< not at all
  kOutcome,       ///< "finished" must stay "finished"
  kDoubts,        ///< what a run's own record says against it: no new reason may come (doubts.h)
  kEqual,         ///< a number that says what was measured: any change is a difference
  kCount,         ///< an exact count of work: more is worse, fewer is better
  kHash,          ///< equal bits
  kError,         ///< drift, energy error, ...: a ratio
  kInstructions,  ///< executed instructions: a ratio
  kTime,          ///< a sample of times: a test
};

/// Where a case that is run again gives the same value.
enum class Repeats {
  kAlways,
  /// Depends on the last bits of floating-point numbers, or on what the compiler makes of the code
  /// (alignment of memory): comparable under one arithmetic only (provenance.h).
  kUnderOneArithmetic,
  /// Tells of the clock, of the machine and how busy it was, or of how the command was typed: two
  /// runs of one case by one program may differ in it.
  kNever,
};

struct Measure {
  std::string_view key = {};  ///< with a "*" at its end: all keys that begin so
  ValueType type = ValueType::kAny;
  Heading heading = {};
  Merging merging = {};
  Rule rule = Rule::kNone;
  Repeats repeats = Repeats::kAlways;
};

/// All rows, those with a rule in the order of comparisons: the built-in ones (measures.cpp), then
/// those added. They stay where they are.
const std::deque<Measure>& Measures();
std::span<const Measure> BuiltInMeasures();
std::vector<const Measure*> AddedMeasures();

/// Adds rows of a program's own, of which RegisterObserver() is the way
/// (harness/observers/registry.h); their words are copied. Throws std::invalid_argument, and adds
/// none, where a key is no key or there already, has no type, or is merged with a key that does not
/// decide which part counts.
void AddMeasures(std::span<const Measure> fresh);

/// The row of a key: its own, else that of the longest beginning; null where there is none.
const Measure* FindMeasure(std::string_view key);

/// kAny where there is no row.
ValueType TypeOf(std::string_view key);

/// Whether records have, or may get, a value of this name from a run: no parameter of a sweep may
/// be called so.
bool IsReserved(std::string_view name);

}  // namespace loopbench::harness
