// <actuator>: under controls that stay, motors of joints are constant efforts.
//
// MuJoCo: force = gain * ctrl + bias, with ctrl within ctrlrange and force within forcerange; the
// joint's effort is the sum of gear * force over its actuators, within its actuatorfrcrange.
#include <fmt/format.h>

#include <algorithm>

#include "harness/exchange/import_mjcf.h"

namespace loopbench::harness {

namespace {

double Within(const std::optional<MjcfLimits>& limits, double value) {
  return limits ? std::clamp(value, limits->first, limits->second) : value;
}

/// Gain and bias of an actuator, where they are constants.
struct Law {
  std::vector<double> gain = {1.0}, bias = {0.0};
  std::string gain_type = "fixed", bias_type = "none", dynamics = "none";
  bool is_other = false;  ///< a layer of another kind has set what is not followed here

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

/// What one layer makes of it; as numbers of a shorter list, those that it does not say stay.
void Apply(const XmlElement& layer, Law* law) {
  if (layer.tag() == "motor") {
    *law = Law();
    return;
  }
  if (layer.tag() != "general") {
    law->is_other = true;
    // parameters of such actuators, which a motor nearer than they are replaces
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

/// Layers of all kinds of actuators set the same values, the nearest one last.
Law LawOf(const MjcfElement& actuator) {
  Law law;
  const std::vector<XmlElement> layers = actuator.Layers();
  std::for_each(layers.rbegin(), layers.rend(),
                [&law](const XmlElement& layer) { Apply(layer, &law); });
  return law;
}

/// What says nothing about an actuator without dynamics.
void ReadRest(const MjcfElement& actuator) {
  for (const char* name : {"name", "group", "user", "dynprm", "actdim", "actlimited", "actrange",
                           "actearly", "lengthrange", "cranklength"}) {
    actuator.Attribute(name);
  }
}

/// A constant effort on a joint, which is one of MjcfModel::joints.
struct Effort {
  std::size_t joint = 0;
  double value = 0.0;
};

constexpr const char* kNoMotor = "there are no actuators but motors of joints (<key ctrl=...>)";

/// An actuator on a joint with one coordinate, under a control that stays; others are dropped.
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
  std::vector<Effort> efforts;  // of each joint together, in the order of their first actuators
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
