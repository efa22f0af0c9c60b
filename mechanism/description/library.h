// Families of mechanisms, built in code for tests and benchmarks of growing size.
//
//   Chain(n)      o--1--2-- .. --n--o       n equal bars between two ground pins; n >= 3
//   Ladder(n)     o  o  o       o           n windows: n + 1 cranks on ground pins, n couplers
//                 |--|--|-- .. -|           (reference A02, "N-four-bar")
//   Grid(m, n)    m ladders of n windows, each hanging from the joints of the one above: loops that
//                 share bodies in two directions, m degrees of freedom
//   Tree(n)       n bars below a ground pin, two on the tip of each: no loop, log2(n) deep
//   Hub(m, n)     a disc on a ground pin, m arms of n bars around it; arms may end on ground pins,
//                 then each closes a loop through the disc
//   Arm(n)        n bars in space, each joint's axis turned against the one before; open, or closed
//                 on Ground: a loop with n - 5 degrees of freedom
#pragma once

#include "mechanism/description/description.h"

namespace loopbench {

/// Closed planar chain of n unit bars (1 m, 1 kg, 1 kg m^2), gravity along -y. The joints lie on an
/// arc of a regular polygon, so the loop is closed exactly and no three joints are in line; the
/// last joint is the one to cut. Speeds are left to the caller.
MechanismDescription Chain(int num_bars);

/// N-four-bar of benchmark A02: cranks and couplers of 1 m, 1 kg, 1/12 kg m^2 (slender), cranks at
/// `angle` from +x, turning at `speed` [rad/s] on the parallel branch.
MechanismDescription Ladder(int num_windows, double angle, double speed);

/// Returns `num_storeys` rows of `num_windows` parallelograms of unit bars as in Ladder. Storey r =
/// 1, 2, .. is at `angle` + 0.1 (r - 1) from +x and turns at r `speed` [rad/s].
MechanismDescription Grid(int num_storeys, int num_windows, double angle, double speed);

/// Returns unit bars as in Ladder: the first hangs from Ground, the others in pairs from the tips
/// of the previous ones, bent to either side by 0.4 rad. All rotate at `speed` [rad/s] relative to
/// their parents.
MechanismDescription Tree(int num_bars, double speed);

/// A disc (radius 1 m, 1 kg) pinned to Ground at its centre, with `num_arms` arms of `num_bars`
/// bars as in Ladder on its rim, all bent alike. Open arms have 1 + arms x bars degrees of freedom,
/// those whose tips are pinned to Ground (`closed`, bars >= 2) 1 + arms x (bars - 2). Speeds are
/// left to the caller.
MechanismDescription Hub(int num_arms, int num_bars, bool closed);

/// `num_bars` bars of 1 m and 1 kg with moments of inertia of 0.02, 0.3 and 0.31 kg m^2, along the
/// sides of a regular polygon with one corner more, gravity along -y. Axes of joints are across the
/// bars and out of the polygon's plane, each turned by 2.4 rad (the golden angle) about the bar
/// against that before it, so that no three of them are alike. `closed` (bars >= 6) adds the side
/// that is left as Ground; its last joint is the one to cut. Coordinates start at 0, speeds are
/// left to the caller.
MechanismDescription Arm(int num_bars, bool closed);

/// A unit bar from its origin A to B = (length, 0): com in the middle.
BodyDescription Bar(const std::string& name, double length, double mass, double inertia);

/// Revolute joint between points of two bodies.
JointDescription Revolute(const std::string& name, int from, const Eigen::Vector3d& at_from, int to,
                          const Eigen::Vector3d& at_to);

}  // namespace loopbench
