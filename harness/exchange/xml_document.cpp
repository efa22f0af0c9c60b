#include "harness/exchange/xml_document.h"

#include <fmt/format.h>

#include <cmath>
#include <functional>

#include "harness/base/text.h"

namespace loopbench::harness {

namespace fs = std::filesystem;

using xml::Element;

namespace {

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

std::vector<const tinyxml2::XMLAttribute*> AttributesIn(const Element& element) {
  std::vector<const tinyxml2::XMLAttribute*> attributes;
  for (const auto* one = element.FirstAttribute(); one != nullptr; one = one->Next()) {
    attributes.push_back(one);
  }
  return attributes;
}

}  // namespace

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
  const auto& main = element_.document_->path;
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
  const char* name = element_->Attribute("name");
  std::string shown = "<" + Abbreviated(element_->Name());
  if (name != nullptr && IsText(name)) shown += " name=" + Quoted(name);
  return shown + ">";
}

void XmlElement::Fail(std::string_view found, std::string_view expected,
                      const std::string& attribute) const {
  const std::string where = attribute.empty() ? "" : " " + Abbreviated(attribute);
  throw ConfigError(Printable(fmt::format("{}:{}: {}{}: found {}, expected {}", file(), line(),
                                          Shown(), where, found, expected)));
}

void XmlElement::RequireFew(std::size_t count, std::size_t most, std::string_view what) const {
  if (count > most) Fail(fmt::format("more than {} {}", most, what), "fewer");
}

std::vector<XmlElement> XmlElement::Children(const std::vector<std::string_view>& tags) const {
  std::vector<XmlElement> children;
  for (Element* child : document_->ChildrenOf(element_)) {
    if (tags.empty() || Contains(tags, child->Name())) {
      children.emplace_back(document_, child);
    }
  }
  return children;
}

std::vector<XmlElement> XmlElement::InSections(const char* section,
                                               const std::vector<std::string_view>& tags) const {
  std::vector<XmlElement> all;
  for (const XmlElement& one : Children({section})) {
    std::ranges::copy(one.Children(tags), std::back_inserter(all));
  }
  return all;
}

std::optional<XmlElement> XmlElement::Within(const std::vector<std::string_view>& tags) const {
  for (Element* one : document_->Within(element_)) {
    if (Contains(tags, one->Name())) return XmlElement(document_, one);
  }
  return std::nullopt;
}

std::optional<XmlElement> XmlElement::Child(const char* tag) const {
  const std::vector<XmlElement> children = Children({tag});
  if (children.empty()) return std::nullopt;
  if (children.size() > 1) {
    children[1].Fail(fmt::format("a second <{}> in {}", tag, Shown()), "one");
  }
  return children[0];
}

XmlElement XmlElement::RequiredChild(const char* tag) const {
  const auto child = Child(tag);
  if (!child) Fail(fmt::format("no <{}>", tag), "one");
  return *child;
}

std::optional<XmlValue> XmlElement::Attribute(const std::string& name) const {
  std::optional<XmlValue> found;
  if (const auto* own = element_->FindAttribute(name.c_str()); own != nullptr) {
    document_->read.insert(own);
    found = XmlValue(XmlElement(document_, element_), name, own->Value());
  }
  if (name == "name") return found;
  for (const XmlElement& element : defaults_) {
    auto value = element.Attribute(name);
    if (!found) found = std::move(value);
  }
  return found;
}

std::optional<XmlValue> XmlElement::Filled(const std::string& name) const {
  auto value = Attribute(name);
  if (value && value->text().empty()) value.reset();
  return value;
}

XmlValue XmlElement::Required(const std::string& name, std::string_view expected) const {
  auto value = Attribute(name);
  if (!value) Fail(fmt::format("no \"{}\"", name), expected);
  return *std::move(value);
}

std::string XmlElement::RequiredName() const { return Required("name", "a name").Name(); }

XmlValue XmlElement::Content() const {
  const char* text = element_->GetText();
  return XmlValue(*this, "", text == nullptr ? "" : text);
}

std::optional<XmlValue> XmlElement::Content(const char* tag) const {
  const auto child = Child(tag);
  return child ? std::optional(child->Content()) : std::nullopt;
}

void XmlElement::Ignore() const {
  for (const auto* attribute : AttributesIn(*element_)) document_->read.insert(attribute);
  for (const XmlElement& child : Children()) child.Ignore();
  for (const XmlElement& element : defaults_) element.Ignore();
}

XmlElement XmlDocument::root() { return XmlElement(this, files.front().xml.RootElement()); }

std::vector<Element*> XmlDocument::ChildrenOf(Element* element) const {
  std::vector<Element*> children = xml::ChildrenIn(element);
  if (included.empty() && added.empty()) return children;
  std::vector<Element*> all;
  for (Element* child : children) {
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

void XmlDocument::AddWithin(Element* element, std::string_view tag,
                            std::vector<Element*>* found) const {
  for (Element* child : ChildrenOf(element)) {
    const bool fits = tag.empty() || child->Name() == tag;
    if (fits) found->push_back(child);
    if (!fits || tag.empty()) AddWithin(child, tag, found);
  }
}

Element* XmlDocument::Parse(std::string_view text, const std::string& file) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  auto& [xml, name] = files.emplace_back();
  name = file;
  xml.SetUserData(&name);
  if (const std::string fault = EncodingFault(text); !fault.empty()) {
    throw ConfigError(file + ":" + fault);
  }
  RefuseManyAttributes(text, file);
  const auto error = xml.Parse(text.data(), text.size());
  if (error == tinyxml2::XML_ELEMENT_DEPTH_EXCEEDED) {
    xml::FailIn(file, xml.ErrorLineNum(),
                fmt::format("more than {} elements within each other", TINYXML2_MAX_ELEMENT_DEPTH),
                "fewer");
  }
  if (error == tinyxml2::XML_ERROR_PARSING_ATTRIBUTE) {
    xml::FailIn(file, xml.ErrorLineNum(), "an attribute twice, or without a value in quotes",
                "each attribute once, as name=\"value\"");
  }
  if (error != tinyxml2::XML_SUCCESS) {
    xml::FailIn(file, std::max(1, xml.ErrorLineNum()),
                fmt::format("a fault of syntax ({})", xml.ErrorIDToName(error)), "well-formed XML");
  }
  for (const auto* node = xml.FirstChild(); node != nullptr; node = node->NextSibling()) {
    if (node->ToUnknown() != nullptr) {
      xml::FailIn(file, node->GetLineNum(), "a document type or declaration of entities",
                  "none: they are not read");
    }
    if (node->ToElement() != nullptr && node != xml.RootElement()) {
      xml::FailIn(file, node->GetLineNum(), "a second root element", "one");
    }
  }
  if (xml.RootElement() == nullptr) {
    xml::FailIn(file, 1, "no element", "<mujoco>, <robot> or <sdf>");
  }
  return xml.RootElement();
}

std::vector<std::pair<XmlElement, std::string>> XmlDocument::Unread() {
  std::vector<std::pair<XmlElement, std::string>> parts;
  const std::function<void(Element*)> add = [&](Element* element) {
    if (!read.contains(element)) {
      parts.emplace_back(XmlElement(this, element), "");
      return;
    }
    for (const auto* one : AttributesIn(*element)) {
      if (read.contains(one)) continue;
      parts.emplace_back(XmlElement(this, element), IsText(one->Name()) ? one->Name() : "?");
    }
    for (Element* child : ChildrenOf(element)) add(child);
  };
  add(files.front().xml.RootElement());
  return parts;
}

}  // namespace loopbench::harness
