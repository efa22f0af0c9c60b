// What the forces of a mechanism do together: wrenches, energy, power.
#include "mechanism/algebra/instantiate.h"
#include "mechanism/model/kinematics.h"

namespace loopbench {

template <class Space, class S>
void AppliedForces(const Kinematics<Space, S>& kinematics, std::span<Wrench<Space, S>> wrenches) {
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  wrenches[kGround].setZero();
  for (int body = 1; body < mechanism.num_bodies(); ++body) {
    wrenches[body].template head<Space::kRot>().setZero();
    wrenches[body].template tail<Space::kLin>() =
        mechanism.bodies()[body].mass * mechanism.gravity();
  }
  mechanism.forces().ForEach(
      [&](const auto& element) { element.AddWrenches(kinematics, wrenches); });
}

/// Kinetic: (m v^2 + w . I w) / 2 at the centre of mass. Potential: -m g . p and that of forces.
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

#define LOOPBENCH_INSTANTIATE(Space, S)                                                  \
  template void AppliedForces(const Kinematics<Space, S>&, std::span<Wrench<Space, S>>); \
  template Energy<S> ComputeEnergy(const Kinematics<Space, S>&);                         \
  template Power<S> AppliedPower(const Kinematics<Space, S>&);
LOOPBENCH_FOR_EACH_SPACE_AND_MODEL_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
