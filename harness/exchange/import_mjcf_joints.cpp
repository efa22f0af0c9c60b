// Joints and actuators of MuJoCo. Joints of one body act in series, through links without mass.
#include "harness/exchange/import_mjcf.h"

namespace loopbench::harness {

namespace {

using Eigen::Vector3d;

/// Adds springs, dampers and the rotor of the joint that was added last; a ball's are dropped.
void AddJointForces(MjcfModel* model, const MjcfJoint& joint) {
  const XmlElement& element = joint.element;
  double k = element.Number("stiffness", 0.0, kNotNegative);
  double c = element.Number("damping", 0.0, kNotNegative);
  if (!model->settings.has_springs) k = 0.0;
  if (!model->settings.has_dampers) c = 0.0;
  const double rotor = element.Number("armature", 0.0, kNotNegative);
  if (joint.num_q() == 1) {
    model->draft->AddSpringAndDamper(k, joint.spring_reference - joint.reference, c);
    model->draft->description.joints.back().rotor_inertia = rotor;
    return;
  }
  if (rotor > 0.0) model->draft->Drop(element, "armature", kNoRotors);
  if (k > 0.0) model->draft->Drop(element, "stiffness", kNeedsOneCoordinate);
  if (c > 0.0) model->draft->Drop(element, "damping", kNeedsOneCoordinate);
}

/// Reads a <joint> or <freejoint>, but not its springs and dampers.
MjcfJoint ReadJoint(MjcfModel* written, const MjcfPlaced& placed) {
  const MjcfModel& model = *written;
  const auto& [element, X, childclass, replica] = placed;
  MjcfJoint joint(element);
  if (const auto name = element.Attribute("name")) {
    joint.name = written->NewName("joint", *name, replica);
  }
  if (element.tag() == "freejoint") {
    joint.type = JointType::kFree;
    return joint;
  }
  using enum JointType;
  constexpr XmlChoice<JointType> kTypes[] = {
      {"hinge", kRevolute}, {"slide", kPrismatic}, {"ball", kSpherical}, {"free", kFree}};
  if (const auto type = joint.element.Attribute("type")) joint.type = type->Choice(kTypes);
  const auto position = joint.element.Attribute("pos");
  if (joint.type != kFree) joint.position = X.At(VectorOr(position));
  if (const auto axis = joint.element.Attribute("axis")) {
    joint.axis = model.draft->Vector(*axis, "d");
    const bool matters = joint.type == kRevolute || joint.type == kPrismatic;
    if (matters && !(joint.axis.norm() > 0.0)) axis->Fail("an axis that is not zero");
    if (std::abs(joint.axis.squaredNorm() - 1.0) > 0.0) joint.axis.normalize();
  }
  joint.axis = X.q * joint.axis;
  const auto angle_or_length = [&](const char* name) {
    const double value = joint.element.Number(name, 0.0);
    return joint.type == kRevolute ? model.settings.Angle(value) : value;
  };
  joint.reference = angle_or_length("ref");
  joint.spring_reference = angle_or_length("springref");
  if (model.settings.has_friction) model.DropNonzero(joint.element, "frictionloss", kDryFriction);
  if (!model.settings.has_passive()) joint.element.Attribute("springdamper");
  model.NoteLimits(joint.element, kNoEnds);
  if (BoolOr(joint.element.Attribute("actuatorgravcomp")) &&
      (!model.settings.has_actuation || model.LimitsOf(joint.element, kEffortFlag, kEffortRange))) {
    model.draft->Drop(element, "actuatorgravcomp", "gravcomp acts whatever actuators may do");
  }
  return joint;
}

/// Adds a joint between two bodies; X_PB is the drawn pose of the child.
void AddJoint(MjcfModel* model, const XmlElement& body, int parent, int child,
              const Placement& X_PB, MjcfJoint joint) {
  ImportDraft* draft = model->draft;
  const bool is_free = joint.type == JointType::kFree;
  if (is_free && parent != kGround) {
    joint.element.Fail("a free joint of a body within another",
                       "a free joint in a body of <worldbody>");
  }
  const std::string name = joint.name.empty()
                               ? draft->NameLater(draft->description.bodies[child].name)
                               : draft->NewJointName(body, joint.name);
  const Placement X_BJ(joint.position), X_PF = is_free ? Placement() : X_PB * X_BJ;
  JointDescription& made = draft->AddJoint(name, joint.type, {parent, X_PF}, {child, X_BJ});
  joint.joint = draft->last_joint();
  if (is_free) {
    const auto& [q, p] = X_PB * model->FrameOf(child).X;
    draft->description.initial.coordinates.push_back({joint.joint, X_PB.AsCoordinates()});
    joint.drawn = {p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z()};
  } else if (joint.num_q() == 1) {
    const bool turns = joint.type == JointType::kRevolute;
    const Vector3d own = turns ? Vector3d::UnitZ() : Vector3d::UnitX();
    if (joint.axis != own) made.axis = joint.axis;
    joint.drawn = {joint.reference};
    Placement& X = model->where_springs_are_free[child];
    X = X * MotionOf(joint, &joint.spring_reference);
  } else {
    joint.drawn = {1.0, 0.0, 0.0, 0.0};
  }
  if (!joint.name.empty()) model->joint_names.emplace(joint.name, model->joints.size());
  AddJointForces(model, joint);
  model->joints.push_back(std::move(joint));
}

// <actuator>: at constant controls, actuators of joints are efforts, springs and dampers.
//
// MuJoCo: force = gain * ctrl + bias, with ctrl within ctrlrange and force within forcerange; gain
// and bias are linear in length = gear * qpos and its rate. The joint's effort is the sum of gear *
// force over its actuators, within its actuatorfrcrange.

double Within(const std::optional<MjcfLimits>& limits, double value) {
  return limits ? std::clamp(value, limits->first, limits->second) : value;
}

/// Coefficients of 1, of the length and of its rate.
using Linear3 = std::array<double, 3>;

/// Fields of an actuator in MuJoCo. Each layer overwrites some of them.
struct Law {
  std::vector<double> gain = {1.0, 0.0, 0.0}, bias = {0.0, 0.0, 0.0};
  std::string gain_type = "fixed", bias_type = "none", dynamics = "none";
  double inherited_range = 0.0;  ///< ratio of the control's range to the joint's; 0: its own
  bool is_other = false;         ///< a layer of another kind has set unsupported parameters

  bool inherits_range() const {
    return inherited_range > 0.0 && gain_type == "fixed" && bias_type == "affine" &&
           gain[0] == -bias[1];
  }
  bool is_linear() const {
    return !is_other && dynamics == "none" && (gain_type == "fixed" || gain_type == "affine") &&
           (bias_type == "none" || bias_type == "affine");
  }
  Linear3 ForceAt(double control) const {
    Linear3 force = {gain[0] * control, 0.0, 0.0};
    for (std::size_t i = 0; i < force.size(); ++i) {
      if (i > 0 && gain_type == "affine") force[i] += gain[i] * control;
      if (bias_type == "affine") force[i] += bias[i];
    }
    return force;
  }
};

/// Applies a <position>, <velocity> or <damper>. Missing gains keep the values of the layers below
/// (MuJoCo: OneActuator() in xml_native_reader.cc, mjs_setToPosition() and others in user_api.cc).
void SetServo(const XmlElement& layer, Law* law) {
  const auto kp = layer.Attribute("kp"), kv = layer.Attribute("kv");
  if (layer.tag() == "damper") {
    const double inherited = law->gain_type == "affine" ? -law->gain[2] : 0.0;
    law->gain = {0.0, 0.0, -NumberOr(kv, inherited, kNotNegative)};
    law->gain_type = "affine";
    law->bias_type = law->dynamics = "none";
    return;
  }
  law->gain_type = "fixed";
  law->bias_type = "affine";
  if (layer.tag() == "velocity") {
    law->gain[0] = NumberOr(kv, law->gain[0], kNotNegative);
    law->bias = {0.0, 0.0, -law->gain[0]};
    law->dynamics = "none";
    return;
  }
  law->gain[0] = NumberOr(kp, law->gain[0], kNotNegative);
  law->bias[1] = -law->gain[0];
  if (kv) law->bias[2] = -kv->Number(kNotNegative);
  if (const auto ratio = layer.Attribute("dampratio")) law->bias[2] = ratio->Number(kNotNegative);
  if (const auto time = layer.Attribute("timeconst")) {
    law->dynamics = time->Number(kNotNegative) == 0.0 ? "none" : "filterexact";
  }
  law->inherited_range = layer.Number("inheritrange", law->inherited_range, kNotNegative);
}

/// Returns the law from layers of all kinds of actuators, where the nearest one has precedence. In
/// a shorter list the remaining values stay unchanged.
Law LawOf(const XmlElement& actuator) {
  Law law;
  const std::vector<XmlElement> layers = actuator.Layers();
  for (auto layer = layers.rbegin(); layer != layers.rend(); ++layer) {
    const std::string tag = layer->tag();
    if (tag == "motor") {
      law.gain[0] = 1.0;
      law.gain_type = "fixed";
      law.bias_type = law.dynamics = "none";
      law.is_other = false;
    } else if (tag == "position" || tag == "velocity" || tag == "damper") {
      SetServo(*layer, &law);
    } else if (tag != "general") {
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

/// Effort of actuators on a joint in MjcfModel::joints: constant - stiffness q - damping u, with
/// the coordinate q of Loopbench.
struct Effort {
  std::size_t joint = 0;
  double constant = 0.0, stiffness = 0.0, damping = 0.0;
};

constexpr std::string_view kActuators[] = {"motor", "general", "position", "velocity", "damper"};
constexpr const char* kNoMotor =
    "only motors, positions, velocities and dampers of joints act (<key ctrl=...>)";

/// Returns the range of an actuator's control.
std::optional<MjcfLimits> ControlRange(const XmlElement& actuator, const Law& law,
                                       const MjcfJoint& joint, const MjcfModel& model) {
  if (!law.inherits_range()) return model.LimitsOf(actuator, "ctrllimited", "ctrlrange");
  auto range = model.LimitsOf(joint.element, "limited", "range");
  if (!range) return std::nullopt;
  const double unit = joint.type == JointType::kRevolute ? model.settings.Angle(1.0) : 1.0;
  const double middle = 0.5 * unit * (range->first + range->second);
  const double half = 0.5 * unit * law.inherited_range * (range->second - range->first);
  return MjcfLimits{middle - half, middle + half};
}

/// Reads an actuator on a joint with one coordinate at a constant control; drops others.
std::optional<Effort> ReadActuator(const XmlElement& element, double control, MjcfModel* model) {
  const auto drop = [&](const char* why, bool changes_motion) {
    model->draft->DropWhole(element, why, changes_motion);
    return std::nullopt;
  };
  const MjcfSettings& settings = model->settings;
  const XmlElement peeked = model->defaults.Of(element, "", "", false);
  const auto group = static_cast<int>(std::clamp(peeked.Number("group", 0.0), -1e6, 1e6));
  if (!settings.has_actuation || settings.silent_groups.contains(group)) {
    return drop("it is switched off (<option>)", false);
  }
  const Law law = LawOf(peeked);
  const auto name = element.Attribute("joint");
  const bool is_known = law.is_linear() && Contains(kActuators, element.tag());
  if (!is_known || !name) return drop(kNoMotor, true);
  const std::size_t index = model->JointNamed(*name);
  const MjcfJoint& joint = model->joints[index];
  const auto controls = ControlRange(peeked, law, joint, *model);
  const Linear3 force = law.ForceAt(settings.clamps_controls ? Within(controls, control) : control);
  const bool is_constant = force[1] == 0.0 && force[2] == 0.0;
  const auto forces = model->LimitsOf(peeked, "forcelimited", "forcerange");
  const double constant = is_constant ? Within(forces, force[0]) : force[0];
  if (is_constant && constant == 0.0) {
    return drop(control == 0.0 ? "its control is 0 in the start that is read" : "its force is 0",
                false);
  }
  if (joint.num_q() != 1) return drop(kNeedsOneCoordinate, true);
  if (force[1] > 0.0 || force[2] > 0.0) {
    return drop("its stiffness or damping is negative, or a damping ratio", true);
  }
  const XmlElement motor = model->defaults.Of(element, "");
  // without effect on an actuator without dynamics
  for (const char* rest : {"name", "group", "user", "dynprm", "actdim", "actlimited", "actrange",
                           "actearly", "lengthrange", "cranklength"}) {
    motor.Attribute(rest);
  }
  const auto gear = motor.Attribute("gear");
  const double ratio = gear ? gear->Numbers(1, 6)[0] : 1.0, square = ratio * ratio;
  model->draft->Note(element, is_constant ? "a constant effort here, with the control of the start"
                                          : "a spring or damper here, at the control of the start");
  if (forces && !is_constant) {
    model->draft->Drop(element, "forcerange", "springs and dampers have no largest effort");
  }
  // MuJoCo's coordinate is Loopbench's plus the reference
  return Effort{.joint = index,
                .constant = ratio * constant + square * force[1] * joint.reference,
                .stiffness = -square * force[1],
                .damping = -square * force[2]};
}

}  // namespace

void AddMjcfJoints(MjcfModel* model, const XmlElement& body, int parent, int child,
                   const Placement& X_PB, const std::vector<MjcfPlaced>& placed) {
  ImportDraft* draft = model->draft;
  std::vector<MjcfJoint> joints =
      Mapped<MjcfJoint>(placed, [&](const MjcfPlaced& joint) { return ReadJoint(model, joint); });
  if (joints.size() > 1 && std::ranges::count(joints, JointType::kFree, &MjcfJoint::type) > 0) {
    body.Fail(fmt::format("{} joints on one body, one of them free", joints.size()),
              "a free joint alone");
  }
  int freedoms = 0;
  for (const MjcfJoint& joint : joints) freedoms += joint.num_u();
  if (freedoms > 6) {
    body.Fail(fmt::format("joints with {} degrees of freedom on one body", freedoms),
              "at most 6, as in MuJoCo");
  }
  Placement X = X_PB;
  const auto place = [&](int next) {
    auto& poses = model->where_springs_are_free;
    poses.resize(draft->at_rest.size());
    poses[next] = poses[parent] * X;
  };
  if (joints.empty()) {
    draft->Fix(parent, X_PB, child, " fixed");
    place(child);
  }
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const bool is_last = i + 1 == joints.size();
    const int next = is_last ? child : draft->AddLink(body, child);
    if (!is_last) model->links.insert(next);
    place(next);
    AddJoint(model, body, parent, next, X, std::move(joints[i]));
    parent = next;
    X = {};
  }
}

void ReadMjcfActuators(const XmlElement& root, const std::optional<XmlValue>& controls,
                       MjcfModel* model) {
  const std::vector<XmlElement> actuators = root.InSections("actuator");
  std::vector<double> ctrl(actuators.size(), 0.0);
  if (controls) ctrl = controls->Numbers(ctrl.size(), ctrl.size());
  std::vector<Effort> efforts;  // summed for each joint, in the order of their first actuators
  std::map<std::size_t, std::size_t> places;  // of joints in `efforts`
  for (std::size_t i = 0; i < actuators.size(); ++i) {
    model->ForReplicas({{"joint", actuators[i].Attribute("joint")}}, [&] {
      const auto effort = ReadActuator(actuators[i], ctrl[i], model);
      if (!effort) return;
      const auto [known, is_new] = places.emplace(effort->joint, efforts.size());
      if (is_new) {
        efforts.push_back(*effort);
        return;
      }
      Effort& sum = efforts[known->second];
      sum.constant += effort->constant;
      sum.stiffness += effort->stiffness;
      sum.damping += effort->damping;
    });
  }
  for (const Effort& effort : efforts) {
    const MjcfJoint& joint = model->joints[effort.joint];
    auto& forces = model->draft->description.forces;
    const auto limits = model->LimitsOf(joint.element, kEffortFlag, kEffortRange);
    const bool is_constant = effort.stiffness == 0.0 && effort.damping == 0.0;
    if (limits && !is_constant) {
      model->draft->Drop(joint.element, kEffortRange, "springs and dampers have no largest effort");
    }
    const double constant = is_constant ? Within(limits, effort.constant) : effort.constant;
    if (effort.stiffness > 0.0) {
      forces.emplace_back(JointSpring{joint.joint, effort.stiffness, constant / effort.stiffness});
    } else if (constant != 0.0) {
      forces.emplace_back(JointTorque{joint.joint, Polynomial{{constant}}});
    }
    if (effort.damping > 0.0) forces.emplace_back(JointDamper{joint.joint, effort.damping});
  }
}

}  // namespace loopbench::harness
