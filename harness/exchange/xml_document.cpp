#include "harness/exchange/xml_document.h"

#include <tinyxml2.h>

#include <cmath>

#include "harness/base/text.h"

namespace loopbench::harness {

namespace fs = std::filesystem;

namespace {

static_assert(kMaxXmlDepth == TINYXML2_MAX_ELEMENT_DEPTH);
constexpr std::string_view kBlanks = " \t\r\n";

std::string Quoted(const std::string& text) { return '"' + Abbreviated(text) + '"'; }

/// Returns true for valid UTF-8. XML numeric references can produce invalid text from a valid file,
/// which would garble messages and cannot be written as JSON.
bool IsText(std::string_view text) { return EncodingFault(text).empty(); }

/// Limits attributes before parsing, since the parser compares all attributes of an element.
void RefuseManyAttributes(std::string_view text, const std::string& file) {
  constexpr int kMost = 1000;
  constexpr std::string_view kEndOfComment = "-->", kEndOfData = "]]>";
  for (std::size_t at = text.find('<'); at < text.size(); at = text.find('<', at)) {
    const std::string_view rest = text.substr(at);
    if (rest.starts_with("<!--") || rest.starts_with("<![CDATA[")) {
      at = text.find(rest[2] == '-' ? kEndOfComment : kEndOfData, at);
      continue;
    }
    int count = 0;
    char quote = '\0';
    for (; at < text.size() && (quote != '\0' || text[at] != '>'); ++at) {
      const char c = text[at];
      if (c != '"' && c != '\'') continue;
      if (quote == '\0') ++count;
      if (quote == '\0' || quote == c) quote = quote == c ? '\0' : c;
    }
    if (count <= kMost) continue;
    xml::FailIn(file, 1 + std::ranges::count(text.substr(0, at), '\n'),
                fmt::format("an element with {} attributes", count),
                fmt::format("at most {}", kMost));
  }
}

XmlNodePointer Converted(const tinyxml2::XMLElement& element,
                         const std::shared_ptr<const XmlFile>& file) {
  const char* text = element.GetText();
  const auto node = std::make_shared<XmlNode>(XmlNode{.file = file,
                                                      .line = element.GetLineNum(),
                                                      .has_contents = !element.NoChildren(),
                                                      .tag = element.Name(),
                                                      .text = text == nullptr ? "" : text});
  for (const auto* one = element.FirstAttribute(); one != nullptr; one = one->Next()) {
    node->attributes.push_back({one->Name(), one->Value()});
  }
  for (const auto* child = element.FirstChildElement(); child != nullptr;
       child = child->NextSiblingElement()) {
    node->children.push_back(Converted(*child, file));
  }
  return node;
}

void AddDescendants(const XmlNode& node, std::vector<XmlNodePointer>* all) {
  for (const XmlNodePointer& child : node.children) {
    all->push_back(child);
    AddDescendants(*child, all);
  }
}

}  // namespace

std::vector<XmlNodePointer> XmlNode::Descendants() const {
  std::vector<XmlNodePointer> all;
  AddDescendants(*this, &all);
  return all;
}

void xml::FailIn(const std::string& file, std::ptrdiff_t line, std::string_view found,
                 std::string_view expected) {
  const std::string place = line == 0 ? file : fmt::format("{}:{}", file, line);
  throw ConfigError(fmt::format("{}: found {}, expected {}", place, found, expected));
}

std::string_view xml::Trimmed(std::string_view text) {
  const std::size_t start = text.find_first_not_of(kBlanks);
  if (start == std::string_view::npos) return {};
  return text.substr(start, text.find_last_not_of(kBlanks) - start + 1);
}

std::vector<std::string_view> xml::Words(std::string_view text) {
  std::vector<std::string_view> words;
  for (text = Trimmed(text); !text.empty(); text = Trimmed(text)) {
    const std::size_t end = std::min(text.find_first_of(kBlanks), text.size());
    words.push_back(text.substr(0, end));
    text.remove_prefix(end);
  }
  return words;
}

XmlNodePointer xml::Parse(std::string_view text, const XmlFile& file) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  if (const std::string fault = EncodingFault(text); !fault.empty()) {
    throw ConfigError(file.name + ":" + fault);
  }
  RefuseManyAttributes(text, file.name);
  tinyxml2::XMLDocument xml;
  const auto error = xml.Parse(text.data(), text.size());
  const auto fail = [&](int line, std::string_view found, std::string_view expected) {
    FailIn(file.name, line, found, expected);
  };
  if (error == tinyxml2::XML_ELEMENT_DEPTH_EXCEEDED) {
    fail(xml.ErrorLineNum(), fmt::format("more than {} elements within each other", kMaxXmlDepth),
         "fewer");
  }
  if (error == tinyxml2::XML_ERROR_PARSING_ATTRIBUTE) {
    fail(xml.ErrorLineNum(), "an attribute twice, or without a value in quotes",
         "each attribute once, as name=\"value\"");
  }
  if (error != tinyxml2::XML_SUCCESS) {
    fail(std::max(1, xml.ErrorLineNum()),
         fmt::format("a fault of syntax ({})", xml.ErrorIDToName(error)), "well-formed XML");
  }
  for (const auto* node = xml.FirstChild(); node != nullptr; node = node->NextSibling()) {
    if (node->ToUnknown() != nullptr) {
      fail(node->GetLineNum(), "a document type or declaration of entities",
           "none: they are not read");
    }
    if (node->ToElement() != nullptr && node != xml.RootElement()) {
      fail(node->GetLineNum(), "a second root element", "one");
    }
  }
  if (xml.RootElement() == nullptr) fail(1, "no element", "<mujoco>, <robot> or <sdf>");
  return Converted(*xml.RootElement(), std::make_shared<const XmlFile>(file));
}

void XmlValue::Fail(std::string_view expected) const {
  element_.Fail(IsText(text_) ? Quoted(text_) : "a text that is not UTF-8", expected, attribute_);
}

std::string XmlValue::Name() const {
  if (text_.empty()) Fail("a name that is not empty");
  if (!IsText(text_)) Fail("a name in UTF-8, without zero bytes");
  return text_;
}

double XmlValue::OneNumber(std::string_view word) const {
  double number = 0.0;
  if (!xml::ReadNumber(word, &number) || !std::isfinite(number)) Fail("finite numbers only");
  return number;
}

double XmlValue::Number(const Range& range) const {
  const std::vector<std::string_view> words = xml::Words(text_);
  const double number = words.size() == 1 ? OneNumber(words[0]) : std::nan("");
  if (!range.Contains(number)) Fail("a number" + range.Text());
  return number;
}

std::vector<double> XmlValue::Numbers(std::size_t least, std::size_t most) const {
  const std::vector<std::string_view> words = xml::Words(text_);
  if (words.size() < least || words.size() > most) {
    Fail(least == most ? WithCount(least, "number") : fmt::format("{} to {} numbers", least, most));
  }
  return Mapped<double>(words, [&](const std::string_view word) { return OneNumber(word); });
}

fs::path XmlValue::File(const fs::path& subfolder, const fs::path& otherwise) const {
  const auto& main = element_.file().main;
  if (!main) Fail("nothing: a text has no other files");
  std::error_code error;
  const fs::path folder = main->parent_path(), base = fs::canonical(folder / ".", error);
  fs::path shown = folder / subfolder / Name(), path = xml::CanonicalOf(shown);
  if (path.empty() && !otherwise.empty()) path = xml::CanonicalOf(shown = otherwise / Name());
  if (!path.empty() && std::ranges::mismatch(base, path).in1 != base.end()) {
    Fail("a file below the folder of the main file");
  }
  if (path.empty() || !fs::is_regular_file(path, error)) {
    Fail(fmt::format("a file that exists, from the folder {}", (base / subfolder).string()));
  }
  return shown;
}

bool XmlValue::Bool() const {
  if (text_ == "true" || text_ == "1") return true;
  if (text_ != "false" && text_ != "0") Fail("true or false");
  return false;
}

std::string XmlElement::Shown() const {
  const XmlNode::Attribute* name = node_->Find("name");
  std::string shown = "<" + Abbreviated(tag());
  if (name != nullptr && IsText(name->value)) shown += " name=" + Quoted(name->value);
  return shown + ">";
}

void XmlElement::Fail(std::string_view found, std::string_view expected,
                      const std::string& attribute) const {
  const std::string where = attribute.empty() ? "" : " " + Abbreviated(attribute);
  throw ConfigError(Printable(fmt::format("{}:{}: {}{}: found {}, expected {}", file().name, line(),
                                          Shown(), where, found, expected)));
}

void XmlElement::RequireFew(std::size_t count, std::size_t most, std::string_view what) const {
  if (count > most) Fail(fmt::format("more than {} {}", most, what), "fewer");
}

std::vector<XmlElement> XmlElement::Children(const std::vector<std::string_view>& tags) const {
  std::vector<XmlElement> children;
  for (const XmlNodePointer& child : node_->children) {
    if (tags.empty() || Contains(tags, child->tag)) children.emplace_back(child);
  }
  return children;
}

std::vector<XmlElement> XmlElement::InSections(std::string_view section,
                                               const std::vector<std::string_view>& tags) const {
  std::vector<XmlElement> all;
  for (const XmlElement& one : Children({section})) {
    std::ranges::copy(one.Children(tags), std::back_inserter(all));
  }
  return all;
}

std::optional<XmlElement> XmlElement::Child(std::string_view tag) const {
  const std::vector<XmlElement> children = Children({tag});
  if (children.empty()) return std::nullopt;
  if (children.size() > 1) {
    children[1].Fail(fmt::format("a second <{}> in {}", tag, Shown()), "one");
  }
  return children[0];
}

XmlElement XmlElement::RequiredChild(std::string_view tag) const {
  const auto child = Child(tag);
  if (!child) Fail(fmt::format("no <{}>", tag), "one");
  return *child;
}

std::optional<XmlValue> XmlElement::Attribute(std::string_view name) const {
  std::optional<XmlValue> found;
  if (XmlNode::Attribute* own = node_->Find(name); own != nullptr) {
    own->is_read = true;
    found = XmlValue(XmlElement(node_), name, own->value);
  }
  if (name == "name") return found;
  for (const XmlElement& element : defaults_) {
    auto value = element.Attribute(name);
    if (!found) found = std::move(value);
  }
  return found;
}

std::optional<XmlValue> XmlElement::Filled(std::string_view name) const {
  auto value = Attribute(name);
  if (value && value->text().empty()) value.reset();
  return value;
}

XmlValue XmlElement::Required(std::string_view name, std::string_view expected) const {
  auto value = Attribute(name);
  if (!value) Fail(fmt::format("no \"{}\"", name), expected);
  return *std::move(value);
}

std::string XmlElement::RequiredName() const { return Required("name", "a name").Name(); }

XmlValue XmlElement::Content() const { return XmlValue(*this, "", node_->text); }

std::optional<XmlValue> XmlElement::Content(std::string_view tag) const {
  const auto child = Child(tag);
  return child ? std::optional(child->Content()) : std::nullopt;
}

void XmlElement::Ignore() const {
  for (XmlNode::Attribute& attribute : node_->attributes) attribute.is_read = true;
  for (const XmlElement& child : Children()) child.Ignore();
  for (const XmlElement& element : defaults_) element.Ignore();
}

void XmlElement::ForUnread(
    const std::function<void(const XmlElement&, const std::string&)>& use) const {
  for (const auto& [name, value, is_read] : node_->attributes) {
    if (!is_read) use(*this, IsText(name) ? name : "?");
  }
  for (const XmlNodePointer& child : node_->children) {
    const bool is_read = child->is_read;
    const XmlElement element(child);
    if (is_read) {
      element.ForUnread(use);
    } else {
      use(element, "");
    }
  }
}

}  // namespace loopbench::harness
