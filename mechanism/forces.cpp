#include "mechanism/instantiate.h"
#include "mechanism/kinematics.h"

namespace loopbench {

namespace {

template <class Space, class S>
Linear<Space, S> ForceInGround(const BodyForce<Space, S>& force, const Pose<Space, S>& X_WB) {
  return force.in_body_axes ? Linear<Space, S>(X_WB.R * force.force) : force.force;
}

}  // namespace

template <class Space, class S>
void AppliedForces(const Kinematics<Space, S>& kinematics, std::span<Motion<Space, S>> wrenches) {
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  wrenches[kGround].setZero();
  for (int body = 1; body < mechanism.num_bodies(); ++body) {
    wrenches[body].template head<Space::kRot>().setZero();
    wrenches[body].template tail<Space::kLin>() =
        mechanism.bodies()[body].mass * mechanism.gravity();
  }
  for (const BodyForce<Space, S>& force : mechanism.body_forces()) {
    const Pose<Space, S>& X_WB = kinematics.poses()[force.body];
    const Linear<Space, S> f = ForceInGround(force, X_WB);
    const Linear<Space, S> r = X_WB.R * force.at;
    wrenches[force.body].template head<Space::kRot>() += Moment<S>(r, f);
    wrenches[force.body].template tail<Space::kLin>() += f;
  }
  for (const JointForce<S>& force : mechanism.joint_forces()) {
    S tau = force.value;
    if (force.stiffness != S(0)) {
      tau -= force.stiffness * (kinematics.JointCoordinate(force.joint) - force.rest);
    }
    if (force.damping != S(0)) tau -= force.damping * kinematics.JointSpeed(force.joint);
    const Joint<Space, S>& joint = mechanism.joints()[force.joint];
    const JointState<Space, S>& state = kinematics.joints()[force.joint];
    const Motion<Space, S> F = state.H(0) * (tau * joint.kind->per_speed);
    wrenches[joint.to] += ShiftForce<Space, S>(F, state.r_Q);
    wrenches[joint.from] -= ShiftForce<Space, S>(F, state.r_P);
  }
}

template <class Space, class S>
Energy<S> ComputeEnergy(const Kinematics<Space, S>& kinematics) {
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
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
  for (const BodyForce<Space, S>& force : mechanism.body_forces()) {
    if (force.in_body_axes) continue;
    const Pose<Space, S>& X_WB = kinematics.poses()[force.body];
    energy.potential -= force.force.dot(X_WB.p + X_WB.R * force.at);
  }
  for (const JointForce<S>& force : mechanism.joint_forces()) {
    const S q = kinematics.JointCoordinate(force.joint);
    energy.potential +=
        half * force.stiffness * (q - force.rest) * (q - force.rest) - force.value * q;
  }
  return energy;
}

#define LOOPBENCH_INSTANTIATE(Space, S)                                                  \
  template void AppliedForces(const Kinematics<Space, S>&, std::span<Motion<Space, S>>); \
  template Energy<S> ComputeEnergy(const Kinematics<Space, S>&);
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
