// Constraint rows of all cut joints, scaled so that lengths and angles compare: geometry alone.
#pragma once

#include <vector>

#include "mechanism/algebra/factors.h"
#include "mechanism/loops/tree_dynamics.h"

namespace loopbench {

/// Constraints of all cut joints as rows that compare: J L^-T with L L^T the geometric mass matrix,
/// each row over the square root of its own free response. Rows are by joint and direction in the
/// joint's own axes, imposed directions before released ones. In double, whatever the scalar.
struct DirectionRows {
  Eigen::MatrixXd rows;
  Eigen::VectorXd mismatch;           ///< of positions, scaled with unit masses, so [m]
  Eigen::LLT<Eigen::MatrixXd> mass;   ///< L
  std::vector<int> first, count;      ///< rows of each constraint, in the order of constraints()
  std::vector<Eigen::MatrixXd> free;  ///< of each constraint: free responses, unscaled
};
/// Positions of `kinematics` must be current; any coordinate set.
template <class Space, class S>
DirectionRows RowsOfDirections(const Kinematics<Space, S>& kinematics);

}  // namespace loopbench
