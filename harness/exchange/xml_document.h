// The parsed files of an XmlFile.
//
// Internal to xml_file.cpp and import_mjcf_files.cpp.
#pragma once

#include <tinyxml2.h>

#include <algorithm>
#include <deque>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <vector>

namespace loopbench::harness {

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

}  // namespace xml

/// Parsed files; `read` contains elements and attributes.
struct XmlDocument {
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
  std::unordered_set<const void*> read;

  xml::Element* root() { return files.front().xml.RootElement(); }
  /// Returns the children of an element, including children from other files.
  std::vector<xml::Element*> ChildrenOf(xml::Element* element) const {
    std::vector<xml::Element*> children = xml::ChildrenIn(element);
    if (included.empty() && added.empty()) return children;
    std::vector<xml::Element*> all;
    for (xml::Element* child : children) {
      const auto found = included.find(child);
      if (found == included.end()) {
        all.push_back(child);
      } else {
        std::ranges::copy(ChildrenOf(found->second), std::back_inserter(all));
      }
    }
    const auto more = added.find(element);
    if (more != added.end()) std::ranges::copy(more->second, std::back_inserter(all));
    return all;
  }
};

namespace xml {

/// Adds a parsed file and returns its root element. Throws ConfigError.
Element* Parse(std::string_view text, const std::string& file, XmlDocument* document);

/// Returns "" for files that do not exist.
std::filesystem::path CanonicalOf(const std::filesystem::path& path);
/// Returns the text without surrounding blanks.
std::string_view Trimmed(std::string_view text);

}  // namespace xml

}  // namespace loopbench::harness
