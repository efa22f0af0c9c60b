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

}  // namespace loopbench::testing
