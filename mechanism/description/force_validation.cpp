#include "mechanism/description/force_validation.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>

namespace loopbench {

namespace {

/// The first thing wrong with a force.
class Validator {
 public:
  explicit Validator(const MechanismDescription& description) : description_(description) {}

  std::string operator()(const JointTorque& torque) const {
    std::string error = Joint(torque.joint);
    if (error.empty()) error = Validate(torque.value);
    return error.empty() ? "" : "joint torque: " + error;
  }
  std::string operator()(const JointSpring& spring) const {
    std::string error = Joint(spring.joint);
    if (error.empty()) error = NotNegative({spring.stiffness});
    if (error.empty()) error = Finite({spring.rest, spring.preload});
    return error.empty() ? "" : "joint spring: " + error;
  }
  std::string operator()(const JointDamper& damper) const {
    std::string error = Joint(damper.joint);
    if (error.empty()) error = NotNegative({damper.damping});
    return error.empty() ? "" : "joint damper: " + error;
  }
  std::string operator()(const PointForce& force) const {
    std::string error = Point({force.body, force.at}, false);
    if (error.empty()) error = Vector(force.force);
    return error.empty() ? "" : "point force: " + error;
  }
  std::string operator()(const SpringDamper& spring) const {
    std::string error = Point(spring.from, true);
    if (error.empty()) error = Point(spring.to, true);
    if (error.empty() && spring.from.body == spring.to.body) error = "joins a body with itself";
    if (error.empty()) error = NotNegative({spring.stiffness, spring.damping, spring.length});
    if (error.empty()) error = Finite({spring.preload});
    return error.empty() ? "" : "spring-damper: " + error;
  }
  std::string operator()(const Drag& drag) const {
    std::string error = Point(drag.point, false);
    if (error.empty()) error = NotNegative({drag.linear, drag.quadratic});
    return error.empty() ? "" : "drag: " + error;
  }

 private:
  std::string Joint(int index) const {
    if (index < 0 || index >= static_cast<int>(description_.joints.size())) {
      return "joint index " + std::to_string(index) + " does not exist";
    }
    const JointDescription& joint = description_.joints[index];
    if (NumValues(joint.type, description_.space, true) == 1) return "";
    return "joint \"" + joint.name + "\" has not one coordinate, which a joint force acts along";
  }
  std::string Point(const BodyPoint& point, bool may_be_ground) const {
    const int first = may_be_ground ? kGround : kGround + 1;
    if (point.body < first || point.body >= static_cast<int>(description_.bodies.size())) {
      return "body index " + std::to_string(point.body) + ", expected a " +
             (may_be_ground ? "" : "moving ") + "body";
    }
    return Vector(point.at);
  }
  std::string Vector(const Eigen::Vector3d& v) const {
    if (!v.allFinite()) return "vectors must be finite";
    return description_.space == SpaceKind::kPlanar && v.z() != 0.0 ? "leaves the plane" : "";
  }
  static std::string Finite(std::initializer_list<double> numbers) {
    const bool finite = std::ranges::all_of(numbers, [](double x) { return std::isfinite(x); });
    return finite ? "" : "numbers must be finite";
  }
  static std::string NotNegative(std::initializer_list<double> numbers) {
    const bool positive = std::ranges::all_of(numbers, [](double x) { return x >= 0.0; });
    return positive ? Finite(numbers) : "stiffness, damping and length must not be negative";
  }

  const MechanismDescription& description_;
};

}  // namespace

std::string ValidateForce(const MechanismDescription& description, const ForceDescription& force) {
  return std::visit(Validator(description), force);
}

}  // namespace loopbench
