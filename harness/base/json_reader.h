// Values of a document with their locations, and readers that report all errors.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "harness/base/json_document.h"

namespace loopbench::harness {

/// Origin of the values of a document: its file, included files, and settings. A sweep and --set
/// change a document after it was parsed, and a pointer through the path of a mechanism includes
/// that file. Messages must still name the file and line to edit.
class Origins {
 public:
  /// Origin in document `file`; its text outlives the object. "": messages without line numbers.
  explicit Origins(std::string file, std::string_view text = "") {
    parts_.push_back({"", std::move(file), text, "", ""});
  }

  /// Records that the value at `pointer` is now the document `file`.
  void TakeIn(std::string pointer, std::string file, std::string_view text) {
    parts_.push_back({std::move(pointer), std::move(file), text, "", ""});
  }

  /// Records that the value at `pointer` was set. `note` describes the setter; `source` is its
  /// pointer in the first file, or "" if it is in no file.
  void Note(std::string pointer, std::string note, std::string source) {
    parts_.push_back({std::move(pointer), "", "", std::move(note), std::move(source)});
  }

  struct Place {
    std::string file;
    std::string pointer;       ///< within `file`, for messages
    std::string line_pointer;  ///< pointer whose line is reported
    std::string_view text;     ///< of `file`
    std::string note;          ///< "" for values from a file
  };

  /// Returns the innermost part that contains the value; of equally deep parts, the latest.
  Place Find(const std::string& pointer) const {
    const Part* found = &parts_.front();
    for (const Part& part : parts_) {
      const bool inside =
          pointer.starts_with(part.pointer) &&
          (pointer.size() == part.pointer.size() || pointer[part.pointer.size()] == '/');
      if (inside && part.pointer.size() >= found->pointer.size()) found = &part;
    }
    if (!found->note.empty()) {
      const Part& root = parts_.front();
      return {root.file, pointer, found->source, found->source.empty() ? "" : root.text,
              found->note};
    }
    const std::string within = pointer.substr(found->pointer.size());
    return {found->file, within, within, found->text, ""};
  }

 private:
  struct Part {
    std::string pointer, file;
    std::string_view text;
    std::string note, source;
  };
  std::vector<Part> parts_;
};

/// Errors of one file, in the order of detection. Errors beyond kMaxMessages are only counted.
/// After an error, reading continues with a placeholder value, so that all errors are reported:
///   FILE:LINE: /json/pointer: found VALUE, expected WHAT (did you mean "x"?)
/// The caller ends with ThrowIfAny(); values read before are not used if it throws.
class ErrorList {
 public:
  /// `text` is the file's text, for line numbers; it must outlive the list.
  ErrorList(std::string file, std::string_view text) : origins_(std::move(file), text) {}
  explicit ErrorList(Origins origins) : origins_(std::move(origins)) {}

  /// Adds an error; `suggestion` is the nearest valid spelling or "".
  void Add(std::string_view pointer, std::string_view found, std::string_view expected,
           std::string_view suggestion = "");

  /// Adds an error that may share its cause with others, such as a key missing elsewhere. The
  /// message is "found ..., expected ..., or CURE" with the locations of the others.
  void AddWithCure(std::string_view cure, std::string_view pointer, std::string_view found,
                   std::string_view expected);

  /// Adds complete messages, such as those of an included file. Equal texts are added once.
  void AddText(const std::string& text);

  /// Returns the place "FILE:LINE: /json/pointer" of a value, for messages after reading.
  std::string PlaceOf(const std::string& pointer) const;

  bool empty() const { return messages_.empty(); }
  /// Returns true if further errors are only counted and need no text.
  bool full() const { return messages_.size() >= kMaxMessages; }

  /// Throws ConfigError with all messages, one per line, and a line `ending`, if there are any.
  void ThrowIfAny(const std::string& ending = "") const;

 private:
  struct Message {
    bool finished;        ///< text is the complete message
    std::string pointer;  ///< otherwise file, line and pointer precede the text
    std::string text;
    std::string cure = "";
    std::vector<std::string> also = {};  ///< first locations of other errors with this cure
    std::size_t others = 0;              ///< number of these errors
  };
  Origins origins_;
  std::vector<Message> messages_;
  std::size_t more_ = 0;
};

/// List of names with constant-time lookup of their indices.
class NameList {
 public:
  NameList() = default;
  NameList(const std::vector<std::string>& names) {  // NOLINT: a list is a NameList
    for (const std::string& name : names) Add(name);
  }
  NameList(std::initializer_list<std::string> names) : NameList(std::vector<std::string>(names)) {}

  /// Adds a name with the next index; a repeated name, an error of the file, as an empty one.
  void Add(const std::string& name) {
    const bool first = indices_.emplace(name, names_.size()).second;
    names_.push_back(first ? name : "");
  }
  /// Returns the index of a name, or nothing if it is empty or unknown.
  std::optional<int> Find(const std::string& name) const {
    const auto found = indices_.find(name);
    if (name.empty() || found == indices_.end()) return std::nullopt;
    return static_cast<int>(found->second);
  }
  const std::vector<std::string>& all() const { return names_; }

 private:
  std::vector<std::string> names_;
  std::unordered_map<std::string, std::size_t> indices_;
};

/// Range of numbers that a getter accepts.
struct Range {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool above_min = false;     ///< min itself is excluded
  std::string_view why = "";  ///< reason for min, appended in messages: " (the spacing of doubles)"

  bool Contains(double value) const {
    return (above_min ? value > min : value >= min) && value <= max;
  }
  /// "", " > 0", " >= 0", " from 0 to 1".
  std::string Text() const;
};

inline constexpr int kMaxInRange = 10000;  ///< maximum count of a lin or log range

inline constexpr Range kPositive = {.min = 0.0, .above_min = true};
inline constexpr Range kNotNegative = {.min = 0.0};

/// Value of a document with its location. The document and the error list must outlive it.
class JsonNode {
 public:
  JsonNode(const Json& value, std::string pointer, ErrorList& errors)
      : value_(&value), pointer_(std::move(pointer)), errors_(&errors) {}

  const Json& value() const { return *value_; }
  std::string Place() const { return errors_->PlaceOf(pointer_); }

  /// Reports this value as an error.
  void Fail(std::string_view expected, std::string_view suggestion = "") const;
  /// Reports this location with the description `found` instead of the value.
  void FailAs(std::string_view found, std::string_view expected,
              std::string_view suggestion = "") const;

  /// Reports this value, with a cure that may also correct similar errors.
  void FailWithCure(std::string_view cure, std::string_view expected) const;

  /// Returns true for an object. Reports other values, and every key that is not in `known`.
  bool ExpectObject(const NameList& known) const;
  /// Returns the member, or nothing if it is absent or this is not an object.
  std::optional<JsonNode> Optional(const std::string& key) const;
  /// Returns the member, or reports that it is absent. `expected` describes it.
  std::optional<JsonNode> Required(const std::string& key, std::string_view expected) const;
  /// Returns all members in the order of the file; reports values that are not objects.
  std::vector<std::pair<std::string, JsonNode>> Members() const;

  /// Returns the elements of an array; reports other values. `what` names the elements ("joints").
  /// Reports an empty array if there is a text for `least`, such as "at least one joint".
  std::vector<JsonNode> Elements(std::string_view what, std::string_view least = "") const;
  /// Returns the elements of a non-empty array, or the value itself: `"x": 1` for `"x": [1]`.
  std::vector<JsonNode> OneOrMore(std::string_view what) const;

  /// Returns a number in the range, or 0 after an error. The number is finite: JSON has no NaN and
  /// no infinity, and ParseDocument rejects overflow.
  double Number(const Range& range = {}) const;
  /// Returns an integer in [min, max], or `min` after an error. 2.7 is an error, 1e3 an integer.
  std::int64_t Integer(std::int64_t min, std::int64_t max) const;
  bool Bool() const;
  /// Returns a string with at least one character.
  std::string Text() const;
  /// Returns a vector of two or three numbers; z = 0 if two are given.
  Eigen::Vector3d Vector() const;
  /// Returns exactly `count` numbers.
  std::vector<double> Numbers(std::size_t count) const;
  /// Returns one number, a list of different numbers, or a range {"lin": [from, to, count]} or
  /// {"log": [from, to, count]}, all in the range.
  std::vector<double> NumberList(const Range& range = {}) const;
  /// Returns integers in [min, max], as NumberList(); values of lin and log are rounded.
  std::vector<std::int64_t> IntegerList(std::int64_t min, std::int64_t max) const;
  /// Returns the numbers of {"lin": [from, to, count]} or {"log": [from, to, count]}: evenly spaced
  /// linearly or logarithmically, with exact ends; count is 2 to kMaxInRange.
  std::vector<double> Spaced(const Range& range = {}) const;

  /// Returns the index of this string in `known`; reports other values with the nearest spelling.
  /// `what` names the object ("a body").
  std::optional<int> Choice(const NameList& known, std::string_view what) const;
  /// Returns the indices of one string or of an array of different strings, as Choice().
  std::vector<std::size_t> Choices(const NameList& known, std::string_view what) const;

  const std::string& pointer() const { return pointer_; }
  ErrorList& errors() const { return *errors_; }

 private:
  JsonNode Child(const Json& value, std::string_view token) const;

  const Json* value_;
  std::string pointer_;
  ErrorList* errors_;
};

/// Parses `text` and returns `read(top level)`. Throws ConfigError with all reported errors.
template <class Read>
auto ReadDocument(std::string_view text, const std::string& file, Read read) {
  const Json document = ParseDocument(text, file);
  ErrorList errors(file, text);
  auto result = read(JsonNode(document, "", errors));
  errors.ThrowIfAny();
  return result;
}

}  // namespace loopbench::harness
