// SDF (sdformat.org, versions 1.4 to 1.12).
#include "harness/exchange/import_sdf.h"

#include "harness/exchange/solids.h"

namespace loopbench::harness {

namespace {

using Eigen::Vector3d;

constexpr int kFirstVersion = 4, kLastVersion = 12;
constexpr double kSdfGravity = 9.8;     // [m/s^2]
constexpr double kSdfDensity = 1000.0;  // [kg/m^3]

constexpr DroppedReason kSdfReasons[] = {
    {"collision", "there is no contact"},
    {"sensor", "there are no sensors"},
    {"atmosphere enable_wind", "there is no medium"},
    {"wind fluid_added_mass", "there is no medium", true},
    {"kinematic", "bodies move as forces make them", true},
    {"plugin", "there are no plugins", true},
    {"state", "the start is that of the poses", true},
    {"actor", "actors are no mechanism"},
    {"population", "it makes models while it runs", true},
    // without influence on the motion
    {"visual audio_source audio_sink light projector particle_emitter battery scene gui audio "
     "magnetic_field spherical_coordinates self_collide allow_auto_disable must_be_base_link "
     "road gripper link@name model@canonical_link sdf@version",
     ""}};

void RefuseIncludes(const XmlElement& element) {
  for (const XmlElement& include : element.Children({"include"})) {
    include.Fail("a model in another file", "all in one file (gz sdf -p FILE writes it)");
  }
}

void Shorten(SdfScope* scope, std::size_t length) {
  scope->prefix = scope->prefix.substr(length);
  for (auto& [name, model] : scope->models) Shorten(model.get(), length);
}

Solid MeshIn(const XmlElement& shape) {
  const XmlValue uri = shape.RequiredChild("uri").Content();
  TriangleMesh mesh = ReadMesh(uri.File());
  if (const auto scale = shape.Content("scale")) {
    const Vector3d factors = scale->Vector();
    if (!(factors.minCoeff() > 0.0)) scale->Fail("factors > 0");
    for (Vector3d& point : mesh.points) point = factors.cwiseProduct(point);
  }
  const std::size_t open = NumOpenEdges(mesh);
  const Solid solid = SolidOf(mesh, MeshRule::kEnclosed);
  if (open > 0 || !(solid.volume > 0.0)) {
    uri.Fail(
        fmt::format("a closed mesh with triangles counter-clockwise from outside: {} edges "
                    "are open, the volume is {:.3g} m^3",
                    open, solid.volume));
  }
  return solid;
}

Solid ShapeIn(const XmlElement& geometry) {
  const auto number = [](const XmlElement& shape, const char* name) {
    return shape.RequiredChild(name).Content().Number(kPositive);
  };
  const auto sizes = [](const XmlElement& shape, const char* name) {
    const XmlValue value = shape.RequiredChild(name).Content();
    const Vector3d read = value.Vector();
    if (!(read.minCoeff() > 0.0)) value.Fail("sizes > 0");
    return read;
  };
  for (const XmlElement& shape : geometry.Children()) {
    const std::string tag = shape.tag();
    if (tag == "box") return BoxOf(0.5 * sizes(shape, "size"));
    if (tag == "ellipsoid") return EllipsoidOf(sizes(shape, "radii"));
    if (tag == "sphere") return EllipsoidOf(Vector3d::Constant(number(shape, "radius")));
    if (tag == "cylinder" || tag == "capsule") {
      const double radius = number(shape, "radius"), half = 0.5 * number(shape, "length");
      return tag == "capsule" ? CapsuleOf(radius, half) : CylinderOf(radius, half);
    }
    if (tag == "mesh") return MeshIn(shape);
  }
  geometry.Fail("a shape whose volume is not known here",
                "box, sphere, ellipsoid, cylinder, capsule or mesh");
}

int VersionOf(const XmlElement& root) {
  const XmlValue value = root.Required("version", "1.4 to 1.12");
  for (int minor = kFirstVersion; minor <= kLastVersion; ++minor) {
    if (value.text() == fmt::format("1.{}", minor)) return minor;
  }
  value.Fail("a version from 1.4 to 1.12");
}

/// Reads the <pose> of an element and its `relative_to`.
SdfFrame ReadPose(const XmlElement& element, const SdfFile& file) {
  SdfFrame frame{element};
  const auto pose = element.Child("pose");
  if (!pose) return frame;
  if (const auto old = pose->Filled("frame")) {
    old->Fail("none: what it means was said only from 1.7 on, as relative_to");
  }
  if (const auto relative = pose->Filled("relative_to")) {
    if (file.minor < 7) relative->Fail("none before version 1.7");
    frame.relative_to = relative->Name();
  }
  const bool in_degrees = BoolOr(pose->Attribute("degrees"));
  const auto format = pose->Attribute("rotation_format");
  const bool quaternion =
      format && format->Choice<bool>({{"euler_rpy", false}, {"quat_xyzw", true}});
  const XmlValue content = pose->Content();
  if (content.text().empty()) return frame;
  const char* kinds = quaternion ? "nnnr" : in_degrees ? "nnnnnn" : "nnnaaa";
  const std::vector<double> p = file.draft->Numbers(content, kinds);
  frame.raw.p = {p[0], p[1], p[2]};
  frame.raw.q = quaternion
                    ? UnitQuaternion(content, {p[6], p[3], p[4], p[5]})
                    : FromRollPitchYaw((in_degrees ? kDegree : 1.0) * Vector3d(p[3], p[4], p[5]));
  return frame;
}

/// Returns the pose of a part in its link. Only parts other than <inertial> may be relative to
/// other frames.
Placement PoseInLink(const XmlElement& part, const XmlElement& link, const SdfScope& scope) {
  const SdfFrame pose = ReadPose(part, scope.file);
  const std::string own = link.RequiredName();
  if (pose.relative_to.empty() || pose.relative_to == own) return pose.raw;
  if (part.tag() == "inertial") {
    part.RequiredChild("pose").Required("relative_to", "").Fail("none, or its own link");
  }
  return scope.Resolve(own, part).Inverse() * scope.Resolve(pose.relative_to, part) * pose.raw;
}

/// Reads the name and frame of a link, frame or joint.
void ReadName(const XmlElement& child, SdfScope* scope) {
  SdfFrame frame = ReadPose(child, scope->file);
  const bool is_joint = child.tag() == "joint";
  if (is_joint) {
    const XmlValue moved = child.RequiredChild("child").Content();
    if (moved.Name() == kSdfWorld) {
      moved.Fail("a link, frame or nested model: the world is no child, it can be the <parent>");
    }
    frame.attached_to = moved.text();
  } else if (child.tag() == "frame") {
    if (const auto attached = child.Attribute("attached_to")) frame.attached_to = attached->text();
  }
  if (frame.relative_to.empty()) {
    frame.relative_to = frame.attached_to;
    frame.is_raw_to_child = is_joint;
  }
  const std::string name = child.RequiredName();
  scope->Add(is_joint ? scope->FrameOf(name) : name, std::move(frame));
}

/// Reads all names of a world or model, including nested models.
void ReadNames(SdfScope* scope) {
  const XmlElement& element = scope->element;
  RefuseIncludes(element);
  scope->joints = element.Children({"joint"});
  for (const char* tag : {"link", "frame", "joint"}) {
    for (const XmlElement& child : element.Children({tag})) ReadName(child, scope);
  }
  for (const XmlElement& child : element.Children({"model"})) {
    const std::string name = child.RequiredName();
    const auto fixed = child.Content("static");
    const bool is_static = scope->is_static || BoolOr(fixed);
    const auto& model = scope->models[name] =
        std::make_unique<SdfScope>(child, scope->file, scope->prefix + name + "::", is_static);
    ReadNames(model.get());
    SdfFrame frame = ReadPose(child, scope->file);
    if (const auto placed = child.Filled("placement_frame")) {
      // the pose is the pose of this frame of the model
      frame.raw = frame.raw * model->Resolve(placed->Name(), child).Inverse();
    }
    scope->Add(name, std::move(frame));
  }
}

/// Computes the mass of a link from its collision shapes, which have these poses in it.
void ReadShapes(const XmlElement& link, const XmlElement& inertial,
                const std::vector<Placement>& poses, int body, ImportDraft* draft) {
  const double density = NumberOr(inertial.Content("density"), kSdfDensity, kPositive);
  std::vector<PlacedSolid> parts;
  for (const XmlElement& collision : link.Children({"collision"})) {
    PlacedSolid part;
    part.solid = ShapeIn(collision.RequiredChild("geometry"));
    part.X = poses[parts.size()];
    part.mass = part.solid.volume * NumberOr(collision.Content("density"), density, kPositive);
    parts.push_back(part);
  }
  const BodyDescription sum = SumOf(parts);
  if (!(sum.mass > 0.0)) inertial.Fail("auto without a <collision>", "one with a volume");
  const double mass = NumberOr(inertial.Content("mass"), sum.mass, kPositive);
  draft->SetMass(body, mass, sum.com, mass / sum.mass * sum.inertia);
}

/// Reads <inertial> and the other properties of a link.
void ReadLink(const XmlElement& link, int body, const SdfScope& scope) {
  ImportDraft* draft = scope.file.draft;
  const bool has_weight = BoolOr(link.Content("gravity"), true);
  if (!has_weight && !scope.is_static) draft->AddLift(body, 1.0);
  const auto kinematic = link.Child("kinematic");
  if (kinematic && kinematic->Content().Bool()) {
    draft->Note(*kinematic, "dropped: bodies move as forces make them", true);
  }
  if (const auto decay = link.Child("velocity_decay")) {
    const double linear = NumberOr(decay->Content("linear"), 0.0);
    const bool acts = linear != 0.0 || NumberOr(decay->Content("angular"), 0.0) != 0.0;
    decay->Ignore();
    if (acts && !scope.is_static) draft->DropWhole(*decay, "there is no medium", true);
  }
  const auto inertial = link.Child("inertial");
  if (scope.is_static) {
    if (inertial) inertial->Ignore();
    return;  // merged with the ground
  }
  if (!inertial) {
    draft->SetMass(body, 1.0, Vector3d::Zero(), Eigen::Matrix3d::Identity());
    return draft->Note(link, "no <inertial>: 1 kg and 1 kg m^2, the defaults of SDF");
  }
  if (BoolOr(inertial->Attribute("auto"))) {
    inertial->Ignore();
    std::vector<Placement> poses;
    for (const XmlElement& collision : link.Children({"collision"})) {
      draft->DropWhole(collision, "only its mass matters");
      poses.push_back(PoseInLink(collision, link, scope));
    }
    draft->ReadMassLater(body, [=] { ReadShapes(link, *inertial, poses, body, draft); });
    return;
  }
  const double mass = NumberOr(inertial->Content("mass"), 1.0, kNotNegative);
  Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  if (const auto inertia = inertial->Child("inertia")) {
    I = InertiaOf([&](const char* name, bool is_moment) {
      return NumberOr(inertia->Content(name), is_moment ? 1.0 : 0.0);
    });
  }
  const Placement X = PoseInLink(*inertial, link, scope);
  draft->SetMass(body, mass, X.p, InTurnedAxes(X.q, I));
}

/// Sets poses of models and links, and adds links as bodies.
void ReadLinks(SdfScope* scope) {
  ImportDraft* draft = scope->file.draft;
  for (const XmlElement& child : scope->element.Children({"link"})) {
    const std::string name = child.RequiredName();
    const int body = draft->AddBody(child, scope->prefix + name);
    const Placement X = scope->at_rest * scope->Resolve(name, child);
    draft->at_rest[body] = X;
    ReadLink(child, body, *scope);
    if (scope->is_static) draft->Fix(kGround, X, body, " fixed");
  }
  for (auto& [name, model] : scope->models) {
    model->at_rest = scope->at_rest * scope->Resolve(name, model->element);
    ReadLinks(model.get());
  }
}

/// Returns the gravity, if it is given. Before 1.6 it is in the first <physics>, from where
/// libsdformat moves it (sdf/1.6/1_5.convert).
std::optional<XmlValue> GravityOf(const XmlElement& world, const SdfFile& file) {
  auto gravity = world.Content("gravity");
  const std::vector<XmlElement> profiles = world.Children({"physics"});
  if (!gravity && file.minor < 6 && !profiles.empty()) gravity = profiles[0].Content("gravity");
  for (const XmlElement& physics : profiles) {
    file.draft->DropWhole(physics, "runs choose their own integrator and steps");
    const auto other = physics.Child("gravity");
    if (other && file.minor >= 6) {
      file.draft->Note(*other, "dropped: from 1.6 on, <world> contains the gravity", true);
    }
  }
  return gravity;
}

}  // namespace

void SdfScope::Add(const std::string& name, SdfFrame frame) {
  const auto [known, is_new] = frames.emplace(name, frame);
  if (is_new) return;
  frame.element.Fail(
      fmt::format("a second \"{}\"", name),
      fmt::format("a name that is not in use (line {} has it)", known->second.element.line()));
}

Placement SdfScope::Resolve(const std::string& name, const XmlElement& user) const {
  // chain of relative frames, up to a known one
  std::vector<std::pair<std::string, Placement>> chain;
  Placement X;
  for (std::string here = name, next; !IsOwn(here); here = next) {
    if (const auto known = resolved_.find(here); known != resolved_.end()) {
      X = known->second;
      break;
    }
    // without a cycle, a chain has at most each frame and a name within each model
    if (chain.size() > 2 * frames.size()) {
      user.Fail("frames that are relative to each other", "no cycle");
    }
    std::string rest;
    if (const SdfScope* nested = NestedScope(here, &rest)) {
      chain.emplace_back(here, nested->Resolve(rest, user));
      next = here.substr(0, here.find(kWithin));
    } else {
      const SdfFrame& frame = FrameNamed(here, user);
      chain.emplace_back(here, frame.raw);
      next = frame.relative_to;
    }
  }
  for (auto link = chain.rbegin(); link != chain.rend(); ++link) {
    X = X * link->second;
    resolved_.emplace(link->first, X);
  }
  return X;
}

SdfScope::Link SdfScope::LinkOf(const std::string& name, const XmlElement& user) const {
  std::vector<std::string> chain;  // each attached to the next
  std::string here = name;
  std::optional<Link> link;
  while (!link) {
    if (const auto known = links_.find(here); known != links_.end()) {
      link = known->second;
      break;
    }
    if (chain.size() > frames.size() + 1) {
      user.Fail("frames that are attached to each other", "no cycle");
    }
    chain.push_back(here);
    std::string rest;
    if (const SdfScope* nested = NestedScope(here, &rest)) {
      link = nested->LinkOf(rest, user);
    } else if (IsOwn(here) && is_world()) {
      link = Link{nullptr, ""};
    } else if (IsOwn(here)) {
      // a model moves with its canonical link, by default the first one
      const auto canonical = element.Filled("canonical_link");
      const std::vector<XmlElement> links = element.Children({"link"});
      if (!canonical && links.empty()) {
        user.Fail(fmt::format("the model of \"{}\" without a link", name), "one");
      }
      here = canonical ? canonical->text() : links[0].RequiredName();
    } else {
      const SdfFrame& frame = FrameNamed(here, user);
      const std::string tag = frame.element.tag();
      if (tag == "link") link = Link{this, here};
      if (tag == "model") link = models.at(here)->LinkOf("", user);
      here = frame.attached_to;
    }
  }
  for (const std::string& attached : chain) links_.emplace(attached, *link);
  return *link;
}

void ReadSdf(const XmlElement& root, ImportDraft* draft) {
  const SdfFile file{draft, VersionOf(root)};
  const auto world = root.Child("world");
  const XmlElement& top = world ? *world : root;
  RefuseIncludes(root);
  RefuseIncludes(top);
  if (world && !root.Children({"model"}).empty()) {
    root.Fail("a <world> and a <model> beside it", "one of the two");
  }
  const std::vector<XmlElement> models = top.Children({"model"});
  if (models.empty()) top.Fail("no <model>", "at least one");
  if (const auto gravity = GravityOf(top, file)) {
    draft->description.gravity = gravity->Vector();
  } else {
    draft->AssumeGravity(top, kSdfGravity);
  }
  SdfScope scope(top, file);
  ReadNames(&scope);
  const auto name = world ? world->Attribute("name") : std::nullopt;
  if (models.size() == 1) {
    // names within the only model need no model prefix
    SdfScope& only = *scope.models.begin()->second;
    draft->description.name = models[0].RequiredName();
    Shorten(&only, only.prefix.size());
  } else if (name) {
    draft->description.name = name->Name();
  }
  ReadLinks(&scope);
  ReadSdfJoints(scope);
  draft->NoteUnread(kSdfReasons);
}

// libsdformat converts a robot to SDF 1.11 and inserts <gazebo> (parser_urdf.cc,
// InitModelString()). Links have the frames of URDF, the model has the frame of the root.
void ReadGazeboJoints(const XmlElement& robot, const std::vector<XmlElement>& joints,
                      ImportDraft* draft) {
  if (joints.empty()) return;
  SdfScope scope(robot, {draft, 11});
  for (int i = 1; i < std::ssize(draft->at_rest); ++i) {
    const XmlElement& link = draft->element(i);
    scope.Add(link.RequiredName(), {link, draft->at_rest[i]});
  }
  scope.joints = joints;
  for (const XmlElement& joint : joints) ReadName(joint, &scope);
  ReadSdfJoints(scope);
}

}  // namespace loopbench::harness
