// All forces of a mechanism together: wrenches, energy, power.
#include "mechanism/algebra/instantiate.h"
#include "mechanism/model/kinematics.h"

namespace loopbench {

template <class Space, class S>
void ForcesBesideGravity(const Kinematics<Space, S>& kinematics,
                         std::span<Wrench<Space, S>> wrenches) {
  for (Wrench<Space, S>& wrench : wrenches) wrench.setZero();
  kinematics.mechanism().forces().ForEach(
      [&](const auto& element) { element.AddWrenches(kinematics, wrenches); });
}

template <class Space, class S>
void AppliedForces(const Kinematics<Space, S>& kinematics, std::span<Wrench<Space, S>> wrenches) {
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  wrenches[kGround].setZero();
  for (int body = 1; body < mechanism.num_bodies(); ++body) {
    wrenches[body] = {Angular<Space, S>::Zero(),
                      mechanism.bodies()[body].mass * mechanism.gravity()};
  }
  mechanism.forces().ForEach(
      [&](const auto& element) { element.AddWrenches(kinematics, wrenches); });
}

/// Kinetic: (m v^2 + w . I w) / 2 at the centre of mass, and I q'^2 / 2 of rotors. Potential:
/// -m g . p and the forces' own.
template <class Space, class S>
Energy<S> ComputeEnergy(const Kinematics<Space, S>& kinematics) {
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  const S half = S(1) / S(2);
  Energy<S> energy;
  for (int body = 1; body < mechanism.num_bodies(); ++body) {
    const Inertia<Space, S>& inertia = mechanism.bodies()[body];
    const Velocity<Space, S>& V = kinematics.motions()[body];
    const Angular<Space, S> Iw = kinematics.RotationalInertia(inertia, body) * V.angular;
    energy.kinetic += half * (inertia.mass * V.linear.squaredNorm() + V.angular.dot(Iw));
    energy.potential -= inertia.mass * mechanism.gravity().dot(kinematics.poses()[body].p);
  }
  for (const auto& [joint, inertia] : mechanism.rotors()) {
    const S rate = kinematics.JointSpeed(joint);
    energy.kinetic += half * inertia * rate * rate;
  }
  mechanism.forces().ForEach(
      [&](const auto& element) { energy.potential += element.Potential(kinematics); });
  return energy;
}

template <class Space, class S>
Power<S> AppliedPower(const Kinematics<Space, S>& kinematics) {
  Power<S> power;
  kinematics.mechanism().forces().ForEach([&](const auto& element) {
    if (element.has_power()) element.AddPower(kinematics, power);
  });
  return power;
}

#define LOOPBENCH_INSTANTIATE(Space, S)                                                        \
  template void ForcesBesideGravity(const Kinematics<Space, S>&, std::span<Wrench<Space, S>>); \
  template void AppliedForces(const Kinematics<Space, S>&, std::span<Wrench<Space, S>>);       \
  template Energy<S> ComputeEnergy(const Kinematics<Space, S>&);                               \
  template Power<S> AppliedPower(const Kinematics<Space, S>&);
LOOPBENCH_FOR_EACH_SPACE_AND_MODEL_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
