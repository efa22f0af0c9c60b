// XML files for the importers: elements and values with their location, and which were read.
//
// XmlElement::ForUnread() lists all unread parts at the end, so that none is lost silently. All
// errors are ConfigError, "FILE:LINE: <element name="...">: found ..., expected ...". Rejected
// files: larger than kMaxConfigBytes, nested deeper than kMaxXmlDepth, invalid UTF-8, or with a
// document type, the only place for entity declarations (no entity is expanded).
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <filesystem>
#include <functional>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "harness/base/json_reader.h"

namespace loopbench::harness {

inline constexpr int kMaxXmlDepth = 100;  ///< largest nesting depth, the limit of tinyxml2

struct XmlFile {
  std::string name;                           ///< in messages
  std::optional<std::filesystem::path> main;  ///< the main file; without it there are no others
};

/// An element of a file, or its copy, with file and line of the original.
struct XmlNode {
  struct Attribute {
    std::string name, value = "";
    bool is_read = false;
  };

  std::shared_ptr<const XmlFile> file;
  int line = 0;
  bool has_contents = false;         ///< elements, text or comments in the file
  bool is_attached_default = false;  ///< the outermost <default> of an attached model of MJCF
  bool is_read = false;
  std::string tag, text = "";
  std::vector<Attribute> attributes = {};
  std::vector<std::shared_ptr<XmlNode>> children = {};

  /// Returns an attribute; null if absent.
  Attribute* Find(std::string_view name) {
    const auto found = std::ranges::find(attributes, name, &Attribute::name);
    return found == attributes.end() ? nullptr : &*found;
  }
  void Set(const std::string& name, const std::string& value) {
    Attribute* known = Find(name);
    (known != nullptr ? *known : attributes.emplace_back(Attribute{name})).value = value;
  }
  /// Returns all elements in it, in file order.
  std::vector<std::shared_ptr<XmlNode>> Descendants() const;
};
using XmlNodePointer = std::shared_ptr<XmlNode>;

namespace xml {

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
  const std::optional<Number> whole = WholeNumber<Number>(word);
  if (whole) *number = *whole;
  return whole.has_value();
}

/// Returns the root element of a text. Throws ConfigError.
XmlNodePointer Parse(std::string_view text, const XmlFile& file);

}  // namespace xml

class XmlValue;

/// An element that counts as read, with the elements that give its defaults.
class XmlElement {
 public:
  explicit XmlElement(XmlNodePointer node) : node_(std::move(node)) { node_->is_read = true; }

  const XmlNodePointer& node() const { return node_; }
  /// Returns an identity that no other element has.
  const void* id() const { return node_.get(); }
  const std::string& tag() const { return node_->tag; }
  int line() const { return node_->line; }
  const XmlFile& file() const { return *node_->file; }
  /// Returns <tag name="...">, for messages and notes.
  std::string Shown() const;

  /// Returns its children in file order, of these tags if any, and marks them as read.
  std::vector<XmlElement> Children(const std::vector<std::string_view>& tags = {}) const;
  /// Returns the children of all its children with tag `section`, of these tags if any.
  std::vector<XmlElement> InSections(std::string_view section,
                                     const std::vector<std::string_view>& tags = {}) const;
  /// Returns the only child with this tag; throws if there are several.
  std::optional<XmlElement> Child(std::string_view tag) const;
  /// Returns the only child with this tag; throws if it is absent.
  XmlElement RequiredChild(std::string_view tag) const;

  /// Returns an attribute of the element or else of its nearest default; names have no default.
  std::optional<XmlValue> Attribute(std::string_view name) const;
  /// Returns the number of an attribute; `otherwise` if absent.
  double Number(std::string_view name, double otherwise, const Range& range = {}) const;
  /// Returns an attribute that is not empty.
  std::optional<XmlValue> Filled(std::string_view name) const;
  /// Returns an attribute; if absent, throws with `expected`.
  XmlValue Required(std::string_view name, std::string_view expected) const;
  /// Returns the attribute "name".
  std::string RequiredName() const;
  /// Returns the text of the element itself.
  XmlValue Content() const;
  /// Returns the text of the only child with this tag, if any.
  std::optional<XmlValue> Content(std::string_view tag) const;

  /// Adds an element whose attributes are defaults, after the nearer ones.
  void AddDefault(const XmlElement& element) { defaults_.push_back(element); }
  /// Returns the element alone, then its defaults alone, nearest first.
  std::vector<XmlElement> Layers() const {
    std::vector<XmlElement> layers = {XmlElement(node_)};
    std::ranges::copy(defaults_, std::back_inserter(layers));
    return layers;
  }

  /// Marks the element, all its contents and its defaults as read.
  void Ignore() const;
  /// Calls `use` for all unread parts of an element that was read, in file order: an element with
  /// its contents (attribute ""), or an attribute.
  void ForUnread(const std::function<void(const XmlElement& element, const std::string& attribute)>&
                     use) const;

  [[noreturn]] void Fail(std::string_view found, std::string_view expected,
                         const std::string& attribute = "") const;
  /// Rejects more than `most` of something.
  void RequireFew(std::size_t count, std::size_t most, std::string_view what) const;

 private:
  XmlNodePointer node_;
  std::vector<XmlElement> defaults_;  ///< nearest first
};

/// A word and its value.
template <class T>
using XmlChoice = std::pair<std::string_view, T>;

/// The name and text of an attribute, or the text within an element (name "").
class XmlValue {
 public:
  XmlValue(XmlElement element, std::string_view attribute, std::string_view text)
      : element_(std::move(element)), attribute_(attribute), text_(xml::Trimmed(text)) {}

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
inline double XmlElement::Number(std::string_view name, double otherwise,
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
