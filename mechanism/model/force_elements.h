// The forces of a description compiled for one space and scalar: points from centres of mass,
// coefficients summed up by kind. forces.cpp says what they do.
#pragma once

#include <string>
#include <vector>

#include "mechanism/algebra/space.h"
#include "mechanism/description/description.h"

namespace loopbench {

/// A description's 3-vector in the components of the space.
template <class Space, class S>
Linear<Space, S> ToLinear(const Eigen::Vector3d& v) {
  return v.head<Space::kLin>().template cast<S>();
}

/// Spring, damper and constant force along the coordinate of a joint:
/// tau = value - stiffness (q - rest) - damping u. A preload is part of the value.
template <class S>
struct JointForce {
  int joint = 0;
  S value = S(0), stiffness = S(0), rest = S(0), damping = S(0);
};

/// tau(t) along the coordinate of a joint.
struct TimedTorque {
  int joint = 0;
  TimeFunction value;
};

template <class Space, class S>
struct PointOfBody {
  int body = 0;
  Linear<Space, S> at;  ///< from the centre of mass, body axes
};

template <class Space, class S>
struct BodyForce {
  PointOfBody<Space, S> point;
  Linear<Space, S> force;
  bool in_body_axes = false;
};

/// See SpringDamper.
template <class Space, class S>
struct PointSpring {
  PointOfBody<Space, S> from, to;
  S stiffness = S(0), damping = S(0), length = S(0), preload = S(0);
};

/// See Drag.
template <class Space, class S>
struct PointDrag {
  PointOfBody<Space, S> point;
  S linear = S(0), quadratic = S(0);
};

/// All of a mechanism, by kind and in the order of the description.
template <class Space, class S>
struct ForceElements {
  std::vector<JointForce<S>> joint_forces;
  std::vector<TimedTorque> timed_torques;
  std::vector<BodyForce<Space, S>> body_forces;
  std::vector<PointSpring<Space, S>> point_springs;
  std::vector<PointDrag<Space, S>> drags;

  /// Whether any of them has no potential.
  bool has_power() const;
  /// Knots of all functions of time [s], ascending, each once.
  std::vector<double> Knots() const;
};

/// `description` must be valid.
template <class Space, class S>
ForceElements<Space, S> CompileForces(const MechanismDescription& description);

}  // namespace loopbench
