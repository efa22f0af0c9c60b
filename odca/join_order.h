// In which order assemblies are joined: the tree behind a plan, before its lists are written.
//
// Two rules compete, and what a sweep would cost decides (`JoinCost`).
//
// *Pairing* grows the tree from below. All pairs of neighbouring assemblies wait in a queue; the
// next pair has the smallest boundary after its join, in classes a factor sqrt(2) apart (up to four
// bodies are one class), then the fewest bodies, also in powers of two, then exactly the smallest
// boundary. A chain halves, arms are finished before their hub takes them, and what would spread
// along a hub waits.
//
// *Dissection* splits from above, where pairing has made large joins. Four bodies far from each
// other are landmarks; the difference of the distances to two of them is a coordinate of the graph,
// and each of the six coordinates is swept for the cut with the fewest bodies on it
// (`Dissection`). On a k x k grid cuts have O(k) bodies at the top and halve in area below, hence
// O(k^3) multiply-adds = O(n^1.5) (Lipton, Rose and Tarjan 1979; George 1973).
//
// Both take O(n log n) steps per level of the dissection, of which there are O(log n).
#pragma once

#include <span>
#include <vector>

#include "odca/plan.h"

namespace loopbench::odca {

/// A join of two assemblies. Assembly b < num_bodies is body b alone, num_bodies + k is the result
/// of join k.
struct Join {
  int left = 0, right = 0;
};

/// Multiply-adds of a node with `rows` rows, `handles` bodies before it and `kept` after it, each
/// with `dim` directions, as `Sweep::operations()` counts them when each joint meets both sides.
double JoinCost(double rows, double handles, double kept, double dim);

/// The joins of all bodies, children first. `waiting`: joints to Ground that no join closes, by
/// body. Every join has at least one joint between its sides; separate parts stay separate.
std::vector<Join> OrderJoins(int num_bodies, std::span<const PlanJoint> joints,
                             std::span<const int> waiting, int dim);

}  // namespace loopbench::odca
