// Records: ordered keys and values, and their JSON with its checksum.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace loopbench::harness {

// One case's result as named values: what the store keeps and what tables, plots and claims read.

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

  /// Adds a key that the record does not have yet, without looking for it.
  void Append(std::string key, Value value) {
    items_.emplace_back(std::move(key), std::move(value));
  }

  /// The value, or nullptr when the record has no such key.
  const Value* Find(std::string_view key) const;

  /// The value as text: strings as they are, numbers in shortest round-trip form, "" when absent.
  std::string Text(std::string_view key) const;

  /// The value as a number (integers and bools converted), or NaN when absent or not a number.
  double Number(std::string_view key) const;

  /// The value as a series, or an empty one.
  const std::vector<double>& Numbers(std::string_view key) const;

  const std::vector<std::pair<std::string, Value>>& items() const { return items_; }

  friend bool operator==(const Record&, const Record&) = default;

 private:
  std::vector<std::pair<std::string, Value>> items_;
};

// A Record as one line of JSON, and back.

/// The record as one JSON object without line breaks: "format" (files.h), keys in the
/// record's order, and behind them its checksum.
///
/// JSON has no NaN and no infinity. A non-finite double is written as null, which reads back as
/// monostate ("not measured"); inside a series it reads back as NaN. Every other value comes back
/// with the same type and the same bits (doubles in shortest round-trip form, "1.0" never "1").
/// Bytes that are not UTF-8 become U+FFFD.
///
/// The line ends with ,"checksum":"16 hexadecimal digits"}: FNV-1a (64 bit) of all bytes before
/// this. It finds whatever changes a line by accident, a flipped bit with certainty; it is no
/// signature.
std::string ToJsonLine(const Record& record);
/// The same object without format and checksum: a row of a table, not of a store.
std::string ToJsonObject(const Record& record);

/// The record that `line` describes, without its format and checksum. A line without both (made by
/// hand) is accepted, and `is_sealed` is false then. Throws std::runtime_error with the value found
/// and the value expected for another format, a format without a checksum, and a wrong checksum. It
/// also throws unless the line is one flat JSON object of null, bool, number, string or array of
/// numbers, whose keys occur once and whose values have the types of their keys (measures.h).
/// Linear in the length of any line.
Record FromJsonLine(std::string_view line, bool* is_sealed = nullptr);

/// Whether `line` is the beginning of a line that ToJsonLine() wrote of a run's record, and no
/// more: what a crash leaves.
bool IsTornRecord(std::string_view line);

/// 16 hexadecimal digits that name a case: FNV-1a (64 bit) of the canonical JSON of its keys. In
/// the canonical form keys are sorted and there are no spaces, so the order in which keys were set
/// does not matter. A hash, not a signature: it is for finding equal cases, not for security.
std::string CaseId(const Record& canonical_keys);

// The checksum at the end of a record's line.

/// `object`, a JSON object in one line, with its checksum as last key.
std::string WithChecksum(std::string object);

/// The error of a line that should have a checksum and has none.
inline constexpr const char* kWithoutChecksum =
    "found a line without its checksum, expected one: it may have been changed";

/// Whether the line ends with its checksum. Throws std::runtime_error naming the checksum found and
/// the one expected when it ends with another one, or with its own under a damaged name.
bool VerifyChecksum(std::string_view line);

// Pieces of stores in messages.

/// The beginning of `text`, whatever it holds, in valid UTF-8 and without control characters: at
/// most some 80 bytes, other bytes as \xNN.
std::string Excerpt(std::string_view text);

// JSON documents that commands print for programs, made of values, records and other documents.

/// Keys in the order in which they were added. Texts that are not UTF-8, NaN and infinity become
/// what they are in records (record.h).
class JsonObject {
 public:
  JsonObject() = default;
  explicit JsonObject(const Record& record);

  JsonObject& Add(std::string_view key, Value value);
  JsonObject& Add(std::string_view key, const std::vector<std::string>& texts);
  /// A document: an object, or a list of them.
  JsonObject& Add(std::string_view key, const JsonObject& object);
  JsonObject& Add(std::string_view key, const std::vector<JsonObject>& objects);

  /// Without line breaks.
  std::string Text() const { return "{" + members_ + "}"; }

 private:
  void Append(std::string_view key, const std::string& document);

  std::string members_;
};

/// A number of things, as a value.
inline Value Count(std::size_t number) { return static_cast<std::int64_t>(number); }

/// "[...]", an object a line.
std::string JsonList(const std::vector<JsonObject>& objects);

}  // namespace loopbench::harness
