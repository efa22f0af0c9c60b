// XML files for the importers: elements and values with their location, strict parsing, and a
// record of the parts that were read.
//
// XmlDocument::Unread lists all unread parts at the end, so that none is lost silently. All errors
// are ConfigError, "FILE:LINE: <element name="...">: found ..., expected ...". Rejected files:
// larger than kMaxConfigBytes, nested deeper than the parser's limit, invalid UTF-8, or with a
// document type, the only place for entity declarations (no entity is expanded).
//
// A file may contain others (Include()): their elements are read in place of <include> or <attach>,
// with their own file names and lines in messages.
#pragma once

#include <tinyxml2.h>

#include <Eigen/Core>
#include <algorithm>
#include <charconv>
#include <deque>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "harness/base/json_reader.h"

namespace loopbench::harness {

class XmlElement;

namespace xml {

using Element = tinyxml2::XMLElement;

inline std::vector<Element*> ChildrenIn(Element* element) {
  std::vector<Element*> children;
  for (Element* child = element->FirstChildElement(); child != nullptr;
       child = child->NextSiblingElement()) {
    children.push_back(child);
  }
  return children;
}

/// Returns the element of a file that an element copies, or the element itself. The user data of a
/// copy points to its original.
inline Element* OriginalOf(Element* element) {
  void* original = element->GetUserData();
  return original != nullptr ? static_cast<Element*>(original) : element;
}

/// Throws ConfigError: FILE:LINE: found ..., expected ...; without the line if it is 0.
[[noreturn]] void FailIn(const std::string& file, std::ptrdiff_t line, std::string_view found,
                         std::string_view expected);
/// Returns "" for files that do not exist.
inline std::filesystem::path CanonicalOf(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::canonical(path, error);
}
/// Returns the text without surrounding blanks.
std::string_view Trimmed(std::string_view text);
/// Returns the words between blanks.
std::vector<std::string_view> Words(std::string_view text);

/// Reads a number, with a decimal point in any locale and nothing after it.
template <class Number>
bool ReadNumber(std::string_view word, Number* number) {
  if (word.starts_with('+')) word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), *number);
  return error == std::errc() && end == word.data() + word.size();
}

}  // namespace xml

/// A file with the files that it contains. Its elements are valid as long as the document.
class XmlDocument {
 public:
  /// `file` is the name in messages; `place` its path, without which it has no other files.
  XmlDocument(std::string_view text, const std::string& file,
              const std::optional<std::filesystem::path>& place = {})
      : path(place) {
    Parse(text, file);
  }

  /// Adds a parsed file and returns its root element. Throws ConfigError.
  xml::Element* Parse(std::string_view text, const std::string& file);
  /// Resolves the elements of MJCF that stand for other files, at most kMaxConfigBytes in all, or
  /// for copies.
  ///   <include file="...">: the children of the root element of that file, which is read once.
  ///   <attach model="..." body="..." prefix="...">: a body of a <model> in <asset>, or its whole
  ///   world; then its defaults, meshes, tendons, constraints and actuators, with prefixed names.
  ///   Without `model`: a copy of a body of the file itself, then of tendons and so on.
  void Include();

  XmlElement root();
  const std::string& name() const { return files.front().name; }
  /// Returns the children of an element, including children from other files.
  std::vector<xml::Element*> ChildrenOf(xml::Element* element) const;
  /// Returns its descendants in file order; with `tag`, those with this tag that are not within
  /// each other.
  std::vector<xml::Element*> Within(xml::Element* element, std::string_view tag = "") const {
    std::vector<xml::Element*> found;
    AddWithin(element, tag, &found);
    return found;
  }
  /// Returns all unread parts in file order: an element with its contents (attribute ""), or an
  /// attribute of an element that was read.
  std::vector<std::pair<XmlElement, std::string>> Unread();

  struct File {
    tinyxml2::XMLDocument xml;  ///< its user data points to `name`
    std::string name;           ///< in messages
  };
  std::deque<File> files;                     ///< the main file first
  std::optional<std::filesystem::path> path;  ///< of the main file
  /// The element whose children are in place of an <include> or <attach>.
  std::unordered_map<const xml::Element*, xml::Element*> included;
  std::unordered_map<const xml::Element*, std::vector<xml::Element*>> added;  ///< further children
  std::unordered_set<const xml::Element*> attached_defaults;
  std::unordered_set<const void*> read;  ///< elements and attributes

 private:
  void AddWithin(xml::Element* element, std::string_view tag,
                 std::vector<xml::Element*>* found) const;
};

class XmlValue;

class XmlElement {
 public:
  XmlElement(XmlDocument* document, xml::Element* element)
      : document_(document), element_(element) {
    document_->read.insert(element_);
  }

  /// Returns an identity that no other element has.
  const void* id() const { return element_; }
  std::string tag() const { return element_->Name(); }
  int line() const { return xml::OriginalOf(element_)->GetLineNum(); }
  /// Returns the name of its file.
  const std::string& file() const {
    return *static_cast<std::string*>(xml::OriginalOf(element_)->GetDocument()->GetUserData());
  }
  /// Returns <tag name="...">, for messages and notes.
  std::string Shown() const;

  /// Returns its children in file order, of these tags if any, and marks them as read.
  std::vector<XmlElement> Children(const std::vector<std::string_view>& tags = {}) const;
  /// Returns the children of all its children with tag `section`, of these tags if any.
  std::vector<XmlElement> InSections(const char* section,
                                     const std::vector<std::string_view>& tags = {}) const;
  /// Returns the only child with this tag; throws if there are several.
  std::optional<XmlElement> Child(const char* tag) const;
  /// Returns the only child with this tag; throws if it is absent.
  XmlElement RequiredChild(const char* tag) const;

  /// Returns an attribute of the element or, if absent, of the nearest default that has it; names
  /// have no default.
  std::optional<XmlValue> Attribute(const std::string& name) const;
  /// Returns the number of an attribute; `otherwise` if absent.
  double Number(const std::string& name, double otherwise, const Range& range = {}) const;
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

  /// Adds an element whose attributes are defaults, after the nearer ones.
  void AddDefault(const XmlElement& element) { defaults_.push_back(element); }
  /// Returns the element alone, then its defaults alone, nearest first.
  std::vector<XmlElement> Layers() const {
    std::vector<XmlElement> layers = {XmlElement(document_, element_)};
    std::ranges::copy(defaults_, std::back_inserter(layers));
    return layers;
  }

  /// Returns true for the outermost <default> of an attached model.
  bool is_attached_default() const { return document_->attached_defaults.contains(element_); }

  /// Marks the element, all its contents and its defaults as read.
  void Ignore() const;

  [[noreturn]] void Fail(std::string_view found, std::string_view expected,
                         const std::string& attribute = "") const;
  /// Rejects more than `most` of something.
  void RequireFew(std::size_t count, std::size_t most, std::string_view what) const;

 private:
  friend class XmlValue;

  XmlDocument* document_;
  xml::Element* element_;
  std::vector<XmlElement> defaults_;  ///< nearest first
};

/// A word and its value.
template <class T>
using XmlChoice = std::pair<std::string_view, T>;

/// The name and text of an attribute, or the text within an element (name "").
class XmlValue {
 public:
  XmlValue(XmlElement element, std::string attribute, std::string_view text)
      : element_(std::move(element)), attribute_(std::move(attribute)), text_(xml::Trimmed(text)) {}

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
  Eigen::Vector3d Vector() const { return Eigen::Vector3d(Numbers(3, 3).data()); }
  /// Returns the regular file that the text names, from `subfolder` of the main file's folder, else
  /// from `otherwise`. Rejects files that are not below the main file's folder.
  std::filesystem::path File(const std::filesystem::path& subfolder = {},
                             const std::filesystem::path& otherwise = {}) const;
  /// Accepts true, false, 1 or 0.
  bool Bool() const;
  /// Returns the value of the row with this word.
  template <class T, std::size_t size>
  T Choice(const XmlChoice<T> (&rows)[size]) const {
    std::string words;
    for (const auto& [word, value] : rows) {
      if (word == text_) return value;
      words.append(words.empty() ? "one of " : ", ").append(word);
    }
    Fail(words);
  }

  [[noreturn]] void Fail(std::string_view expected) const;

 private:
  double OneNumber(std::string_view word) const;

  XmlElement element_;
  std::string attribute_, text_;
};

inline double NumberOr(const std::optional<XmlValue>& value, double otherwise,
                       const Range& range = {}) {
  return value ? value->Number(range) : otherwise;
}
inline double XmlElement::Number(const std::string& name, double otherwise,
                                 const Range& range) const {
  return NumberOr(Attribute(name), otherwise, range);
}
inline bool BoolOr(const std::optional<XmlValue>& value, bool otherwise = false) {
  return value ? value->Bool() : otherwise;
}
inline Eigen::Vector3d VectorOr(const std::optional<XmlValue>& value,
                                const Eigen::Vector3d& otherwise = Eigen::Vector3d::Zero()) {
  return value ? value->Vector() : otherwise;
}

}  // namespace loopbench::harness
