// <include> and <attach> of MJCF: elements of other files.
#include <fmt/format.h>

#include <set>

#include "harness/exchange/xml_document.h"
#include "harness/exchange/xml_file.h"
#include "harness/text/files.h"

namespace loopbench::harness {

namespace fs = std::filesystem;

namespace {

using xml::Element;

/// Resolves the <include> and <attach> elements of MJCF.
class Includer {
 public:
  explicit Includer(const std::shared_ptr<XmlDocument>& document)
      : document_(document), open_{xml::CanonicalOf(*document->path)} {
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
    return xml::Parse(ReadTextFile(path), shown->string(), document_.get());
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
        const std::string name(xml::Trimmed(given)), attribute = key;
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

void XmlFile::Include() {
  if (document_->path) {
    Includer(document_).Resolve(document_->root(), document_->path->parent_path());
  }
}

}  // namespace loopbench::harness
