#include "mechanism/model/force_elements.h"

#include <algorithm>

#include "mechanism/algebra/instantiate.h"

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

#define LOOPBENCH_INSTANTIATE(Space, S)    \
  template struct ForceElements<Space, S>; \
  template ForceElements<Space, S> CompileForces(const MechanismDescription&);
LOOPBENCH_FOR_EACH_SPACE_AND_MODEL_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
