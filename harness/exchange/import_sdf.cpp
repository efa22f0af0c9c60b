// SDF (sdformat.org, versions 1.4 to 1.12).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "harness/exchange/import_draft.h"
#include "harness/exchange/solids.h"

namespace loopbench::harness {

namespace {

using Eigen::Vector3d;

constexpr int kFirstVersion = 4, kLastVersion = 12;
constexpr double kSdfGravity = 9.8;     // [m/s^2]
constexpr double kSdfDensity = 1000.0;  // [kg/m^3]

constexpr DroppedReason kSdfReasons[] = {
    {"visual", "shapes do not move anything"},
    {"collision", "there is no contact"},
    {"sensor", "there are no sensors"},
    {"physics", "runs choose their own integrator and steps"},
    {"atmosphere enable_wind", "there is no medium"},
    {"wind fluid_added_mass", "there is no medium", true},
    {"velocity_decay", "there is no medium: a force would have to say it", true},
    {"kinematic", "bodies move as forces make them", true},
    {"mimic", "no joint follows another: a freedom more than in the file", true},
    {"plugin", "there are no plugins", true},
    {"state", "the start is that of the poses", true},
    {"actor", "actors are no mechanism"},
    {"population", "it makes models while it runs", true},
    // without influence on the motion
    {"audio_source audio_sink light projector particle_emitter battery scene gui audio "
     "magnetic_field spherical_coordinates self_collide allow_auto_disable must_be_base_link "
     "road gripper link@name model@canonical_link sdf@version",
     ""}};

constexpr double kPerpendicular = 1e-9;  // cosine tolerance for nine digits
constexpr double kNoLimit = 1e15;        // the defaults are 1e16 and infinity
constexpr const char* kSdfWorld = "world";
constexpr std::string_view kWithin = "::";

/// An element with a pose: a link, joint, frame or nested model.
struct SdfFrame {
  XmlElement element;
  Placement raw = {};            ///< as given in the file
  std::string relative_to = "";  ///< a name in the same scope; "" for the scope's own frame
  std::string attached_to = "";  ///< for frames and joints: the name that they move with
  bool is_raw_to_child = false;  ///< for joints: raw is in the frame of the child
};

/// A world or a model: its named elements, each in its own frame.
class SdfScope {
 public:
  SdfScope(XmlElement element_, std::string prefix_, bool is_static_)
      : element(std::move(element_)), prefix(std::move(prefix_)), is_static(is_static_) {}

  XmlElement element;
  std::string prefix;  ///< of names of bodies and joints: "arm::"
  bool is_static;
  std::map<std::string, SdfFrame> frames;
  std::map<std::string, std::unique_ptr<SdfScope>> models;  ///< nested; each has a frame too
  Placement at_rest;                                        ///< in ground axes

  /// A link's scope and its name there; no scope for the world.
  using Link = std::pair<const SdfScope*, std::string>;

  /// Refuses a name that is in use here.
  void Add(const std::string& name, SdfFrame frame) {
    const auto [known, is_new] = frames.emplace(name, frame);
    if (is_new) return;
    frame.element.Fail(
        fmt::format("a second \"{}\"", name),
        fmt::format("a name that is not in use (line {} has it)", known->second.element.line()));
  }

  /// Returns the pose of a frame in this scope's frame. `user`: the referring element.
  Placement Resolve(const std::string& name, const XmlElement& user) const {
    // chain of relative frames, up to a known one
    std::vector<std::pair<std::string, Placement>> chain;
    Placement X;
    std::string here = name;
    while (!IsOwn(here)) {
      if (const auto known = resolved_.find(here); known != resolved_.end()) {
        X = known->second;
        break;
      }
      // without a cycle, a chain has at most each frame and a name within each model
      if (chain.size() > 2 * frames.size()) {
        user.Fail("frames that are relative to each other", "no cycle");
      }
      std::string rest, next = here.substr(0, here.find(kWithin));
      if (const SdfScope* nested = NestedScope(here, &rest)) {
        chain.emplace_back(here, nested->Resolve(rest, user));
      } else {
        const SdfFrame& frame = FrameNamed(here, user);
        chain.emplace_back(here, frame.raw);
        next = frame.relative_to;
      }
      here = next;
    }
    for (auto link = chain.rbegin(); link != chain.rend(); ++link) {
      X = X * link->second;
      resolved_.emplace(link->first, X);
    }
    return X;
  }

  /// Returns the link that a link, frame or model moves with.
  Link LinkOf(const std::string& name, const XmlElement& user) const {
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
        const std::vector<XmlElement> links = element.Children("link");
        if (canonical) {
          here = canonical->text();
        } else if (links.empty()) {
          user.Fail(fmt::format("the model of \"{}\" without a link", name), "one");
        } else {
          here = links[0].RequiredName();
        }
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

 private:
  bool is_world() const { return element.tag() != "model"; }
  bool IsOwn(const std::string& name) const {
    return name.empty() || name == "__model__" || (is_world() && name == kSdfWorld);
  }

  const SdfFrame& FrameNamed(const std::string& name, const XmlElement& user) const {
    const auto found = frames.find(name);
    if (found == frames.end()) {
      user.Fail(fmt::format("the frame \"{}\", which is not there", name),
                "a link, joint, frame or nested model of the same model");
    }
    return found->second;
  }

  /// Splits "arm::hand" into the model "arm" and the name "hand".
  const SdfScope* NestedScope(const std::string& name, std::string* rest) const {
    const std::size_t cut = name.find(kWithin);
    if (cut == std::string::npos) return nullptr;
    const auto found = models.find(name.substr(0, cut));
    if (found == models.end()) return nullptr;
    *rest = name.substr(cut + kWithin.size());
    return found->second.get();
  }

  // results, so that a chain of frames is followed once
  mutable std::map<std::string, Placement> resolved_;
  mutable std::map<std::string, Link> links_;
};

/// The body that a parent or child moves with, and its pose in ground axes.
struct JointEnd {
  int body = kGround;
  Placement at_rest;
};

/// Returns axes with x along the first axis, y along the second.
Eigen::Quaterniond UniversalAxes(const XmlElement& joint, Vector3d first, Vector3d second) {
  first.normalize();
  second.normalize();
  if (std::abs(first.dot(second)) > kPerpendicular) {
    joint.Fail(fmt::format("axes {:.6g} degrees apart",
                           std::acos(first.dot(second)) * 180.0 / std::numbers::pi),
               "perpendicular ones: others need a body with mass between them");
  }
  Eigen::Matrix3d R;
  R << first, second, first.cross(second);
  return Eigen::Quaterniond(R);
}

/// Returns the advance per angle [m/rad]. thread_pitch is in rad/m and positive for a left-handed
/// thread; screw_thread_pitch, from 1.10 on, in m per turn and positive for a right-handed one.
double ReadPitch(const XmlElement& joint) {
  const auto old = joint.Content("thread_pitch"), pitch = joint.Content("screw_thread_pitch");
  const double turns = NumberOr(old, 0.0);
  if (pitch) return pitch->Number() / (2.0 * std::numbers::pi);
  if (!old) joint.Fail("no pitch", "<screw_thread_pitch> or <thread_pitch>");
  if (turns == 0.0) old->element().Fail("a pitch of 0 rad/m", "one that is not 0");
  return -1.0 / turns;
}

void RefuseIncludes(const XmlElement& element) {
  for (const XmlElement& include : element.Children("include")) {
    include.Fail("a model in another file", "all in one file (gz sdf -p FILE writes it)");
  }
}

class SdfReader {
 public:
  explicit SdfReader(ImportDraft* draft) : draft_(draft) {}

  void Read(const XmlElement& root) {
    ReadVersion(root.Required("version", "1.4 to 1.12"));
    const auto world = root.Child("world");
    RefuseIncludes(root);
    const XmlElement& top = world ? *world : root;
    if (world && !root.Children("model").empty()) {
      root.Fail("a <world> and a <model> beside it", "one of the two");
    }
    const std::vector<XmlElement> models = top.Children("model");
    if (models.empty()) top.Fail("no <model>", "at least one");
    if (const auto gravity = world ? world->Content("gravity") : std::nullopt) {
      draft_->description.gravity = gravity->Vector();
    } else {
      draft_->AssumeGravity(top, kSdfGravity);
    }
    SdfScope scope(top, "", false);
    ReadNames(&scope);
    const auto name = world ? world->Attribute("name") : std::nullopt;
    if (models.size() == 1) {
      // names within the only model need no model prefix
      SdfScope& only = *scope.models.begin()->second;
      draft_->description.name = models[0].RequiredName();
      Shorten(&only, only.prefix.size());
    } else if (name) {
      draft_->description.name = name->Name();
    }
    ReadLinks(&scope);
    ReadJoints(scope);
    draft_->NoteUnread(kSdfReasons);
  }

 private:
  void ReadVersion(const XmlValue& value) {
    for (minor_ = kFirstVersion; minor_ <= kLastVersion; ++minor_) {
      if (value.text() == fmt::format("1.{}", minor_)) return;
    }
    value.Fail("a version from 1.4 to 1.12");
  }

  static void Shorten(SdfScope* scope, std::size_t length) {
    scope->prefix = scope->prefix.substr(length);
    for (auto& [name, model] : scope->models) Shorten(model.get(), length);
  }

  /// Reads the <pose> of an element and its `relative_to`.
  SdfFrame ReadPose(const XmlElement& element) const {
    SdfFrame frame{element};
    const auto pose = element.Child("pose");
    if (!pose) return frame;
    if (const auto old = pose->Filled("frame")) {
      old->Fail("none: what it means was said only from 1.7 on, as relative_to");
    }
    if (const auto relative = pose->Filled("relative_to")) {
      if (minor_ < 7) relative->Fail("none before version 1.7");
      frame.relative_to = relative->Name();
    }
    const bool in_degrees = BoolOr(pose->Attribute("degrees"));
    const auto format = pose->Attribute("rotation_format");
    const bool quaternion =
        format && format->Choice<bool>({{"euler_rpy", false}, {"quat_xyzw", true}});
    const XmlValue content = pose->Content();
    if (content.text().empty()) return frame;
    const std::vector<double> p = draft_->Numbers(content, quaternion   ? "nnnr"
                                                           : in_degrees ? "nnnnnn"
                                                                        : "nnnaaa");
    frame.raw.p = {p[0], p[1], p[2]};
    if (quaternion) {
      frame.raw.q = UnitQuaternion(content, {p[6], p[3], p[4], p[5]});
    } else {
      frame.raw.q = FromRollPitchYaw((in_degrees ? kDegree : 1.0) * Vector3d(p[3], p[4], p[5]));
    }
    return frame;
  }

  /// Reads all names of a world or model, including nested models.
  void ReadNames(SdfScope* scope) const {
    const XmlElement& element = scope->element;
    RefuseIncludes(element);
    for (const char* tag : {"link", "frame", "joint"}) {
      for (const XmlElement& child : element.Children(tag)) {
        SdfFrame frame = ReadPose(child);
        if (child.tag() == "frame") {
          if (const auto attached = child.Attribute("attached_to")) {
            frame.attached_to = attached->text();
          }
        } else if (child.tag() == "joint") {
          const XmlValue moved = child.RequiredChild("child").Content();
          if (moved.Name() == kSdfWorld) {
            moved.Fail(
                "a link, frame or nested model: the world is no child, it can be the <parent>");
          }
          frame.attached_to = moved.text();
        }
        if (frame.relative_to.empty()) {
          frame.relative_to = frame.attached_to;
          frame.is_raw_to_child = child.tag() == "joint";
        }
        scope->Add(child.RequiredName(), std::move(frame));
      }
    }
    for (const XmlElement& child : element.Children("model")) {
      const std::string name = child.RequiredName();
      if (const auto placement = child.Filled("placement_frame")) {
        placement->Fail("none: poses are those of the model's frame");
      }
      const auto fixed = child.Content("static");
      const bool is_static = scope->is_static || BoolOr(fixed);
      scope->Add(name, ReadPose(child));
      auto model = std::make_unique<SdfScope>(child, scope->prefix + name + "::", is_static);
      ReadNames(model.get());
      scope->models.emplace(name, std::move(model));
    }
  }

  /// Sets poses of models and links, and adds links as bodies.
  void ReadLinks(SdfScope* scope) const {
    for (const XmlElement& child : scope->element.Children("link")) {
      const std::string name = child.RequiredName();
      const int body = draft_->AddBody(child, scope->prefix + name);
      const Placement X = scope->at_rest * scope->Resolve(name, child);
      draft_->at_rest[body] = X;
      ReadLink(child, body, scope->is_static);
      if (scope->is_static) draft_->Fix(kGround, X, body, " fixed");
    }
    for (auto& [name, model] : scope->models) {
      model->at_rest = scope->at_rest * scope->Resolve(name, model->element);
      ReadLinks(model.get());
    }
  }

  /// Reads <inertial> and the other properties of a link.
  void ReadLink(const XmlElement& element, int index, bool is_static) const {
    const bool has_weight = BoolOr(element.Content("gravity"), true);
    if (!has_weight && !is_static) draft_->AddLift(index, 1.0);
    const auto kinematic = element.Child("kinematic");
    if (kinematic && kinematic->Content().Bool()) {
      draft_->Note(*kinematic, "dropped: bodies move as forces make them", true);
    }
    const auto inertial = element.Child("inertial");
    if (is_static) {
      if (inertial) inertial->Ignore();
      return;  // merged with the ground
    }
    if (inertial && BoolOr(inertial->Attribute("auto"))) {
      draft_->ReadMassLater(index, [reader = *this, element, inertial = *inertial, index] {
        reader.ReadShapes(element, inertial, index);
      });
      inertial->Ignore();
      for (const XmlElement& collision : element.Children("collision")) {
        draft_->DropWhole(collision, "only its mass matters");
      }
      return;
    }
    BodyDescription& body = draft_->description.bodies[index];
    body.mass = 1.0;
    body.inertia.setIdentity();
    if (!inertial) {
      draft_->Note(element, "no <inertial>: 1 kg and 1 kg m^2, the defaults of SDF");
      return;
    }
    body.mass = NumberOr(inertial->Content("mass"), 1.0, kNotNegative);
    if (const auto inertia = inertial->Child("inertia")) {
      body.inertia = InertiaOf([&](const char* name, bool is_moment) {
        return NumberOr(inertia->Content(name), is_moment ? 1.0 : 0.0);
      });
    }
    const SdfFrame pose = ReadPose(*inertial);
    if (!pose.relative_to.empty() && pose.relative_to != element.RequiredName()) {
      inertial->RequiredChild("pose").Required("relative_to", "").Fail("none, or its own link");
    }
    body.com = pose.raw.p;
    body.inertia = InTurnedAxes(pose.raw.q, body.inertia);
  }

  /// Computes the mass of a link from its collision shapes.
  void ReadShapes(const XmlElement& element, const XmlElement& inertial, int index) const {
    const double density = NumberOr(inertial.Content("density"), kSdfDensity, kPositive);
    std::vector<PlacedSolid> parts;
    for (const XmlElement& collision : element.Children("collision")) {
      const XmlElement geometry = collision.RequiredChild("geometry");
      PlacedSolid part;
      part.solid = ShapeIn(geometry);
      const SdfFrame pose = ReadPose(collision);
      if (!pose.relative_to.empty() && pose.relative_to != element.RequiredName()) {
        collision.RequiredChild("pose").Required("relative_to", "").Fail("none, or its own link");
      }
      part.X = pose.raw;
      part.mass = part.solid.volume * NumberOr(collision.Content("density"), density, kPositive);
      parts.push_back(part);
    }
    const BodyDescription sum = SumOf(parts);
    if (!(sum.mass > 0.0)) inertial.Fail("auto without a <collision>", "one with a volume");
    BodyDescription& body = draft_->description.bodies[index];
    body.mass = sum.mass;
    body.com = sum.com;
    body.inertia = sum.inertia;
  }

  static Solid ShapeIn(const XmlElement& geometry) {
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

  static Solid MeshIn(const XmlElement& shape) {
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

  void ReadJoints(const SdfScope& scope) const {
    for (const XmlElement& joint : scope.element.Children("joint")) ReadJoint(joint, scope);
    for (const auto& [name, model] : scope.models) ReadJoints(*model);
  }

  /// Reads a <joint> between links that are bodies already.
  void ReadJoint(const XmlElement& element, const SdfScope& scope) const {
    const std::string name = element.RequiredName();
    const auto known = element.Required("type", "a joint type")
                           .Choice<std::optional<JointType>>({{"revolute", JointType::kRevolute},
                                                              {"continuous", JointType::kRevolute},
                                                              {"prismatic", JointType::kPrismatic},
                                                              {"screw", JointType::kHelical},
                                                              {"ball", JointType::kSpherical},
                                                              {"fixed", JointType::kWeld},
                                                              {"universal", JointType::kUniversal},
                                                              {"revolute2", JointType::kUniversal},
                                                              {"gearbox", std::nullopt}});
    const XmlElement parent = element.RequiredChild("parent");
    const XmlElement child = element.RequiredChild("child");
    if (!known) {
      return draft_->DropWhole(element, "no joint follows another: a freedom more than in the file",
                               true);
    }
    const JointType type = *known;
    const bool is_universal = type == JointType::kUniversal;
    const JointEnd P = EndOf(parent, scope), Q = EndOf(child, scope);
    if (P.body == Q.body) {
      element.Fail("parent and child that are one body", "two different bodies");
    }
    const SdfFrame& frame = scope.frames.at(name);
    const Placement X_model_joint = scope.Resolve(name, element);
    const Placement X_rest = scope.at_rest * X_model_joint;
    // bit-identical to the file if the child is a link and not a frame on a link
    const auto named = scope.frames.find(frame.attached_to);
    const bool is_raw = frame.is_raw_to_child && Q.body != kGround && named != scope.frames.end() &&
                        named->second.element.tag() == "link";
    Placement X_QM = is_raw ? frame.raw : Q.at_rest.Inverse() * X_rest;
    Placement X_PF = P.at_rest.Inverse() * (is_raw ? Q.at_rest * X_QM : X_rest);
    const auto axis = element.Child("axis"), axis2 = element.Child("axis2");
    const bool has_own_axis = TraitsOf(type).own_axis != '-';
    const bool has_axis = has_own_axis || is_universal;
    if (has_axis && !axis) element.Fail("no <axis>", "one");
    Vector3d own = Vector3d::Zero();
    if (has_axis) own = ReadAxis(*axis, scope, X_model_joint);
    if (is_universal) {
      if (!axis2) element.Fail("no <axis2>", "one");
      const Eigen::Quaterniond q =
          UniversalAxes(element, own, ReadAxis(*axis2, scope, X_model_joint));
      X_QM.q = X_QM.q * q;
      X_PF.q = X_PF.q * q;
    }
    JointDescription& joint = draft_->AddJoint(draft_->NewJointName(element, scope.prefix + name),
                                               type, P.body, X_PF, Q.body, X_QM);
    if (has_own_axis) joint.axis = own;
    if (type == JointType::kHelical) joint.parameter = ReadPitch(element);
    if (const auto physics = element.Child("physics")) {
      const auto simbody = physics->Child("simbody");
      joint.cut = simbody && BoolOr(simbody->Content("must_be_loop_joint"));
      physics->Ignore();
    }
    // the joint's own axes come first
    std::vector<XmlElement> axes;
    for (const auto& one : {axis, axis2}) {
      if (one) axes.push_back(*one);
    }
    const std::size_t num_own = is_universal ? 2 : has_axis ? 1 : 0;
    for (std::size_t i = 0; i < axes.size(); ++i) ReadDynamics(axes[i], num_own == 1 && i == 0);
    ReadStart(axes, num_own);
  }

  JointEnd EndOf(const XmlElement& side, const SdfScope& scope) const {
    const std::string name = side.Content().Name();
    if (name == kSdfWorld) return {};
    const auto [owner, link] = scope.LinkOf(name, side);
    if (owner == nullptr) return {};
    const int body = draft_->BodyNamed(owner->prefix + link, side);
    return {body, draft_->at_rest[body]};
  }

  /// Returns the axis in the joint's frame; before 1.5 it was given in the model's frame.
  Vector3d ReadAxis(const XmlElement& axis, const SdfScope& scope,
                    const Placement& X_model_joint) const {
    Vector3d xyz = Vector3d::UnitZ();
    std::string frame;
    bool in_joint = minor_ >= 5;
    if (const auto given = axis.Child("xyz")) {
      xyz = draft_->Vector(given->Content(), "d");
      if (!(xyz.norm() > 0.0)) given->Fail("an axis of length 0", "one that is not zero");
      if (const auto expressed = given->Filled("expressed_in")) {
        frame = expressed->Name();
        in_joint = false;
      }
    }
    if (BoolOr(axis.Content("use_parent_model_frame"))) in_joint = false;
    if (in_joint) return xyz;
    return X_model_joint.q.conjugate() * (scope.Resolve(frame, axis).q * xyz);
  }

  /// Reads spring and damper of one axis; `has_one`: the joint has only this axis.
  void ReadDynamics(const XmlElement& axis, bool has_one) const {
    NoteLimits(axis);
    const auto dynamics = axis.Child("dynamics");
    if (!dynamics) return;
    const auto number = [&](const char* name, const Range& range) {
      return NumberOr(dynamics->Content(name), 0.0, range);
    };
    const double c = number("damping", kNotNegative), k = number("spring_stiffness", kNotNegative);
    const double rest = number("spring_reference", {}), friction = number("friction", {});
    if (friction != 0.0) draft_->Drop(*dynamics, "friction", kDryFriction);
    if (has_one) {
      draft_->AddSpringAndDamper(k, rest, c);
    } else if (c > 0.0 || k > 0.0) {
      draft_->Note(*dynamics, "dropped: only joints with one coordinate have springs and dampers",
                   true);
    }
  }

  void NoteLimits(const XmlElement& axis) const {
    const auto limit = axis.Child("limit");
    if (!limit) return;
    bool ends = false;
    for (const char* name : {"lower", "upper"}) {
      const auto bound = limit->Content(name);
      if (!bound || bound->text().find("inf") != std::string::npos) continue;
      ends = ends || std::abs(bound->Number()) < kNoLimit;
    }
    limit->Ignore();
    if (ends) draft_->DropWhole(*limit, kNoEnds, true);
  }

  /// Sets the start of a joint: a coordinate for each of its own axes, 0 by default.
  void ReadStart(const std::vector<XmlElement>& axes, std::size_t num_own) const {
    std::vector<double> values(num_own);
    for (std::size_t i = 0; i < axes.size(); ++i) {
      const auto start = axes[i].Child("initial_position");
      const double value = start ? start->Content().Number() : 0.0;
      if (i < num_own) {
        values[i] = value;
      } else if (value != 0.0) {
        draft_->Note(*start, "dropped: the joint has no coordinate of this axis", true);
      }
    }
    const bool moves = std::ranges::any_of(values, [](double value) { return value != 0.0; });
    if (moves) draft_->description.initial.coordinates.push_back({draft_->last_joint(), values});
  }

  ImportDraft* draft_;
  int minor_ = 0;  ///< of version 1.x
};

}  // namespace

void ReadSdf(const XmlElement& root, ImportDraft* draft) { SdfReader(draft).Read(root); }

}  // namespace loopbench::harness
