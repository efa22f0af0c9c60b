// <include> and <attach> of MJCF: elements of other files, copies of elements.
#include <fmt/format.h>

#include <set>

#include "harness/base/text.h"
#include "harness/exchange/xml_document.h"

namespace loopbench::harness {

namespace fs = std::filesystem;

namespace {

using xml::Element;

/// Attributes that name another element, and its kind.
constexpr std::pair<const char*, const char*> kReferences[] = {
    {"body", "body"},     {"body1", "body"},         {"body2", "body"},
    {"joint", "joint"},   {"joint1", "joint"},       {"joint2", "joint"},
    {"site", "site"},     {"site1", "site"},         {"site2", "site"},
    {"geom", "geom"},     {"geom1", "geom"},         {"geom2", "geom"},
    {"tendon", "tendon"}, {"tendon1", "tendon"},     {"tendon2", "tendon"},
    {"refsite", "site"},  {"cranksite", "site"},     {"slidersite", "site"},
    {"sidesite", "site"}, {"jointinparent", "joint"}};

/// Attributes of <compiler> that attached models share, and their defaults.
constexpr std::pair<const char*, const char*> kSettings[] = {
    {"angle", "degree"},         {"eulerseq", "xyz"},          {"autolimits", "true"},
    {"inertiafromgeom", "auto"}, {"inertiagrouprange", "0 5"}, {"balanceinertia", "false"},
    {"boundmass", "0"},          {"boundinertia", "0"},        {"settotalmass", "-1"},
    {"alignfree", "false"},      {"exactmeshinertia", "false"}};

/// Sections of elements that refer to others.
constexpr auto kReferring = {"tendon", "equality", "actuator"};

/// Returns the value of an attribute without surrounding blanks, or "".
std::string ValueOf(const Element* element, const char* key) {
  const char* given = element->Attribute(key);
  return given != nullptr ? std::string(xml::Trimmed(given)) : "";
}

/// Returns kind and name of an element, which identify it; "" without a name.
std::string KindAndName(const Element* element, const std::string& prefix = "") {
  const std::string name = ValueOf(element, "name"), tag = element->Name();
  return name.empty() ? "" : (tag == "freejoint" ? "joint" : tag) + " " + prefix + name;
}

/// Resolves the <include> and <attach> elements of MJCF.
class Includer {
 public:
  explicit Includer(XmlDocument* document)
      : document_(document), open_{xml::CanonicalOf(*document->path)} {
    known_.insert(open_[0]);
  }

  /// Resolves a model, whose file is in `folder`.
  void Resolve(Element* root, const fs::path& folder) {
    Include(root, folder);
    if (Setting(root, "strippath", "false") == "true") {
      ForElements(root, {"asset"}, [](Element* one, const char*) {
        const std::string file = ValueOf(one, "file");
        if (file.empty() || std::string_view(one->Name()) != "mesh") return;
        one->SetAttribute("file", file.substr(file.find_last_of("/\\") + 1).c_str());
      });
    }
    for (Element* place : InWorlds(root, "attach")) Attach(place, root, folder);
  }

 private:
  void Include(Element* element, const fs::path& folder) {
    for (Element* child : xml::ChildrenIn(element)) {
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
    const fs::path path = xml::CanonicalOf(*shown);
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
    return document_->Parse(ReadTextFile(path), shown->string());
  }

  std::vector<Element*> Named(Element* root, std::string_view tag) const {
    std::vector<Element*> named = document_->ChildrenOf(root);
    std::erase_if(named, [&](Element* child) { return child->Name() != tag; });
    return named;
  }
  /// Calls `use` for the elements of these sections, with the tag of the section.
  template <class Use>
  void ForElements(Element* root, std::initializer_list<const char*> tags, const Use& use) const {
    for (const char* tag : tags) {
      for (Element* section : Named(root, tag)) {
        for (Element* one : document_->ChildrenOf(section)) use(one, tag);
      }
    }
  }
  /// Returns the elements in <worldbody>, as XmlDocument::Within().
  std::vector<Element*> InWorlds(Element* root, std::string_view tag = "") const {
    std::vector<Element*> all;
    for (Element* world : Named(root, "worldbody")) {
      std::ranges::copy(document_->Within(world, tag), std::back_inserter(all));
    }
    return all;
  }
  /// Returns an attribute of <compiler>, of the last one that has it.
  std::string Setting(Element* root, const char* name, const char* otherwise) const {
    std::string value = otherwise;
    for (Element* compiler : Named(root, "compiler")) {
      if (const char* given = compiler->Attribute(name)) value = xml::Trimmed(given);
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
    for (const auto* given = place->FirstAttribute(); given != nullptr; given = given->Next()) {
      const std::string_view key = given->Name();
      if (key == "model" || key == "body" || key == "frame" || key == "prefix") continue;
      attach.Fail(fmt::format("\"{}\"", key),
                  "\"model\", \"body\" or \"frame\", \"prefix\"; a <frame> around it moves it");
    }
    if (!place->NoChildren()) attach.Fail("contents", "none; a <frame> around it moves it");
    if (attach.Attribute("body") && attach.Attribute("frame")) {
      attach.Fail("\"body\" and \"frame\"", "one of them");
    }
    const auto given_model = attach.Attribute("model");
    if (!given_model) return AttachCopy(attach, place, root);
    const XmlValue& model = *given_model;
    std::optional<XmlValue> file;
    for (const XmlElement& given : XmlElement(document_, root).InSections("asset", {"model"})) {
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
    for (const auto& [name, otherwise] : kSettings) {
      const std::string wanted = Setting(root, name, otherwise);
      if (Setting(other, name, otherwise) == wanted) continue;
      model.Fail(fmt::format("a model with {}=\"{}\" in its <compiler>, as in {}", name, wanted,
                             attach.file()));
    }
    auto part = attach.Attribute("body");
    if (part && part->text() == "world") part.reset();
    if (!part) part = attach.Attribute("frame");
    std::vector<Element*> contents;
    for (Element* world : Named(other, "worldbody")) {
      std::ranges::copy(document_->ChildrenOf(world), std::back_inserter(contents));
    }
    if (part) {
      const std::vector<Element*> all = InWorlds(other);
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
    Element* frame = Insert(place, main, contents);
    if (part) DropOutside(other, frame);
    for (const char* tag : {"default", "asset", "contact", "tendon", "equality", "actuator",
                            "deformable", "extension"}) {
      std::ranges::copy(Named(other, tag), std::back_inserter(document_->added[root]));
    }
  }

  /// Inserts elements in place of another one, in a frame with this class. Returns the frame.
  Element* Insert(Element* place, const std::string& childclass,
                  const std::vector<Element*>& contents) {
    Element* frame = place->GetDocument()->NewElement("frame");
    frame->SetAttribute("childclass", childclass.c_str());
    Element* attached = place->GetDocument()->NewElement("attached");
    document_->added[frame] = contents;
    document_->added[attached] = {frame};
    document_->included.emplace(place, attached);
    return frame;
  }

  /// Inserts a copy of a body or frame of the model itself. As in MuJoCo, the original is complete
  /// before `place`, and its default classes apply to the copy too.
  void AttachCopy(const XmlElement& attach, Element* place, Element* root) {
    auto part = attach.Attribute("body");
    if (!part) part = attach.Attribute("frame");
    if (!part) {
      attach.Fail("no \"model\", \"body\" or \"frame\"",
                  "a <model> of <asset>, or a body or frame of this model");
    }
    const std::string kind = part->attribute(), name = part->Name();
    const XmlValue prefix = attach.Required("prefix", "the beginning of the names of the copy");
    std::vector<Placed> all;
    for (Element* world : Named(root, "worldbody")) AddPlaced(world, -1, &all);
    visited_ += all.size();
    const auto end = std::ranges::find(all, place, &Placed::element);
    const auto original = std::find_if(all.begin(), end, [&](const Placed& one) {
      return one.element->Name() == kind && ValueOf(one.element, "name") == name;
    });
    if (original == end) part->Fail(fmt::format("the name of a {} before this <attach>", kind));
    std::set<const Element*> around;  // the place
    for (int i = end->parent; i >= 0; i = all[i].parent) around.insert(all[i].element);
    if (around.contains(original->element)) {
      part->Fail(fmt::format("no cycle: this {} contains the <attach>", kind));
    }
    std::string childclass;
    for (int i = original->parent; i >= 0; i = all[i].parent) {
      const Element* outer = all[i].element;
      if (childclass.empty()) childclass = ValueOf(outer, "childclass");
      if (std::string_view(outer->Name()) == "replicate" && !around.contains(outer)) {
        part->Fail(fmt::format("a {} that is not in a <replicate>", kind));
      }
    }
    std::vector<Element*> parts = document_->Within(original->element);
    parts.push_back(original->element);
    std::set<std::string> inside, made;
    for (const Element* one : parts) {
      inside.insert(KindAndName(one));
      made.insert(KindAndName(one, prefix.text()));
    }
    for (const Placed& one : all) {
      if (!ValueOf(one.element, "name").starts_with(prefix.text())) continue;
      const std::string taken = KindAndName(one.element);
      if (!taken.empty() && made.contains(taken)) {
        prefix.Fail(fmt::format("one that makes new names: there is a {}", taken));
      }
    }
    if (made.contains("body world")) prefix.Fail("one that makes no body \"world\"");
    Insert(place, childclass.empty() ? "main" : childclass,
           {Copy(original->element, prefix.text(), root->GetDocument(), attach)});
    CopyReferring(root, &inside, prefix.text(), attach);
  }

  struct Placed {
    Element* element;
    int parent;  ///< index of the element around it
  };
  /// Adds an element and its descendants in file order.
  void AddPlaced(Element* element, int parent, std::vector<Placed>* found) const {
    const int index = static_cast<int>(found->size());
    found->push_back({element, parent});
    for (Element* child : document_->ChildrenOf(element)) AddPlaced(child, index, found);
  }

  /// Copies the tendons, constraints and actuators that refer to `inside` only, and adds their
  /// names there. As in MuJoCo, the world is outside.
  void CopyReferring(Element* root, std::set<std::string>* inside, const std::string& prefix,
                     const XmlElement& attach) {
    std::vector<Element*> sections;
    ForElements(root, kReferring, [&](Element* one, const char* tag) {
      ++visited_;
      if (NumReferences(one, *inside) <= 0) return;
      if (const std::string name = ValueOf(one, "name"); !name.empty()) {
        inside->insert(std::string(tag) + " " + name);
      }
      sections.push_back(root->GetDocument()->NewElement(tag));
      sections.back()->InsertEndChild(Copy(one, prefix, root->GetDocument(), attach));
    });
    std::ranges::copy(sections, std::back_inserter(document_->added[root]));
    attach.RequireFew(visited_, 10000000, "elements to search for copies");
  }

  /// Returns a copy of an element and its contents, with prefixed names.
  Element* Copy(Element* element, const std::string& prefix, tinyxml2::XMLDocument* document,
                const XmlElement& attach, int depth = 1) {
    attach.RequireFew(++copied_, 100000, "elements of copies");
    if (depth > TINYXML2_MAX_ELEMENT_DEPTH) {
      attach.Fail(fmt::format("a copy with more than {} elements within each other",
                              TINYXML2_MAX_ELEMENT_DEPTH),
                  "fewer");
    }
    Element* copy = element->ShallowClone(document)->ToElement();
    copy->SetUserData(xml::OriginalOf(element));
    Prefix(copy, "name", prefix);
    for (const auto& [key, kind] : kReferences) Prefix(copy, key, prefix);
    for (Element* child : document_->ChildrenOf(element)) {
      copy->InsertEndChild(Copy(child, prefix, document, attach, depth + 1));
    }
    return copy;
  }

  void Prefix(Element* element, const char* key, const std::string& prefix) const {
    const std::string name = ValueOf(element, key);
    const bool is_world = std::string_view(key).starts_with("body") && name == "world";
    if (name.empty() || is_world) return;
    element->SetAttribute(key, (prefix + name).c_str());
  }

  /// Returns the number of references of an element and its contents into `inside`, or -1 if some
  /// are to other elements.
  int NumReferences(Element* element, const std::set<std::string>& inside) const {
    std::vector<Element*> own = document_->Within(element);
    own.push_back(element);
    int count = 0;
    for (const Element* one : own) {
      for (const auto& [key, kind] : kReferences) {
        const std::string name = ValueOf(one, key);
        if (name.empty()) continue;
        if (!inside.contains(std::string(kind) + " " + name)) return -1;
        ++count;
      }
    }
    return count;
  }

  /// Adds a prefix to all names of a model, and paths to its meshes. Returns the name of its
  /// default class, which no class of other models is.
  std::string Rename(Element* root, const std::string& prefix, const fs::path& folder) {
    constexpr const char* kNames[] = {"name",     "mesh",    "hfield", "actuator",
                                      "material", "texture", "target"};
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
    ForElements(root, {"asset", "tendon", "equality", "actuator"}, [&](Element* one, const char*) {
      if (one->Attribute("class") == nullptr) one->SetAttribute("class", "main");
      const char* file = one->Attribute("file");
      if (file == nullptr || std::string_view(one->Name()) != "mesh") return;
      const fs::path path = file;
      if (one->Attribute("name") == nullptr) one->SetAttribute("name", path.stem().c_str());
      const std::string meshes = Setting(root, "meshdir", Setting(root, "assetdir", "").c_str());
      one->SetAttribute("file", fs::absolute(folder / meshes / path).c_str());
    });
    for (Element* one : document_->Within(root)) {
      for (const char* key : kNames) Prefix(one, key, prefix);
      for (const auto& [key, kind] : kReferences) Prefix(one, key, prefix);
      for (const char* key : {"class", "childclass"}) {
        const std::string name = ValueOf(one, key);
        if (!name.empty() && names_of_main.contains(name)) {
          one->SetAttribute(key, main.c_str());
        } else {
          Prefix(one, key, prefix);
        }
      }
    }
    document_->attached_defaults.insert(defaults.begin(), defaults.end());
    return main;
  }

  /// Hides tendons, constraints and actuators of a model that refer to parts outside `frame`.
  void DropOutside(Element* root, Element* frame) {
    std::set<std::string> inside = {"body world"};
    for (const Element* one : document_->Within(frame)) inside.insert(KindAndName(one));
    Element* none = root->GetDocument()->NewElement("none");
    ForElements(root, kReferring, [&](Element* one, const char* tag) {
      if (NumReferences(one, inside) >= 0) {
        inside.insert(std::string(tag) + " " + ValueOf(one, "name"));
      } else {
        document_->included.emplace(one, none);  // copies refer to it
      }
    });
  }

  XmlDocument* document_;
  std::vector<fs::path> open_;  ///< the files around the element, the main file first
  std::set<fs::path> known_;    ///< of the model that is read
  std::uintmax_t bytes_ = 0;
  std::size_t copied_ = 0, visited_ = 0;  ///< elements, for all copies
};

}  // namespace

void XmlDocument::Include() {
  if (path) Includer(this).Resolve(files.front().xml.RootElement(), path->parent_path());
}

}  // namespace loopbench::harness
