// <include> and <attach> of MJCF: elements of other files, copies of elements.
#include <set>

#include "harness/exchange/import_mjcf.h"

namespace loopbench::harness {

namespace fs = std::filesystem;

namespace {

using Nodes = std::vector<XmlNodePointer>;

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
std::string ValueOf(XmlNode& node, std::string_view key) {
  const XmlNode::Attribute* given = node.Find(key);
  return given != nullptr ? std::string(xml::Trimmed(given->value)) : "";
}

/// Returns kind and name of an element, which identify it; "" without a name.
std::string KindAndName(XmlNode& node, const std::string& prefix = "") {
  const std::string name = ValueOf(node, "name");
  return name.empty() ? "" : (node.tag == "freejoint" ? "joint" : node.tag) + " " + prefix + name;
}

Nodes Named(const XmlNode& root, std::string_view tag) {
  Nodes named;
  std::ranges::copy_if(root.children, std::back_inserter(named),
                       [&](const XmlNodePointer& child) { return child->tag == tag; });
  return named;
}

/// Calls `use` for the elements of these sections, with the tag of the section.
template <class Use>
void ForElements(const XmlNode& root, std::initializer_list<const char*> tags, const Use& use) {
  for (const char* tag : tags) {
    for (const XmlNodePointer& section : Named(root, tag)) {
      for (const XmlNodePointer& one : section->children) use(*one, tag);
    }
  }
}

/// Returns an attribute of <compiler>, of the last one that has it.
std::string Setting(const XmlNode& root, const char* name, std::string value) {
  for (const XmlNodePointer& compiler : Named(root, "compiler")) {
    if (compiler->Find(name) != nullptr) value = ValueOf(*compiler, name);
  }
  return value;
}

void Prefix(XmlNode& node, std::string_view key, const std::string& prefix) {
  const std::string name = ValueOf(node, key);
  const bool is_world = key.starts_with("body") && name == "world";
  if (!name.empty() && !is_world) node.Find(key)->value = prefix + name;
}
void PrefixReferences(XmlNode& node, const std::string& prefix) {
  for (const auto& [key, kind] : kReferences) Prefix(node, key, prefix);
}

/// Returns the number of references of an element and its contents; -1 if one leaves `inside`.
int NumReferences(XmlNode& node, const std::set<std::string>& inside) {
  int count = 0;
  for (const auto& [key, kind] : kReferences) {
    const std::string name = ValueOf(node, key);
    if (name.empty()) continue;
    if (!inside.contains(std::string(kind) + " " + name)) return -1;
    ++count;
  }
  for (const XmlNodePointer& child : node.children) {
    const int more = NumReferences(*child, inside);
    if (more < 0) return -1;
    count += more;
  }
  return count;
}

/// Returns a frame with this class and these contents, in place of an element.
XmlNodePointer MakeFrame(const XmlNode& place, const std::string& childclass, Nodes contents) {
  return std::make_shared<XmlNode>(XmlNode{.file = place.file,
                                           .tag = "frame",
                                           .attributes = {{"childclass", childclass}},
                                           .children = std::move(contents)});
}

/// An element, and the index of the element around it.
struct Placed {
  XmlNodePointer node;
  int parent;
};

/// Adds an element and its descendants in file order.
void AddPlaced(const XmlNodePointer& node, int parent, std::vector<Placed>* found) {
  const int index = static_cast<int>(found->size());
  found->push_back({node, parent});
  for (const XmlNodePointer& child : node->children) AddPlaced(child, index, found);
}

/// Resolves the <include> and <attach> elements of MJCF.
class Includer {
 public:
  explicit Includer(const XmlFile& main) : main_(main), open_{xml::CanonicalOf(*main.main)} {
    known_.insert(open_[0]);
  }

  /// Resolves a model, whose file is in `folder`.
  void Resolve(XmlNode& root, const fs::path& folder) {
    Include(root, folder);
    if (Setting(root, "strippath", "false") == "true") {
      ForElements(root, {"asset"}, [](XmlNode& one, const char*) {
        const std::string file = ValueOf(one, "file");
        if (file.empty() || one.tag != "mesh") return;
        one.Set("file", file.substr(file.find_last_of("/\\") + 1));
      });
    }
    Attached outer;
    std::swap(outer, attached_);
    for (const XmlNodePointer& world : Named(root, "worldbody")) AttachIn(*world, root, folder);
    std::swap(outer, attached_);
    std::ranges::move(outer.sections, std::back_inserter(root.children));
  }

 private:
  /// Sections of attached models and of copies. The model takes them over when all are attached:
  /// searches through its own sections stay short.
  struct Attached {
    Nodes sections, with_models;  ///< with_models: those <asset> sections that contain a <model>

    void Add(const XmlNodePointer& section) {
      sections.push_back(section);
      if (section->tag == "asset" && !Named(*section, "model").empty()) {
        with_models.push_back(section);
      }
    }
  };

  void Include(XmlNode& node, const fs::path& folder) {
    Nodes children;
    for (const XmlNodePointer& child : node.children) {
      if (child->tag != "include") {
        Include(*child, folder);
        children.push_back(child);
        continue;
      }
      const XmlValue name =
          XmlElement(child).Required("file", "a file below the folder of the main file");
      fs::path shown;
      const XmlNodePointer root = Open(name, folder, &shown);
      if (!known_.insert(open_.back()).second) name.Fail("each file once");
      Include(*root, shown.parent_path());
      std::ranges::copy(root->children, std::back_inserter(children));
      open_.pop_back();
    }
    node.children = std::move(children);
  }

  /// Reads a file, named from the main file's folder or from `folder`. It is the last open file.
  XmlNodePointer Open(const XmlValue& name, const fs::path& folder, fs::path* shown) {
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
    return xml::Parse(ReadTextFile(path), {shown->string(), main_.main});
  }

  void AttachIn(XmlNode& node, XmlNode& root, const fs::path& folder) {
    for (XmlNodePointer& child : node.children) {
      if (child->tag == "attach") {
        child = Attach(child, root, folder);
      } else {
        AttachIn(*child, root, folder);
      }
    }
  }

  /// Returns the name of a <model> in <asset>: its own, or the one in its file.
  std::string NameOf(const XmlElement& model, const XmlValue& file, const fs::path& folder) {
    if (const auto name = model.Attribute("name")) return name->Name();
    fs::path shown;
    const XmlNodePointer root = Open(file, folder, &shown);
    open_.pop_back();
    const XmlNode::Attribute* name = root->Find("model");
    return name != nullptr ? name->value : "";
  }

  /// Returns the contents in place of an <attach>.
  XmlNodePointer Attach(const XmlNodePointer& place, XmlNode& root, const fs::path& folder) {
    const XmlElement attach(place);
    for (const auto& [key, value, is_read] : place->attributes) {
      if (Contains(std::array{"model", "body", "frame", "prefix"}, key)) continue;
      attach.Fail(fmt::format("\"{}\"", key),
                  "\"model\", \"body\" or \"frame\", \"prefix\"; a <frame> around it moves it");
    }
    if (place->has_contents) attach.Fail("contents", "none; a <frame> around it moves it");
    if (attach.Attribute("body") && attach.Attribute("frame")) {
      attach.Fail("\"body\" and \"frame\"", "one of them");
    }
    const auto given_model = attach.Attribute("model");
    if (!given_model) return AttachCopy(attach, root);
    const XmlValue& model = *given_model;
    std::optional<XmlValue> file;
    Nodes assets = Named(root, "asset");
    std::ranges::copy(attached_.with_models, std::back_inserter(assets));
    for (const XmlNodePointer& asset : assets) {
      for (const XmlElement& given : XmlElement(asset).Children({"model"})) {
        const XmlValue path = given.Required("file", "a MJCF file");
        if (NameOf(given, path, folder) == model.text()) file = path;
      }
    }
    if (!file) model.Fail("the name of a <model> in <asset>");
    std::set<fs::path> known;
    std::swap(known, known_);
    fs::path shown;
    const XmlNodePointer pointer = Open(*file, folder, &shown);
    XmlNode& other = *pointer;
    Resolve(other, shown.parent_path());
    open_.pop_back();
    std::swap(known, known_);
    for (const auto& [name, otherwise] : kSettings) {
      const std::string wanted = Setting(root, name, otherwise);
      if (Setting(other, name, otherwise) == wanted) continue;
      model.Fail(fmt::format("a model with {}=\"{}\" in its <compiler>, as in {}", name, wanted,
                             attach.file().name));
    }
    auto part = attach.Attribute("body");
    if (part && part->text() == "world") part.reset();
    if (!part) part = attach.Attribute("frame");
    Nodes contents, all;
    for (const XmlNodePointer& world : Named(other, "worldbody")) {
      std::ranges::copy(world->children, std::back_inserter(contents));
      std::ranges::copy(world->Descendants(), std::back_inserter(all));
    }
    if (part) {
      const auto named = std::ranges::find_if(all, [&](const XmlNodePointer& one) {
        const XmlNode::Attribute* name = one->Find("name");
        return one->tag == part->attribute() && name != nullptr && part->text() == name->value;
      });
      if (named == all.end()) {
        part->Fail(fmt::format("the name of a {} of {}", part->attribute(), shown.string()));
      }
      contents = {*named};
    }
    const auto prefix = attach.Attribute("prefix");
    const std::string main = Rename(other, prefix ? prefix->text() : "", shown.parent_path());
    const XmlNodePointer frame = MakeFrame(*place, main, contents);
    if (part) DropOutside(other, *frame);
    for (const char* tag : {"default", "asset", "contact", "tendon", "equality", "actuator",
                            "deformable", "extension"}) {
      for (const XmlNodePointer& section : Named(other, tag)) attached_.Add(section);
    }
    return frame;
  }

  /// Returns a copy of a body or frame of the model itself. As in MuJoCo, the original is complete
  /// before the <attach>, and its default classes apply to the copy too.
  XmlNodePointer AttachCopy(const XmlElement& attach, XmlNode& root) {
    auto part = attach.Attribute("body");
    if (!part) part = attach.Attribute("frame");
    if (!part) {
      attach.Fail("no \"model\", \"body\" or \"frame\"",
                  "a <model> of <asset>, or a body or frame of this model");
    }
    const std::string kind = part->attribute(), name = part->Name();
    const XmlValue prefix = attach.Required("prefix", "the beginning of the names of the copy");
    std::vector<Placed> all;
    for (const XmlNodePointer& world : Named(root, "worldbody")) AddPlaced(world, -1, &all);
    visited_ += all.size();
    const auto end = std::ranges::find(all, attach.node(), &Placed::node);
    const auto original = std::find_if(all.begin(), end, [&](const Placed& one) {
      return one.node->tag == kind && ValueOf(*one.node, "name") == name;
    });
    if (original == end) part->Fail(fmt::format("the name of a {} before this <attach>", kind));
    std::set<XmlNodePointer> around;  // the place
    for (int i = end->parent; i >= 0; i = all[i].parent) around.insert(all[i].node);
    if (around.contains(original->node)) {
      part->Fail(fmt::format("no cycle: this {} contains the <attach>", kind));
    }
    std::string childclass;
    for (int i = original->parent; i >= 0; i = all[i].parent) {
      const XmlNodePointer& outer = all[i].node;
      if (childclass.empty()) childclass = ValueOf(*outer, "childclass");
      if (outer->tag == "replicate" && !around.contains(outer)) {
        part->Fail(fmt::format("a {} that is not in a <replicate>", kind));
      }
    }
    std::vector<Placed> parts;
    AddPlaced(original->node, -1, &parts);
    std::set<std::string> inside, made;
    for (const auto& [one, parent] : parts) {
      inside.insert(KindAndName(*one));
      made.insert(KindAndName(*one, prefix.text()));
    }
    for (const auto& [one, parent] : all) {
      if (!ValueOf(*one, "name").starts_with(prefix.text())) continue;
      const std::string taken = KindAndName(*one);
      if (!taken.empty() && made.contains(taken)) {
        prefix.Fail(fmt::format("one that makes new names: there is a {}", taken));
      }
    }
    if (made.contains("body world")) prefix.Fail("one that makes no body \"world\"");
    const XmlNodePointer frame = MakeFrame(*attach.node(), childclass.empty() ? "main" : childclass,
                                           {Copy(*original->node, prefix.text(), attach)});
    CopyReferring(root, &inside, prefix.text(), attach);
    return frame;
  }

  /// Copies the tendons, constraints and actuators that refer to `inside` only, and adds their
  /// names there. As in MuJoCo, the world is outside.
  void CopyReferring(XmlNode& root, std::set<std::string>* inside, const std::string& prefix,
                     const XmlElement& attach) {
    Nodes made;
    const auto copy_from = [&](const XmlNode& section) {
      for (const XmlNodePointer& one : section.children) {
        ++visited_;
        if (NumReferences(*one, *inside) <= 0) continue;
        if (const std::string name = ValueOf(*one, "name"); !name.empty()) {
          inside->insert(section.tag + " " + name);
        }
        made.push_back(std::make_shared<XmlNode>(XmlNode{
            .file = root.file, .tag = section.tag, .children = {Copy(*one, prefix, attach)}}));
      }
    };
    for (const char* tag : kReferring) {
      for (const Nodes* sections : {&root.children, &attached_.sections}) {
        for (const XmlNodePointer& section : *sections) {
          if (section->tag == tag) copy_from(*section);
        }
      }
    }
    for (const XmlNodePointer& section : made) attached_.Add(section);
    attach.RequireFew(visited_, 10000000, "elements to search for copies");
  }

  /// Returns a copy of an element and its contents, with prefixed names.
  XmlNodePointer Copy(const XmlNode& node, const std::string& prefix, const XmlElement& attach,
                      int depth = 1) {
    attach.RequireFew(++copied_, 100000, "elements of copies");
    if (depth > kMaxXmlDepth) {
      attach.Fail(fmt::format("a copy with more than {} elements within each other", kMaxXmlDepth),
                  "fewer");
    }
    const auto copy = std::make_shared<XmlNode>(node);
    Prefix(*copy, "name", prefix);
    PrefixReferences(*copy, prefix);
    for (XmlNodePointer& child : copy->children) child = Copy(*child, prefix, attach, depth + 1);
    return copy;
  }

  /// Adds a prefix to all names of a model, and paths to its meshes. Returns the name of its
  /// default class, which no class of other models is.
  std::string Rename(XmlNode& root, const std::string& prefix, const fs::path& folder) {
    constexpr const char* kNames[] = {"name",     "mesh",    "hfield", "actuator",
                                      "material", "texture", "target"};
    const std::string main = fmt::format("{}main ({})", prefix, num_defaults_);
    std::set<std::string> names_of_main = {"main"};
    Nodes defaults = Named(root, "default");
    std::erase_if(defaults, [](const XmlNodePointer& one) { return one->is_attached_default; });
    if (defaults.empty()) {
      defaults.push_back(std::make_shared<XmlNode>(XmlNode{.file = root.file, .tag = "default"}));
      root.children.push_back(defaults[0]);
    }
    for (const XmlNodePointer& one : defaults) {
      if (const XmlNode::Attribute* name = one->Find("class")) names_of_main.insert(name->value);
      one->Set("class", "main");
    }
    ForElements(root, {"asset", "tendon", "equality", "actuator"}, [&](XmlNode& one, const char*) {
      if (one.Find("class") == nullptr) one.Set("class", "main");
      const XmlNode::Attribute* file = one.Find("file");
      if (file == nullptr || one.tag != "mesh") return;
      const fs::path path = file->value;
      if (one.Find("name") == nullptr) one.Set("name", path.stem().string());
      const std::string meshes = Setting(root, "meshdir", Setting(root, "assetdir", ""));
      one.Set("file", fs::absolute(folder / meshes / path).string());
    });
    for (const XmlNodePointer& one : root.Descendants()) {
      for (const char* key : kNames) Prefix(*one, key, prefix);
      PrefixReferences(*one, prefix);
      for (const char* key : {"class", "childclass"}) {
        const std::string name = ValueOf(*one, key);
        if (!name.empty() && names_of_main.contains(name)) {
          one->Set(key, main);
        } else {
          Prefix(*one, key, prefix);
        }
      }
    }
    for (const XmlNodePointer& one : defaults) one->is_attached_default = true;
    num_defaults_ += defaults.size();
    return main;
  }

  /// Removes the tendons, constraints and actuators of a model that refer to parts outside `frame`.
  void DropOutside(XmlNode& root, const XmlNode& frame) {
    std::set<std::string> inside = {"body world"};
    for (const XmlNodePointer& one : frame.Descendants()) inside.insert(KindAndName(*one));
    for (const char* tag : kReferring) {
      for (const XmlNodePointer& section : Named(root, tag)) {
        std::erase_if(section->children, [&](const XmlNodePointer& one) {
          const bool stays = NumReferences(*one, inside) >= 0;
          if (stays) inside.insert(std::string(tag) + " " + ValueOf(*one, "name"));
          return !stays;
        });
      }
    }
  }

  const XmlFile main_;
  std::vector<fs::path> open_;  ///< the files around the element, the main file first
  std::set<fs::path> known_;    ///< of the model that is read
  Attached attached_;           ///< to the model that is read
  std::uintmax_t bytes_ = 0;
  std::size_t copied_ = 0, visited_ = 0;  ///< elements, for all copies
  std::size_t num_defaults_ = 0;          ///< of attached models
};

}  // namespace

void IncludeMjcf(const XmlElement& root) {
  const auto& main = root.file().main;
  if (main) Includer(root.file()).Resolve(*root.node(), main->parent_path());
}

}  // namespace loopbench::harness
