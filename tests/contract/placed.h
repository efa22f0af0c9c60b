// A random mechanism in one coordinate set at a consistent state, for tests of what solves there.
#pragma once

#include "mechanism/model/kinematics.h"
#include "tests/contract/generators.h"

namespace loopbench::testing {

template <class Space>
struct Placed {
  Placed(const MechanismDescription& description, Coordinates coordinates, std::uint64_t seed)
      : mechanism(description, coordinates), kinematics(mechanism) {
    const Mechanism<Space, double> joint_set(description, Coordinates::kJoint);
    state = ConsistentState(description, joint_set, seed);
    if (coordinates == Coordinates::kAbsolute) state = StateIn(mechanism, joint_set, state);
    kinematics.UpdatePosition(state.q);
    kinematics.UpdateVelocity(state.u);
  }
  Placed(const Placed&) = delete;

  const Mechanism<Space, double> mechanism;
  Kinematics<Space, double> kinematics;
  State state;
};

inline VectorX<double> RandomNumbers(Random& random, Eigen::Index count) {
  VectorX<double> numbers(count);
  for (double& number : numbers) number = random.Uniform(-1.0, 1.0);
  return numbers;
}

/// Coordinates of a ladder whose cranks are at `angle`.
inline VectorX<double> LadderAt(const Mechanism<Planar, double>& mechanism, double angle) {
  VectorX<double> q = VectorX<double>::Zero(mechanism.num_q());
  for (const TreeStep& step : mechanism.tree()) {
    const bool is_crank = step.parent == kGround;
    q[mechanism.joints()[step.joint].q_offset] = is_crank ? angle : -angle;
  }
  return q;
}

}  // namespace loopbench::testing
