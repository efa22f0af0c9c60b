// An XML file as the importers see it: elements and values that know their place, are read
// strictly, and remember whether anybody has read them.
//
// What nobody reads is told at the end (XmlFile::Unread), so that nothing is left out without a
// word. All errors are ConfigError, "FILE:LINE: <element name="...">: found ..., expected ...".
// Hostile files are refused: larger than kMaxConfigBytes, deeper than the parser's limit of
// elements, with a document type (which is where entities are declared, and none is ever expanded),
// no UTF-8.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "harness/json/json_reader.h"

namespace tinyxml2 {
class XMLElement;
}

namespace loopbench::harness {

class XmlElement;
struct XmlDocument;

/// A name of an attribute, or "" for what stands within the element, and its text.
class XmlValue {
 public:
  XmlValue(const XmlElement& element, std::string attribute, std::string text);

  /// Without blanks around it; may be empty.
  const std::string& text() const { return text_; }
  const std::string& attribute() const { return attribute_; }
  XmlElement element() const;
  /// A text that is not empty and can be printed: UTF-8 without zero bytes.
  std::string Name() const;
  /// A finite number, with a point whatever the locale, and nothing behind it.
  double Number(const Range& range = {}) const;
  /// `least` to `most` of them, between blanks.
  std::vector<double> Numbers(std::size_t least, std::size_t most) const;
  Eigen::Vector3d Vector() const;
  /// true, false, 1 or 0.
  bool Bool() const;
  /// Its index among `words`.
  std::size_t Choice(const std::vector<std::string>& words) const;

  [[noreturn]] void Fail(std::string_view expected) const;

 private:
  double OneNumber(std::string_view word) const;

  std::shared_ptr<XmlDocument> document_;
  const tinyxml2::XMLElement* element_;
  std::string attribute_, text_;
};

class XmlElement {
 public:
  XmlElement(std::shared_ptr<XmlDocument> document, const tinyxml2::XMLElement* element);

  std::string tag() const;
  int line() const;
  /// <tag name="...">, for messages and notes.
  std::string Shown() const;

  /// Its children, which count as read, in the order of the file.
  std::vector<XmlElement> Children() const;
  std::vector<XmlElement> Children(std::string_view tag) const;
  /// Those of one of these tags, in the order of the file.
  std::vector<XmlElement> ChildrenOf(const std::vector<std::string_view>& tags) const;
  /// The only child of this tag; a second one is refused.
  std::optional<XmlElement> Child(std::string_view tag) const;
  /// The same; refused where it is absent.
  XmlElement RequiredChild(std::string_view tag) const;

  std::optional<XmlValue> Attribute(const std::string& name) const;
  /// Refused where it is absent; `expected` says what it would be.
  XmlValue Required(const std::string& name, std::string_view expected) const;
  /// The text of the element itself.
  XmlValue Content() const;
  bool HasAttribute(const std::string& name) const;

  /// The first element of one of these tags within it, at whatever depth; it alone counts as read.
  std::optional<XmlElement> Within(const std::vector<std::string_view>& tags) const;

  /// Counts as read, with all that is in it.
  void Ignore() const;
  /// Its attributes count as read, its children do not.
  void IgnoreAttributes() const;

  [[noreturn]] void Fail(std::string_view found, std::string_view expected) const;

 private:
  friend class XmlFile;
  friend class XmlValue;
  std::shared_ptr<XmlDocument> document_;
  const tinyxml2::XMLElement* element_;
};

class XmlFile {
 public:
  /// `file` is the name in messages.
  XmlFile(std::string_view text, const std::string& file);

  XmlElement root() const;
  const std::string& name() const;

  /// What nobody has read, in the order of the file: an element with all in it (attribute ""), or
  /// an attribute of an element that was read.
  void Unread(
      const std::function<void(const XmlElement&, const std::string& attribute)>& see) const;

 private:
  std::shared_ptr<XmlDocument> document_;
};

}  // namespace loopbench::harness
