#include "mechanism/force_elements.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "mechanism/instantiate.h"

namespace loopbench {

namespace {

/// Sorts one description after another into its list.
template <class Space, class S>
class Compiler {
 public:
  Compiler(const MechanismDescription& description, ForceElements<Space, S>& elements)
      : description_(description), elements_(elements) {}

  void operator()(const JointTorque& torque) {
    const auto* polynomial = std::get_if<Polynomial>(&torque.value);
    if (polynomial != nullptr && polynomial->coefficients.size() == 1) {
      elements_.joint_forces.push_back(
          {.joint = torque.joint, .value = S(polynomial->coefficients[0])});
    } else {
      elements_.timed_torques.push_back({torque.joint, TimeFunction(torque.value)});
    }
  }
  void operator()(const JointSpring& spring) {
    elements_.joint_forces.push_back({.joint = spring.joint,
                                      .value = S(spring.preload),
                                      .stiffness = S(spring.stiffness),
                                      .rest = S(spring.rest)});
  }
  void operator()(const JointDamper& damper) {
    elements_.joint_forces.push_back({.joint = damper.joint, .damping = S(damper.damping)});
  }
  void operator()(const PointForce& force) {
    elements_.body_forces.push_back(
        {Point({force.body, force.at}), ToLinear<Space, S>(force.force), force.in_body_axes});
  }
  void operator()(const SpringDamper& spring) {
    elements_.point_springs.push_back({Point(spring.from), Point(spring.to), S(spring.stiffness),
                                       S(spring.damping), S(spring.length), S(spring.preload)});
  }
  void operator()(const Drag& drag) {
    elements_.drags.push_back({Point(drag.point), S(drag.linear), S(drag.quadratic)});
  }

 private:
  PointOfBody<Space, S> Point(const BodyPoint& point) const {
    return {point.body, ToLinear<Space, S>(point.at - description_.bodies[point.body].com)};
  }

  const MechanismDescription& description_;
  ForceElements<Space, S>& elements_;
};

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

template <class Space, class S>
bool ForceElements<Space, S>::has_power() const {
  return !timed_torques.empty() ||
         std::ranges::any_of(joint_forces, [](const auto& f) { return f.damping != S(0); }) ||
         std::ranges::any_of(body_forces, [](const auto& f) { return f.in_body_axes; }) ||
         std::ranges::any_of(point_springs, [](const auto& f) { return f.damping != S(0); }) ||
         std::ranges::any_of(drags,
                             [](const auto& f) { return f.linear != S(0) || f.quadratic != S(0); });
}

template <class Space, class S>
std::vector<double> ForceElements<Space, S>::Knots() const {
  std::vector<double> knots;
  for (const TimedTorque& torque : timed_torques) {
    knots.insert(knots.end(), torque.value.knots().begin(), torque.value.knots().end());
  }
  std::ranges::sort(knots);
  knots.erase(std::ranges::unique(knots).begin(), knots.end());
  return knots;
}

template <class Space, class S>
ForceElements<Space, S> CompileForces(const MechanismDescription& description) {
  ForceElements<Space, S> elements;
  Compiler<Space, S> compiler(description, elements);
  for (const ForceDescription& force : description.forces) std::visit(compiler, force);
  return elements;
}

std::string ValidateForce(const MechanismDescription& description, const ForceDescription& force) {
  return std::visit(Validator(description), force);
}

#define LOOPBENCH_INSTANTIATE(Space, S)    \
  template struct ForceElements<Space, S>; \
  template ForceElements<Space, S> CompileForces(const MechanismDescription&);
LOOPBENCH_FOR_EACH_SPACE_AND_MODEL_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
