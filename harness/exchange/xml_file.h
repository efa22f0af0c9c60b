// An XML file for the importers: elements and values with their location, strict parsing, and a
// record of the parts that were read.
//
// XmlFile::Unread lists all unread parts at the end, so that none is lost silently. All errors are
// ConfigError, "FILE:LINE: <element name="...">: found ..., expected ...". Rejected files: larger
// than kMaxConfigBytes, nested deeper than the parser's limit, invalid UTF-8, or with a document
// type, the only place for entity declarations (no entity is expanded).
//
// A file may contain others (Include()): their elements are read in place of <include> or <attach>,
// with their own file names and lines in messages.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "harness/json/json_reader.h"

namespace tinyxml2 {
class XMLElement;
}

namespace loopbench::harness {

class XmlValue;
struct XmlDocument;

class XmlElement {
 public:
  XmlElement(std::shared_ptr<XmlDocument> document, tinyxml2::XMLElement* element);

  /// Returns an identity that no other element has.
  const void* id() const { return element_; }
  std::string tag() const;
  int line() const;
  /// Returns the name of its file.
  const std::string& file() const;
  /// Returns <tag name="...">, for messages and notes.
  std::string Shown() const;

  /// Returns its children in file order, of these tags if any, and marks them as read.
  std::vector<XmlElement> Children(const std::vector<std::string_view>& tags = {}) const;
  std::vector<XmlElement> Children(const char* tag) const;
  /// Returns the children of all its children with tag `section`, of a tag if any.
  std::vector<XmlElement> InSections(const char* section, const char* tag = nullptr) const;
  /// Returns the only child with this tag; throws if there are several.
  std::optional<XmlElement> Child(const char* tag) const;
  /// Returns the only child with this tag; throws if it is absent.
  XmlElement RequiredChild(const char* tag) const;

  std::optional<XmlValue> Attribute(const std::string& name) const;
  /// Returns an attribute that is not empty.
  std::optional<XmlValue> Filled(const std::string& name) const;
  /// Returns an attribute; if absent, throws with `expected`.
  XmlValue Required(const std::string& name, std::string_view expected) const;
  /// Returns the attribute "name".
  std::string RequiredName() const;
  /// Returns the text of the element itself.
  XmlValue Content() const;
  /// Returns the text of the only child with this tag, if any.
  std::optional<XmlValue> Content(const char* tag) const;

  /// Returns the first descendant with one of these tags; marks only that element as read.
  std::optional<XmlElement> Within(const std::vector<std::string_view>& tags) const;

  /// Returns true for the outermost <default> of an attached model.
  bool is_attached_default() const;

  /// Marks the element and all its contents as read.
  void Ignore() const;

  [[noreturn]] void Fail(std::string_view found, std::string_view expected) const;

 private:
  friend class XmlValue;
  [[noreturn]] void FailAt(const std::string& attribute, std::string_view found,
                           std::string_view expected) const;

  std::shared_ptr<XmlDocument> document_;
  tinyxml2::XMLElement* element_;
};

/// The name and text of an attribute, or the text within an element (name "").
class XmlValue {
 public:
  XmlValue(XmlElement element, std::string attribute, std::string_view text);

  /// Returns the text without surrounding blanks; may be empty.
  const std::string& text() const { return text_; }
  const std::string& attribute() const { return attribute_; }
  const XmlElement& element() const { return element_; }
  /// Returns a non-empty printable text: UTF-8 without zero bytes.
  std::string Name() const;
  /// Returns a finite number, with a decimal point in any locale and nothing after it.
  double Number(const Range& range = {}) const;
  /// Returns `least` to `most` numbers separated by blanks.
  std::vector<double> Numbers(std::size_t least, std::size_t most) const;
  Eigen::Vector3d Vector() const;
  /// Returns the regular file that the text names, from `subfolder` of the main file's folder, else
  /// from `otherwise`. Rejects files that are not below the main file's folder.
  std::filesystem::path File(const std::filesystem::path& subfolder = {},
                             const std::filesystem::path& otherwise = {}) const;
  /// Accepts true, false, 1 or 0.
  bool Bool() const;
  /// Returns the value of the row with this word.
  template <class T>
  T Choice(std::initializer_list<std::pair<std::string_view, T>> rows) const {
    std::vector<std::string> words;
    for (const auto& [word, value] : rows) {
      if (word == text_) return value;
      words.emplace_back(word);
    }
    FailChoice(words);
  }

  [[noreturn]] void Fail(std::string_view expected) const;

 private:
  double OneNumber(std::string_view word) const;
  [[noreturn]] void FailChoice(const std::vector<std::string>& words) const;

  XmlElement element_;
  std::string attribute_, text_;
};

inline double NumberOr(const std::optional<XmlValue>& value, double otherwise,
                       const Range& range = {}) {
  return value ? value->Number(range) : otherwise;
}
inline bool BoolOr(const std::optional<XmlValue>& value, bool otherwise = false) {
  return value ? value->Bool() : otherwise;
}

class XmlFile {
 public:
  /// `file` is the name in messages; `path` its place, without which it has no other files.
  XmlFile(std::string_view text, const std::string& file,
          const std::optional<std::filesystem::path>& path = {});

  /// Resolves the elements of MJCF that stand for other files, at most kMaxConfigBytes in all, or
  /// for copies.
  ///   <include file="...">: the children of the root element of that file, which is read once.
  ///   <attach model="..." body="..." prefix="...">: a body of a <model> in <asset>, or its whole
  ///   world; then its defaults, meshes, tendons, constraints and actuators, with prefixed names.
  ///   Without `model`: a copy of a body of the file itself, then of tendons and so on.
  void Include();

  XmlElement root() const;
  const std::string& name() const;

  /// Returns all unread parts in file order: an element with its contents (attribute ""), or an
  /// attribute of an element that was read.
  std::vector<std::pair<XmlElement, std::string>> Unread() const;

 private:
  std::shared_ptr<XmlDocument> document_;
};

}  // namespace loopbench::harness
