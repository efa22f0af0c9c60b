#include "reduction/partition.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "mechanism/algebra/instantiate.h"
#include "mechanism/loops/loop_solver.h"

namespace loopbench::reduction {

namespace {

/// Returns the first `rank` pivots of a QR with column pivoting, ascending. Columns equal up to
/// rounding, as for equal bodies, are taken in order: each has a slightly smaller weight than the
/// one before, by more than rounding in any scalar and less than a useful difference.
template <class S>
std::vector<int> FirstPivots(MatrixX<S> columns, int rank) {
  constexpr double kFromFirstToLast = 1e-3;
  for (Eigen::Index j = 1; j < columns.cols(); ++j) {
    columns.col(j) *=
        S(1.0 - kFromFirstToLast * static_cast<double>(j) / static_cast<double>(columns.cols()));
  }
  const Eigen::ColPivHouseholderQR<MatrixX<S>> qr(columns);
  std::vector<int> pivots(rank);
  for (int i = 0; i < rank; ++i) pivots[i] = static_cast<int>(qr.colsPermutation().indices()[i]);
  std::ranges::sort(pivots);
  return pivots;
}

}  // namespace

template <class Space, class S>
int GeometricRank(const Kinematics<Space, S>& kinematics, TreeDynamics<Space, S>& dynamics,
                  const MatrixX<S>& J) {
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  LoopSolver<S> loop(mechanism.RowsOfConstraints());
  if (loop.size() == 0 || mechanism.num_u() == 0) return 0;
  for (int j = 0; j < static_cast<int>(mechanism.constraints().size()); ++j) {
    loop.SetScale(j, FreeResponse(kinematics, Masses::kGeometric, mechanism.constraints()[j]));
  }
  MatrixX<S> M;
  dynamics.MassMatrix(kinematics, Masses::kGeometric, M);
  const MatrixX<S> response = J * M.llt().solve(J.transpose());
  loop.FactorGeometric(response, kinematics.regularization());
  return loop.rank();
}

template <class S>
Partition<S> BestPartition(const MatrixX<S>& J, int rank) {
  Partition<S> partition;
  if (rank == 0) return partition;
  partition.dependent = FirstPivots<S>(J, rank);
  MatrixX<S> transposed(rank, J.rows());
  for (int i = 0; i < rank; ++i) transposed.row(i) = J.col(partition.dependent[i]).transpose();
  partition.rows = FirstPivots<S>(transposed, rank);
  partition.rcond = PartitionCondition(J, partition);
  return partition;
}

template <class S>
S PartitionCondition(const MatrixX<S>& J, const Partition<S>& partition) {
  MatrixX<S> J_D(partition.rows.size(), partition.dependent.size());
  for (std::size_t k = 0; k < partition.rows.size(); ++k) {
    for (std::size_t i = 0; i < partition.dependent.size(); ++i) {
      J_D(k, i) = J(partition.rows[k], partition.dependent[i]);
    }
  }
  // one pivot has no other to be compared with: the largest it could be
  if (J_D.size() == 1) {
    using std::abs;
    return abs(J_D(0, 0)) / J.row(partition.rows[0]).cwiseAbs().maxCoeff();
  }
  const Eigen::ColPivHouseholderQR<MatrixX<S>> qr(J_D);
  const auto pivots = qr.matrixQR().diagonal().cwiseAbs();
  return pivots.minCoeff() / pivots.maxCoeff();
}

#define LOOPBENCH_INSTANTIATE(Space, S)                                            \
  template int GeometricRank(const Kinematics<Space, S>&, TreeDynamics<Space, S>&, \
                             const MatrixX<S>&);
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

#define LOOPBENCH_INSTANTIATE(S)                               \
  template Partition<S> BestPartition(const MatrixX<S>&, int); \
  template S PartitionCondition(const MatrixX<S>&, const Partition<S>&);
LOOPBENCH_FOR_EACH_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench::reduction
