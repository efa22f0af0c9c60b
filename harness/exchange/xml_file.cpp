#include "harness/exchange/xml_file.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <deque>
#include <set>
#include <unordered_map>
#include <unordered_set>

#include "harness/text/files.h"
#include "harness/text/words.h"

namespace loopbench::harness {

namespace fs = std::filesystem;

namespace {

using Element = tinyxml2::XMLElement;

std::vector<Element*> ChildrenIn(Element* element) {
  std::vector<Element*> children;
  for (Element* child = element->FirstChildElement(); child != nullptr;
       child = child->NextSiblingElement()) {
    children.push_back(child);
  }
  return children;
}

}  // namespace

/// Parsed files; `read` contains elements and attributes.
struct XmlDocument {
  struct File {
    tinyxml2::XMLDocument xml;  ///< its user data points to `name`
    std::string name;           ///< in messages
  };
  std::deque<File> files;        ///< the main file first
  std::optional<fs::path> path;  ///< of the main file
  /// The element whose children are in place of an <include> or <attach>.
  std::unordered_map<const Element*, Element*> included;
  std::unordered_map<const Element*, std::vector<Element*>> added;  ///< further children
  std::unordered_set<const Element*> attached_defaults;
  std::unordered_set<const void*> read;

  Element* root() { return files.front().xml.RootElement(); }
  /// Returns the children of an element, including children from other files.
  std::vector<Element*> ChildrenOf(Element* element) const {
    std::vector<Element*> children = ChildrenIn(element);
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
};

namespace {

/// Returns "" for files that do not exist.
fs::path CanonicalOf(const fs::path& path) {
  std::error_code error;
  return fs::canonical(path, error);
}

std::string Quoted(const std::string& text) { return '"' + Abbreviated(text) + '"'; }

/// Returns true for valid UTF-8. XML numeric references can produce invalid text from a valid file,
/// which would garble messages and cannot be written as JSON.
bool IsText(std::string_view text) { return EncodingFault(text).empty(); }

std::string_view Trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n";
  const std::size_t start = text.find_first_not_of(kBlanks);
  if (start == std::string_view::npos) return {};
  return text.substr(start, text.find_last_not_of(kBlanks) - start + 1);
}

std::vector<std::string_view> Words(std::string_view text) {
  std::vector<std::string_view> words;
  for (text = Trimmed(text); !text.empty(); text = Trimmed(text)) {
    const std::size_t end = std::min(text.find_first_of(" \t\r\n"), text.size());
    words.push_back(text.substr(0, end));
    text.remove_prefix(end);
  }
  return words;
}

void RefuseDocumentTypes(const XmlDocument::File& document) {
  for (const auto* node = document.xml.FirstChild(); node != nullptr; node = node->NextSibling()) {
    if (node->ToUnknown() == nullptr) continue;
    throw ConfigError(fmt::format(
        "{}:{}: found a document type or declaration of entities, expected none: they are not read",
        document.name, node->GetLineNum()));
  }
}

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
    const auto line = 1 + std::ranges::count(text.substr(0, at), '\n');
    throw ConfigError(fmt::format("{}:{}: found an element with {} attributes, expected at most {}",
                                  file, line, count, kMost));
  }
}

std::vector<const tinyxml2::XMLAttribute*> AttributesIn(const Element& element) {
  std::vector<const tinyxml2::XMLAttribute*> attributes;
  for (const auto* one = element.FirstAttribute(); one != nullptr; one = one->Next()) {
    attributes.push_back(one);
  }
  return attributes;
}

Element* FirstWithin(const XmlDocument& document, Element* element,
                     const std::vector<std::string_view>& tags) {
  for (Element* child : document.ChildrenOf(element)) {
    if (std::ranges::find(tags, child->Name()) != tags.end()) return child;
    if (Element* within = FirstWithin(document, child, tags)) return within;
  }
  return nullptr;
}

}  // namespace

XmlValue::XmlValue(XmlElement element, std::string attribute, std::string_view text)
    : element_(std::move(element)), attribute_(std::move(attribute)), text_(Trimmed(text)) {}

void XmlValue::Fail(std::string_view expected) const {
  element_.FailAt(attribute_, IsText(text_) ? Quoted(text_) : "a text that is not UTF-8", expected);
}

std::string XmlValue::Name() const {
  if (text_.empty()) Fail("a name that is not empty");
  if (!IsText(text_)) Fail("a name in UTF-8, without zero bytes");
  return text_;
}

double XmlValue::OneNumber(std::string_view word) const {
  double number = 0.0;
  if (word.starts_with('+')) word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  const bool whole = error == std::errc() && end == word.data() + word.size();
  if (!whole || word.empty() || !std::isfinite(number)) Fail("finite numbers only");
  return number;
}

double XmlValue::Number(const Range& range) const {
  const std::vector<std::string_view> words = Words(text_);
  const double number = words.size() == 1 ? OneNumber(words[0]) : std::nan("");
  if (!range.Contains(number)) Fail("a number" + range.Text());
  return number;
}

std::vector<double> XmlValue::Numbers(std::size_t least, std::size_t most) const {
  const std::vector<std::string_view> words = Words(text_);
  if (words.size() < least || words.size() > most) {
    Fail(least == most ? WithCount(least, "number") : fmt::format("{} to {} numbers", least, most));
  }
  std::vector<double> numbers;
  for (const std::string_view word : words) numbers.push_back(OneNumber(word));
  return numbers;
}

Eigen::Vector3d XmlValue::Vector() const { return Eigen::Vector3d(Numbers(3, 3).data()); }

fs::path XmlValue::File(const fs::path& subfolder, const fs::path& otherwise) const {
  const auto& main = element_.document_->path;
  if (!main) Fail("nothing: a text has no other files");
  std::error_code error;
  const fs::path folder = main->parent_path(), base = fs::canonical(folder / ".", error);
  fs::path shown = folder / subfolder / Name(), path = CanonicalOf(shown);
  if (path.empty() && !otherwise.empty()) path = CanonicalOf(shown = otherwise / Name());
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

void XmlValue::FailChoice(const std::vector<std::string>& words) const {
  Fail(fmt::format("one of {}", fmt::join(words, ", ")));
}

XmlElement::XmlElement(std::shared_ptr<XmlDocument> document, Element* element)
    : document_(std::move(document)), element_(element) {
  document_->read.insert(element_);
}

std::string XmlElement::tag() const { return element_->Name(); }
int XmlElement::line() const { return element_->GetLineNum(); }
const std::string& XmlElement::file() const {
  return *static_cast<const std::string*>(element_->GetDocument()->GetUserData());
}

bool XmlElement::is_attached_default() const {
  return document_->attached_defaults.contains(element_);
}

std::string XmlElement::Shown() const {
  const char* name = element_->Attribute("name");
  std::string shown = "<" + Abbreviated(element_->Name());
  if (name != nullptr && IsText(name)) shown += " name=" + Quoted(name);
  return shown + ">";
}

void XmlElement::FailAt(const std::string& attribute, std::string_view found,
                        std::string_view expected) const {
  const std::string where = attribute.empty() ? "" : " " + Abbreviated(attribute);
  throw ConfigError(Printable(fmt::format("{}:{}: {}{}: found {}, expected {}", file(), line(),
                                          Shown(), where, found, expected)));
}

void XmlElement::Fail(std::string_view found, std::string_view expected) const {
  FailAt("", found, expected);
}

std::vector<XmlElement> XmlElement::Children(const std::vector<std::string_view>& tags) const {
  std::vector<XmlElement> children;
  for (Element* child : document_->ChildrenOf(element_)) {
    if (tags.empty() || std::ranges::find(tags, child->Name()) != tags.end()) {
      children.emplace_back(document_, child);
    }
  }
  return children;
}

std::vector<XmlElement> XmlElement::Children(const char* tag) const {
  return Children(std::vector<std::string_view>{tag});
}

std::vector<XmlElement> XmlElement::InSections(const char* section, const char* tag) const {
  std::vector<XmlElement> all;
  for (const XmlElement& one : Children(section)) {
    for (const XmlElement& child : tag != nullptr ? one.Children(tag) : one.Children()) {
      all.push_back(child);
    }
  }
  return all;
}

std::optional<XmlElement> XmlElement::Within(const std::vector<std::string_view>& tags) const {
  Element* found = FirstWithin(*document_, element_, tags);
  if (found == nullptr) return std::nullopt;
  return XmlElement(document_, found);
}

std::optional<XmlElement> XmlElement::Child(const char* tag) const {
  const std::vector<XmlElement> children = Children(tag);
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
  const tinyxml2::XMLAttribute* attribute = element_->FindAttribute(name.c_str());
  if (attribute == nullptr) return std::nullopt;
  document_->read.insert(attribute);
  return XmlValue(*this, name, attribute->Value());
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
  if (!child) return std::nullopt;
  return child->Content();
}

void XmlElement::Ignore() const {
  for (const auto* attribute : AttributesIn(*element_)) document_->read.insert(attribute);
  for (const XmlElement& child : Children()) child.Ignore();
}

namespace {

/// Adds a parsed file and returns its root element.
Element* Parse(std::string_view text, const std::string& file, XmlDocument* document) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  XmlDocument::File& parsed = document->files.emplace_back();
  parsed.name = file;
  parsed.xml.SetUserData(&parsed.name);
  if (const std::string fault = EncodingFault(text); !fault.empty()) {
    throw ConfigError(file + ":" + fault);
  }
  RefuseManyAttributes(text, file);
  const auto error = parsed.xml.Parse(text.data(), text.size());
  if (error == tinyxml2::XML_ELEMENT_DEPTH_EXCEEDED) {
    throw ConfigError(
        fmt::format("{}:{}: found more than {} elements within each other, expected "
                    "fewer",
                    file, parsed.xml.ErrorLineNum(), TINYXML2_MAX_ELEMENT_DEPTH));
  }
  if (error != tinyxml2::XML_SUCCESS) {
    throw ConfigError(fmt::format("{}:{}: found a fault of syntax ({}), expected well-formed XML",
                                  file, std::max(1, parsed.xml.ErrorLineNum()),
                                  tinyxml2::XMLDocument::ErrorIDToName(error)));
  }
  RefuseDocumentTypes(parsed);
  if (parsed.xml.RootElement() == nullptr) {
    throw ConfigError(file + ":1: found no element, expected <mujoco>, <robot> or <sdf>");
  }
  return parsed.xml.RootElement();
}

/// Resolves the <include> and <attach> elements of MJCF.
class Includer {
 public:
  explicit Includer(const std::shared_ptr<XmlDocument>& document)
      : document_(document), open_{CanonicalOf(*document->path)} {
    known_.insert(open_[0]);
  }

  /// Resolves a model, whose file is in `folder`.
  void Resolve(Element* root, const fs::path& folder) {
    Include(root, folder);
    std::vector<Element*> places;
    for (Element* world : Named(root, "worldbody")) AddWithin(world, "attach", &places);
    for (Element* place : places) Attach(place, root, folder);
  }

 private:
  void Include(Element* element, const fs::path& folder) {
    for (Element* child : ChildrenIn(element)) {
      if (std::string_view(child->Name()) != "include") {
        Include(child, folder);
        continue;
      }
      const auto name =
          XmlElement(document_, child).Required("file", "a file below the folder of the main file");
      fs::path shown;
      Element* root = Open(name, folder, &shown);
      if (!known_.insert(open_.back()).second) name.Fail("each file once");
      document_->included.emplace(child, root);
      Include(root, shown.parent_path());
      open_.pop_back();
    }
  }

  /// Reads a file, named from the folder of the main file or from `folder`, and returns its root
  /// element. It is the last of the open files.
  Element* Open(const XmlValue& name, const fs::path& folder, fs::path* shown) {
    constexpr std::size_t kMaxDepth = 16;
    *shown = name.File({}, folder);
    const fs::path path = CanonicalOf(*shown);
    if (const auto cycle = std::ranges::find(open_, path); cycle != open_.end()) {
      std::string names;
      for (auto at = cycle; at != open_.end(); ++at) names += at->filename().string() + " > ";
      name.Fail(fmt::format("no cycle of files ({}{})", names, path.filename().string()));
    }
    if (open_.size() > kMaxDepth) name.Fail(fmt::format("at most {} nested files", kMaxDepth));
    std::error_code error;
    bytes_ += fs::file_size(path, error);
    if (error || bytes_ > kMaxConfigBytes) {
      name.Fail(fmt::format("files of at most {} MiB in all", kMaxConfigBytes >> 20));
    }
    open_.push_back(path);
    return Parse(ReadTextFile(path), shown->string(), document_.get());
  }

  std::vector<Element*> Named(Element* root, std::string_view tag) const {
    std::vector<Element*> named = document_->ChildrenOf(root);
    std::erase_if(named, [&](Element* child) { return child->Name() != tag; });
    return named;
  }
  /// Adds the descendants of an element with this tag and not those within them, or all without
  /// tag.
  void AddWithin(Element* element, std::string_view tag, std::vector<Element*>* found) const {
    for (Element* child : document_->ChildrenOf(element)) {
      const bool fits = tag.empty() || child->Name() == tag;
      if (fits) found->push_back(child);
      if (!fits || tag.empty()) AddWithin(child, tag, found);
    }
  }
  /// Returns an attribute of <compiler>, of the last one that has it.
  std::string Setting(Element* root, const char* name, const char* otherwise) const {
    std::string value = otherwise;
    for (Element* compiler : Named(root, "compiler")) {
      if (const char* given = compiler->Attribute(name)) value = Trimmed(given);
    }
    return value;
  }

  /// Returns the name of a <model> in <asset>: its own, or the one in its file.
  std::string NameOf(const XmlElement& model, const XmlValue& file, const fs::path& folder) {
    if (const auto name = model.Attribute("name")) return name->Name();
    fs::path shown;
    const char* name = Open(file, folder, &shown)->Attribute("model");
    open_.pop_back();
    return name != nullptr ? name : "";
  }

  void Attach(Element* place, Element* root, const fs::path& folder) {
    const XmlElement attach(document_, place);
    const XmlValue model = attach.Required("model", "the name of a <model> in <asset>");
    std::optional<XmlValue> file;
    for (const XmlElement& given : XmlElement(document_, root).InSections("asset", "model")) {
      const XmlValue path = given.Required("file", "a MJCF file");
      if (NameOf(given, path, folder) == model.text()) file = path;
    }
    if (!file) model.Fail("the name of a <model> in <asset>");
    std::set<fs::path> known;
    std::swap(known, known_);
    fs::path shown;
    Element* other = Open(*file, folder, &shown);
    Resolve(other, shown.parent_path());
    open_.pop_back();
    std::swap(known, known_);
    for (const auto& [name, otherwise] : {std::pair{"angle", "degree"},
                                          {"eulerseq", "xyz"},
                                          {"autolimits", "true"},
                                          {"inertiafromgeom", "auto"},
                                          {"inertiagrouprange", "0 5"},
                                          {"balanceinertia", "false"},
                                          {"boundmass", "0"},
                                          {"boundinertia", "0"},
                                          {"settotalmass", "-1"}}) {
      const std::string wanted = Setting(root, name, otherwise);
      if (Setting(other, name, otherwise) == wanted) continue;
      model.Fail(fmt::format("a model with {}=\"{}\" in its <compiler>, as in {}", name, wanted,
                             attach.file()));
    }
    auto part = attach.Attribute("body");
    if (part && part->text() == "world") part.reset();
    if (!part) part = attach.Attribute("frame");
    std::vector<Element*> contents, all;
    for (Element* world : Named(other, "worldbody")) {
      std::ranges::copy(document_->ChildrenOf(world), std::back_inserter(contents));
      AddWithin(world, "", &all);
    }
    if (part) {
      const auto named = std::ranges::find_if(all, [&](const Element* one) {
        const char* name = one->Attribute("name");
        return one->Name() == part->attribute() && name != nullptr && part->text() == name;
      });
      if (named == all.end()) {
        part->Fail(fmt::format("the name of a {} of {}", part->attribute(), shown.string()));
      }
      contents = {*named};
    }
    const auto prefix = attach.Attribute("prefix");
    const std::string main = Rename(other, prefix ? prefix->text() : "", shown.parent_path());
    Element* frame = other->GetDocument()->NewElement("frame");
    frame->SetAttribute("childclass", main.c_str());
    Element* attached = other->GetDocument()->NewElement("attached");
    document_->added[frame] = contents;
    document_->added[attached] = {frame};
    document_->included.emplace(place, attached);
    if (part) DropOutside(other, frame);
    for (const char* tag : {"default", "asset", "contact", "tendon", "equality", "actuator",
                            "deformable", "extension"}) {
      std::ranges::copy(Named(other, tag), std::back_inserter(document_->added[root]));
    }
  }

  /// Adds a prefix to all names of a model, and paths to its meshes. Returns the name of its
  /// default class, which no class of other models is.
  std::string Rename(Element* root, const std::string& prefix, const fs::path& folder) {
    constexpr const char* kNames[] = {
        "name",          "class",    "childclass", "body",    "body1",     "body2",
        "joint",         "joint1",   "joint2",     "site",    "site1",     "site2",
        "geom",          "geom1",    "geom2",      "tendon",  "mesh",      "tendon1",
        "tendon2",       "hfield",   "actuator",   "refsite", "cranksite", "slidersite",
        "jointinparent", "sidesite", "material",   "texture", "target"};
    const std::string main =
        fmt::format("{}main ({})", prefix, document_->attached_defaults.size());
    std::set<std::string> names_of_main = {"main"};
    std::vector<Element*> defaults = Named(root, "default");
    std::erase_if(defaults,
                  [&](Element* one) { return document_->attached_defaults.contains(one); });
    if (defaults.empty()) {
      defaults.push_back(root->GetDocument()->NewElement("default"));
      document_->added[root].push_back(defaults[0]);
    }
    for (Element* one : defaults) {
      if (const char* name = one->Attribute("class")) names_of_main.insert(name);
      one->SetAttribute("class", "main");
    }
    for (const char* tag : {"asset", "tendon", "equality", "actuator"}) {
      for (Element* section : Named(root, tag)) {
        for (Element* one : document_->ChildrenOf(section)) {
          if (one->Attribute("class") == nullptr) one->SetAttribute("class", "main");
          const char* file = one->Attribute("file");
          if (file == nullptr || std::string_view(one->Name()) != "mesh") continue;
          const std::string path = file;
          if (one->Attribute("name") == nullptr) {
            one->SetAttribute("name", fs::path(path).stem().c_str());
          }
          const std::string meshes =
              Setting(root, "meshdir", Setting(root, "assetdir", "").c_str());
          one->SetAttribute("file", fs::absolute(folder / meshes / path).c_str());
        }
      }
    }
    std::vector<Element*> all;
    AddWithin(root, "", &all);
    for (Element* one : all) {
      for (const char* key : kNames) {
        const char* given = one->Attribute(key);
        if (given == nullptr) continue;
        const std::string name(Trimmed(given)), attribute = key;
        if (name.empty() || (attribute.starts_with("body") && name == "world")) continue;
        const bool is_main = attribute.ends_with("class") && names_of_main.contains(name);
        one->SetAttribute(key, (is_main ? main : prefix + name).c_str());
      }
    }
    document_->attached_defaults.insert(defaults.begin(), defaults.end());
    return main;
  }

  /// Deletes tendons, constraints and actuators of a model that refer to parts outside `frame`.
  void DropOutside(Element* root, Element* frame) {
    std::set<std::string> inside;  // kind and name
    std::vector<Element*> parts;
    const auto note = [&](Element* one, const std::string& kind) {
      if (const char* name = one->Attribute("name")) inside.insert(kind + " " + name);
    };
    AddWithin(frame, "", &parts);
    for (Element* one : parts) {
      note(one, std::string_view(one->Name()) == "freejoint" ? "joint" : one->Name());
    }
    const auto is_inside = [&](Element* one) {
      for (const char* kind : {"body", "joint", "site", "geom", "tendon"}) {
        for (const std::string& key :
             {kind + std::string(), kind + std::string("1"), kind + std::string("2")}) {
          const char* name = one->Attribute(key.c_str());
          if (name == nullptr || std::string_view(name) == "world") continue;
          if (!inside.contains(std::string(kind) + " " + name)) return false;
        }
      }
      return true;
    };
    for (const char* tag : {"tendon", "equality", "actuator"}) {
      for (Element* section : Named(root, tag)) {
        for (Element* one : document_->ChildrenOf(section)) {
          std::vector<Element*> own = {one};
          AddWithin(one, "", &own);
          if (std::ranges::all_of(own, is_inside)) {
            note(one, tag);
          } else {
            one->Parent()->DeleteChild(one);
          }
        }
      }
    }
  }

  std::shared_ptr<XmlDocument> document_;
  std::vector<fs::path> open_;  ///< the files around the element, the main file first
  std::set<fs::path> known_;    ///< of the model that is read
  std::uintmax_t bytes_ = 0;
};

}  // namespace

XmlFile::XmlFile(std::string_view text, const std::string& file,
                 const std::optional<fs::path>& path)
    : document_(std::make_shared<XmlDocument>()) {
  document_->path = path;
  Parse(text, file, document_.get());
}

void XmlFile::Include() {
  if (document_->path) {
    Includer(document_).Resolve(document_->root(), document_->path->parent_path());
  }
}

XmlElement XmlFile::root() const { return XmlElement(document_, document_->root()); }
const std::string& XmlFile::name() const { return document_->files.front().name; }

namespace {

using Parts = std::vector<std::pair<XmlElement, std::string>>;

void AddUnread(const std::shared_ptr<XmlDocument>& document, Element* element, Parts* parts) {
  if (!document->read.contains(element)) {
    parts->emplace_back(XmlElement(document, element), "");
    return;
  }
  for (const auto* one : AttributesIn(*element)) {
    if (document->read.contains(one)) continue;
    parts->emplace_back(XmlElement(document, element), IsText(one->Name()) ? one->Name() : "?");
  }
  for (Element* child : document->ChildrenOf(element)) AddUnread(document, child, parts);
}

}  // namespace

Parts XmlFile::Unread() const {
  Parts parts;
  AddUnread(document_, document_->root(), &parts);
  return parts;
}

}  // namespace loopbench::harness
