// Values of a document with their places, and readers that report every mistake.
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

#include "harness/json/json_document.h"

namespace loopbench::harness {

// Where the values of a document come from: its own file, files taken into it, and settings.
//
// A sweep and --set change a document after it was parsed, and a pointer that goes through the path
// of a mechanism takes that file in. Messages must still name the file and line a person can edit.
// Internal to harness/config.

class Origins {
 public:
  /// The document `file` with this text, which must outlive the object; "" when it is not at hand,
  /// and messages then go without lines.
  explicit Origins(std::string file, std::string_view text = "") {
    parts_.push_back({"", std::move(file), text, "", ""});
  }

  /// The value at `pointer` is now the document `file`.
  void TakeIn(std::string pointer, std::string file, std::string_view text) {
    parts_.push_back({std::move(pointer), std::move(file), text, "", ""});
  }

  /// The value at `pointer` was set; `note` says by what, and `source` is the pointer of that in
  /// the first file, "" when it stands in no file.
  void Note(std::string pointer, std::string note, std::string source) {
    parts_.push_back({std::move(pointer), "", "", std::move(note), std::move(source)});
  }

  struct Place {
    std::string file;
    std::string pointer;       ///< within `file`, as a message shows it
    std::string line_pointer;  ///< whose line the message shows
    std::string_view text;     ///< of `file`
    std::string note;          ///< "" for what stands in a file
  };

  /// The innermost part that holds the value, the latest of those as deep.
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

// A cursor over a JSON document whose getters report what they do not accept.
//
// Reading goes on after an error with a stand-in value, so that one run shows all errors of a file:
//   FILE:LINE: /json/pointer: found VALUE, expected WHAT (did you mean "x"?)
// The caller ends with ErrorList::ThrowIfAny(); what was read before is not used when it throws.
// For harness/config and harness/store (see json_document.h).

/// All complaints about one file, in the order they were found. Of more than kMostMessages the rest
/// is counted.
class ErrorList {
 public:
  /// `text` is the file's, for line numbers; it must outlive the list.
  ErrorList(std::string file, std::string_view text) : origins_(std::move(file), text) {}
  explicit ErrorList(Origins origins) : origins_(std::move(origins)) {}

  /// Adds one complaint; `suggestion` is the nearest valid spelling or "".
  void Add(std::string_view pointer, std::string_view found, std::string_view expected,
           std::string_view suggestion = "");

  /// Adds a complaint of which many may have one cause, such as a key that is missing elsewhere:
  /// "found ..., expected ..., or CURE", and the places of others with this cure, which have no
  /// messages of their own.
  void AddWithCure(std::string_view cure, std::string_view pointer, std::string_view found,
                   std::string_view expected);

  /// Adds finished messages, such as those of a file that this file refers to; the same text twice
  /// (two scenes with one broken mechanism) once.
  void AddText(const std::string& text);

  bool empty() const { return messages_.empty(); }
  /// Further complaints are only counted: their words need not be found.
  bool full() const { return messages_.size() >= kMostMessages; }

  /// Throws ConfigError with all messages, one per line, unless there are none. `ending` is one
  /// more line.
  void ThrowIfAny(const std::string& ending = "") const;

 private:
  struct Message {
    bool finished;        ///< text is all of it
    std::string pointer;  ///< else: in front of it come file, line and pointer
    std::string text;
    std::string cure = "";
    std::vector<std::string> also = {};  ///< first places of others with this cure
    std::size_t others = 0;              ///< how many there are
  };
  Origins origins_;
  std::vector<Message> messages_;
  std::size_t more_ = 0;
};

/// Names in use and the index of each, found without a search.
class NameList {
 public:
  NameList() = default;
  NameList(const std::vector<std::string>& names) {  // NOLINT: a list is a NameList
    for (const std::string& name : names) Add(name);
  }
  NameList(std::initializer_list<std::string> names) : NameList(std::vector<std::string>(names)) {}

  /// A name with the next index. Of equal names, which are an error of the file, the first counts;
  /// the others are kept as empty ones.
  void Add(const std::string& name) {
    const bool first = indices_.emplace(name, names_.size()).second;
    names_.push_back(first ? name : "");
  }
  /// The index of a name that is not empty, or nothing.
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

/// The numbers a getter accepts.
struct Range {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool above_min = false;     ///< min itself is refused
  std::string_view why = "";  ///< of min, after it in messages: " (the spacing of doubles)"

  bool Contains(double value) const {
    return (above_min ? value > min : value >= min) && value <= max;
  }
  /// "", " > 0", " >= 0", " from 0 to 1".
  std::string Text() const;
};

inline constexpr int kMostInRange = 10000;  ///< numbers that one lin or log stands for

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

  /// Reports this value, and what would make it and others like it right.
  void FailWithCure(std::string_view cure, std::string_view expected) const;

  /// True for an object. Reports anything else, and every key that is not in `known`.
  bool ExpectObject(const NameList& known) const;
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
  /// One number, a list of different numbers, or {"lin": [from, to, count]} or {"log": [from, to,
  /// count]}, all in the range.
  std::vector<double> NumberList(const Range& range = {}) const;
  /// The same for integers in [min, max]; values of lin and log are rounded.
  std::vector<std::int64_t> IntegerList(std::int64_t min, std::int64_t max) const;
  /// The numbers that {"lin": [from, to, count]} or {"log": [from, to, count]} stands for: evenly
  /// spaced, in themselves or in their logarithms, both ends exact; 2 to kMostInRange of them.
  std::vector<double> Spaced(const Range& range = {}) const;

  /// Index of this string in `known`; reports anything else with the nearest spelling. `what` names
  /// the thing ("a body"). An enum is a choice among its names.
  std::optional<int> Choice(const NameList& known, std::string_view what) const;
  /// The same for one string or an array of different ones.
  std::vector<std::size_t> Choices(const NameList& known, std::string_view what) const;

  const std::string& pointer() const { return pointer_; }
  ErrorList& errors() const { return *errors_; }

 private:
  JsonNode Child(const Json& value, std::string_view token) const;

  const Json* value_;
  std::string pointer_;
  ErrorList* errors_;
};

}  // namespace loopbench::harness
