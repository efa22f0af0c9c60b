// Choice of dependent speeds and constraints for coordinate reduction.
//
// Made at the start and reviewed at accepted steps, never inside a right-hand side; may allocate.
#pragma once

#include <vector>

#include "mechanism/loops/tree_dynamics.h"

namespace loopbench::reduction {

/// Dependent speeds (columns of J) and the rows of J that determine them, both ascending.
template <class S>
struct Partition {
  std::vector<int> dependent, rows;
  S rcond = S(1);  ///< ratio of the extreme pivots of J restricted to them
};

/// Rank of J at the current positions, a property of geometry (mechanism/loops/loop_solver.h).
template <class Space, class S>
int GeometricRank(const Kinematics<Space, S>& kinematics, TreeDynamics<Space, S>& dynamics,
                  const MatrixX<S>& J);

/// Chooses dependent speeds by QR of J with column pivoting, and rows by QR of the remainder of J.
template <class S>
Partition<S> BestPartition(const MatrixX<S>& J, int rank);

/// rcond of a given partition at the current J; of a single constraint its pivot over the best one.
template <class S>
S PartitionCondition(const MatrixX<S>& J, const Partition<S>& partition);

}  // namespace loopbench::reduction
