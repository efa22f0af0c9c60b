// Mechanisms that short cuts of right-hand sides serve, and what tests need to know of each.
#pragma once

#include <algorithm>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "odca/arm_sweep.h"
#include "odca/path_sweep.h"
#include "tests/contract/builder.h"
#include "tests/odca/short_cut.h"

namespace loopbench::odca {

using testing::Builder;
using testing::Random;

inline JointDescription Pin(Random& random, int from, int to) {
  const auto side = [&](int body) {
    return JointSide{body,
                     random.Vector(1.0, false),
                     {0.0, 0.0, random.Uniform(-std::numbers::pi, std::numbers::pi)}};
  };
  JointDescription pin;
  pin.from = side(from);
  pin.to = side(to);
  if (random.Chance(0.5)) std::swap(pin.from, pin.to);
  return pin;
}

/// Bodies in a row, in any order of numbers, some of them pinned to Ground, no two neighbours, so
/// that they can move; where that closes a loop the joint before such a body is cut, or the pin of
/// the last one. Half of them may be a path of its own.
inline MechanismDescription RandomPath(int n, std::uint64_t seed, bool in_halves = false) {
  Builder b("path", SpaceKind::kPlanar, seed);
  std::vector<int> row;
  for (int k = 0; k < n; ++k) row.push_back(b.AddBody(1.0));
  for (int k = n - 1; k > 0; --k) std::swap(row[k], row[b.random.Below(k + 1)]);
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
  for (std::size_t j = 0; j < joints.size(); ++j) joints[j].name = "j" + std::to_string(j);
  return b.description;
}

/// Bodies in a row from Ground, in any order of numbers, joints in any frames and either way round;
/// closed on Ground by one more joint, of which one is cut, with this kind.
inline void AddPath(Builder& b, int n, bool closed, JointType cut_kind) {
  auto& joints = b.description.joints;
  std::vector<int> row;
  for (int k = 0; k < n; ++k) row.push_back(b.AddBody(1.0));
  for (int k = n - 1; k > 0; --k) std::swap(row[k], row[b.random.Below(k + 1)]);
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
  using Sweep = pins::PathSweep;
  static constexpr SpaceKind kSpace = SpaceKind::kPlanar;
  static constexpr int kOneFreedom = 3;           ///< bodies of a closed chain
  static constexpr bool kNearDegenerate = false;  ///< such chains come near degenerate positions
  static MechanismDescription Draw(int n, std::uint64_t seed) {
    return RandomPath(n, 100 * seed + n, n > 40);
  }
};

/// The sweep along arms of revolute joints in space.
struct AlongArms {
  using Space = Spatial;
  using Sweep = arms::ArmSweep;
  static constexpr SpaceKind kSpace = SpaceKind::kSpatial;
  static constexpr int kOneFreedom = 6;
  static constexpr bool kNearDegenerate = true;
  static MechanismDescription Draw(int n, std::uint64_t seed) {
    const bool closed = n > kOneFreedom && seed % 2 == 0;
    return RandomArms({.open = closed ? 0 : n, .closed = closed ? n : 0}, 100 * seed + n);
  }
};

}  // namespace loopbench::odca
