// Records: keys and values, measures, selection, origin, quiet machines.
#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace loopbench::harness {

// Metadata of record keys, one row each: heading, type, rule for merging the parts of a mechanism,
// comparison rule. Tables, the store, `compare` and sweeps all read this list.

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
  kWarnings,      ///< warnings of a run's own record: no new code may appear (analysis.h)
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
  /// Depends on last bits or on compiled code: comparable under one arithmetic only (Origin).
  kUnderOneArithmetic,
  /// Depends on the clock, the machine, its load or the typed command: equal runs may differ.
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

/// State of the machine during timing.
struct MachineState {
  double load1 = 0;    ///< load average of the last minute: processes that run or are ready to run
  int processors = 1;  ///< processors that this process may use
  std::string governor;  ///< frequency governor of the processor, "" if unreadable (as on most VMs)
};

/// Reads /proc/loadavg and cpufreq's governor. `load1` is NaN if it cannot be read.
MachineState ReadMachineState();

/// Returns the value at a fraction of the sorted sample (nearest rank); NaN for an empty one.
double Quantile(std::vector<double> sample, double fraction);

/// Returns the A/A spread: one subject timed twice as if it were two methods, alternating batch by
/// batch. The relative difference of the medians, |a - b| / min(a, b), is the apparent difference
/// of two equal methods. NaN if either sample is empty.
double AaSpread(const std::vector<double>& first, const std::vector<double>& second);

struct NoiseThresholds {
  /// Smallest difference that `compare` reports: not credible if equal subjects differ by more.
  double aa_spread = 0.02;

  /// Runnable processes per processor. Up to 1 the timed process has a free processor; above, the
  /// system takes turns. (After accuracy runs of the same command the load comes from their jobs,
  /// so a smaller threshold would blame the program itself.)
  double load_per_processor = 1.0;

  /// Other governors change the frequency with the load, so that the first batches are slower.
  std::string governor = "performance";
};

/// Times whose calibrations (harness/run/timing.h) differ by more than this factor count as
/// times of two machines. On an idle machine, medians of the calibration differ by less than 1 %;
/// with a loaded host or a lower clock they are 5 % longer or more.
inline constexpr double kOtherSpeed = 1.03;

/// Returns `wanted` rounds of measurements, ascending: first the rounds in which no calibration
/// took longer than on an idle machine, in order, then the least disturbed ones.
/// @param slowest  longest calibration of each round [ns]
/// @param alone    calibration of the idle machine [ns]
std::vector<std::size_t> QuietRounds(const std::vector<double>& slowest, double alone,
                                     std::size_t wanted);

/// Returns the reasons why the machine counts as noisy, as one sentence such as "A/A spread 5.1 %
/// (quiet: up to 2 %)"; "" if it counts as quiet. NaN is no reason: the value was not measured.
std::string NoiseReasons(const MachineState& machine, double aa_spread_rhs, double aa_spread_wall,
                         const NoiseThresholds& thresholds = {});

/// A value of a record. `monostate` is "not measured"; it prints as an empty cell, never as zero.
///
/// The copy constructor of std::variant in libstdc++ 12 crashes if memory runs out while it copies
/// a string or a vector: it destroys an alternative that does not exist yet. A copy is assigned
/// here.
struct Value
    : std::variant<std::monostate, bool, std::int64_t, double, std::string, std::vector<double>> {
  using variant::variant;
  using variant::operator=;
  Value() = default;
  Value(const Value& other) : variant() { variant::operator=(other); }
  Value(Value&&) noexcept = default;
  Value& operator=(const Value&) = default;
  Value& operator=(Value&&) noexcept = default;
  ~Value() = default;
};

/// Ordered (key, value) pairs. Keys are column names (docs/reference/records.md), with dots for
/// nested values such as "series.t". Order of first insertion is the order of writing.
class Record {
 public:
  /// Sets or replaces the value of `key`.
  void Set(std::string_view key, Value value);

  /// Adds a key that the record does not have yet, without searching for it.
  void Append(std::string key, Value value) {
    items_.emplace_back(std::move(key), std::move(value));
  }

  /// Returns the value, or nullptr if the record has no such key.
  const Value* Find(std::string_view key) const;

  /// Returns the value as text: strings unchanged, numbers in shortest exact form, "" if absent.
  std::string Text(std::string_view key) const;

  /// Returns the value as a number (integers and bools converted), NaN if absent or not a number.
  double Number(std::string_view key) const;

  /// Returns the value as a series, or an empty one.
  const std::vector<double>& Numbers(std::string_view key) const;

  const std::vector<std::pair<std::string, Value>>& items() const { return items_; }

  /// Returns "mass = 1, damping = 0.5".
  std::string Described() const;

  friend bool operator==(const Record&, const Record&) = default;

 private:
  std::vector<std::pair<std::string, Value>> items_;
};

/// Returns the record as one JSON object without line breaks: "format" (text.h), keys in the
/// record's order, then its checksum.
///
/// A non-finite double is written as null, which reads back as monostate ("not measured"), or as
/// NaN inside a series. All other values keep their type and bits ("1.0" never "1"). Bytes that are
/// not UTF-8 become U+FFFD. The line ends with ,"checksum":"16 hexadecimal digits"}: FNV-1a (64
/// bit) of all bytes before. It detects accidental changes; it is no signature.
std::string ToJsonLine(const Record& record);
/// Returns the object without format and checksum: a row of a table, not of a store.
std::string ToJsonObject(const Record& record);

/// Returns the record in `line`, without its format and checksum. A line without both (written by
/// hand) is accepted, with `is_sealed` false. Throws std::runtime_error with the value found and
/// the value expected for another format, a format without checksum, and a wrong checksum. Also
/// throws unless the line is one flat JSON object of null, bool, number, string or array of
/// numbers, with unique keys and values of the types of their keys (Measure). Linear in the line
/// length.
Record FromJsonLine(std::string_view line, bool* is_sealed = nullptr);

/// True if `line` is only the beginning of a run's line by ToJsonLine(), as after a crash.
bool IsTornRecord(std::string_view line);

/// Returns 16 hexadecimal digits that identify a case: FNV-1a (64 bit) of the JSON of its keys,
/// sorted and without spaces. It finds equal cases; it gives no security.
std::string CaseId(const Record& canonical_keys);

/// Returns `object`, a JSON object in one line, with its checksum as last key.
std::string WithChecksum(std::string object);

/// Error for a line without its required checksum.
inline constexpr const char* kWithoutChecksum =
    "found a line without its checksum, expected one: it may have been changed";

/// Returns true if the line ends with its checksum. Throws std::runtime_error with the checksum
/// found and expected if it ends with another one, or with its own under a damaged key.
bool VerifyChecksum(std::string_view line);

/// Returns the beginning of `text`, any bytes, as valid UTF-8 without control characters: about 80
/// bytes at most, other bytes as \xNN.
std::string Excerpt(std::string_view text);

/// JSON object for programs, with keys in the order of adding. Converts values as records do.
class JsonObject {
 public:
  JsonObject() = default;
  explicit JsonObject(const Record& record);

  JsonObject& Add(std::string_view key, Value value);
  JsonObject& Add(std::string_view key, const std::vector<std::string>& texts);
  /// Adds a document: an object, or a list of objects.
  JsonObject& Add(std::string_view key, const JsonObject& object);
  JsonObject& Add(std::string_view key, const std::vector<JsonObject>& objects);

  /// Returns the object without line breaks.
  std::string Text() const { return "{" + members_ + "}"; }

 private:
  void Append(std::string_view key, const std::string& document);

  std::string members_;
};

/// Returns a count as a value.
inline Value Count(std::size_t number) { return static_cast<std::int64_t>(number); }

/// Returns "[...]", one object per line.
std::string JsonList(const std::vector<JsonObject>& objects);

/// Origin of a record, which limits comparisons: times need one machine, bits one arithmetic.
struct Origin {
  std::string machine;   ///< processor model and number of logical processors
  std::string compiler;  ///< name and version
  std::string flags;     ///< build type, -march and other flags that change results
  std::string libm;  ///< hash of sines, powers, ... at fixed arguments: equal libraries, equal bits
  std::string commit;  ///< "-dirty" if the tree was changed

  /// True if equal code gives equal bits: compiler, flags and libm are known and equal.
  bool SameArithmetic(const Origin& other) const;
  /// True if times may be compared: the machine is known and equal.
  bool SameMachine(const Origin& other) const;
};

/// Returns the origin of this program on this machine.
const Origin& ThisOrigin();

/// Sets the keys "machine", "compiler", "flags", "libm" and "commit".
void Stamp(Record& record);

/// Returns the origin from the keys set by Stamp(); unknown parts are empty.
Origin OriginOf(const Record& record);

/// Returns the lines below every table: command, machine, compiler, versions, commit, one fact per
/// line, "command: ...". `command` is the typed command.
std::vector<std::string> Provenance(const std::string& command);

/// Returns the output of `loopbench --version`: the version, and facts independent of the command.
std::string VersionText();

/// Returns 16 hexadecimal digits that change with any byte of this program.
const std::string& CodeVersion();

/// Returns the program's name and its arguments, separated by spaces.
std::string CommandLine(int argc, const char* const* argv);

/// Returns the command line in shell syntax, with the program as it was called.
std::string ShellLine(const std::vector<std::string>& words);

// Selection and order of records: filters of the command line, of claims and of tables.

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

/// True if the record meets every condition. None holds for a missing key or NaN, not even "!=".
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

/// Sorts stably by one key: numbers, then texts; missing values and NaN last in both directions.
void SortRowsBy(std::vector<Record>* records, const std::string& key, bool descending);

}  // namespace loopbench::harness
