// <worldbody>: bodies, their masses and their sites; <replicate>: copies of elements.
#include "harness/exchange/import_mjcf.h"
#include "mechanism/algebra/symmetric_eigen.h"

namespace loopbench::harness {

namespace {

using Eigen::Vector3d;

// Masses of MuJoCo shapes.

constexpr double kDensity = 1000.0;  // [kg/m^3], MuJoCo's default
/// Smaller volumes [m^3] ignore a given mass, and smaller masses [kg] are ignored: mjEPS in
/// MuJoCo's src/user/user_objects.cc.
constexpr double kLeast = 1e-14;

/// Types of geoms; the first ones have a mass.
enum Type { kSphere, kCapsule, kCylinder, kBox, kEllipsoid, kWithoutMass, kOfMesh };
/// Number of values of `size`; one with `fromto`.
constexpr std::size_t kSizes[] = {1, 2, 2, 3, 3};

/// Returns the sizes of a geom and its frame; `fromto` gives position, axis and half length.
Vector3d PlaceAndSize(const MjcfModel& model, const XmlElement& geom, Type type, Placement* X) {
  const auto size = geom.Attribute("size");
  const auto along = geom.Attribute("fromto");
  *X = model.PlacementOf(geom);
  if (!size) geom.Fail("no \"size\"", "the sizes of the shape");
  const bool has_ends = along && type != kSphere;
  std::vector<double> sizes = size->Numbers(has_ends ? 1 : kSizes[type], 3);
  sizes.resize(3);
  if (!has_ends) return Vector3d(sizes.data());
  const double length = model.PlaceAlong(*along, X);
  if (type == kCapsule || type == kCylinder) return {sizes[0], 0.5 * length, 0.0};
  return {sizes[0], sizes[0], 0.5 * length};
}

Solid ShapeOf(Type type, const Vector3d& size) {
  if (type == kCapsule) return CapsuleOf(size[0], size[1]);
  if (type == kCylinder) return CylinderOf(size[0], size[1]);
  if (type == kBox) return BoxOf(size);
  return EllipsoidOf(type == kSphere ? Vector3d(size[0], size[0], size[0]) : size);
}

/// Returns numbers in threes.
std::vector<double> Triples(const XmlValue& value, std::size_t most, const char* what) {
  std::vector<double> numbers = value.Numbers(12, most);
  if (numbers.size() % 3 == 0) return numbers;
  value.element().Fail(fmt::format("{} numbers in \"{}\"", numbers.size(), value.attribute()),
                       fmt::format("three for each {}", what));
}

/// Reads the points of a mesh from `vertex`, and triangles from `face`, if any.
TriangleMesh ReadVertices(const XmlValue& vertex, const std::optional<XmlValue>& face) {
  TriangleMesh mesh;
  const std::vector<double> numbers = Triples(vertex, 3 * kMostHullPoints, "point");
  for (std::size_t i = 0; i < numbers.size(); i += 3) {
    mesh.points.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
  }
  if (!face) return mesh;
  const std::vector<double> corners = Triples(*face, 6 * kMostHullPoints, "triangle");
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const double corner = corners[i];
    if (corner != std::floor(corner) || corner < 0.0 ||
        corner >= static_cast<double>(mesh.points.size())) {
      face->element().Fail(fmt::format("{} in \"face\"", corner),
                           fmt::format("a point, 0 to {}", mesh.points.size() - 1));
    }
    if (i % 3 == 0) mesh.triangles.emplace_back();
    mesh.triangles.back()[i % 3] = static_cast<int>(corner);
  }
  return mesh;
}

/// Reads a mesh of <asset> as a solid in its frame; points without triangles as convex hull.
Solid ReadMeshSolid(const MjcfModel& model, const XmlElement& asset) {
  const auto file = asset.Attribute("file"), vertex = asset.Attribute("vertex");
  if (!file && !vertex) {
    asset.Fail("a mesh without points", "\"file\", an .stl or .obj with triangles, or \"vertex\"");
  }
  const auto inertia = asset.Attribute("inertia");
  const bool is_convex = inertia && inertia->text() == "convex";
  using enum MeshRule;
  constexpr XmlChoice<MeshRule> kRules[] = {
      {"convex", kEnclosed}, {"legacy", kPyramids}, {"exact", kEnclosed}, {"shell", kShell}};
  const MeshRule rule = inertia                           ? inertia->Choice(kRules)
                        : model.settings.has_exact_meshes ? kEnclosed
                                                          : kPyramids;
  const Vector3d scale = VectorOr(asset.Attribute("scale"), Vector3d::Ones());
  const Vector3d origin = VectorOr(asset.Attribute("refpos"));
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  if (const auto given = asset.Attribute("refquat")) {
    const std::vector<double> q = given->Numbers(4, 4);
    turn = UnitQuaternion(*given, {q[0], q[1], q[2], q[3]});
  }
  TriangleMesh mesh = file ? ReadMesh(file->File(model.settings.mesh_folder))
                           : ReadVertices(*vertex, asset.Attribute("face"));
  const XmlValue& given = file ? *file : *vertex;
  if (is_convex || mesh.triangles.empty()) {
    if (mesh.points.size() > kMostHullPoints) {
      given.element().Fail(fmt::format("{} points", mesh.points.size()),
                           fmt::format("at most {} for a convex hull", kMostHullPoints));
    }
    mesh = ConvexHullOf(mesh.points);
    if (mesh.triangles.empty()) {
      given.element().Fail("points in a plane", "points that enclose a volume");
    }
  }
  for (Vector3d& point : mesh.points) {
    point = scale.cwiseProduct(turn.conjugate() * (point - origin));
  }
  if (scale.prod() < 0.0) {
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  }
  const Solid solid = SolidOf(mesh, rule);
  if (!(solid.volume > 0.0)) {
    given.element().Fail(fmt::format("a mesh of {:.3g} m^3", solid.volume),
                         "a volume > 0, with triangles counter-clockwise from outside");
  }
  const std::size_t open = NumOpenEdges(mesh);
  if (open > 0 && rule == kEnclosed) {
    given.Fail(fmt::format("a closed mesh: {} edges have a triangle on one side only", open));
  }
  if (open > 0 && rule == kPyramids) {
    model.draft->Note(asset, file ? "file" : "vertex",
                      fmt::format("not closed at {} edges: mass by MuJoCo's legacy rule", open));
  }
  return solid;
}

const Solid& MeshSolid(const MjcfModel& model, const XmlValue& name) {
  const XmlElement& asset = Named(model.meshes, name.Name(), name, "the name of a mesh");
  const auto [known, is_new] = model.mesh_solids.try_emplace(name.text());
  if (is_new) known->second = ReadMeshSolid(model, asset);
  return known->second;
}

/// Reads a geom; returns false if it has no mass. `is_idle`: without effect, of any shape.
bool ReadGeom(const MjcfModel& model, const MjcfPlaced& geom, bool is_idle, PlacedSolid* read) {
  const XmlElement& element = geom.element;
  const auto given = element.Attribute("type");
  const auto mesh = element.Attribute("mesh");
  constexpr XmlChoice<Type> kTypes[] = {{"sphere", kSphere},       {"capsule", kCapsule},
                                        {"cylinder", kCylinder},   {"box", kBox},
                                        {"ellipsoid", kEllipsoid}, {"plane", kWithoutMass},
                                        {"hfield", kWithoutMass},  {"mesh", kOfMesh},
                                        {"sdf", kOfMesh}};
  const Type type = given ? given->Choice(kTypes) : kSphere;
  const double kg = element.Number("mass", -1.0, kNotNegative);
  const double density = element.Number("density", kDensity, kNotNegative);
  const double group = element.Number("group", 0.0);
  if (group < model.settings.first_group || group > model.settings.last_group) return false;
  if (kg == 0.0 || (kg < 0.0 && density == 0.0)) return false;
  const auto shell = element.Attribute("shellinertia");
  const bool is_shell = BoolOr(shell);
  if (type == kWithoutMass || (is_idle && (mesh || type == kOfMesh || is_shell))) return false;
  if (is_shell) {
    shell->Fail("false: the inertia of shells is not known here");
  }
  if (mesh && type != kOfMesh) mesh->Fail("no mesh: a shape is not fitted to it");
  if (type == kOfMesh) {
    read->solid = MeshSolid(model, element.Required("mesh", "the name of a mesh"));
    read->X = model.PlacementOf(element);
  } else {
    const Vector3d size = PlaceAndSize(model, element, type, &read->X);
    for (std::size_t i = 0; i < kSizes[type]; ++i) {
      if (!(size[i] > 0.0)) element.Fail("a size that is not > 0", "sizes > 0");
    }
    read->solid = ShapeOf(type, size);
  }
  if (kg > 0.0 && !(read->solid.volume > kLeast)) {
    model.draft->Note(element, "mass",
                      fmt::format("dropped, as in MuJoCo: its shape has {:.2g} m^3, not more than "
                                  "{:.0e}",
                                  read->solid.volume, kLeast),
                      true);
    return false;
  }
  read->mass = kg > 0.0 ? kg : density * read->solid.volume;
  read->X = geom.X * read->X;
  return read->mass > kLeast;
}

/// Marks geoms and their classes as read, with a note.
void IgnoreGeoms(const std::vector<MjcfPlaced>& geoms, const std::string& fate,
                 const MjcfModel& model) {
  for (const MjcfPlaced& geom : geoms) {
    geom.element.Ignore();
    if (model.settings.has_contact) model.draft->Note(geom.element, fate + "there is no contact");
  }
}

// Bodies.

/// Contents of a body by tag, without intermediate <frame> elements.
using Contents = std::map<std::string, std::vector<MjcfPlaced>>;

std::string ClassWithin(const MjcfModel& model, const XmlElement& element,
                        const std::string& around) {
  const auto given = element.Attribute("childclass");
  if (!given) return around;
  model.defaults.CheckClass(*given);
  return given->text();
}

void Gather(MjcfModel* model, const MjcfPlaced& placed, Contents* contents);

/// Collects the contents of all copies. As in MuJoCo (xml_native_reader.cc), copy i is turned by i
/// times the angles, and shifted from copy i - 1 by the offset in the axes of that copy.
void GatherReplicas(MjcfModel* model, const MjcfPlaced& placed, Contents* contents) {
  const XmlElement& element = placed.element;
  constexpr double kMostReplicas = 1e5;
  const XmlValue given = element.Required("count", "a whole number from 1 to 100000");
  const double count = given.Number();
  if (!(count >= 1.0 && count <= kMostReplicas) || count != std::floor(count)) {
    given.Fail("a whole number from 1 to 100000");
  }
  constexpr std::size_t kMostLetters = 32;
  const auto separator = element.Attribute("sep"), euler = element.Attribute("euler");
  if (separator && !separator->text().empty() && separator->Name().size() > kMostLetters) {
    separator->Fail(fmt::format("at most {} bytes", kMostLetters));
  }
  const bool degrees = model->settings.degrees;
  const Vector3d offset = VectorOr(element.Attribute("offset"));
  const Vector3d angles =
      euler ? model->draft->Vector(*euler, degrees ? "nnn" : "aaa") : Vector3d::Zero();
  const auto digits = fmt::format("{}", count).size();
  Placement X;
  for (int i = 0; i < count; ++i) {
    const Vector3d turned = (degrees ? kDegree : 1.0) * i * angles;
    X.q = FromEuler(model->settings.euler, turned);
    const std::string suffix =
        fmt::format("{}{:0{}}", separator ? separator->text() : "", i, digits);
    const MjcfReplica* replica = model->AddReplica(element, placed.replica, suffix);
    Gather(model, {element, placed.X * X, placed.childclass, replica}, contents);
    X.p += X.q * offset;
  }
}

/// Collects contents in file order, inside and outside of frames; this is the order of qpos.
void Gather(MjcfModel* model, const MjcfPlaced& placed, Contents* contents) {
  for (const XmlElement& child : placed.element.Children(
           {"body", "geom", "site", "joint", "freejoint", "inertial", "frame", "replicate"})) {
    const std::string tag = child.tag();
    if (placed.replica != nullptr) model->CountCopy(child);
    if (tag.ends_with("joint") && placed.element.tag() == "replicate") {
      child.Fail("a joint in a <replicate>", "joints in its bodies");
    }
    if (tag != "frame" && tag != "replicate") {
      const bool has_class = tag != "body" && tag != "inertial";
      (*contents)[tag == "freejoint" ? "joint" : tag].push_back(
          {has_class ? model->defaults.Of(child, placed.childclass) : child, placed.X,
           placed.childclass, placed.replica});
      continue;
    }
    child.Attribute("name");
    MjcfPlaced within{child, placed.X, ClassWithin(*model, child, placed.childclass),
                      placed.replica};
    if (tag == "replicate") {
      GatherReplicas(model, within, contents);
    } else {
      within.X = placed.X * model->PlacementOf(child);
      Gather(model, within, contents);
    }
  }
}

void ReadSites(const std::vector<MjcfPlaced>& sites, int body, MjcfModel* model) {
  for (const MjcfPlaced& site : sites) {
    const auto given = site.element.Attribute("name");
    Placement X = model->PlacementOf(site.element);
    if (const auto along = site.element.Attribute("fromto")) model->PlaceAlong(*along, &X);
    X = site.X * X;
    if (!given) continue;
    const std::string name = model->NewName("site", *given, site.replica);
    if (!model->sites.emplace(name, FrameOn{body, X}).second) {
      given->Fail("a name that no other site has");
    }
    model->draft->description.bodies[body].points.emplace(name, X.p);
  }
}

/// Reads <inertial>: about its own axes, rotated into body axes.
BodyDescription ReadInertial(const MjcfPlaced& placed, const MjcfModel& model) {
  const XmlElement& element = placed.element;
  const Placement X = placed.X * model.PlacementOf(element);
  BodyDescription read;
  read.mass = element.Required("mass", "a number [kg]").Number(kNotNegative);
  read.com = X.p;
  const auto full = element.Attribute("fullinertia");
  const auto diagonal = element.Attribute("diaginertia");
  if (full && diagonal) full->Fail("either fullinertia or diaginertia");
  if (full) {
    const std::vector<double> I = full->Numbers(6, 6);
    read.inertia = SymmetricMatrix(I[0], I[1], I[2], I[3], I[4], I[5]);
  } else if (diagonal) {
    read.inertia.diagonal() = diagonal->Vector();
  }  // otherwise a point mass, as in MuJoCo
  read.inertia = InTurnedAxes(X.q, read.inertia);
  return read;
}

/// Reads masses and returns the inertial frame. `is_fixed`: fixed to the ground, where masses
/// matter only for a total mass. `own`: the pose of the body, without frames around it.
MjcfFrame ReadMasses(Contents& contents, int body, bool is_fixed, const Placement& own,
                     MjcfModel* model) {
  const std::vector<MjcfPlaced>& inertials = contents["inertial"];
  const bool has_inertial = !inertials.empty();
  if (inertials.size() > 1) {
    inertials[1].element.Fail("a second <inertial>", "at most one in a body");
  }
  const MjcfSettings& settings = model->settings;
  const bool wants_geoms = settings.inertia == MjcfSettings::kFromGeoms ||
                           (settings.inertia == MjcfSettings::kAuto && !has_inertial);
  const bool is_idle = is_fixed && settings.total_mass <= 0.0;
  std::vector<PlacedSolid> parts;
  bool has_axes = true;
  for (const MjcfPlaced& geom : contents["geom"]) {
    PlacedSolid part;
    if (!wants_geoms || !ReadGeom(*model, geom, is_idle, &part)) continue;
    has_axes = parts.empty() && !geom.element.Attribute("mesh");
    parts.push_back(part);
  }
  BodyDescription masses = SumOf(parts);
  const bool from_geoms = masses.mass > 0.0;  // as in MuJoCo: otherwise <inertial> remains
  Placement X = own;
  if (from_geoms) {
    X = {parts[0].X.q, masses.com};
    if (has_inertial) {
      model->draft->DropWhole(inertials[0].element, "inertiafromgeom asks for the geoms' masses");
    }
  } else if (has_inertial) {
    masses = ReadInertial(inertials[0], *model);
    X = inertials[0].X * model->PlacementOf(inertials[0].element);
    has_axes = !inertials[0].element.Attribute("fullinertia");
  } else if (settings.least_mass > 0.0) {
    masses.com = own.p;  // in MuJoCo, the pose of such a body is its inertial frame too
  }
  model->draft->SetMass(body, masses.mass, masses.com, masses.inertia);
  IgnoreGeoms(contents["geom"],
              from_geoms ? "no shape here, only its mass: " : "dropped: ", *model);
  if (!has_axes) X.q.setIdentity();
  return {X, has_axes};
}

/// Returns true if MuJoCo moves the frame of the body to its inertial frame.
bool IsAligned(Contents& contents, const MjcfSettings& settings) {
  if (contents["joint"].size() != 1 || !contents["body"].empty()) return false;
  const XmlElement& joint = contents["joint"][0].element;
  const auto type = joint.Attribute("type"), align = joint.Attribute("align");
  const bool is_free = joint.tag() == "freejoint" || (type && type->text() == "free");
  const bool aligns =
      align
          ? align->Choice<bool>({{"false", false}, {"true", true}, {"auto", settings.aligns_free}})
          : settings.aligns_free;
  return is_free && aligns;
}

/// Reads a body. `is_fixed`: the parent is the ground or is fixed to it.
void ReadBody(const MjcfPlaced& placed, int parent, bool is_fixed, MjcfModel* model) {
  const XmlElement& element = placed.element;
  ImportDraft* draft = model->draft;
  const std::string childclass = ClassWithin(*model, element, placed.childclass);
  const auto name = element.Attribute("name");
  const int body =
      draft->AddBody(element, name ? model->NewName("body", *name, placed.replica) : "");
  const Placement own = model->PlacementOf(element), X_PB = placed.X * own;
  draft->at_rest[body] = draft->at_rest[parent] * X_PB;
  Contents contents;
  Gather(model, {element, {}, childclass, placed.replica}, &contents);
  is_fixed = is_fixed && contents["joint"].empty();
  const MjcfFrame inertial = ReadMasses(contents, body, is_fixed, own, model);
  if (IsAligned(contents, model->settings)) model->aligned.emplace(body, inertial);
  ReadSites(contents["site"], body, model);
  const double lift = element.Number("gravcomp", 0.0);
  if (lift != 0.0 && model->settings.has_passive()) model->lifts.emplace_back(body, lift);
  if (BoolOr(element.Attribute("mocap"))) {
    draft->Note(element, "mocap", "stays where the file draws it", true);
  }
  AddMjcfJoints(model, element, parent, body, X_PB, contents["joint"]);
  for (const MjcfPlaced& child : contents["body"]) ReadBody(child, body, is_fixed, model);
}

void BoundBelow(double least, Eigen::Matrix3d* inertia) {
  MatrixX<double> A = *inertia, U(3, 3);
  VectorX<double> moments(3);
  SymmetricEigen<double>(A, U, moments);
  if (moments[0] >= least) return;
  const Eigen::Matrix3d axes = U;
  const Vector3d bounded = moments.cwiseMax(least);
  *inertia = axes * bounded.asDiagonal() * axes.transpose();
}

// <replicate>: copies of elements, their names, and the elements that refer to them.

/// Returns the replica itself or the one around it of this <replicate>, if any.
const MjcfReplica* ReplicaOf(const void* replicate, const MjcfReplica* replica) {
  while (replica != nullptr && replica->replicate != replicate) replica = replica->around;
  return replica;
}

}  // namespace

void ReadMjcfWorld(const XmlElement& world, MjcfModel* model) {
  Contents contents;
  Gather(model, {world, {}, ClassWithin(*model, world, "")}, &contents);
  IgnoreGeoms(contents["geom"], "dropped: ", *model);
  for (const MjcfPlaced& joint : contents["joint"]) {
    joint.element.Fail("a joint of the world", "joints in bodies");
  }
  for (const MjcfPlaced& inertial : contents["inertial"]) {
    inertial.element.Fail("a mass of the world", "masses of bodies");
  }
  ReadSites(contents["site"], kGround, model);
  for (const MjcfPlaced& body : contents["body"]) ReadBody(body, kGround, true, model);
}

void AdjustMasses(MjcfModel* model) {
  const MjcfSettings& settings = model->settings;
  auto& bodies = model->draft->description.bodies;
  double total = 0.0;
  for (std::size_t i = 1; i < bodies.size(); ++i) {
    if (model->links.contains(static_cast<int>(i))) continue;
    BodyDescription& body = bodies[i];
    body.mass = std::max(body.mass, settings.least_mass);
    if (settings.least_inertia > 0.0) BoundBelow(settings.least_inertia, &body.inertia);
    if (settings.balances_inertia) Balance(&body.inertia);
    total += body.mass;
  }
  if (settings.total_mass > 0.0 && total > 0.0) {
    const double factor = settings.total_mass / total;
    for (std::size_t i = 1; i < bodies.size(); ++i) {
      bodies[i].mass *= factor;
      bodies[i].inertia *= factor;
    }
  }
}

const MjcfReplica* MjcfModel::AddReplica(const XmlElement& element, const MjcfReplica* around,
                                         const std::string& suffix) {
  draft->has_replicas = true;
  CountCopy(element);
  std::size_t depth = 1;
  for (const MjcfReplica* outer = around; outer != nullptr; outer = outer->around) ++depth;
  element.RequireFew(depth, 16, "nested <replicate>");
  const std::string outer = around != nullptr ? around->suffix : "";
  replicas_.push_back({element.id(), around, suffix + outer});
  return replicates[element.id()].emplace_back(&replicas_.back());
}

std::string MjcfModel::NameOf(const std::string& kind, const XmlValue& reference) const {
  const auto found = replicated_.find(kind + " " + reference.Name());
  const MjcfReplica* replica =
      found == replicated_.end() ? nullptr : ReplicaOf(found->second, present_);
  return reference.Name() + (replica != nullptr ? replica->suffix : "");
}

void MjcfModel::ForReplicas(const References& references, const std::function<void()>& read) {
  const MjcfReplica* innermost = nullptr;  // the first of its <replicate>
  for (const auto& [kind, name] : references) {
    const auto found = name ? replicated_.find(kind + " " + name->text()) : replicated_.end();
    if (found == replicated_.end() || ReplicaOf(found->second, innermost) != nullptr) continue;
    const MjcfReplica* first = replicates[found->second].front();
    if (innermost != nullptr && ReplicaOf(innermost->replicate, first) == nullptr) {
      name->Fail("names in one <replicate>, or in others around it");
    }
    innermost = first;
  }
  if (innermost == nullptr) return read();
  for (const MjcfReplica* replica : replicates[innermost->replicate]) {
    present_ = replica;
    CountCopy(references[0].second ? references[0].second->element() : draft->element(kGround));
    read();
  }
  present_ = nullptr;
}

}  // namespace loopbench::harness
