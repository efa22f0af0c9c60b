#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "harness/exchange/import_draft.h"

namespace loopbench::harness {
// SDF (sdformat.org, versions 1.4 to 1.12): common parts.
//
// Internal to import_sdf*.cpp.

/// An element with a pose: a link, joint, frame or nested model.
struct SdfFrame {
  XmlElement element;
  Placement raw;                 ///< as given in the file
  std::string relative_to;       ///< a name in the same scope; "" for the scope's own frame
  std::string attached_to;       ///< for frames and joints: the name that they move with
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
  void Add(const std::string& name, SdfFrame frame);
  /// Returns the pose of a frame in this scope's frame. `user`: the referring element.
  Placement Resolve(const std::string& name, const XmlElement& user) const;
  /// Returns the link that a link, frame or model moves with.
  Link LinkOf(const std::string& name, const XmlElement& user) const;
  bool is_world() const { return element.tag() != "model"; }

 private:
  // results, so that a chain of frames is followed once
  mutable std::map<std::string, Placement> resolved_;
  mutable std::map<std::string, Link> links_;
};

struct SdfVersion {
  int minor = 0;  ///< of 1.x
};

/// Reads the <pose> of an element and its `relative_to`.
SdfFrame ReadSdfPose(const XmlElement& element, SdfVersion version, ImportDraft* draft);
/// Reads a <joint> between links that are bodies already, with their indices by full name.
void ReadSdfJoint(const XmlElement& element, const std::string& name, const SdfScope& scope,
                  SdfVersion version, ImportDraft* draft);
/// Reads <inertial> and the other properties of a link.
void ReadSdfLink(const XmlElement& element, int body, bool is_static, SdfVersion version,
                 ImportDraft* draft);

namespace {

constexpr int kFirstVersion = 4, kLastVersion = 12;
constexpr double kSdfGravity = 9.8;  // [m/s^2]

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

SdfVersion ReadVersion(const XmlElement& root) {
  const XmlValue value = root.Required("version", "1.4 to 1.12");
  const std::string& text = value.text();
  SdfVersion version;
  const bool first = text.starts_with("1.");
  const char* start = text.data() + (first ? 2 : 0);
  const auto [end, error] = std::from_chars(start, text.data() + text.size(), version.minor);
  const bool whole = first && error == std::errc() && end == text.data() + text.size();
  if (!whole || version.minor < kFirstVersion || version.minor > kLastVersion) {
    value.Fail("a version from 1.4 to 1.12");
  }
  return version;
}

void RefuseIncludes(const XmlElement& element) {
  for (const XmlElement& include : element.Children("include")) {
    include.Fail("a model in another file", "all in one file (gz sdf -p FILE writes it)");
  }
}

/// Returns the child of a joint.
XmlValue ReadChild(const XmlElement& joint) {
  const XmlValue child = joint.RequiredChild("child").Content();
  if (child.Name() == "world") {
    child.Fail("a link, frame or nested model: the world is no child, it can be the <parent>");
  }
  return child;
}

/// Reads all names of a world or model, including nested models.
void ReadNames(SdfScope* scope, SdfVersion version, ImportDraft* draft) {
  const XmlElement& element = scope->element;
  RefuseIncludes(element);
  for (const char* tag : {"link", "frame", "joint"}) {
    for (const XmlElement& child : element.Children(tag)) {
      SdfFrame frame = ReadSdfPose(child, version, draft);
      if (child.tag() == "frame") {
        if (const auto attached = child.Attribute("attached_to")) {
          frame.attached_to = attached->text();
        }
      } else if (child.tag() == "joint") {
        frame.attached_to = ReadChild(child).text();
      }
      if (frame.relative_to.empty()) {
        frame.relative_to = frame.attached_to;
        frame.is_raw_to_child = child.tag() == "joint";
      }
      scope->Add(child.Required("name", "a name").Name(), std::move(frame));
    }
  }
  for (const XmlElement& child : element.Children("model")) {
    const std::string name = child.Required("name", "a name").Name();
    if (const auto placement = child.Attribute("placement_frame")) {
      if (!placement->text().empty()) placement->Fail("none: poses are those of the model's frame");
    }
    const auto fixed = child.Child("static");
    const bool is_static = scope->is_static || (fixed && fixed->Content().Bool());
    scope->Add(name, ReadSdfPose(child, version, draft));
    auto model = std::make_unique<SdfScope>(child, scope->prefix + name + "::", is_static);
    ReadNames(model.get(), version, draft);
    scope->models.emplace(name, std::move(model));
  }
}

/// Sets poses of models and links, and adds links as bodies.
void ReadLinks(SdfScope* scope, SdfVersion version, ImportDraft* draft) {
  for (const XmlElement& child : scope->element.Children("link")) {
    const std::string name = child.Required("name", "a name").Name();
    const int body = draft->AddBody(child, scope->prefix + name);
    const Placement X = scope->at_rest * scope->Resolve(name, child);
    draft->at_rest[static_cast<std::size_t>(body)] = X;
    ReadSdfLink(child, body, scope->is_static, version, draft);
    if (!scope->is_static) continue;
    const std::string& body_name = draft->description.bodies[static_cast<std::size_t>(body)].name;
    draft->AddJoint(draft->NameLater(body_name + " fixed"), JointType::kWeld, kGround, X, body, {});
  }
  for (auto& [name, model] : scope->models) {
    model->at_rest = scope->at_rest * scope->Resolve(name, model->element);
    ReadLinks(model.get(), version, draft);
  }
}

void ReadJoints(const SdfScope& scope, SdfVersion version, ImportDraft* draft) {
  for (const XmlElement& joint : scope.element.Children("joint")) {
    const std::string name = joint.Required("name", "a name").Name();
    ReadSdfJoint(joint, scope.prefix + name, scope, version, draft);
  }
  for (const auto& [name, model] : scope.models) ReadJoints(*model, version, draft);
}

}  // namespace

void ReadSdfLink(const XmlElement& element, int index, bool is_static, SdfVersion version,
                 ImportDraft* draft) {
  BodyDescription& body = draft->description.bodies[static_cast<std::size_t>(index)];
  if (const auto gravity = element.Child("gravity")) {
    if (!gravity->Content().Bool() && !is_static) draft->AddLift(index, 1.0);
  }
  const auto kinematic = element.Child("kinematic");
  if (kinematic && kinematic->Content().Bool()) {
    draft->Note(*kinematic, "dropped: bodies move as forces make them", true);
  }
  const auto inertial = element.Child("inertial");
  if (is_static) {
    if (inertial) inertial->Ignore();
    return;  // merged with the ground
  }
  if (!inertial) {
    body.mass = 1.0;
    body.inertia.setIdentity();
    draft->Note(element, "no <inertial>: 1 kg and 1 kg m^2, the defaults of SDF");
    return;
  }
  if (const auto automatic = inertial->Attribute("auto"); automatic && automatic->Bool()) {
    draft->LeaveMass(index, *automatic);
    inertial->Ignore();
    return;
  }
  const auto number = [](const XmlElement& of, const char* name, double otherwise) {
    const auto child = of.Child(name);
    return child ? child->Content().Number() : otherwise;
  };
  const auto mass = inertial->Child("mass");
  body.mass = mass ? mass->Content().Number(kNotNegative) : 1.0;
  body.inertia.setIdentity();
  if (const auto inertia = inertial->Child("inertia")) {
    body.inertia = SymmetricMatrix(number(*inertia, "ixx", 1.0), number(*inertia, "iyy", 1.0),
                                   number(*inertia, "izz", 1.0), number(*inertia, "ixy", 0.0),
                                   number(*inertia, "ixz", 0.0), number(*inertia, "iyz", 0.0));
  }
  const SdfFrame pose = ReadSdfPose(*inertial, version, draft);
  if (!pose.relative_to.empty() && pose.relative_to != element.Required("name", "a name").text()) {
    inertial->RequiredChild("pose").Required("relative_to", "").Fail("none, or its own link");
  }
  body.com = pose.raw.p;
  body.inertia = InTurnedAxes(pose.raw.q, body.inertia);
}

void ReadSdf(const XmlElement& root, ImportDraft* draft) {
  const SdfVersion version = ReadVersion(root);
  const auto world = root.Child("world");
  RefuseIncludes(root);
  const XmlElement& top = world ? *world : root;
  if (world && !root.Children("model").empty()) {
    root.Fail("a <world> and a <model> beside it", "one of the two");
  }
  const std::vector<XmlElement> models = top.Children("model");
  if (models.empty()) top.Fail("no <model>", "at least one");
  if (const auto gravity = world ? world->Child("gravity") : std::nullopt) {
    draft->description.gravity = gravity->Content().Vector();
  } else {
    draft->AssumeGravity(top, kSdfGravity);
  }
  SdfScope scope(top, "", false);
  ReadNames(&scope, version, draft);
  if (models.size() == 1) {
    // names within the only model need no model prefix
    SdfScope& only = *scope.models.begin()->second;
    const std::string before = only.prefix;
    draft->description.name = models[0].Required("name", "a name").Name();
    const auto shorten = [&](auto&& self, SdfScope* one) -> void {
      one->prefix = one->prefix.substr(before.size());
      for (auto& [name, model] : one->models) self(self, model.get());
    };
    shorten(shorten, &only);
  } else if (world) {
    if (const auto name = world->Attribute("name")) draft->description.name = name->Name();
  }
  if (world) world->Attribute("name");
  ReadLinks(&scope, version, draft);
  ReadJoints(scope, version, draft);
  draft->NoteUnread(kSdfReasons);
}

// SDF frame semantics: poses and `attached_to`.

namespace {

constexpr std::string_view kOwn = "__model__";
constexpr std::string_view kSdfWorld = "world";
constexpr std::string_view kWithin = "::";

bool IsOwn(const std::string& name, const SdfScope& scope) {
  return name.empty() || name == kOwn || (scope.is_world() && name == kSdfWorld);
}

[[noreturn]] void FailToFind(const std::string& name, const XmlElement& user) {
  user.Fail(fmt::format("the frame \"{}\", which is not there", name),
            "a link, joint, frame or nested model of the same model");
}

/// Splits "arm::hand" into the model "arm" and the name "hand".
const SdfScope* NestedScope(const SdfScope& scope, const std::string& name, std::string* rest) {
  const std::size_t cut = name.find(kWithin);
  if (cut == std::string::npos) return nullptr;
  const auto found = scope.models.find(name.substr(0, cut));
  if (found == scope.models.end()) return nullptr;
  *rest = name.substr(cut + kWithin.size());
  return found->second.get();
}

}  // namespace

SdfFrame ReadSdfPose(const XmlElement& element, SdfVersion version, ImportDraft* draft) {
  SdfFrame frame{element, {}, "", ""};
  const auto pose = element.Child("pose");
  if (!pose) return frame;
  if (const auto old = pose->Attribute("frame"); old && !old->text().empty()) {
    old->Fail("none: what it means was said only from 1.7 on, as relative_to");
  }
  if (const auto relative = pose->Attribute("relative_to"); relative && !relative->text().empty()) {
    if (version.minor < 7) relative->Fail("none before version 1.7");
    frame.relative_to = relative->Name();
  }
  const auto degrees = pose->Attribute("degrees");
  const bool in_degrees = degrees && degrees->Bool();
  const auto format = pose->Attribute("rotation_format");
  const bool quaternion = format && format->Choice({"euler_rpy", "quat_xyzw"}) == 1;
  const XmlValue content = pose->Content();
  if (content.text().empty()) return frame;
  const std::vector<double> p = draft->Numbers(content, quaternion   ? "nnnr"
                                                        : in_degrees ? "nnnnnn"
                                                                     : "nnnaaa");
  frame.raw.p = {p[0], p[1], p[2]};
  if (quaternion) {
    frame.raw.q = UnitQuaternion(content, {p[6], p[3], p[4], p[5]});
  } else {
    frame.raw.q =
        FromRollPitchYaw((in_degrees ? kDegree : 1.0) * Eigen::Vector3d(p[3], p[4], p[5]));
  }
  return frame;
}

void SdfScope::Add(const std::string& name, SdfFrame frame) {
  const auto known = frames.find(name);
  if (known != frames.end()) {
    frame.element.Fail(
        fmt::format("a second \"{}\"", name),
        fmt::format("a name that is not in use (line {} has it)", known->second.element.line()));
  }
  frames.emplace(name, std::move(frame));
}

Placement SdfScope::Resolve(const std::string& name, const XmlElement& user) const {
  // chain of relative frames, up to a known one
  std::vector<std::pair<std::string, Placement>> chain;
  Placement X;
  std::string here = name;
  while (!IsOwn(here, *this)) {
    if (const auto known = resolved_.find(here); known != resolved_.end()) {
      X = known->second;
      break;
    }
    // without a cycle, a chain has at most each frame and a name within each model
    if (chain.size() > 2 * frames.size()) {
      user.Fail("frames that are relative to each other", "no cycle");
    }
    std::string rest, next = here.substr(0, here.find(kWithin));
    if (const SdfScope* nested = NestedScope(*this, here, &rest)) {
      chain.emplace_back(here, nested->Resolve(rest, user));
    } else {
      const auto found = frames.find(here);
      if (found == frames.end()) FailToFind(here, user);
      chain.emplace_back(here, found->second.raw);
      next = found->second.relative_to;
    }
    here = next;
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
    if (const SdfScope* nested = NestedScope(*this, here, &rest)) {
      link = nested->LinkOf(rest, user);
    } else if (IsOwn(here, *this) && is_world()) {
      link = Link{nullptr, ""};
    } else if (IsOwn(here, *this)) {
      // a model moves with its canonical link, by default the first one
      const auto canonical = element.Attribute("canonical_link");
      const std::vector<XmlElement> links = element.Children("link");
      if (canonical && !canonical->text().empty()) {
        here = canonical->text();
      } else if (links.empty()) {
        user.Fail(fmt::format("the model of \"{}\" without a link", name), "one");
      } else {
        here = links[0].Required("name", "a name").Name();
      }
    } else {
      const auto found = frames.find(here);
      if (found == frames.end()) FailToFind(here, user);
      const std::string tag = found->second.element.tag();
      if (tag == "link") link = Link{this, here};
      if (tag == "model") link = models.at(here)->LinkOf("", user);
      here = found->second.attached_to;
    }
  }
  for (const std::string& attached : chain) links_.emplace(attached, *link);
  return *link;
}

// Joints of SDF.

namespace {

using Eigen::Vector3d;

constexpr double kPerpendicular = 1e-9;  // cosine tolerance for nine digits
constexpr double kNoLimit = 1e15;        // the defaults are 1e16 and infinity

/// Returns the axis in the joint's frame; before 1.5 it was given in the model's frame.
Vector3d ReadAxis(const XmlElement& axis, const SdfScope& scope, const Placement& X_model_joint,
                  SdfVersion version, ImportDraft* draft) {
  Vector3d xyz = Vector3d::UnitZ();
  std::string frame;
  bool in_joint = version.minor >= 5;
  if (const auto given = axis.Child("xyz")) {
    xyz = draft->Vector(given->Content(), "d");
    if (!(xyz.norm() > 0.0)) given->Fail("an axis of length 0", "one that is not zero");
    if (const auto expressed = given->Attribute("expressed_in")) {
      if (!expressed->text().empty()) {
        frame = expressed->Name();
        in_joint = false;
      }
    }
  }
  if (const auto flag = axis.Child("use_parent_model_frame")) {
    if (flag->Content().Bool()) in_joint = false;
  }
  if (in_joint) return xyz;
  return X_model_joint.q.conjugate() * (scope.Resolve(frame, axis).q * xyz);
}

void NoteLimits(const XmlElement& axis, ImportDraft* draft) {
  const auto limit = axis.Child("limit");
  if (!limit) return;
  bool ends = false;
  for (const char* name : {"lower", "upper"}) {
    const auto bound = limit->Child(name);
    if (!bound) continue;
    const XmlValue value = bound->Content();
    const bool is_infinite = value.text().find("inf") != std::string::npos;
    ends = ends || (!is_infinite && std::abs(value.Number()) < kNoLimit);
  }
  limit->Ignore();
  if (ends) draft->Note(*limit, "dropped: joints turn and slide without ends", true);
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

/// Reads spring and damper of one axis; `has_one`: the joint has only this axis.
void ReadDynamics(const XmlElement& axis, bool has_one, ImportDraft* draft) {
  NoteLimits(axis, draft);
  const int joint = draft->last_joint();
  const auto dynamics = axis.Child("dynamics");
  if (!dynamics) return;
  const auto number = [&](const char* name, const Range& range) {
    const auto child = dynamics->Child(name);
    return child ? child->Content().Number(range) : 0.0;
  };
  const double c = number("damping", kNotNegative), k = number("spring_stiffness", kNotNegative);
  const double rest = number("spring_reference", {}), friction = number("friction", {});
  if (friction != 0.0) {
    draft->Note(*dynamics, "friction", "dropped: dry friction is no force of mechanism files",
                true);
  }
  if (!has_one && (c > 0.0 || k > 0.0)) {
    draft->Note(*dynamics, "dropped: only joints with one coordinate have springs and dampers",
                true);
    return;
  }
  if (k > 0.0) draft->description.forces.emplace_back(JointSpring{joint, k, rest, 0.0});
  if (c > 0.0) draft->description.forces.emplace_back(JointDamper{joint, c});
}

/// Reads all of both axes except their directions. The joint's own axes come first: `num_own` is
/// usually 1, 2 for universal joints, 0 for balls.
void ReadAxisForces(const std::optional<XmlElement>& axis, const std::optional<XmlElement>& axis2,
                    std::size_t num_own, ImportDraft* draft) {
  std::vector<XmlElement> axes;
  for (const auto& one : {axis, axis2}) {
    if (one) axes.push_back(*one);
  }
  for (std::size_t i = 0; i < axes.size(); ++i) {
    ReadDynamics(axes[i], num_own == 1 && i == 0, draft);
  }
  ReadStart(axes, num_own, draft);
}

/// Returns the advance per angle [m/rad]. thread_pitch is in rad/m and positive for a left-handed
/// thread; screw_thread_pitch, from 1.10 on, in m per turn and positive for a right-handed one.
double ReadPitch(const XmlElement& joint) {
  const auto old = joint.Child("thread_pitch");
  if (const auto pitch = joint.Child("screw_thread_pitch")) {
    if (old) old->Content().Number();
    return pitch->Content().Number() / (2.0 * std::numbers::pi);
  }
  if (!old) joint.Fail("no pitch", "<screw_thread_pitch> or <thread_pitch>");
  const double turns = old->Content().Number();
  if (turns == 0.0) old->Fail("a pitch of 0 rad/m", "one that is not 0");
  return -1.0 / turns;
}

const std::vector<std::string>& SdfTypes() {
  static const std::vector<std::string> names = {"revolute",  "continuous", "prismatic",
                                                 "screw",     "ball",       "fixed",
                                                 "universal", "revolute2",  "gearbox"};
  return names;
}

JointType TypeOfSdf(std::size_t index) {
  constexpr JointType kTypes[] = {
      JointType::kRevolute,  JointType::kRevolute, JointType::kPrismatic, JointType::kHelical,
      JointType::kSpherical, JointType::kWeld,     JointType::kUniversal, JointType::kUniversal};
  return kTypes[index];
}

/// The body that a parent or child moves with, and its pose in ground axes.
struct JointEnd {
  int body = kGround;
  Placement at_rest;
};

JointEnd EndOf(const XmlElement& side, const SdfScope& scope, const ImportDraft& draft) {
  const std::string name = side.Content().Name();
  if (name == "world") return {};
  const auto [owner, link] = scope.LinkOf(name, side);
  if (owner == nullptr) return {};
  const int body = draft.BodyNamed(owner->prefix + link, side);
  return {body, draft.at_rest[static_cast<std::size_t>(body)]};
}

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

}  // namespace

void ReadSdfJoint(const XmlElement& element, const std::string& name, const SdfScope& scope,
                  SdfVersion version, ImportDraft* draft) {
  const std::size_t index = element.Required("type", "a joint type").Choice(SdfTypes());
  const XmlElement parent = element.RequiredChild("parent"), child = element.RequiredChild("child");
  if (SdfTypes()[index] == "gearbox") {
    element.Ignore();
    draft->Note(element, "dropped: no joint follows another: a freedom more than in the file",
                true);
    return;
  }
  const JointEnd P = EndOf(parent, scope, *draft), Q = EndOf(child, scope, *draft);
  if (P.body == Q.body) element.Fail("parent and child that are one body", "two different bodies");
  const SdfFrame& frame = scope.frames.at(element.Required("name", "a name").Name());
  const Placement X_model_joint = scope.Resolve(element.Required("name", "a name").Name(), element);
  const Placement X_rest = scope.at_rest * X_model_joint;
  // bit-identical to the file if the child is a link and not a frame on a link
  const auto named = scope.frames.find(frame.attached_to);
  const bool is_raw = frame.is_raw_to_child && Q.body != kGround && named != scope.frames.end() &&
                      named->second.element.tag() == "link";
  Placement X_QM = is_raw ? frame.raw : Q.at_rest.Inverse() * X_rest;
  const JointType type = TypeOfSdf(index);
  Placement X_PF = P.at_rest.Inverse() * (is_raw ? Q.at_rest * X_QM : X_rest);
  const auto axis = element.Child("axis"), axis2 = element.Child("axis2");
  const bool has_axis = TraitsOf(type).own_axis != '-' || type == JointType::kUniversal;
  if (has_axis && !axis) element.Fail("no <axis>", "one");
  Vector3d own = Vector3d::Zero();
  if (axis && has_axis) own = ReadAxis(*axis, scope, X_model_joint, version, draft);
  if (type == JointType::kUniversal) {
    if (!axis2) element.Fail("no <axis2>", "one");
    const Eigen::Quaterniond q =
        UniversalAxes(element, own, ReadAxis(*axis2, scope, X_model_joint, version, draft));
    X_QM.q = X_QM.q * q;
    X_PF.q = X_PF.q * q;
  }
  JointDescription& joint =
      draft->AddJoint(draft->NewJointName(element, name), type, P.body, X_PF, Q.body, X_QM);
  if (TraitsOf(type).own_axis != '-') joint.axis = own;
  if (type == JointType::kHelical) joint.parameter = ReadPitch(element);
  if (const auto physics = element.Child("physics")) {
    const auto simbody = physics->Child("simbody");
    const auto loop = simbody ? simbody->Child("must_be_loop_joint") : std::nullopt;
    if (loop) joint.cut = loop->Content().Bool();
    physics->Ignore();
  }
  ReadAxisForces(axis, axis2, type == JointType::kUniversal ? 2 : has_axis ? 1 : 0, draft);
}

}  // namespace loopbench::harness
