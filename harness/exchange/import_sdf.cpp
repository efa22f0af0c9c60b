// SDF (sdformat.org, versions 1.4 to 1.12), in SDF files and in <gazebo> elements of URDF.
#include "harness/exchange/import_sdf.h"

#include "harness/exchange/solids.h"

namespace loopbench::harness {

namespace {

using Eigen::Vector3d;

constexpr int kFirstVersion = 4, kLastVersion = 12;
constexpr double kSdfGravity = 9.8;      // [m/s^2]
constexpr double kSdfDensity = 1000.0;   // [kg/m^3]
constexpr double kPerpendicular = 1e-9;  // cosine tolerance for nine digits
constexpr double kSameAxis = 1e-5;       // [rad]: axes of gearboxes repeat those of joints
constexpr double kNoLimit = 1e15;        // the defaults are 1e16 and infinity
constexpr const char* kNoMedium = "there is no medium";
constexpr const char* kByForces = "bodies move as forces make them";

constexpr DroppedReason kSdfReasons[] = {
    {"collision", "there is no contact"},
    {"sensor", "there are no sensors"},
    {"atmosphere enable_wind", kNoMedium},
    {"wind fluid_added_mass", kNoMedium, true},
    {"kinematic", kByForces, true},
    {"plugin", "there are no plugins", true},
    {"state", "the start is that of the poses", true},
    {"actor", "actors are no mechanism"},
    {"population", "it makes models while it runs", true},
    // without influence on the motion
    {"visual audio_source audio_sink light projector particle_emitter battery scene gui audio "
     "magnetic_field spherical_coordinates self_collide allow_auto_disable must_be_base_link "
     "road gripper link@name model@canonical_link sdf@version",
     ""}};

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
  ImportDraft* draft = scope.draft;
  const bool has_weight = BoolOr(link.Content("gravity"), true);
  if (!has_weight && !scope.is_static) draft->AddLift(body, 1.0);
  const auto kinematic = link.Child("kinematic");
  if (kinematic && kinematic->Content().Bool()) draft->Drop(*kinematic, "", kByForces);
  if (const auto decay = link.Child("velocity_decay")) {
    const double linear = NumberOr(decay->Content("linear"), 0.0);
    const bool acts = linear != 0.0 || NumberOr(decay->Content("angular"), 0.0) != 0.0;
    decay->Ignore();
    if (acts && !scope.is_static) draft->DropWhole(*decay, kNoMedium, true);
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
  ImportDraft* draft = scope->draft;
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
std::optional<XmlValue> GravityOf(const SdfScope& scope) {
  auto gravity = scope.element.Content("gravity");
  const std::vector<XmlElement> profiles = scope.element.Children({"physics"});
  if (!gravity && scope.minor < 6 && !profiles.empty()) gravity = profiles[0].Content("gravity");
  for (const XmlElement& physics : profiles) {
    scope.draft->DropWhole(physics, "runs choose their own integrator and steps");
    const auto other = physics.Child("gravity");
    if (other && scope.minor >= 6) {
      scope.draft->Drop(*other, "", "from 1.6 on, <world> contains the gravity");
    }
  }
  return gravity;
}

/// Returns axes with x along the first axis, y along the second, if these are perpendicular.
std::optional<Eigen::Quaterniond> UniversalAxes(Vector3d first, Vector3d second) {
  first.normalize();
  second.normalize();
  if (std::abs(first.dot(second)) > kPerpendicular) return std::nullopt;
  return FromAxes(first, second, first.cross(second));
}

/// Returns the advance per angle [m/rad]. thread_pitch is in rad/m and positive for a left-handed
/// thread; screw_thread_pitch, from 1.10 on, in m per turn and positive for a right-handed one.
double ReadPitch(const XmlElement& joint) {
  const auto old = joint.Content("thread_pitch"), pitch = joint.Content("screw_thread_pitch");
  const auto& given = pitch ? pitch : old;
  if (!given) joint.Fail("no pitch", "<screw_thread_pitch> or <thread_pitch>");
  const double value = given->Number();
  if (value == 0.0) given->Fail("a pitch that is not 0");
  return pitch ? value / (2.0 * std::numbers::pi) : -1.0 / value;
}

/// An element that couples joints, read after all joints.
struct Coupling {
  XmlElement element;
  const SdfScope* scope;
  int follower = -1;
};
struct Couplings {
  std::vector<Coupling> mimics, gearboxes;
};

/// Returns the body that a parent or child moves with, and its pose in ground axes.
FrameOn EndOf(const XmlElement& side, const SdfScope& scope) {
  const XmlValue name = side.Content();
  if (name.Name() == kWorld) return {};
  const auto [owner, link] = scope.LinkOf(name.text(), side);
  if (owner == nullptr) return {};
  const int body = scope.draft->BodyNamed(owner->prefix + link, name);
  return {body, scope.draft->at_rest[body]};
}

/// Returns the axis in the joint's frame; before 1.5 it was given in the model's frame.
Vector3d ReadAxis(const XmlElement& axis, const SdfScope& scope, const Placement& X_model_joint) {
  Vector3d xyz = Vector3d::UnitZ();
  std::string frame;
  bool in_joint = scope.minor >= 5;
  if (const auto given = axis.Child("xyz")) {
    xyz = scope.draft->Vector(given->Content(), "d");
    if (!(xyz.norm() > 0.0)) given->Fail("an axis of length 0", "one that is not zero");
    if (const auto expressed = given->Filled("expressed_in")) {
      frame = expressed->Name();
      in_joint = false;
    }
  }
  if (BoolOr(axis.Content("use_parent_model_frame"))) in_joint = false;
  if (!in_joint) return X_model_joint.q.conjugate() * (scope.Resolve(frame, axis).q * xyz);
  if (scope.is_urdf() && !(X_model_joint.q * xyz).isApprox(xyz, kSameAxis)) {
    scope.draft->Note(
        axis, "in axes of the joint, as in SDF 1.11; before SDF 1.5, axes were the model's");
  }
  return xyz;
}

void NoteLimits(const XmlElement& axis, ImportDraft* draft) {
  const auto limit = axis.Child("limit");
  if (!limit) return;
  bool ends = false;
  for (const char* name : {"lower", "upper"}) {
    const auto bound = limit->Content(name);
    if (!bound || bound->text().find("inf") != std::string::npos) continue;
    ends = ends || std::abs(bound->Number()) < kNoLimit;
  }
  limit->Ignore();
  if (ends) draft->DropWhole(*limit, kNoEnds, true);
}

/// Reads spring and damper of one axis; `has_one`: the joint has only this axis.
void ReadDynamics(const XmlElement& axis, bool has_one, ImportDraft* draft) {
  NoteLimits(axis, draft);
  const auto dynamics = axis.Child("dynamics");
  if (!dynamics) return;
  const auto number = [&](const char* name, const Range& range) {
    return NumberOr(dynamics->Content(name), 0.0, range);
  };
  const double c = number("damping", kNotNegative), k = number("spring_stiffness", kNotNegative);
  const double rest = number("spring_reference", {}), friction = number("friction", {});
  if (friction != 0.0) draft->Drop(*dynamics, "friction", kDryFriction);
  if (has_one) {
    draft->AddSpringAndDamper(k, rest, c);
  } else if (c > 0.0 || k > 0.0) {
    draft->Note(*dynamics, "dropped: only joints with one coordinate have springs and dampers",
                true);
  }
}

/// Sets the start of a joint: a coordinate for each of its own axes, 0 by default.
void ReadStart(const std::vector<XmlElement>& axes, std::size_t num_own, ImportDraft* draft) {
  std::vector<double> values(num_own);
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const auto start = axes[i].Child("initial_position");
    const double value = start ? start->Content().Number() : 0.0;
    if (i < num_own) {
      values[i] = value;
    } else if (value != 0.0) {
      draft->Note(*start, "dropped: the joint has no coordinate of this axis", true);
    }
  }
  const bool moves = std::ranges::any_of(values, [](double value) { return value != 0.0; });
  if (moves) draft->description.initial.coordinates.push_back({draft->last_joint(), values});
}

/// Reads dynamics, mimics and start of the joint that was added last. Its own axes come first.
void ReadAxes(const std::vector<XmlElement>& axes, std::size_t num_own, const SdfScope& scope,
              Couplings* couplings) {
  ImportDraft* draft = scope.draft;
  if (num_own == 0) {
    for (const XmlElement& axis : axes) draft->DropWhole(axis, "joints of this type have no axis");
    return;
  }
  for (std::size_t i = 0; i < axes.size(); ++i) {
    ReadDynamics(axes[i], num_own == 1 && i == 0, draft);
    const auto mimic = axes[i].Child("mimic");
    if (mimic && i < num_own) couplings->mimics.push_back({*mimic, &scope, draft->last_joint()});
    if (mimic && i >= num_own) draft->DropWhole(*mimic, "the joint has no such axis", true);
  }
  ReadStart(axes, num_own, draft);
}

/// Reads a <joint> between links that are bodies already.
void ReadJoint(const XmlElement& element, const SdfScope& scope, Couplings* couplings) {
  ImportDraft* draft = scope.draft;
  const std::string name = element.RequiredName();
  using enum JointType;
  constexpr XmlChoice<std::optional<JointType>> kTypes[] = {
      {"revolute", kRevolute},   {"continuous", kRevolute}, {"prismatic", kPrismatic},
      {"screw", kHelical},       {"ball", kSpherical},      {"fixed", kWeld},
      {"universal", kUniversal}, {"revolute2", kUniversal}, {"gearbox", std::nullopt}};
  const auto known = element.Required("type", "a joint type").Choice(kTypes);
  const XmlElement parent = element.RequiredChild("parent");
  const XmlElement child = element.RequiredChild("child");
  if (!known) return couplings->gearboxes.push_back({element, &scope});
  JointType type = *known;
  const FrameOn P = EndOf(parent, scope);
  FrameOn Q = EndOf(child, scope);
  if (P.body == Q.body) {
    element.Fail("parent and child that are one body", "two different bodies");
  }
  const SdfFrame& frame = scope.frames.at(scope.FrameOf(name));
  const Placement X_model_joint = scope.Resolve(scope.FrameOf(name), element);
  const Placement X_rest = scope.at_rest * X_model_joint;
  // bit-identical to the file if the child is a link and not a frame on a link
  const auto named = scope.frames.find(frame.attached_to);
  const bool is_raw = frame.is_raw_to_child && Q.body != kGround && named != scope.frames.end() &&
                      named->second.element.tag() == "link";
  Placement X_QM = is_raw ? frame.raw : Q.X.Inverse() * X_rest;
  Placement X_PF = P.X.Inverse() * (is_raw ? Q.X * X_QM : X_rest);
  std::vector<XmlElement> axes = element.Children({"axis"});
  const auto axis = element.Child("axis"), axis2 = element.Child("axis2");
  const bool has_axis = TraitsOf(type).own_axis != '-' || type == kUniversal;
  if (has_axis && !axis) element.Fail("no <axis>", "one");
  Vector3d own = Vector3d::Zero();
  if (has_axis) own = ReadAxis(*axis, scope, X_model_joint);
  if (type == kUniversal && !axis2) element.Fail("no <axis2>", "one");
  if (axis2) axes.push_back(*axis2);
  if (type == kUniversal) {
    const Vector3d second = ReadAxis(*axis2, scope, X_model_joint);
    if (const auto q = UniversalAxes(own, second)) {
      X_QM.q = X_QM.q * *q;
      X_PF.q = X_PF.q * *q;
    } else {
      // two hinges, with a link without mass between them
      const int link = draft->AddLink(element, Q.body);
      draft
          ->AddJoint(draft->NameLater(scope.prefix + name), kRevolute, {link, X_QM}, {Q.body, X_QM})
          .axis = second;
      ReadAxes({*axis2}, 1, scope, couplings);
      type = kRevolute;
      Q.body = link;
      axes.pop_back();
    }
  }
  JointDescription& joint = draft->AddJoint(draft->NewJointName(element, scope.prefix + name), type,
                                            {P.body, X_PF}, {Q.body, X_QM});
  if (TraitsOf(type).own_axis != '-') joint.axis = own;
  if (type == kHelical) joint.parameter = ReadPitch(element);
  joint.cut = scope.is_urdf();
  if (const auto physics = element.Child("physics")) {
    const auto simbody = physics->Child("simbody");
    if (simbody && BoolOr(simbody->Content("must_be_loop_joint"))) joint.cut = true;
    physics->Ignore();
  }
  ReadAxes(axes, type == kUniversal ? 2 : has_axis ? 1 : 0, scope, couplings);
}

void ReadJoints(const SdfScope& scope, Couplings* couplings) {
  for (const XmlElement& joint : scope.joints) ReadJoint(joint, scope, couplings);
  if (scope.is_urdf()) return;
  for (const XmlElement& ball : scope.element.Children({kDrakeBall})) {
    scope.draft->AddBall(
        ball, [&](const XmlElement& side) { return EndOf(side, scope).body; },
        [](const XmlElement& point) { return point.Content(); });
  }
  for (const auto& [name, model] : scope.models) ReadJoints(*model, couplings);
}

void ReadMimic(const Coupling& coupling) {
  const XmlElement& mimic = coupling.element;
  ImportDraft* draft = coupling.scope->draft;
  const auto axis = mimic.Attribute("axis");
  const bool is_second = axis && axis->Choice<bool>({{"axis", false}, {"axis2", true}});
  const int leader =
      draft->JointNamed(mimic.Required("joint", "the name of a joint"), coupling.scope->prefix);
  const JointType type = draft->description.joints[leader].type;
  if (is_second && type != JointType::kUniversal) axis->Fail("axis: its joint has no second one");
  const double multiplier = NumberOr(mimic.Content("multiplier"), 1.0);
  const double offset = NumberOr(mimic.Content("offset"), 0.0);
  const double reference = NumberOr(mimic.Content("reference"), 0.0);
  draft->AddMimic(mimic, coupling.follower, {leader, multiplier}, offset - multiplier * reference);
}

/// Hinges and screws, by groups of bodies that are fixed together.
struct Turns {
  std::vector<int> groups;
  std::multimap<std::pair<int, int>, int> joints;

  explicit Turns(const MechanismDescription& d) : groups(FixedTogether(d)) {
    for (int j = 0; j < std::ssize(d.joints); ++j) {
      const JointDescription& joint = d.joints[j];
      if (joint.type != JointType::kRevolute && joint.type != JointType::kHelical) continue;
      joints.emplace(std::minmax({groups[joint.from.body], groups[joint.to.body]}), j);
    }
  }

  /// Returns the joint whose coordinate is the angle of a body from the reference body about an
  /// axis in ground axes, and their ratio, 1 or -1.
  CouplingDescription::Part Of(const XmlElement& side, const SdfScope& scope, const Vector3d& axis,
                               int reference) const {
    const ImportDraft& draft = *scope.draft;
    const int body = groups[EndOf(side, scope).body];
    const auto [first, last] = joints.equal_range(std::minmax({body, reference}));
    for (auto turn = first; turn != last && body != reference; ++turn) {
      const JointDescription& joint = draft.description.joints[turn->second];
      const JointSide& from = joint.from;
      const Vector3d own =
          draft.at_rest[from.body].q * (PoseOf(from).R * AxisAlignment(joint) * Vector3d::UnitZ());
      if (own.cross(axis).norm() > kSameAxis) continue;
      const bool turns_body = groups[from.body] == reference;
      return {turn->second, (own.dot(axis) > 0.0) == turns_body ? 1.0 : -1.0};
    }
    side.Fail(fmt::format("\"{}\", which no hinge or screw about this axis joins to the reference "
                          "body",
                          side.Content().text()),
              "one: the gearbox couples the coordinates of two such joints");
  }
};

/// SDFormat specification, joint/gearbox_reference_body: theta_1 is the angle from the reference
/// body to the parent about <axis>, theta_2 to the child about <axis2>, and
/// theta_2 = -gearbox_ratio theta_1. Gazebo verifies this sign (gazebo-classic,
/// test/integration/joint_gearbox.cc). The angles are coordinates of other joints.
void ReadGearbox(const XmlElement& element, const SdfScope& scope, const Turns& turns) {
  ImportDraft* draft = scope.draft;
  const auto given = element.Content("gearbox_ratio");
  const double ratio = NumberOr(given, 1.0);
  if (ratio == 0.0) given->Fail("a ratio that is not 0");
  const int reference =
      turns.groups[EndOf(element.RequiredChild("gearbox_reference_body"), scope).body];
  const XmlElement axis = element.RequiredChild("axis");
  const auto axis2 = element.Child("axis2");
  if (!axis2) draft->Note(element, "no <axis2>: the angle of the child is about <axis> too");
  const Placement X = scope.Resolve(scope.FrameOf(element.RequiredName()), element);
  CouplingDescription::Part parts[2];  // joints, and their coordinates per theta
  for (const auto& [side, about, part] :
       {std::tuple{"parent", axis, &parts[0]}, {"child", axis2.value_or(axis), &parts[1]}}) {
    const Vector3d direction = (scope.at_rest * X).q * ReadAxis(about, scope, X).normalized();
    *part = turns.Of(element.RequiredChild(side), scope, direction, reference);
    ReadDynamics(about, false, draft);
  }
  if (const auto physics = element.Child("physics")) physics->Ignore();
  draft->AddFollower(element, scope.prefix + element.RequiredName(), parts[1].joint,
                     {parts[0].joint, -ratio * parts[0].ratio * parts[1].ratio}, 0.0);
}

/// Adds the joints of a scope and its models, then couplings. Those of a URDF robot close loops.
void ReadSdfJoints(const SdfScope& scope) {
  Couplings couplings;
  ReadJoints(scope, &couplings);
  for (const Coupling& mimic : couplings.mimics) ReadMimic(mimic);
  if (!couplings.gearboxes.empty()) {
    const Turns turns(scope.draft->description);
    for (const Coupling& one : couplings.gearboxes) ReadGearbox(one.element, *one.scope, turns);
  }
  PlaceFollowers(scope.draft);
}

}  // namespace

void ReadSdf(const XmlElement& root, ImportDraft* draft) {
  const int minor = VersionOf(root);
  const auto world = root.Child("world");
  const XmlElement& top = world ? *world : root;
  RefuseIncludes(root);
  RefuseIncludes(top);
  if (world && !root.Children({"model"}).empty()) {
    root.Fail("a <world> and a <model> beside it", "one of the two");
  }
  const std::vector<XmlElement> models = top.Children({"model"});
  if (models.empty()) top.Fail("no <model>", "at least one");
  SdfScope scope{.element = top, .draft = draft, .minor = minor};
  if (const auto gravity = GravityOf(scope)) {
    draft->description.gravity = gravity->Vector();
  } else {
    draft->AssumeGravity(top, kSdfGravity);
  }
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
  SdfScope scope{.element = robot, .draft = draft, .minor = 11};
  for (int i = 1; i < std::ssize(draft->at_rest); ++i) {
    const XmlElement& link = draft->element(i);
    scope.Add(link.RequiredName(), {link, draft->at_rest[i]});
  }
  scope.joints = joints;
  for (const XmlElement& joint : joints) ReadName(joint, &scope);
  ReadSdfJoints(scope);
}

}  // namespace loopbench::harness
