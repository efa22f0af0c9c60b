// A cursor over a JSON document whose getters report what they do not accept.
//
// Reading goes on after an error with a stand-in value, so that one run shows all errors of a file:
//   FILE: /json/pointer: found VALUE, expected WHAT (did you mean "x"?)
// The caller ends with ErrorList::ThrowIfAny(); what was read before is not used when it throws.
// Internal to harness/config (see json_document.h).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "harness/config/json_document.h"

namespace loopbench::harness {

/// All complaints about one file, in the order they were found.
class ErrorList {
 public:
  explicit ErrorList(std::string file) : file_(std::move(file)) {}

  /// Adds one complaint; `suggestion` is the nearest valid spelling or "".
  void Add(std::string_view pointer, std::string_view found, std::string_view expected,
           std::string_view suggestion = "");

  /// Adds finished messages, such as those of a file that this file refers to.
  void AddText(std::string text) { messages_.push_back(std::move(text)); }

  bool empty() const { return messages_.empty(); }

  /// Throws ConfigError with all messages, one per line, unless there are none.
  void ThrowIfAny() const;

 private:
  std::string file_;
  std::vector<std::string> messages_;
};

/// The numbers a getter accepts.
struct Range {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool above_min = false;  ///< min itself is refused

  bool Contains(double value) const {
    return (above_min ? value > min : value >= min) && value <= max;
  }
  /// "", " > 0", " >= 0", " from 0 to 1".
  std::string Text() const;
};

inline constexpr Range kPositive = {.min = 0.0, .above_min = true};
inline constexpr Range kNotNegative = {.min = 0.0};

/// One value of the document and its place. Refers to the document and to the error list, which
/// must both outlive it.
class JsonNode {
 public:
  JsonNode(const Json& value, std::string pointer, ErrorList& errors)
      : value_(&value), pointer_(std::move(pointer)), errors_(&errors) {}

  const Json& value() const { return *value_; }

  /// Reports this value.
  void Fail(std::string_view expected, std::string_view suggestion = "") const;
  /// Reports this place with a description of its own instead of the value.
  void FailAs(std::string_view found, std::string_view expected,
              std::string_view suggestion = "") const;

  /// True for an object. Reports anything else, and every key that is not in `known`.
  bool ExpectObject(const std::vector<std::string>& known) const;
  /// The member, or nothing when it is absent or this is no object.
  std::optional<JsonNode> Optional(const std::string& key) const;
  /// The member; reports when it is absent. `expected` says what it would be.
  std::optional<JsonNode> Required(const std::string& key, std::string_view expected) const;
  /// All members in the order of the file; reports when this is no object.
  std::vector<std::pair<std::string, JsonNode>> Members() const;

  /// The elements of an array; reports anything else. `what` names them ("joints").
  std::vector<JsonNode> Elements(std::string_view what) const;
  /// The elements of an array with at least one, or the value itself: `"x": 1` for `"x": [1]`.
  std::vector<JsonNode> OneOrMore(std::string_view what) const;

  /// A number in the range; 0 after an error. JSON has no NaN and no infinity, and ParseDocument
  /// refuses numbers that overflow, so it is finite.
  double Number(const Range& range = {}) const;
  /// An integer in [min, max]; 2.7 is an error, 1e3 is an integer. `min` after an error.
  std::int64_t Integer(std::int64_t min, std::int64_t max) const;
  bool Bool() const;
  /// A string with at least one character.
  std::string Text() const;
  /// Two or three numbers; z = 0 when only two are given.
  Eigen::Vector3d Vector() const;
  /// Exactly `count` numbers.
  std::vector<double> Numbers(std::size_t count) const;
  /// One number or a list of different numbers, all in the range.
  std::vector<double> NumberList(const Range& range = {}) const;

  /// Index of this string in `known`; reports anything else with the nearest spelling. `what` names
  /// the thing ("a body"). An enum is a choice among its names.
  std::optional<int> Choice(const std::vector<std::string>& known, std::string_view what) const;

 private:
  JsonNode Child(const Json& value, std::string_view token) const;

  const Json* value_;
  std::string pointer_;
  ErrorList* errors_;
};

}  // namespace loopbench::harness
