// Seeded random mechanisms with consistent states, for tests that compare with the oracle.
//
// A sample is a description whose tree joints all carry their coordinate as initial value; its
// loops are closed by construction: the frames of a closing joint are defined from the pose. The
// same (family, size, seed) gives the same sample with one compiler (the order in which arguments
// are drawn is its own).
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "mechanism/start/assembly.h"
#include "tests/contract/oracle.h"

namespace loopbench::testing {

/// Uniform numbers from 53 random bits: the same with every standard library.
class Random {
 public:
  explicit Random(std::uint64_t seed) : generator_(seed * 0x9E3779B97F4A7C15u + 1) {}
  double Uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(generator_() >> 11) * 0x1p-53;
  }
  int Below(int n) { return static_cast<int>(Uniform(0.0, n)); }
  bool Chance(double p) { return Uniform(0.0, 1.0) < p; }
  Eigen::Vector3d Vector(double size, bool spatial) {
    Eigen::Vector3d v(Uniform(-size, size), Uniform(-size, size), 0.0);
    if (spatial) v.z() = Uniform(-size, size);
    return v;
  }

 private:
  std::mt19937_64 generator_;
};

/// Kinds of joints to draw from. The mechanisms of those up to helical do not depend on kinds that
/// are added.
enum class DrawnKinds { kUpToHelical, kAll };
JointType DrawKind(Random& random, DrawnKinds kinds = DrawnKinds::kUpToHelical);

/// Closed chain of n >= 3 bodies between two ground points, revolute joints with random arms. In
/// space n >= 7 has axes in all directions; fewer bodies need axes through one point to move.
MechanismDescription RandomChain(int n, SpaceKind space, std::uint64_t seed);

/// Spherical linkage: a closed chain in space whose n + 1 axes meet in one point; three of the five
/// rows of its closure are redundant.
MechanismDescription SphericalChain(int n, std::uint64_t seed);

/// Open tree of n bodies: revolute, prismatic, weld, free joints, reversed ones among them; the
/// last body floats.
MechanismDescription RandomTree(int n, SpaceKind space, std::uint64_t seed);

/// Ladder of n windows. Plane: cranks and couplers of random shape about the parallelogram's.
/// Space: cranks joined by couplers of 18 links, axes in all directions.
MechanismDescription RandomLadder(int n, SpaceKind space, std::uint64_t seed);

/// Loops that share bodies: each is made of two new branches from random bodies of what there is,
/// closed at their tips by a revolute, prismatic or weld joint.
MechanismDescription RandomGraph(int loops, SpaceKind space, std::uint64_t seed);

/// These kinds of joints but free ones, in the tree and as closures; loops with freedom to spare.
/// Up to `motions` coordinates follow given motions.
MechanismDescription MixedGraph(int loops, SpaceKind space, std::uint64_t seed, int motions = 0,
                                DrawnKinds kinds = DrawnKinds::kUpToHelical);

/// A tree of n bodies with closing joints between random bodies: loops share most of their links.
/// Closures are independent: draws that are over-constrained somewhere are drawn again.
MechanismDescription TightGraph(int n, int loops, SpaceKind space, std::uint64_t seed);

/// The same with short loops and without that care: parts are rigid or over-constrained.
MechanismDescription RedundantGraph(int n, int loops, SpaceKind space, std::uint64_t seed);

/// Anything goes: a tree of n bodies with joints of these kinds but rods, closed between random
/// bodies by joints of these kinds, rods among them; parts may be rigid, over-constrained, or the
/// whole locked. Up to `motions` coordinates follow given motions, which loops may forbid.
MechanismDescription AnyMechanism(int n, int closures, int motions, SpaceKind space,
                                  std::uint64_t seed, DrawnKinds kinds = DrawnKinds::kUpToHelical);

/// Chain of n bodies through all joint types of the space in turn, closed to Ground by a revolute
/// joint. One more body is connected to the last one by a free joint.
MechanismDescription ChainOfEveryKind(int n, SpaceKind space, std::uint64_t seed);

/// Loops inside loops. The first is closed on Ground. Each further one consists of two new branches
/// of revolute joints that meet at their tips; they begin half way along the two branches of the
/// loop before. A loop shares bodies with the one around and the one inside. It has
/// 6 new bodies in the plane, 18 in space.
MechanismDescription NestedLoops(int loops, SpaceKind space, std::uint64_t seed);

/// A state of a mechanism: (q, u) in its own coordinates, rounded to double.
struct State {
  VectorX<double> q, u;
};

/// The description's coordinates with random speeds that satisfy the loops; joint coordinates.
template <class Space>
State ConsistentState(const MechanismDescription& description,
                      const Mechanism<Space, double>& mechanism, std::uint64_t seed);

/// Random speeds that satisfy the loops at given coordinates, in any coordinate set.
template <class Space>
State WithRandomSpeeds(const MechanismDescription& description,
                       const Mechanism<Space, double>& mechanism, const VectorX<double>& q,
                       std::uint64_t seed);

/// The same state in another coordinate set.
template <class Space>
State StateIn(const Mechanism<Space, double>& other, const Mechanism<Space, double>& mechanism,
              const State& state);

}  // namespace loopbench::testing
