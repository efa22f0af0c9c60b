// Order of joins: the tree behind an assembly tree's lists (plan.h).
//
// Three rules compete; the estimated cost of a pass decides (`JoinCost`).
//
// *Pairing* grows the tree from below (pairing.h). All pairs of neighbouring assemblies wait in a
// queue; the next pair has the smallest boundary after its join, in classes a factor sqrt(2) apart
// (up to four bodies are one class), then the fewest bodies, also in powers of two, then exactly
// the smallest boundary. A chain becomes a balanced tree, arms are finished before their hub takes
// them, and pairs whose boundary would grow along a hub come last.
//
// If pairing makes large joins, two other rules are tried. *Front* adds body after body
// to one assembly; it suits bodies between several hubs. *Dissection* cuts from
// above; a k x k grid is cut by O(k) bodies at the top and halves in area below, hence O(k^3)
// multiply-adds = O(n^1.5) (George 1973; Lipton, Rose and Tarjan 1979). The best rule orders its
// parts in turn.
//
// All take O(n log n) steps per level of the dissection, of which there are O(log n).
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
/// body. Every join has at least one joint between its sides; separate parts stay separate. If
/// `start` is a body, every part is joined body after body, and its part begins with it.
std::vector<Join> OrderJoins(int num_bodies, std::span<const PlanJoint> joints,
                             std::span<const int> waiting, int dim, int start = 0);

}  // namespace loopbench::odca
