#include "mechanism/description/description.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <span>

namespace loopbench {

namespace {

std::string Quote(const std::string& name) { return "\"" + name + "\""; }

std::string CheckBody(const BodyDescription& body) {
  if (!(body.mass > 0.0) || !std::isfinite(body.mass)) {
    return "mass is " + std::to_string(body.mass) + ", expected a finite number > 0";
  }
  if (!body.com.allFinite() || !body.inertia.allFinite()) return "com and inertia must be finite";
  if (!body.inertia.isApprox(body.inertia.transpose()) ||
      Eigen::LLT<Eigen::Matrix3d>(body.inertia).info() != Eigen::Success) {
    return "inertia must be symmetric and positive definite";
  }
  return "";
}

/// A planar problem turns about z only: rejects tilts and offsets from the plane.
std::string CheckPlanarJoint(const JointDescription& joint) {
  if (!TraitsOf(joint.type).in_plane) {
    return "a " + std::string(ToString(joint.type)) + " joint does not exist in the plane";
  }
  const auto flat = [](const Eigen::Vector3d& v) { return v.z() == 0.0; };
  const auto about_z = [](const Eigen::Vector3d& v) { return v.x() == 0.0 && v.y() == 0.0; };
  if (!flat(joint.from.position) || !flat(joint.to.position)) return "lies out of the plane";
  if (!about_z(joint.from.rotation) || !about_z(joint.to.rotation)) {
    return "its frames may turn about z only in a planar problem";
  }
  if (joint.axis.isZero()) return "";
  const bool fits = TraitsOf(joint.type).own_axis == 'x'
                        ? flat(joint.axis)
                        : about_z(joint.axis) && joint.axis.z() > 0;
  if (!fits) return "its axis does not belong to the plane";
  return "";
}

std::string CheckMotions(SpaceKind space, const JointDescription& joint) {
  const int speeds = NumValues(joint.type, space, true);
  if (joint.motions.empty()) return "";
  if (NumValues(joint.type, space, false) != speeds) {
    return "a joint with a quaternion has no coordinate to prescribe";
  }
  std::vector<bool> taken(speeds, false);
  for (const PrescribedMotion& motion : joint.motions) {
    if (motion.coordinate < 0 || motion.coordinate >= speeds) {
      return "no coordinate " + std::to_string(motion.coordinate) + " to prescribe";
    }
    if (taken[motion.coordinate]) {
      return "coordinate " + std::to_string(motion.coordinate) + " is prescribed twice";
    }
    taken[motion.coordinate] = true;
    if (const std::string error = Validate(motion.value); !error.empty()) return error;
  }
  return "";
}

std::string CheckJoint(const MechanismDescription& description, const JointDescription& joint) {
  const int num_bodies = static_cast<int>(description.bodies.size());
  for (int body : {joint.from.body, joint.to.body}) {
    if (body < 0 || body >= num_bodies) {
      return "body index " + std::to_string(body) + " does not exist";
    }
  }
  if (joint.from.body == joint.to.body) {
    return "joins body " + Quote(description.bodies[joint.from.body].name) + " with itself";
  }
  if (!joint.from.position.allFinite() || !joint.to.position.allFinite() ||
      !joint.from.rotation.allFinite() || !joint.to.rotation.allFinite() ||
      !joint.axis.allFinite()) {
    return "positions, rotations and axis must be finite";
  }
  const JointParameter& parameter = TraitsOf(joint.type).parameter;
  if (!std::isfinite(joint.parameter)) return "pitch and length must be finite";
  if (parameter.positive && !(joint.parameter > 0.0)) {
    return "a " + std::string(ToString(joint.type)) + " needs a " + std::string(parameter.key) +
           " > 0";
  }
  if (!std::isfinite(joint.rotor_inertia) || joint.rotor_inertia < 0.0) {
    return "rotor_inertia must be finite and not negative";
  }
  if (joint.rotor_inertia > 0.0 && NumValues(joint.type, description.space, false) != 1) {
    return "a rotor needs a joint with one coordinate";
  }
  if (std::string error = CheckMotions(description.space, joint); !error.empty()) return error;
  return description.space == SpaceKind::kPlanar ? CheckPlanarJoint(joint) : "";
}

std::string CheckCoupling(const MechanismDescription& description,
                          const CouplingDescription& coupling) {
  if (coupling.parts.size() < 2) return "a coupling needs two or more joints";
  if (!std::isfinite(coupling.offset)) return "the offset must be finite";
  bool has_free_joint = false;
  for (std::size_t i = 0; i < coupling.parts.size(); ++i) {
    const auto& [index, ratio] = coupling.parts[i];
    if (index < 0 || index >= static_cast<int>(description.joints.size())) {
      return "joint index " + std::to_string(index) + " does not exist";
    }
    const JointDescription& joint = description.joints[index];
    if (NumValues(joint.type, description.space, false) != 1) {
      return "joint " + Quote(joint.name) + " is " + std::string(ToString(joint.type)) +
             ", expected a joint with one coordinate";
    }
    if (!std::isfinite(ratio) || ratio == 0.0) {
      return "the coefficient of joint " + Quote(joint.name) + " must be finite and not 0";
    }
    for (std::size_t k = 0; k < i; ++k) {
      if (coupling.parts[k].joint == index) return "joint " + Quote(joint.name) + " appears twice";
    }
    has_free_joint = has_free_joint || joint.motions.empty();
  }
  return has_free_joint ? "" : "all of its joints have prescribed motions";
}

std::string CheckValues(const MechanismDescription& description,
                        const std::vector<JointValues>& list, bool speeds) {
  for (const JointValues& values : list) {
    if (values.joint < 0 || values.joint >= static_cast<int>(description.joints.size())) {
      return "initial value of joint index " + std::to_string(values.joint) +
             ", which does not exist";
    }
    const JointDescription& joint = description.joints[values.joint];
    const auto expected =
        static_cast<std::size_t>(NumValues(joint.type, description.space, speeds));
    if (values.values.size() != expected) {
      return "initial values of joint " + Quote(joint.name) + ": " +
             std::to_string(values.values.size()) + " given, expected " + std::to_string(expected);
    }
    // targets of poses (poses.h) leave values open
    const bool is_target = joint.type == JointType::kFree && joint.cut;
    for (double value : values.values) {
      if (!std::isfinite(value) && !(is_target && std::isnan(value))) {
        return "initial values of joint " + Quote(joint.name) + " must be finite";
      }
    }
  }
  return "";
}

}  // namespace

double InitialDescription::GuessOf(int joint, std::size_t coordinate) const {
  const auto given = std::ranges::find(coordinates, joint, &JointValues::joint);
  if (given == coordinates.end() || coordinate >= given->values.size()) return 0.0;
  const double guess = given->values[coordinate];
  return std::isnan(guess) ? 0.0 : guess;
}

std::string Validate(const MechanismDescription& description) {
  if (description.bodies.size() < 2) return "a mechanism needs at least one body besides ground";
  if (!description.gravity.allFinite()) return "gravity must be finite";
  if (description.space == SpaceKind::kPlanar && description.gravity.z() != 0.0) {
    return "gravity leaves the plane";
  }
  std::string error;
  const auto note = [&](const char* kind, const std::string& name, const std::string& found) {
    if (error.empty() && !found.empty()) error = kind + Quote(name) + ": " + found;
  };
  for (const BodyDescription& body : std::span(description.bodies).subspan(1)) {
    note("body ", body.name, CheckBody(body));
  }
  for (const JointDescription& joint : description.joints) {
    note("joint ", joint.name, CheckJoint(description, joint));
  }
  for (const CouplingDescription& coupling : description.couplings) {
    note("coupling ", coupling.name, CheckCoupling(description, coupling));
  }
  for (const ForceDescription& force : description.forces) {
    if (error.empty()) error = ValidateForce(description, force);
  }
  if (error.empty()) error = CheckValues(description, description.initial.coordinates, false);
  if (error.empty()) error = CheckValues(description, description.initial.speeds, true);
  return error.empty() ? "" : description.name + ": " + error;
}

MechanismDescription Unreleased(const MechanismDescription& description) {
  MechanismDescription result = description;
  for (JointDescription& joint : result.joints) {
    std::erase_if(joint.released, [&](int direction) {
      return !description.rounded || std::ranges::binary_search(joint.moving, direction);
    });
    joint.moving.clear();
  }
  return result;
}

}  // namespace loopbench
