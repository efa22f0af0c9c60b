// Records: ordered keys and values, and their JSON with its checksum.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace loopbench::harness {

// Result of one case as named values, for the store, tables, plots and claims.

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

  friend bool operator==(const Record&, const Record&) = default;

 private:
  std::vector<std::pair<std::string, Value>> items_;
};

// Conversion of a Record to one line of JSON and back.

/// Returns the record as one JSON object without line breaks: "format" (files.h), keys in the
/// record's order, then its checksum.
///
/// JSON has no NaN and no infinity. A non-finite double is written as null, which reads back as
/// monostate ("not measured"), or as NaN inside a series. All other values keep their type and bits
/// (doubles in shortest round-trip form, "1.0" never "1"). Bytes that are not UTF-8 become U+FFFD.
///
/// The line ends with ,"checksum":"16 hexadecimal digits"}: FNV-1a (64 bit) of all bytes before. It
/// detects accidental changes of a line, single flipped bits with certainty; it is no signature.
std::string ToJsonLine(const Record& record);
/// Returns the object without format and checksum: a row of a table, not of a store.
std::string ToJsonObject(const Record& record);

/// Returns the record in `line`, without its format and checksum. A line without both (written by
/// hand) is accepted, with `is_sealed` false. Throws std::runtime_error with the value found and
/// the value expected for another format, a format without checksum, and a wrong checksum. Also
/// throws unless the line is one flat JSON object of null, bool, number, string or array of
/// numbers, with unique keys and values of the types of their keys (measures.h). Linear in the line
/// length.
Record FromJsonLine(std::string_view line, bool* is_sealed = nullptr);

/// True if `line` is only the beginning of a line that ToJsonLine() wrote of a run's record, as
/// after a crash.
bool IsTornRecord(std::string_view line);

/// Returns 16 hexadecimal digits that identify a case: FNV-1a (64 bit) of the canonical JSON of its
/// keys. The canonical form has sorted keys and no spaces, so the order of setting keys has no
/// effect. The hash finds equal cases; it gives no security.
std::string CaseId(const Record& canonical_keys);

// Checksum at the end of a record's line.

/// Returns `object`, a JSON object in one line, with its checksum as last key.
std::string WithChecksum(std::string object);

/// Error for a line without its required checksum.
inline constexpr const char* kWithoutChecksum =
    "found a line without its checksum, expected one: it may have been changed";

/// Returns true if the line ends with its checksum. Throws std::runtime_error with the checksum
/// found and expected if it ends with another one, or with its own under a damaged key.
bool VerifyChecksum(std::string_view line);

// Excerpts of stores in messages.

/// Returns the beginning of `text`, any bytes, as valid UTF-8 without control characters: about 80
/// bytes at most, other bytes as \xNN.
std::string Excerpt(std::string_view text);

// JSON documents for programs, made of values, records and other documents.

/// JSON object with keys in the order of adding. Invalid UTF-8, NaN and infinity are converted as
/// in records (record.h).
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

}  // namespace loopbench::harness
