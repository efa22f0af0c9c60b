// What the forces of a mechanism do: wrenches, potential energy, power.
//
// Everything is in ground axes. A wrench on a body is [moment; force] at its centre of mass; a
// force f at the point r from there adds [r x f; f]. These are the active forces of the paper
// (section 2), which enter zeta_i3 of its two-handle equations.
#include <cmath>

#include "mechanism/algebra/instantiate.h"
#include "mechanism/model/kinematics.h"

namespace loopbench {

namespace {

/// R_WB f of a force that turns with its body, f of one that does not.
template <class Space, class S>
Linear<Space, S> ForceInGround(const BodyForce<Space, S>& force, const Pose<Space, S>& X_WB) {
  return force.in_body_axes ? Linear<Space, S>(X_WB.R * force.force) : force.force;
}

/// A material point, in ground axes.
template <class Space, class S>
struct PointState {
  Linear<Space, S> r;  ///< from the centre of mass
  Linear<Space, S> p;  ///< from the ground origin
  Linear<Space, S> v;
};

template <class Space, class S>
PointState<Space, S> StateOf(const Kinematics<Space, S>& kinematics,
                             const PointOfBody<Space, S>& point) {
  const Pose<Space, S>& X_WB = kinematics.poses()[point.body];
  const Motion<Space, S>& V = kinematics.motions()[point.body];
  const Angular<Space, S> w = V.template head<Space::kRot>();
  PointState<Space, S> state;
  state.r = X_WB.R * point.at;
  state.p = X_WB.p + state.r;
  state.v = V.template tail<Space::kLin>() + Cross<S>(w, state.r);
  return state;
}

/// Two points joined by a spring. Where they meet the direction is zero, and with it all forces.
template <class Space, class S>
struct SpringState {
  PointState<Space, S> from, to;
  S distance, rate;
  Linear<Space, S> direction;  ///< of unit length, from `from` to `to`
};

template <class Space, class S>
SpringState<Space, S> StateOf(const Kinematics<Space, S>& kinematics,
                              const PointSpring<Space, S>& spring) {
  SpringState<Space, S> state;
  state.from = StateOf(kinematics, spring.from);
  state.to = StateOf(kinematics, spring.to);
  const Linear<Space, S> apart = state.to.p - state.from.p;
  state.distance = apart.norm();
  state.direction.setZero();
  if (state.distance > S(0)) state.direction = apart / state.distance;
  state.rate = state.direction.dot(state.to.v - state.from.v);
  return state;
}

/// Magnitude of the drag over that of the velocity.
template <class Space, class S>
S Resistance(const PointDrag<Space, S>& drag, const Linear<Space, S>& v) {
  return drag.linear + drag.quadratic * v.norm();
}

/// A force at the point r from the centre of mass.
template <class Space, class S>
void AddForce(const Linear<Space, S>& f, const Linear<Space, S>& r, Wrench<Space, S>& wrench) {
  wrench.template head<Space::kRot>() += Moment<S>(r, f);
  wrench.template tail<Space::kLin>() += f;
}

/// H tau / |H|^2 at Mo on Q, its opposite on P, both moved to the centres of mass. The power of it
/// is tau u, because the joint's relative motion is H u.
template <class Space, class S>
void AddJointForce(const Kinematics<Space, S>& kinematics, int index, S tau,
                   std::span<Wrench<Space, S>> wrenches) {
  const Joint<Space, S>& joint = kinematics.mechanism().joints()[index];
  const JointState<Space, S>& state = kinematics.joints()[index];
  const Wrench<Space, S> F = state.H(0) * (tau * joint.kind->inverse_H_squared);
  wrenches[joint.to] += ShiftForce<Space, S>(F, state.r_Q);
  wrenches[joint.from] -= ShiftForce<Space, S>(F, state.r_P);
}

}  // namespace

/// tau of a spring and damper on a joint is value - stiffness (q - rest) - damping u; the tension
/// of one between points pulls `from` along the direction to `to`, and `to` the other way.
template <class Space, class S>
void AppliedForces(const Kinematics<Space, S>& kinematics, std::span<Wrench<Space, S>> wrenches) {
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  const ForceElements<Space, S>& forces = mechanism.forces();
  wrenches[kGround].setZero();
  for (int body = 1; body < mechanism.num_bodies(); ++body) {
    wrenches[body].template head<Space::kRot>().setZero();
    wrenches[body].template tail<Space::kLin>() =
        mechanism.bodies()[body].mass * mechanism.gravity();
  }
  for (const BodyForce<Space, S>& force : forces.body_forces) {
    const Pose<Space, S>& X_WB = kinematics.poses()[force.point.body];
    AddForce<Space, S>(ForceInGround(force, X_WB), X_WB.R * force.point.at,
                       wrenches[force.point.body]);
  }
  for (const PointSpring<Space, S>& spring : forces.point_springs) {
    const SpringState<Space, S> state = StateOf(kinematics, spring);
    const S tension = spring.preload + spring.stiffness * (state.distance - spring.length) +
                      spring.damping * state.rate;
    const Linear<Space, S> f = tension * state.direction;
    AddForce<Space, S>(f, state.from.r, wrenches[spring.from.body]);
    AddForce<Space, S>(-f, state.to.r, wrenches[spring.to.body]);
  }
  for (const PointDrag<Space, S>& drag : forces.drags) {
    const PointState<Space, S> state = StateOf(kinematics, drag.point);
    AddForce<Space, S>(-Resistance(drag, state.v) * state.v, state.r, wrenches[drag.point.body]);
  }
  for (const JointForce<S>& force : forces.joint_forces) {
    S tau = force.value;
    if (force.stiffness != S(0)) {
      tau -= force.stiffness * (kinematics.JointCoordinate(force.joint) - force.rest);
    }
    if (force.damping != S(0)) tau -= force.damping * kinematics.JointSpeed(force.joint);
    AddJointForce<Space, S>(kinematics, force.joint, tau, wrenches);
  }
  for (const TimedTorque& torque : forces.timed_torques) {
    AddJointForce<Space, S>(kinematics, torque.joint, torque.value.At(kinematics.time()).value,
                            wrenches);
  }
}

/// Kinetic: (m v^2 + w . I w) / 2 at the centre of mass. Potential: -m g . p, -f . p of a force of
/// fixed direction, stiffness s^2 / 2 + preload s of a spring stretched by s, and of a joint's
/// force stiffness (q - rest)^2 / 2 - value q.
template <class Space, class S>
Energy<S> ComputeEnergy(const Kinematics<Space, S>& kinematics) {
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  const ForceElements<Space, S>& forces = mechanism.forces();
  const S half = S(1) / S(2);
  Energy<S> energy;
  for (int body = 1; body < mechanism.num_bodies(); ++body) {
    const Inertia<Space, S>& inertia = mechanism.bodies()[body];
    const Angular<Space, S> w = kinematics.motions()[body].template head<Space::kRot>();
    const Linear<Space, S> v = kinematics.motions()[body].template tail<Space::kLin>();
    energy.kinetic += half * (inertia.mass * v.squaredNorm() +
                              w.dot(kinematics.RotationalInertia(inertia, body) * w));
    energy.potential -= inertia.mass * mechanism.gravity().dot(kinematics.poses()[body].p);
  }
  for (const BodyForce<Space, S>& force : forces.body_forces) {
    if (force.in_body_axes) continue;
    const Pose<Space, S>& X_WB = kinematics.poses()[force.point.body];
    energy.potential -= force.force.dot(X_WB.p + X_WB.R * force.point.at);
  }
  for (const PointSpring<Space, S>& spring : forces.point_springs) {
    const S stretch = StateOf(kinematics, spring).distance - spring.length;
    energy.potential += (half * spring.stiffness * stretch + spring.preload) * stretch;
  }
  for (const JointForce<S>& force : forces.joint_forces) {
    const S q = kinematics.JointCoordinate(force.joint);
    energy.potential +=
        half * force.stiffness * (q - force.rest) * (q - force.rest) - force.value * q;
  }
  return energy;
}

/// What ComputeEnergy() leaves out, as f . v at points and tau u at joints.
template <class Space, class S>
Power<S> AppliedPower(const Kinematics<Space, S>& kinematics) {
  const ForceElements<Space, S>& forces = kinematics.mechanism().forces();
  Power<S> power;
  for (const TimedTorque& torque : forces.timed_torques) {
    power.supplied +=
        torque.value.At(kinematics.time()).value * kinematics.JointSpeed(torque.joint);
  }
  for (const BodyForce<Space, S>& force : forces.body_forces) {
    if (!force.in_body_axes) continue;
    const Linear<Space, S> f = ForceInGround(force, kinematics.poses()[force.point.body]);
    power.supplied += f.dot(StateOf(kinematics, force.point).v);
  }
  for (const JointForce<S>& force : forces.joint_forces) {
    if (force.damping == S(0)) continue;
    const S u = kinematics.JointSpeed(force.joint);
    power.dissipated += force.damping * u * u;
  }
  for (const PointSpring<Space, S>& spring : forces.point_springs) {
    if (spring.damping == S(0)) continue;
    const S rate = StateOf(kinematics, spring).rate;
    power.dissipated += spring.damping * rate * rate;
  }
  for (const PointDrag<Space, S>& drag : forces.drags) {
    const Linear<Space, S> v = StateOf(kinematics, drag.point).v;
    power.dissipated += Resistance(drag, v) * v.squaredNorm();
  }
  return power;
}

#define LOOPBENCH_INSTANTIATE(Space, S)                                                  \
  template void AppliedForces(const Kinematics<Space, S>&, std::span<Wrench<Space, S>>); \
  template Energy<S> ComputeEnergy(const Kinematics<Space, S>&);                         \
  template Power<S> AppliedPower(const Kinematics<Space, S>&);
LOOPBENCH_FOR_EACH_SPACE_AND_MODEL_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
