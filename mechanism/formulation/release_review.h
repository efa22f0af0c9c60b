// Looks again, as a mechanism moves, at the directions that its joints release (redundancy.h).
//
// It asks geometry alone, so that all formulations and both coordinate sets change their choice at
// the same positions.
#pragma once

#include <vector>

#include "mechanism/model/kinematics.h"

namespace loopbench {

template <class Space, class S>
class ReleaseReview {
 public:
  /// At an accepted step of length h, kinematics being current in position and speed. The choice to
  /// change to, or null.
  const std::vector<Released>* Review(const Kinematics<Space, S>& kinematics, S h);

 private:
  double travel_ = 0.0;
  std::vector<Released> better_;
};

}  // namespace loopbench
