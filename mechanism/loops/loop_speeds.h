// Speeds of the forest that move the two sides of a cut joint relative to each other.
#pragma once

#include <utility>
#include <vector>

#include "mechanism/model/kinematics.h"

namespace loopbench {

/// The steps of the tree from the two sides of a cut joint, Q and P, inwards to where they meet.
template <class Space, class S>
std::pair<std::vector<TreeStep>, std::vector<TreeStep>> WaysOfLoop(
    const Mechanism<Space, S>& mechanism, int index) {
  std::pair<std::vector<TreeStep>, std::vector<TreeStep>> ways;
  int to_Q = mechanism.step_of_body(mechanism.joints()[index].to),
      to_P = mechanism.step_of_body(mechanism.joints()[index].from);
  while (to_Q != to_P) {
    // a step comes after its inward step: the later one is on one path only
    int& s = to_Q > to_P ? to_Q : to_P;
    (to_Q > to_P ? ways.first : ways.second).push_back(mechanism.tree()[s]);
    s = mechanism.step_of_body(mechanism.tree()[s].parent);
  }
  return ways;
}

/// Calls sink(index into u, V) for each speed of the forest between the two sides of a cut joint; V
/// is the change of V_Q - V_P at the joint's Mo per unit of that speed. A speed of a joint at p_j
/// moves everything outward of it, including the point p of the cut joint:
///
///   V = S(p - p_j) H_i        + on the way from Ground to Q, - on the way to P
///
/// On the common part of both paths, neither side moves relative to the other.
template <class Space, class S, class Sink>
void ForEachSpeedOfLoop(const Kinematics<Space, S>& kinematics, int index, const Sink& sink) {
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  const Joint<Space, S>& cut = mechanism.joints()[index];
  const Linear<Space, S> p = kinematics.JointPoint(index);
  const auto& tree = mechanism.tree();
  int to_Q = mechanism.step_of_body(cut.to), to_P = mechanism.step_of_body(cut.from);
  while (to_Q != to_P) {
    // a step comes after its inward step: the later one is on one path only
    const bool on_Q = to_Q > to_P;
    int& s = on_Q ? to_Q : to_P;
    const TreeStep& step = tree[s];
    const JointState<Space, S>& moving = kinematics.joints()[step.joint];
    const Joint<Space, S>& joint = mechanism.joints()[step.joint];
    const Linear<Space, S> arm = p - kinematics.JointPoint(step.joint);
    const S sign = S(on_Q ? step.sign : -step.sign);
    for (int i = 0; i < joint.num_u(); ++i) {
      sink(joint.u_offset + i, ShiftMotion<Space, S>(Velocity<Space, S>(moving.H(i) * sign), arm));
    }
    s = mechanism.step_of_body(step.parent);
  }
}

/// Calls sink(index into u, rate) for each speed of the forest that changes the one coordinate of a
/// joint; `rate` is the coordinate's rate per unit of that speed. Drives have no speed.
template <class Space, class S, class Sink>
void ForEachSpeedOfCoordinate(const Kinematics<Space, S>& kinematics, int index, const Sink& sink) {
  const Joint<Space, S>& joint = kinematics.mechanism().joints()[index];
  if (joint.in_tree()) {
    if (joint.num_drives == 0) sink(joint.u_offset, S(1));
    return;
  }
  const Wrench<Space, S> along = WrenchOfEffort<Space, S>(kinematics.joints()[index].basis[0],
                                                          joint.kind->inverse_H_squared, S(1));
  ForEachSpeedOfLoop(kinematics, index,
                     [&](int column, const Velocity<Space, S>& V) { sink(column, along.dot(V)); });
}

}  // namespace loopbench
