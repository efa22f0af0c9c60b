// Compiled forces for one space and scalar: a specialisation of ForceElement for each struct of
// mechanism/description/force.h, in force_NAME.h. This file holds their common parts.
//
// Everything is in ground axes. A wrench on a body is [moment; force] at its centre of mass; a
// force f at the point r from there adds [r x f; f]. These are the active forces of the paper
// (section 2), which enter zeta_i3 of its two-handle equations.
#pragma once

#include <span>
#include <vector>

#include "mechanism/algebra/space.h"
#include "mechanism/description/description.h"

namespace loopbench {

template <class Space, class S>
class Kinematics;

/// Power [W] of the forces without a potential, at time(), position and speed:
///   d/dt (kinetic + potential) = supplied - dissipated
/// where the joints themselves do no work.
template <class S>
struct Power {
  S supplied = S(0);    ///< torques that depend on time, forces that turn with a body; any sign
  S dissipated = S(0);  ///< dampers and drag; >= 0
};

/// Built from a force and its valid description. Derives from ForceDefaults and has
/// AddWrenches(kinematics, wrenches), which adds [moment; force] body by body, and any overrides.
/// Its effect needs either a potential or power: otherwise the energy balance does not close.
template <class Space, class S, class Description>
class ForceElement;

template <class Space, class S>
struct ForceDefaults {
  /// Potential energy [J].
  S Potential(const Kinematics<Space, S>&) const { return S(0); }
  /// Adds supplied or dissipated power; called only if has_power().
  void AddPower(const Kinematics<Space, S>&, Power<S>&) const {}
  bool has_power() const { return false; }
  /// Times [s] at which it is not smooth.
  const std::vector<double>& knots() const {
    static const std::vector<double> none;
    return none;
  }
};

/// A description's 3-vector in the components of the space.
template <class Space, class S>
Linear<Space, S> ToLinear(const Eigen::Vector3d& v) {
  Linear<Space, S> linear;
  for (int i = 0; i < Space::kLin; ++i) linear[i] = S(v[i]);
  return linear;
}

/// A material point, in ground axes.
template <class Space, class S>
struct PointState {
  Linear<Space, S> r;  ///< from the centre of mass
  Linear<Space, S> p;  ///< from the ground origin
  Linear<Space, S> v;
};

/// A material point of a body.
template <class Space, class S>
struct PointOfBody {
  int body;
  Linear<Space, S> at;  ///< from the centre of mass, body axes

  PointOfBody(const BodyPoint& point, const MechanismDescription& description)
      : body(point.body), at(ToLinear<Space, S>(point.at - description.bodies[point.body].com)) {}

  PointState<Space, S> StateIn(const Kinematics<Space, S>& kinematics) const {
    const Pose<Space, S>& X_WB = kinematics.poses()[body];
    const Velocity<Space, S>& V = kinematics.motions()[body];
    PointState<Space, S> state;
    state.r = X_WB.R * at;
    state.p = X_WB.p + state.r;
    state.v = V.linear + Cross<S>(V.angular, state.r);
    return state;
  }

  /// Adds the force f at the point.
  void AddForce(const Linear<Space, S>& f, const PointState<Space, S>& state,
                std::span<Wrench<Space, S>> wrenches) const {
    wrenches[body] += {Moment<S>(state.r, f), f};
  }
};

/// The effort tau of a joint at Mo on Q, its opposite on P, both moved to the centres of mass.
template <class Space, class S>
void AddJointForce(const Kinematics<Space, S>& kinematics, int index, S tau,
                   std::span<Wrench<Space, S>> wrenches) {
  const auto& joint = kinematics.mechanism().joints()[index];
  const auto& state = kinematics.joints()[index];
  const Wrench<Space, S> F =
      WrenchOfEffort<Space, S>(state.H(0), joint.kind->inverse_H_squared, tau);
  wrenches[joint.to] += ShiftForce<Space, S>(F, state.r_Q);
  wrenches[joint.from] -= ShiftForce<Space, S>(F, state.r_P);
}

}  // namespace loopbench
