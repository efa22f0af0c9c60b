// Mechanisms that short cuts of right-hand sides serve, and what tests need to know of each.
#pragma once

#include "tests/contract/builder.h"
#include "tests/odca/short_cut.h"

namespace loopbench::odca {

using testing::Builder;
using testing::Random;

inline JointDescription Pin(Random& random, int from, int to) {
  const auto side = [&](int body) {
    return JointSide{body, random.Vector(1.0, false), {0.0, 0.0, random.Uniform(-kPi, kPi)}};
  };
  JointDescription pin;
  pin.from = side(from);
  pin.to = side(to);
  if (random.Chance(0.5)) std::swap(pin.from, pin.to);
  return pin;
}

/// Bodies, drawn in order, in any order of numbers.
inline std::vector<int> BodiesInAnyOrder(Builder& b, int n) {
  std::vector<int> row;
  for (int k = 0; k < n; ++k) row.push_back(b.AddBody(1.0));
  for (int k = n - 1; k > 0; --k) std::swap(row[k], row[b.random.Below(k + 1)]);
  return row;
}

inline void NameJoints(MechanismDescription& description) {
  int number = 0;
  for (JointDescription& joint : description.joints) joint.name = "j" + std::to_string(number++);
}

/// Bodies in a row, in any order of numbers, some of them pinned to Ground, no two neighbours, so
/// that they can move; where that closes a loop the joint before such a body is cut, or the pin of
/// the last one. Half of them may be a path of its own.
inline MechanismDescription RandomPath(int n, std::uint64_t seed, bool in_halves = false) {
  Builder b("path", SpaceKind::kPlanar, seed);
  std::vector<int> row = BodiesInAnyOrder(b, n);
  const double share = b.random.Uniform(0.0, 1.0);
  bool pinned_before = false, neighbour = false;
  auto& joints = b.description.joints;
  const int middle = in_halves ? n / 2 : 0;
  for (int k = 0; k < n; ++k) {
    const bool first = k == 0 || k == middle, last = k + 1 == n || k + 1 == middle;
    if (first) pinned_before = neighbour = false;
    const bool pinned = (b.random.Chance(share) && !neighbour) || (last && !pinned_before);
    const bool cut_pin = pinned && pinned_before && last && b.random.Chance(0.5);
    if (!first) {
      joints.push_back(Pin(b.random, row[k - 1], row[k]));
      joints.back().cut = pinned && pinned_before && !cut_pin;
    }
    if (pinned) {
      joints.push_back(Pin(b.random, kGround, row[k]));
      joints.back().cut = cut_pin;
    }
    pinned_before = pinned_before || pinned;
    neighbour = pinned;
  }
  NameJoints(b.description);
  return b.description;
}

/// Bodies that hang from any other one or from Ground, in any order of numbers; with freedom left,
/// cut pins close loops. Forces are of all kinds.
inline MechanismDescription RandomBranches(int n, std::uint64_t seed, int forces = 0) {
  Builder b("branches", SpaceKind::kPlanar, seed);
  std::vector<int> row = BodiesInAnyOrder(b, n);
  auto& joints = b.description.joints;
  for (int k = 0; k < n; ++k) {
    const bool on_ground = k == 0 || b.random.Chance(0.15);
    // not far back, so that bodies have some pins and none has all
    const int other = on_ground ? kGround : row[k - 1 - b.random.Below(std::min(k, 4))];
    joints.push_back(Pin(b.random, other, row[k]));
  }
  const int loops = n > 3 ? b.random.Below((n - 1) / 3 + 1) : 0;
  for (int loop = 0; loop < loops; ++loop) {
    const int k = b.random.Below(n), other = b.random.Below(n + 1);
    if (other == k) continue;
    joints.push_back(Pin(b.random, other == n ? kGround : row[other], row[k]));
    joints.back().cut = true;
  }
  b.AddForces(forces);
  NameJoints(b.description);
  return b.description;
}

/// Bodies in a row from Ground, in any order of numbers, joints in any frames and either way round;
/// closed on Ground by one more joint, of which one is cut, with this kind.
inline void AddPath(Builder& b, int n, bool closed, JointType cut_kind) {
  auto& joints = b.description.joints;
  std::vector<int> row = BodiesInAnyOrder(b, n);
  row.push_back(kGround);
  const int cut = closed ? b.random.Below(n + 1) : -1;
  for (int k = 0; k < n + (closed ? 1 : 0); ++k) {
    JointDescription& joint = joints.emplace_back();
    joint.name = "j" + std::to_string(joints.size());
    joint.from = {k == 0 ? kGround : row[k - 1], b.random.Vector(1.0, true), b.RandomTurn()};
    joint.to = {row[k], b.random.Vector(1.0, true), b.RandomTurn()};
    if (b.random.Chance(0.5)) std::swap(joint.from, joint.to);
    joint.cut = k == cut;
    if (joint.cut) joint.type = cut_kind;
  }
}

struct Paths {
  int open = 0, closed = 0, also_closed = 0;  ///< bodies of three paths, 0 for none
  JointType cut = JointType::kRevolute;
};
inline MechanismDescription RandomArms(const Paths& paths, std::uint64_t seed) {
  Builder b("arms", SpaceKind::kSpatial, seed);
  if (paths.closed > 0) AddPath(b, paths.closed, true, paths.cut);
  if (paths.open > 0) AddPath(b, paths.open, false, paths.cut);
  if (paths.also_closed > 0) AddPath(b, paths.also_closed, true, paths.cut);
  return b.description;
}

/// The sweep along planar paths of pins.
struct AlongPaths {
  using Space = Planar;
  static constexpr auto kName = "Paths";
  static auto Make(const Mechanism<Planar, double>& mechanism, int threads = 1,
                   int group = pins::kBodiesOfGroup) {
    return pins::MakePathSweep(mechanism, threads, group);
  }
  static MechanismDescription Closed(int n, std::uint64_t seed) {
    return testing::RandomChain(n, SpaceKind::kPlanar, seed);
  }
  static constexpr SpaceKind kSpace = SpaceKind::kPlanar;
  static constexpr int kOneFreedom = 3;           ///< bodies of a closed chain
  static constexpr bool kNearDegenerate = false;  ///< such chains come near degenerate positions
  static constexpr bool kTakesForces = false;     ///< other than gravity
  static MechanismDescription Draw(int n, std::uint64_t seed) {
    return RandomPath(n, 100 * seed + n, n > 40);
  }
};

/// The sweep over assemblies of pins in the plane.
struct OverAssemblies {
  using Space = Planar;
  static constexpr auto kName = "Assemblies";
  static auto Make(const Mechanism<Planar, double>& mechanism, int /*threads*/ = 1,
                   int /*group*/ = 0) {
    const PlanOptions options = PlanOptionsOf(SolverKind::kRankRevealing);
    return pins::MakeAssemblySweep(mechanism, MakePlan(mechanism, options));
  }
  static constexpr SpaceKind kSpace = SpaceKind::kPlanar;
  static constexpr int kOneFreedom = 3;
  static constexpr bool kNearDegenerate = false;
  static constexpr bool kTakesForces = true;
  static MechanismDescription Draw(int n, std::uint64_t seed) {
    return RandomBranches(n, 100 * seed + n);
  }
  /// A closed chain, and a bar that hangs from one of its bars.
  static MechanismDescription Closed(int n, std::uint64_t seed) {
    MechanismDescription chain = testing::RandomChain(n, kSpace, seed);
    chain.bodies.push_back(chain.bodies.back());
    chain.bodies.back().name = "pendulum";
    JointDescription& pin = chain.joints.emplace_back();
    pin.name = "hook";
    pin.from = {2, {0.3, 0.1, 0.0}, {0.0, 0.0, 0.0}};
    pin.to = {static_cast<int>(chain.bodies.size()) - 1, {0.0, 0.2, 0.0}, {0.0, 0.0, 0.0}};
    return chain;
  }
};

/// The sweep along arms of revolute joints in space.
struct AlongArms {
  using Space = Spatial;
  static constexpr auto kName = "Arms";
  static auto Make(const Mechanism<Spatial, double>& mechanism, int threads = 1,
                   int group = arms::kBodiesOfGroup) {
    return arms::MakeArmSweep(mechanism, threads, group);
  }
  static MechanismDescription Closed(int n, std::uint64_t seed) {
    return testing::RandomChain(n, SpaceKind::kSpatial, seed);
  }
  static constexpr SpaceKind kSpace = SpaceKind::kSpatial;
  static constexpr int kOneFreedom = 6;
  static constexpr bool kNearDegenerate = true;
  static constexpr bool kTakesForces = false;
  static MechanismDescription Draw(int n, std::uint64_t seed) {
    const bool closed = n > kOneFreedom && seed % 2 == 0;
    return RandomArms({.open = closed ? 0 : n, .closed = closed ? n : 0}, 100 * seed + n);
  }
};

}  // namespace loopbench::odca
