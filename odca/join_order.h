// Order of joins: the tree behind an assembly tree's lists (plan.h, docs/theory/order-of-joins.md).
//
// Three rules compete; the estimated cost of a pass decides (`JoinCost`). *Pairing* grows the tree
// from below. The next pair of neighbouring assemblies has the smallest boundary after its join, in
// classes a factor sqrt(2) apart. Among equals it has the fewest bodies, in powers of two. If this
// makes large joins, two other rules are tried. *Front* adds body after body to one assembly.
// *Dissection* cuts from above (George 1973; Lipton, Rose and Tarjan 1979); the best rule orders
// its parts in turn. All take O(n log n) steps in each of the O(log n) levels of the dissection.
#pragma once

#include <span>
#include <vector>

#include "odca/plan.h"

namespace loopbench::odca {

/// The graph of bodies and joints without Ground.
class BodyGraph {
 public:
  /// A joint seen from one of its bodies.
  struct End {
    int body = 0;   ///< the other one
    int joint = 0;  ///< position in the list of joints
    int rows = 0;
  };

  BodyGraph(int num_bodies, std::span<const PlanJoint> joints, std::span<const int> waiting)
      : first_(num_bodies + 1, 0), waiting_(waiting) {
    const auto each = [&](auto&& take) {
      for (int j = 0; j < static_cast<int>(joints.size()); ++j) {
        if (joints[j].from == 0 || joints[j].to == 0) continue;
        take(joints[j].from, joints[j].to, j);
        take(joints[j].to, joints[j].from, j);
      }
    };
    each([&](int body, int, int) { ++first_[body + 1]; });
    for (int body = 0; body < num_bodies; ++body) first_[body + 1] += first_[body];
    ends_.resize(first_.back());
    std::vector<int> next(first_.begin(), first_.end() - 1);
    each([&](int body, int other, int j) { ends_[next[body]++] = {other, j, joints[j].rows}; });
  }

  int num_bodies() const { return static_cast<int>(first_.size()) - 1; }
  std::span<const End> ends(int body) const {
    return std::span(ends_).subspan(first_[body], first_[body + 1] - first_[body]);
  }
  /// Returns a body's number of joints: to other bodies, and to Ground as counted by `waiting`.
  int degree(int body) const { return first_[body + 1] - first_[body] + waiting_[body]; }

 private:
  std::vector<int> first_;  ///< of each body in ends_
  std::vector<End> ends_;
  std::span<const int> waiting_;
};

/// A join of two assemblies. Assembly b < num_bodies is body b alone, num_bodies + k is the result
/// of join k.
struct Join {
  int left = 0, right = 0;
};

/// The joins of all bodies, children first. `waiting`: joints to Ground that no join closes, by
/// body. Every join has at least one joint between its sides; separate parts stay separate. If
/// `start` is a body, every part is joined body after body, and its part begins with it. `looks`:
/// number of joint evaluations by pairing.
std::vector<Join> OrderJoins(int num_bodies, std::span<const PlanJoint> joints,
                             std::span<const int> waiting, int dim, int start = 0,
                             long* looks = nullptr);

}  // namespace loopbench::odca
