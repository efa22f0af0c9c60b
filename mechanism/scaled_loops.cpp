#include "mechanism/scaled_loops.h"

#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "mechanism/tree_dynamics.h"

namespace loopbench {

template <class Space>
ScaledLoops ScaleLoops(const Kinematics<Space, double>& kinematics) {
  const Mechanism<Space, double>& mechanism = kinematics.mechanism();
  const auto& unit_bodies = mechanism.geometric_bodies();
  TreeDynamics<Space, double> dynamics(mechanism);
  Eigen::MatrixXd M, J;
  dynamics.MassMatrix(kinematics, unit_bodies, M);
  dynamics.Jacobian(kinematics, J);
  const Eigen::LLT<Eigen::MatrixXd> L(M);
  ScaledLoops scaled;
  scaled.rows = L.matrixL().solve(J.transpose()).transpose();
  scaled.B = scaled.rows;
  for (int index : mechanism.constraints()) {
    const Joint<Space, double>& joint = mechanism.joints()[index];
    const int rows = joint.num_constraints();
    if (rows == 0) continue;
    const JointMatrix<double> free = FreeResponse<Space, double>(kinematics, unit_bodies, index);
    auto block = scaled.B.middleRows(joint.row, rows);
    block = Eigen::LLT<Eigen::MatrixXd>(free).matrixL().solve(Eigen::MatrixXd(block));
    for (int i = 0; i < rows; ++i) scaled.rows.row(joint.row + i) /= std::sqrt(free(i, i));
  }
  Eigen::MatrixXd null = Eigen::MatrixXd::Identity(J.cols(), J.cols());
  if (J.rows() > 0 && J.cols() > 0) {
    const Eigen::BDCSVD<Eigen::MatrixXd> svd(scaled.B, Eigen::ComputeFullV);
    scaled.singular_values = svd.singularValues();
    const double largest =
        std::max(scaled.singular_values[0], std::sqrt(LoopSolver<double>::kLeastResponse));
    const double least = kRankRatio * largest;
    scaled.rank = static_cast<int>((scaled.singular_values.array() > least).count());
    null = svd.matrixV().rightCols(J.cols() - scaled.rank);
  }
  scaled.to_u = null;  // no columns where nothing can move, which a triangular solve does not take
  if (null.cols() > 0) L.matrixU().solveInPlace(scaled.to_u);
  return scaled;
}

template ScaledLoops ScaleLoops(const Kinematics<Planar, double>&);
template ScaledLoops ScaleLoops(const Kinematics<Spatial, double>&);

}  // namespace loopbench
