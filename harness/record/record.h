// One case's result as named values: what the store keeps and what tables, plots and claims read.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace loopbench::harness {

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

}  // namespace loopbench::harness
