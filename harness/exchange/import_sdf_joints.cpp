// Joints of SDF, in SDF files and in <gazebo> elements of URDF: axes, springs, starts, couplings.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>

#include "harness/exchange/import_sdf.h"
#include "mechanism/description/joint_frames.h"

namespace loopbench::harness {

using Eigen::Vector3d;

namespace {

constexpr double kPerpendicular = 1e-9;  // cosine tolerance for nine digits
constexpr double kSameAxis = 1e-5;       // [rad]: axes of gearboxes repeat those of joints
constexpr double kNoLimit = 1e15;        // the defaults are 1e16 and infinity

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

/// Returns, for each body, a body that stands for all that are fixed to it.
std::vector<int> FixedTogether(const MechanismDescription& description) {
  std::vector<int> group(description.bodies.size());
  std::iota(group.begin(), group.end(), 0);
  const auto root = [&](int body) {
    while (group[body] != body) body = group[body] = group[group[body]];
    return body;
  };
  for (const JointDescription& joint : description.joints) {
    if (joint.type == JointType::kWeld) group[root(joint.from.body)] = root(joint.to.body);
  }
  for (int& body : group) body = root(body);
  return group;
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

}  // namespace

void SdfReader::ReadJoints(const SdfScope& scope) {
  for (const XmlElement& joint : scope.element.Children("joint")) ReadJoint(joint, scope);
  for (const XmlElement& ball : scope.element.Children(kDrakeBall)) {
    draft_->AddBall(
        ball, [&](const XmlElement& side) { return EndOf(side, scope).body; },
        [](const XmlElement& point) { return point.Content(); });
  }
  for (const auto& [name, model] : scope.models) ReadJoints(*model);
}

void SdfReader::ReadJoint(const XmlElement& element, const SdfScope& scope) {
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
    gearboxes_.push_back({element, &scope});
    return;
  }
  const JointType type = *known;
  const bool is_universal = type == JointType::kUniversal;
  const End P = EndOf(parent, scope), Q = EndOf(child, scope);
  if (P.body == Q.body) {
    element.Fail("parent and child that are one body", "two different bodies");
  }
  const SdfFrame& frame = scope.frames.at(FrameOf(name));
  const Placement X_model_joint = scope.Resolve(FrameOf(name), element);
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
  for (std::size_t i = 0; i < axes.size(); ++i) {
    ReadDynamics(axes[i], num_own == 1 && i == 0);
    const auto mimic = axes[i].Child("mimic");
    if (mimic && i < num_own) mimics_.push_back({*mimic, &scope, draft_->last_joint()});
    if (mimic && i >= num_own) draft_->DropWhole(*mimic, "the joint has no such axis", true);
  }
  ReadStart(axes, num_own);
}

SdfReader::End SdfReader::EndOf(const XmlElement& side, const SdfScope& scope) const {
  const std::string name = side.Content().Name();
  if (name == kSdfWorld) return {};
  const auto [owner, link] = scope.LinkOf(name, side);
  if (owner == nullptr) return {};
  const int body = draft_->BodyNamed(owner->prefix + link, side);
  return {body, draft_->at_rest[body]};
}

Vector3d SdfReader::ReadAxis(const XmlElement& axis, const SdfScope& scope,
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
  if (is_urdf_ && in_joint && !(X_model_joint.q * xyz).isApprox(xyz, kSameAxis)) {
    draft_->Note(axis,
                 "in axes of the joint, as in SDF 1.11; before SDF 1.5, axes were the model's");
  }
  if (in_joint) return xyz;
  return X_model_joint.q.conjugate() * (scope.Resolve(frame, axis).q * xyz);
}

void SdfReader::ReadDynamics(const XmlElement& axis, bool has_one) const {
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

void SdfReader::NoteLimits(const XmlElement& axis) const {
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

void SdfReader::ReadStart(const std::vector<XmlElement>& axes, std::size_t num_own) const {
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

void SdfReader::ReadCouplings() {
  for (const Coupling& mimic : mimics_) ReadMimic(mimic);
  if (gearboxes_.empty()) return;
  const auto& joints = draft_->description.joints;
  groups_ = FixedTogether(draft_->description);
  for (int j = 0; j < std::ssize(joints); ++j) {
    if (joints[j].type != JointType::kRevolute && joints[j].type != JointType::kHelical) continue;
    turns_.emplace(std::minmax({groups_[joints[j].from.body], groups_[joints[j].to.body]}), j);
  }
  for (const Coupling& gearbox : gearboxes_) ReadGearbox(gearbox.element, *gearbox.scope);
}

void SdfReader::ReadMimic(const Coupling& coupling) const {
  const XmlElement& mimic = coupling.element;
  const auto axis = mimic.Attribute("axis");
  const bool is_second = axis && axis->Choice<bool>({{"axis", false}, {"axis2", true}});
  const int leader =
      draft_->JointNamed(mimic.Required("joint", "the name of a joint"), coupling.scope->prefix);
  const JointType type = draft_->description.joints[leader].type;
  if (is_second && type != JointType::kUniversal) axis->Fail("axis: its joint has no second one");
  const double multiplier = NumberOr(mimic.Content("multiplier"), 1.0);
  const double offset = NumberOr(mimic.Content("offset"), 0.0);
  const double reference = NumberOr(mimic.Content("reference"), 0.0);
  draft_->AddMimic(mimic, coupling.follower, {leader, multiplier}, offset - multiplier * reference);
}

// SDFormat specification, joint/gearbox_reference_body: theta_1 is the angle from the reference
// body to the parent about <axis>, theta_2 to the child about <axis2>, and
// theta_2 = -gearbox_ratio theta_1. Gazebo verifies this sign (gazebo-classic,
// test/integration/joint_gearbox.cc). The angles are coordinates of other joints.
void SdfReader::ReadGearbox(const XmlElement& element, const SdfScope& scope) const {
  const auto given = element.Content("gearbox_ratio");
  const double ratio = NumberOr(given, 1.0);
  if (ratio == 0.0) given->Fail("a ratio that is not 0");
  const int reference = groups_[EndOf(element.RequiredChild("gearbox_reference_body"), scope).body];
  const XmlElement axis = element.RequiredChild("axis");
  const auto axis2 = element.Child("axis2");
  if (!axis2) draft_->Note(element, "no <axis2>: the angle of the child is about <axis> too");
  const Placement X = scope.Resolve(FrameOf(element.RequiredName()), element);
  CouplingDescription::Part parts[2];  // joints, and their coordinates per theta
  for (const auto& [side, about, part] :
       {std::tuple{"parent", axis, &parts[0]}, {"child", axis2.value_or(axis), &parts[1]}}) {
    const Vector3d direction = (scope.at_rest * X).q * ReadAxis(about, scope, X).normalized();
    *part = TurnOf(element.RequiredChild(side), scope, direction, reference);
    ReadDynamics(about, false);
  }
  if (const auto physics = element.Child("physics")) physics->Ignore();
  draft_->AddFollower(element, scope.prefix + element.RequiredName(), parts[1].joint,
                      {parts[0].joint, -ratio * parts[0].ratio * parts[1].ratio}, 0.0);
}

CouplingDescription::Part SdfReader::TurnOf(const XmlElement& side, const SdfScope& scope,
                                            const Vector3d& axis, int reference) const {
  const int body = groups_[EndOf(side, scope).body];
  const auto [first, last] = turns_.equal_range(std::minmax({body, reference}));
  for (auto turn = first; turn != last && body != reference; ++turn) {
    const JointDescription& joint = draft_->description.joints[turn->second];
    const JointSide& from = joint.from;
    const Vector3d own =
        draft_->at_rest[from.body].q * (PoseOf(from).R * AxisAlignment(joint) * Vector3d::UnitZ());
    if (own.cross(axis).norm() > kSameAxis) continue;
    const bool turns_body = groups_[from.body] == reference;
    return {turn->second, (own.dot(axis) > 0.0) == turns_body ? 1.0 : -1.0};
  }
  side.Fail(fmt::format("\"{}\", which no hinge or screw about this axis joins to the reference "
                        "body",
                        side.Content().text()),
            "one: the gearbox couples the coordinates of two such joints");
}

}  // namespace loopbench::harness
