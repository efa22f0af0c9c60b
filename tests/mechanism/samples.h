// Samples in both coordinate sets, for tests of kinematics and forces against the oracle.
#pragma once

#include "tests/contract/generators.h"
#include "tests/standard.h"

namespace loopbench::testing {

template <class Space>
constexpr SpaceKind kKind = Space::kRot == 1 ? SpaceKind::kPlanar : SpaceKind::kSpatial;

/// Calls check(description, mechanism, state) for all samples in both coordinate sets.
template <class Space, class Check>
void ForBothSets(const std::vector<MechanismDescription>& samples, Check check) {
  for (const MechanismDescription& d : samples) {
    SCOPED_TRACE(d.name);
    const Mechanism<Space, double> joint(d, Coordinates::kJoint);
    const Mechanism<Space, double> absolute(d, Coordinates::kAbsolute);
    const State state = ConsistentState(d, joint, 1);
    for (const auto& [mechanism, at] :
         {std::pair{&joint, state}, {&absolute, StateIn(absolute, joint, state)}}) {
      SCOPED_TRACE(ToString(mechanism->coordinates()));
      check(d, *mechanism, at);
    }
  }
}

}  // namespace loopbench::testing
