// The graph of bodies and joints as the rules of join_order.h read it: Ground is left out.
#pragma once

#include <span>
#include <vector>

#include "odca/plan.h"

namespace loopbench::odca {

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

}  // namespace loopbench::odca
