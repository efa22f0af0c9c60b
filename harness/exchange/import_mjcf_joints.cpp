// Joints of MuJoCo: single ones, and several on a body as one Loopbench joint.
//
// MuJoCo's joints of a body act in sequence, each in axes moved by the previous joints. With
// X_i(q_i) the motion of joint i in body axes, the pose of the body in its parent is X_PB X_1 ..
// X_n. The set of reachable poses determines the Loopbench joint type.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "harness/exchange/import_mjcf.h"
#include "mechanism/algebra/symmetric_eigen.h"

namespace loopbench::harness {

namespace {

using Eigen::Vector3d;

/// Tolerance for parallel, perpendicular and intersecting axes: rounding in a file with nine
/// digits.
constexpr double kAligned = 1e-9;

void DropParts(const MjcfModel& model, const MjcfJoint& joint) {
  const XmlElement& own = joint.element.own();
  model.DropNonzero(joint.element, "armature", kNoRotors);
  model.DropNonzero(joint.element, "frictionloss", kDryFriction);
  model.NoteLimits(joint.element, kNoEnds);
  if (BoolOr(joint.element.Attribute("actuatorgravcomp")) &&
      (!model.settings.has_actuation || model.LimitsOf(joint.element, kEffortFlag, kEffortRange))) {
    model.draft->Drop(own, "actuatorgravcomp", "gravcomp acts whatever actuators may do");
  }
}

/// Returns the intersection of the axes of hinges; nothing if there is none.
std::optional<Vector3d> MeetingPoint(const std::vector<MjcfJoint>& hinges) {
  const auto at_first = [&](const MjcfJoint& hinge) {
    return hinge.position == hinges[0].position;
  };
  if (std::ranges::all_of(hinges, at_first)) return hinges[0].position;
  // least-squares point of the distances to all axes
  MatrixX<double> A = MatrixX<double>::Zero(3, 3), U(3, 3);
  VectorX<double> lambda(3);
  Vector3d b = Vector3d::Zero();
  double arms = 1.0;
  for (const MjcfJoint& hinge : hinges) {
    const Eigen::Matrix3d across =
        Eigen::Matrix3d::Identity() - hinge.axis * hinge.axis.transpose();
    A += across;
    b += across * hinge.position;
    arms += hinge.position.norm();
  }
  SymmetricEigen<double>(A, U, lambda);
  // axes 2e-7 rad apart have an eigenvalue of 2e-14; parallel axes have round-off
  const double least = 16.0 * std::numeric_limits<double>::epsilon() * lambda[2];
  Vector3d point = Vector3d::Zero();
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Vector3d u = U.col(k);
    if (lambda[k] > least) point += u.dot(b) / lambda[k] * u;
  }
  for (const MjcfJoint& hinge : hinges) {
    const Vector3d way = point - hinge.position;
    if (!((way - way.dot(hinge.axis) * hinge.axis).norm() <= kAligned * arms)) return std::nullopt;
  }
  return point;
}

bool Parallel(const Vector3d& a, const Vector3d& b) { return a.cross(b).norm() <= kAligned; }
bool Perpendicular(const Vector3d& a, const Vector3d& b) { return std::abs(a.dot(b)) <= kAligned; }

/// Returns axes x, y, z from two axes that are perpendicular up to rounding.
Eigen::Quaterniond Axes(const Vector3d& x, const Vector3d& z_near) {
  const Vector3d z = (z_near - x.dot(z_near) * x).normalized();
  Eigen::Matrix3d R;
  R << x, z.cross(x), z;
  return Eigen::Quaterniond(R);
}

struct Composed {
  JointType type;
  Placement X_BJ;
  bool from_is_child = false;
};

bool Independent(const std::vector<MjcfJoint>& joints) {
  Eigen::Matrix3d axes;
  axes << joints[0].axis, joints[1].axis, joints[2].axis;
  return std::abs(axes.determinant()) > kAligned;
}

/// Returns the joint that several joints form; `all`: in their order, by kind.
std::optional<Composed> Together(const std::vector<MjcfJoint>& joints,
                                 const std::map<MjcfKind, std::vector<MjcfJoint>>& all) {
  const auto of = [&](MjcfKind kind) {
    const auto found = all.find(kind);
    return found == all.end() ? std::vector<MjcfJoint>() : found->second;
  };
  const std::vector<MjcfJoint> hinges = of(MjcfKind::kHinge), slides = of(MjcfKind::kSlide),
                               balls = of(MjcfKind::kBall);
  if (joints.size() == 2 && hinges.size() == 2) {
    const Vector3d &a = hinges[0].axis, &b = hinges[1].axis;
    const auto point = Perpendicular(a, b) ? MeetingPoint(hinges) : std::nullopt;
    // about x of F, then about y of M
    if (point) return Composed{JointType::kUniversal, {Axes(a, a.cross(b)), *point}};
  }
  if (joints.size() == 2 && hinges.size() == 1 && slides.size() == 1) {
    const Vector3d &turn = hinges[0].axis, &slide = slides[0].axis, &at = hinges[0].position;
    if (Parallel(turn, slide)) return Composed{JointType::kCylindrical, {TurnOfZ(turn), at}};
    // the slot is on the parent when the slide comes first, else on the child
    const bool from_is_child = joints[0].kind == MjcfKind::kHinge;
    if (Perpendicular(turn, slide)) {
      return Composed{JointType::kPinInSlot, {Axes(slide, turn), at}, from_is_child};
    }
  }
  if (slides.size() == 2 && hinges.size() == 1) {
    const Vector3d &z = hinges[0].axis, &a = slides[0].axis, &b = slides[1].axis;
    if (Perpendicular(z, a) && Perpendicular(z, b) && !Parallel(a, b)) {
      return Composed{JointType::kPlanar, {Axes(a, z), hinges[0].position}};
    }
  }
  std::optional<Vector3d> centre;
  if (balls.size() == 1 && hinges.empty()) centre = balls[0].position;
  if (balls.empty() && hinges.size() == 3 && Independent(hinges)) centre = MeetingPoint(hinges);
  if (centre && slides.empty()) return Composed{JointType::kSpherical, Placement(*centre)};
  if (centre && slides.size() == 3 && Independent(slides)) {
    return Composed{JointType::kFree, Placement(*centre)};
  }
  return std::nullopt;
}

Composed Compose(const XmlElement& body, const std::vector<MjcfJoint>& joints) {
  if (joints.size() == 1) {
    constexpr JointType kTypes[] = {JointType::kRevolute, JointType::kPrismatic,
                                    JointType::kSpherical, JointType::kFree};
    return {kTypes[static_cast<int>(joints[0].kind)], Placement(joints[0].position)};
  }
  std::map<MjcfKind, std::vector<MjcfJoint>> all;
  std::vector<std::string> words;
  for (const MjcfJoint& joint : joints) {
    constexpr const char* kWords[] = {"hinge", "slide", "ball", "free"};
    all[joint.kind].push_back(joint);
    words.emplace_back(kWords[static_cast<int>(joint.kind)]);
  }
  const bool has_free = all.contains(MjcfKind::kFree);
  if (!has_free) {
    if (const auto composed = Together(joints, all)) return *composed;
  }
  body.Fail(fmt::format("{} joints on one body ({}) that are none of ours together", joints.size(),
                        has_free ? "one of them free" : fmt::format("{}", fmt::join(words, ", "))),
            "a body with mass between them, or axes of a universal, cylindrical, planar, spherical "
            "or free joint or a pin in a slot");
}

/// Adds springs and dampers of a joint that is a whole Loopbench joint; drops others.
void AddJointForces(MjcfModel* model, const MjcfJoint& joint) {
  const MjcfElement& element = joint.element;
  double k = element.Number("stiffness", 0.0, kNotNegative);
  double c = element.Number("damping", 0.0, kNotNegative);
  if (!model->settings.has_springs) k = 0.0;
  if (!model->settings.has_dampers) c = 0.0;
  if (joint.has_coordinate()) {
    model->draft->AddSpringAndDamper(k, joint.spring_reference - joint.reference, c);
    return;
  }
  if (k > 0.0) model->draft->Drop(element.own(), "stiffness", kNeedsOneCoordinate);
  if (c > 0.0) model->draft->Drop(element.own(), "damping", kNeedsOneCoordinate);
}

/// Reads a <joint> or <freejoint>, but not its springs and dampers.
MjcfJoint ReadJoint(const MjcfModel& model, const MjcfPlaced& placed) {
  const auto& [element, X, childclass] = placed;
  MjcfJoint joint(model.defaults.Of(element, childclass));
  if (const auto name = element.Attribute("name")) joint.name = name->Name();
  if (element.tag() == "freejoint") {
    joint.kind = MjcfKind::kFree;
    return joint;
  }
  if (const auto type = joint.element.Attribute("type")) {
    joint.kind = type->Choice<MjcfKind>({{"hinge", MjcfKind::kHinge},
                                         {"slide", MjcfKind::kSlide},
                                         {"ball", MjcfKind::kBall},
                                         {"free", MjcfKind::kFree}});
  }
  const auto position = joint.element.Attribute("pos");
  if (joint.kind != MjcfKind::kFree) {
    joint.position = X.At(position ? position->Vector() : Vector3d::Zero());
  }
  if (const auto axis = joint.element.Attribute("axis")) {
    joint.axis = model.draft->Vector(*axis, "d");
    const bool matters = joint.kind == MjcfKind::kHinge || joint.kind == MjcfKind::kSlide;
    if (matters && !(joint.axis.norm() > 0.0)) axis->Fail("an axis that is not zero");
    if (std::abs(joint.axis.squaredNorm() - 1.0) > 0.0) joint.axis.normalize();
  }
  joint.axis = X.q * joint.axis;
  const auto angle_or_length = [&](const char* name) {
    const double value = joint.element.Number(name, 0.0);
    return joint.kind == MjcfKind::kHinge ? model.settings.Angle(value) : value;
  };
  joint.reference = angle_or_length("ref");
  joint.spring_reference = angle_or_length("springref");
  DropParts(model, joint);
  return joint;
}

/// Adds the Loopbench joint of the joints of a body and sets its frame on the child.
void AddComposed(const XmlElement& body, const std::vector<MjcfJoint>& joints, ImportDraft* draft,
                 MjcfChain* chain) {
  const Composed composed = Compose(body, joints);
  std::vector<std::string> names;
  for (const MjcfJoint& joint : joints) {
    if (!joint.name.empty()) names.push_back(joint.name);
  }
  const std::string name =
      names.empty() ? draft->NameLater(draft->description.bodies[chain->child].name)
                    : draft->NewJointName(body, fmt::format("{}", fmt::join(names, "+")));
  const bool is_free = joints[0].kind == MjcfKind::kFree;
  if (is_free && chain->parent != kGround) {
    joints[0].element.own().Fail("a free joint of a body within another",
                                 "a free joint in a body of <worldbody>");
  }
  chain->X_BJ = composed.X_BJ;
  chain->from_is_child = composed.from_is_child;
  const Placement X_PF = is_free ? Placement() : chain->X_PB * chain->X_BJ;
  JointDescription& made =
      chain->from_is_child
          ? draft->AddJoint(name, composed.type, chain->child, chain->X_BJ, chain->parent, X_PF)
          : draft->AddJoint(name, composed.type, chain->parent, X_PF, chain->child, chain->X_BJ);
  chain->joint = draft->last_joint();
  if (composed.type == JointType::kFree) {
    const Placement X = is_free ? chain->X_PB : Placement();
    draft->description.initial.coordinates.push_back({chain->joint, X.AsCoordinates()});
  }
  if (joints.size() > 1) {
    draft->Note(body,
                fmt::format("{} joints are one here: {}", joints.size(), ToString(composed.type)));
  } else if (joints[0].num_q() == 1) {
    const bool turns = joints[0].kind == MjcfKind::kHinge;
    const Vector3d own = turns ? Vector3d::UnitZ() : Vector3d::UnitX();
    if (joints[0].axis != own) made.axis = joints[0].axis;
  }
}

}  // namespace

void AddMjcfChain(MjcfModel* model, const XmlElement& body, int parent, int child,
                  const Placement& X_PB, const std::vector<MjcfPlaced>& placed) {
  std::vector<MjcfJoint> joints;
  for (const MjcfPlaced& joint : placed) joints.push_back(ReadJoint(*model, joint));
  MjcfChain chain;
  chain.parent = parent;
  chain.child = child;
  chain.X_PB = X_PB;
  if (joints.empty()) {
    model->draft->Fix(parent, X_PB, child, " fixed");
  } else {
    AddComposed(body, joints, model->draft, &chain);
  }
  for (MjcfJoint& joint : joints) {
    joint.joint = chain.joint;
    joint.alone = joints.size() == 1;
    const std::size_t index = model->joints.size();
    if (!joint.name.empty() && !model->joint_names.emplace(joint.name, index).second) {
      joint.element.own().Fail(fmt::format("a second joint \"{}\"", joint.name),
                               "a name that is not in use");
    }
    chain.parts.push_back(index);
    AddJointForces(model, joint);
    model->joints.push_back(joint);
  }
  model->chains.push_back(std::move(chain));
}

// <actuator>: at constant controls, motors of joints are constant efforts.
//
// MuJoCo: force = gain * ctrl + bias, with ctrl within ctrlrange and force within forcerange; the
// joint's effort is the sum of gear * force over its actuators, within its actuatorfrcrange.

namespace {

double Within(const std::optional<MjcfLimits>& limits, double value) {
  return limits ? std::clamp(value, limits->first, limits->second) : value;
}

/// Gain and bias of an actuator, if constant.
struct Law {
  std::vector<double> gain = {1.0}, bias = {0.0};
  std::string gain_type = "fixed", bias_type = "none", dynamics = "none";
  bool is_other = false;  ///< a layer of another kind has set unsupported parameters

  bool is_constant() const {
    if (is_other || gain_type != "fixed" || dynamics != "none") return false;
    if (bias_type == "none") return true;
    const bool varies =
        std::any_of(bias.begin() + 1, bias.end(), [](double x) { return x != 0.0; });
    return bias_type == "affine" && !varies;
  }
  double force(double control) const {
    return gain[0] * control + (bias_type == "affine" ? bias[0] : 0.0);
  }
};

/// Returns the law from layers of all kinds of actuators, where the nearest one has precedence. In
/// a shorter list the remaining values stay unchanged.
Law LawOf(const MjcfElement& actuator) {
  Law law;
  for (auto layer = actuator.layers().rbegin(); layer != actuator.layers().rend(); ++layer) {
    if (layer->tag() == "motor") {
      law = Law();
    } else if (layer->tag() != "general") {
      law.is_other = true;
      // parameters of such actuators, which a nearer motor replaces
      for (const char* name : {"kp", "kv", "dampratio", "timeconst", "inheritrange", "area",
                               "diameter", "bias", "gain", "scale", "force"}) {
        layer->Attribute(name);
      }
    } else {
      for (const auto& [key, text] : {std::pair{"gaintype", &law.gain_type},
                                      {"biastype", &law.bias_type},
                                      {"dyntype", &law.dynamics}}) {
        if (const auto given = layer->Attribute(key)) *text = given->text();
      }
      for (const auto& [key, values] : {std::pair{"gainprm", &law.gain}, {"biasprm", &law.bias}}) {
        const auto given = layer->Attribute(key);
        const std::vector<double> said = given ? given->Numbers(1, 10) : std::vector<double>();
        values->resize(std::max(values->size(), said.size()));
        std::ranges::copy(said, values->begin());
      }
    }
  }
  return law;
}

/// A constant effort on a joint in MjcfModel::joints.
struct Effort {
  std::size_t joint = 0;
  double value = 0.0;
};

constexpr const char* kNoMotor = "there are no actuators but motors of joints (<key ctrl=...>)";

/// Reads an actuator on a joint with one coordinate at a constant control; drops others.
std::optional<Effort> ReadActuator(const XmlElement& element, double control, MjcfModel* model) {
  const auto drop = [&](const char* why, bool changes_motion) {
    model->draft->DropWhole(element, why, changes_motion);
    return std::nullopt;
  };
  const MjcfSettings& settings = model->settings;
  const MjcfElement peeked = model->defaults.Of(element, "", "", false);
  const auto group = static_cast<int>(std::clamp(peeked.Number("group", 0.0), -1e6, 1e6));
  if (!settings.has_actuation || settings.silent_groups.contains(group)) {
    return drop("it is switched off (<option>)", false);
  }
  if (element.tag() != "motor" && element.tag() != "general") return drop(kNoMotor, true);
  const Law law = LawOf(peeked);
  if (!law.is_constant()) return drop("its effort is no constant", true);
  const auto controls = model->LimitsOf(peeked, "ctrllimited", "ctrlrange");
  const double given = settings.clamps_controls ? Within(controls, control) : control;
  const double force =
      Within(model->LimitsOf(peeked, "forcelimited", "forcerange"), law.force(given));
  if (force == 0.0) {
    return drop(control == 0.0 ? "its control is 0 in the start that is read" : "its force is 0",
                false);
  }
  const auto name = element.Attribute("joint");
  if (!name) return drop(kNoMotor, true);
  const MjcfJoint& joint = model->JointNamed(*name);
  if (!joint.has_coordinate()) return drop(kNeedsOneCoordinate, true);
  const MjcfElement motor = model->defaults.Of(element, "");
  // without effect on an actuator without dynamics
  for (const char* rest : {"name", "group", "user", "dynprm", "actdim", "actlimited", "actrange",
                           "actearly", "lengthrange", "cranklength"}) {
    motor.Attribute(rest);
  }
  const auto gear = motor.Attribute("gear");
  const double ratio = gear ? gear->Numbers(1, 6)[0] : 1.0;
  model->draft->Note(element, "a constant effort here, with the control of the start");
  return Effort{model->joint_names.at(name->text()), ratio * force};
}

}  // namespace

void ReadMjcfActuators(const XmlElement& root, const std::optional<XmlValue>& controls,
                       MjcfModel* model) {
  const std::vector<XmlElement> actuators = root.InSections("actuator");
  std::vector<double> ctrl(actuators.size(), 0.0);
  if (controls) ctrl = controls->Numbers(ctrl.size(), ctrl.size());
  std::vector<Effort> efforts;  // summed for each joint, in the order of their first actuators
  for (std::size_t i = 0; i < actuators.size(); ++i) {
    const auto effort = ReadActuator(actuators[i], ctrl[i], model);
    if (!effort) continue;
    const auto known = std::ranges::find(efforts, effort->joint, &Effort::joint);
    if (known == efforts.end()) {
      efforts.push_back(*effort);
    } else {
      known->value += effort->value;
    }
  }
  for (const Effort& effort : efforts) {
    const MjcfJoint& joint = model->joints[effort.joint];
    const auto limits = model->LimitsOf(joint.element, kEffortFlag, kEffortRange);
    const double value = Within(limits, effort.value);
    if (value == 0.0) continue;
    model->draft->description.forces.emplace_back(JointTorque{joint.joint, Polynomial{{value}}});
  }
}

}  // namespace loopbench::harness
