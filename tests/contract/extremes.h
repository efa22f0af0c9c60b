// Mechanisms of extreme structure, seeded and random in shape: long chains of every kind of joint,
// loops nested into each other. States as for generators.h.
#pragma once

#include "tests/contract/generators.h"

namespace loopbench::testing {

/// Chain of n bodies through all kinds of joints in turn, those that the space has, closed to
/// Ground by a revolute joint at its end; one more body floats beyond the last on a free joint.
MechanismDescription ChainOfEveryKind(int n, SpaceKind space, std::uint64_t seed);

/// Loops inside loops: the first is closed on Ground, each further one has its ends on the two
/// branches of the one before, half way along, and is made of two new branches of revolute joints
/// that meet at their tips. A loop shares bodies with the one around and the one inside. It has
/// 6 new bodies in the plane, 18 in space.
MechanismDescription NestedLoops(int loops, SpaceKind space, std::uint64_t seed);

}  // namespace loopbench::testing
