// Joints of MuJoCo: single ones, and several on a body as one Loopbench joint.
//
// MuJoCo's joints of a body act in sequence, each in axes moved by the previous joints. With
// X_i(q_i) the motion of joint i in body axes, the pose of the body in its parent is X_PB X_1 ..
// X_n. The set of reachable poses determines the Loopbench joint type.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "harness/exchange/import_mjcf.h"
#include "mechanism/algebra/symmetric_eigen.h"

namespace loopbench::harness {

namespace {

using Eigen::Vector3d;

/// Tolerance for parallel, perpendicular and intersecting axes: rounding in a file with nine
/// digits.
constexpr double kAligned = 1e-9;

void RefuseOrNote(const MjcfModel& model, const MjcfJoint& joint) {
  ImportDraft* draft = model.draft;
  const XmlElement& own = joint.element.own();
  if (joint.element.Number("armature", 0.0) != 0.0) {
    draft->Note(own, "armature", "dropped: rotors have no inertia beside that of the bodies", true);
  }
  if (joint.element.Number("frictionloss", 0.0) != 0.0) {
    draft->Note(own, "frictionloss", "dropped: dry friction is no force of mechanism files", true);
  }
  model.NoteLimits(joint.element, "dropped: joints turn and slide without ends");
  const auto by_actuators = joint.element.Attribute("actuatorgravcomp");
  if (by_actuators && by_actuators->Bool() &&
      (!model.settings.has_actuation || model.LimitsOf(joint.element, kEffortFlag, kEffortRange))) {
    draft->Note(own, "actuatorgravcomp", "dropped: gravcomp acts whatever actuators may do", true);
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

struct Sorted {
  std::vector<MjcfJoint> hinges, slides, balls;
};

std::optional<Composed> ComposeTwo(const std::vector<MjcfJoint>& joints, const Sorted& sorted) {
  if (sorted.hinges.size() == 2) {
    const Vector3d &a = joints[0].axis, &b = joints[1].axis;
    const auto point = Perpendicular(a, b) ? MeetingPoint(joints) : std::nullopt;
    // about x of F, then about y of M
    if (point) return Composed{JointType::kUniversal, {Axes(a, a.cross(b)), *point}};
  }
  if (sorted.hinges.size() != 1 || sorted.slides.size() != 1) return std::nullopt;
  const MjcfJoint &hinge = sorted.hinges[0], &slide = sorted.slides[0];
  if (Parallel(hinge.axis, slide.axis)) {
    const Eigen::Quaterniond q = TurnOfZ(hinge.axis);
    return Composed{JointType::kCylindrical, {q, hinge.position}};
  }
  if (!Perpendicular(hinge.axis, slide.axis)) return std::nullopt;
  // the slot is on the parent when the slide comes first, else on the child
  return Composed{JointType::kPinInSlot,
                  {Axes(slide.axis, hinge.axis), hinge.position},
                  joints[0].kind == MjcfKind::kHinge};
}

bool Independent(const std::vector<MjcfJoint>& joints) {
  Eigen::Matrix3d axes;
  axes << joints[0].axis, joints[1].axis, joints[2].axis;
  return std::abs(axes.determinant()) > kAligned;
}

std::optional<Composed> ComposeMore(const Sorted& sorted) {
  const std::size_t hinges = sorted.hinges.size(), slides = sorted.slides.size();
  if (slides == 2 && hinges == 1) {
    const Vector3d& z = sorted.hinges[0].axis;
    const Vector3d &a = sorted.slides[0].axis, &b = sorted.slides[1].axis;
    const bool in_plane = Perpendicular(z, a) && Perpendicular(z, b) && !Parallel(a, b);
    if (in_plane) {
      return Composed{JointType::kPlanar, {Axes(a, z), sorted.hinges[0].position}};
    }
  }
  std::optional<Vector3d> centre;
  if (sorted.balls.size() == 1 && hinges == 0) centre = sorted.balls[0].position;
  if (sorted.balls.empty() && hinges == 3 && Independent(sorted.hinges)) {
    centre = MeetingPoint(sorted.hinges);
  }
  if (!centre) return std::nullopt;
  if (slides == 0) return Composed{JointType::kSpherical, Placement(*centre)};
  if (slides == 3 && Independent(sorted.slides))
    return Composed{JointType::kFree, Placement(*centre)};
  return std::nullopt;
}

Composed Compose(const XmlElement& body, const std::vector<MjcfJoint>& joints) {
  if (joints.size() == 1) {
    const MjcfJoint& joint = joints[0];
    const JointType type = joint.kind == MjcfKind::kHinge   ? JointType::kRevolute
                           : joint.kind == MjcfKind::kSlide ? JointType::kPrismatic
                           : joint.kind == MjcfKind::kBall  ? JointType::kSpherical
                                                            : JointType::kFree;
    return {type, Placement(joint.position)};
  }
  Sorted sorted;
  std::vector<std::string> words;
  bool has_free = false;
  for (const MjcfJoint& joint : joints) {
    const bool turns = joint.kind == MjcfKind::kHinge;
    if (turns) sorted.hinges.push_back(joint);
    if (joint.kind == MjcfKind::kSlide) sorted.slides.push_back(joint);
    if (joint.kind == MjcfKind::kBall) sorted.balls.push_back(joint);
    has_free = has_free || joint.kind == MjcfKind::kFree;
    words.emplace_back(turns ? "hinge" : joint.kind == MjcfKind::kSlide ? "slide" : "ball");
  }
  std::optional<Composed> composed;
  if (!has_free) composed = joints.size() == 2 ? ComposeTwo(joints, sorted) : ComposeMore(sorted);
  if (composed) return *composed;
  body.Fail(fmt::format("{} joints on one body ({}) that are none of ours together", joints.size(),
                        has_free ? "one of them free" : fmt::format("{}", fmt::join(words, ", "))),
            "a body with mass between them, or axes of a universal, cylindrical, planar, spherical "
            "or free joint or a pin in a slot");
}

/// Adds springs and dampers of a joint that is a whole Loopbench joint; drops others.
void AddJointForces(MjcfModel* model, const MjcfJoint& joint) {
  ImportDraft* draft = model->draft;
  const MjcfElement& element = joint.element;
  const double k = element.Number("stiffness", 0.0, kNotNegative);
  const double c = element.Number("damping", 0.0, kNotNegative);
  const bool has_one = joint.num_q() == 1 && joint.alone;
  const auto drop = [&](const char* name) {
    draft->Note(element.own(), name, fmt::format("dropped: {}", kNeedsOneCoordinate), true);
  };
  if (k > 0.0 && model->settings.has_springs) {
    if (has_one) {
      draft->description.forces.emplace_back(
          JointSpring{joint.joint, k, joint.spring_reference - joint.reference, 0.0});
    } else {
      drop("stiffness");
    }
  }
  if (c > 0.0 && model->settings.has_dampers) {
    if (has_one) {
      draft->description.forces.emplace_back(JointDamper{joint.joint, c});
    } else {
      drop("damping");
    }
  }
}

/// Adds the Loopbench joint and sets its frame on the child.
void AddComposed(const XmlElement& body, const std::vector<MjcfJoint>& joints,
                 const Composed& composed, ImportDraft* draft, MjcfChain* chain) {
  std::vector<std::string> names;
  for (const MjcfJoint& joint : joints) {
    if (!joint.name.empty()) names.push_back(joint.name);
  }
  const auto child = static_cast<std::size_t>(chain->child);
  const std::string name =
      names.empty() ? draft->NameLater(draft->description.bodies[child].name)
                    : draft->NewJointName(body, fmt::format("{}", fmt::join(names, "+")));
  const bool is_free = joints[0].kind == MjcfKind::kFree;
  if (is_free && chain->parent != kGround) {
    joints[0].element.own().Fail("a free joint of a body within another",
                                 "a free joint in a body of <worldbody>");
  }
  chain->X_BJ = composed.X_BJ;
  chain->from_is_child = composed.from_is_child;
  const Placement X_PF = is_free ? Placement() : chain->X_PB * chain->X_BJ;
  if (chain->from_is_child) {
    draft->AddJoint(name, composed.type, chain->child, chain->X_BJ, chain->parent, X_PF);
  } else {
    draft->AddJoint(name, composed.type, chain->parent, X_PF, chain->child, chain->X_BJ);
  }
  chain->joint = draft->last_joint();
  if (composed.type == JointType::kFree) {
    const Placement X = is_free ? chain->X_PB : Placement();
    draft->description.initial.coordinates.push_back(
        {chain->joint, {X.q.w(), X.q.x(), X.q.y(), X.q.z(), X.p.x(), X.p.y(), X.p.z()}});
  }
}

}  // namespace

MjcfJoint ReadMjcfJoint(const MjcfModel& model, const XmlElement& element, const Placement& X,
                        const std::string& childclass) {
  MjcfJoint joint(model.defaults.Of(element, childclass));
  if (const auto name = element.Attribute("name")) joint.name = name->Name();
  if (element.tag() == "freejoint") {
    joint.kind = MjcfKind::kFree;
    return joint;
  }
  if (const auto type = joint.element.Attribute("type")) {
    constexpr MjcfKind kKinds[] = {MjcfKind::kHinge, MjcfKind::kSlide, MjcfKind::kBall,
                                   MjcfKind::kFree};
    joint.kind = kKinds[type->Choice({"hinge", "slide", "ball", "free"})];
  }
  const auto position = joint.element.Attribute("pos");
  if (position && joint.kind != MjcfKind::kFree) joint.position = position->Vector();
  if (joint.kind != MjcfKind::kFree) joint.position = X.At(joint.position);
  if (const auto axis = joint.element.Attribute("axis")) {
    joint.axis = model.draft->Vector(*axis, "d");
    const bool matters = joint.kind == MjcfKind::kHinge || joint.kind == MjcfKind::kSlide;
    if (matters && !(joint.axis.norm() > 0.0)) axis->Fail("an axis that is not zero");
    if (std::abs(joint.axis.squaredNorm() - 1.0) > 0.0) joint.axis.normalize();
  }
  joint.axis = X.q * joint.axis;
  joint.reference = joint.element.Number("ref", 0.0);
  joint.spring_reference = joint.element.Number("springref", 0.0);
  if (joint.kind == MjcfKind::kHinge) {
    joint.reference = model.settings.Angle(joint.reference);
    joint.spring_reference = model.settings.Angle(joint.spring_reference);
  }
  RefuseOrNote(model, joint);
  return joint;
}

void AddMjcfChain(MjcfModel* model, const XmlElement& body, int parent, int child,
                  const Placement& X_PB, const std::vector<MjcfJoint>& joints) {
  ImportDraft* draft = model->draft;
  MjcfChain chain;
  chain.parent = parent;
  chain.child = child;
  chain.X_PB = X_PB;
  if (joints.empty()) {
    const std::string& name = draft->description.bodies[static_cast<std::size_t>(child)].name;
    draft->AddJoint(draft->NameLater(name + " fixed"), JointType::kWeld, parent, X_PB, child, {});
    model->chains.push_back(std::move(chain));
    return;
  }
  const Composed composed = Compose(body, joints);
  AddComposed(body, joints, composed, draft, &chain);
  if (joints.size() > 1) {
    draft->Note(body,
                fmt::format("{} joints are one here: {}", joints.size(), ToString(composed.type)));
  } else if (joints[0].num_q() == 1) {
    const bool turns = joints[0].kind == MjcfKind::kHinge;
    const Vector3d own = turns ? Vector3d::UnitZ() : Vector3d::UnitX();
    if (joints[0].axis != own) draft->description.joints.back().axis = joints[0].axis;
  }
  for (MjcfJoint joint : joints) {
    joint.joint = chain.joint;
    joint.alone = joints.size() == 1;
    const std::size_t index = model->joints.size();
    if (!joint.name.empty() && !model->joint_names.emplace(joint.name, index).second) {
      joint.element.own().Fail(fmt::format("a second joint \"{}\"", joint.name),
                               "a name that is not in use");
    }
    chain.parts.push_back(index);
    AddJointForces(model, joint);
    model->joints.push_back(std::move(joint));
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

/// Applies one layer; in a shorter list the remaining values stay unchanged.
void Apply(const XmlElement& layer, Law* law) {
  if (layer.tag() == "motor") {
    *law = Law();
    return;
  }
  if (layer.tag() != "general") {
    law->is_other = true;
    // parameters of such actuators, which a nearer motor replaces
    for (const char* name : {"kp", "kv", "dampratio", "timeconst", "inheritrange", "area",
                             "diameter", "bias", "gain", "scale", "force"}) {
      layer.Attribute(name);
    }
    return;
  }
  const auto type = [&layer](const char* key, std::string* text) {
    if (const auto given = layer.Attribute(key)) *text = given->text();
  };
  const auto numbers = [&layer](const char* key, std::vector<double>* values) {
    const auto given = layer.Attribute(key);
    if (!given) return;
    const std::vector<double> said = given->Numbers(1, 10);
    if (values->size() < said.size()) values->resize(said.size());
    std::ranges::copy(said, values->begin());
  };
  type("gaintype", &law->gain_type);
  type("biastype", &law->bias_type);
  type("dyntype", &law->dynamics);
  numbers("gainprm", &law->gain);
  numbers("biasprm", &law->bias);
}

/// Returns the law from layers of all kinds of actuators, where the nearest one has precedence.
Law LawOf(const MjcfElement& actuator) {
  Law law;
  const std::vector<XmlElement> layers = actuator.Layers();
  std::for_each(layers.rbegin(), layers.rend(),
                [&law](const XmlElement& layer) { Apply(layer, &law); });
  return law;
}

/// Reads attributes without effect on an actuator without dynamics.
void ReadRest(const MjcfElement& actuator) {
  for (const char* name : {"name", "group", "user", "dynprm", "actdim", "actlimited", "actrange",
                           "actearly", "lengthrange", "cranklength"}) {
    actuator.Attribute(name);
  }
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
    element.Ignore();
    model->draft->Note(element, fmt::format("dropped: {}", why), changes_motion);
    return std::nullopt;
  };
  const MjcfSettings& settings = model->settings;
  const MjcfElement peeked = model->defaults.Peek(element, "");
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
  if (joint.num_q() != 1 || !joint.alone) return drop(kNeedsOneCoordinate, true);
  const MjcfElement motor = model->defaults.Of(element, "");
  ReadRest(motor);
  const auto gear = motor.Attribute("gear");
  const double ratio = gear ? gear->Numbers(1, 6)[0] : 1.0;
  model->draft->Note(element, "a constant effort here, with the control of the start");
  return Effort{model->joint_names.at(name->text()), ratio * force};
}

}  // namespace

void ReadMjcfActuators(const XmlElement& root, const std::optional<XmlValue>& controls,
                       MjcfModel* model) {
  std::vector<XmlElement> actuators;
  for (const XmlElement& section : root.Children("actuator")) {
    for (const XmlElement& element : section.Children()) actuators.push_back(element);
  }
  std::vector<double> ctrl(actuators.size(), 0.0);
  if (controls) ctrl = controls->Numbers(ctrl.size(), ctrl.size());
  std::vector<Effort> efforts;  // summed for each joint, in the order of their first actuators
  std::map<std::size_t, std::size_t> index_of;
  for (std::size_t i = 0; i < actuators.size(); ++i) {
    const auto effort = ReadActuator(actuators[i], ctrl[i], model);
    if (!effort) continue;
    const auto [known, is_new] = index_of.emplace(effort->joint, efforts.size());
    if (is_new) {
      efforts.push_back(*effort);
    } else {
      efforts[known->second].value += effort->value;
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
