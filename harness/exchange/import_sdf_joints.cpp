// Joints of SDF.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "harness/exchange/import_sdf.h"

namespace loopbench::harness {

namespace {

using Eigen::Vector3d;

constexpr double kPerpendicular = 1e-9;  // cosine that rounding of nine digits leaves
constexpr double kNoLimit = 1e15;        // the defaults are 1e16 and infinity

/// The axis in the joint's frame. Before 1.5 it was in the model's.
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

/// Where a joint starts: a coordinate for each of its own axes, 0 where the file says none.
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

/// Spring and damper of one axis; `has_one`: it is the only one of the joint.
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

/// What both axes say but for their directions. Those that are the joint's own stand first:
/// `num_own` is 1 of most, 2 of universal joints, 0 of balls.
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

/// Advance per angle [m/rad]. thread_pitch is in rad/m, and positive for a left-handed thread;
/// screw_thread_pitch, from 1.10 on, in m per turn, and positive for a right-handed one.
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

/// The body that a parent or child moves with, and where it stands in ground axes.
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

/// x along the first axis, y along the second.
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
  // as the file says it, to the last bit, where the child is a link and no frame on one
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
