#include "mechanism/loops/scaled_loops.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "mechanism/algebra/decompositions.h"
#include "mechanism/algebra/factors.h"
#include "mechanism/loops/tree_dynamics.h"

namespace loopbench {

namespace {

/// B and its factors.
struct Scaling {
  Eigen::MatrixXd B, rows;
  Eigen::LLT<Eigen::MatrixXd> L;
};

template <class Space>
Scaling Scale(const Kinematics<Space, double>& kinematics) {
  const Mechanism<Space, double>& mechanism = kinematics.mechanism();
  TreeDynamics<Space, double> dynamics(mechanism);
  Eigen::MatrixXd M, J, G;
  dynamics.MassMatrix(kinematics, Masses::kGeometric, M);
  dynamics.Jacobian(kinematics, J);
  dynamics.CouplingJacobian(kinematics, G);
  J.conservativeResize(mechanism.num_equations(), Eigen::NoChange);
  J.bottomRows(G.rows()) = G;
  Scaling scaling;
  scaling.L.compute(M);
  scaling.rows = scaling.B = J;
  if (J.size() == 0) return scaling;  // which a triangular solve does not take
  scaling.rows = scaling.L.matrixL().solve(J.transpose()).transpose();
  scaling.B = scaling.rows;
  for (int index : mechanism.constraints()) {
    const Joint<Space, double>& joint = mechanism.joints()[index];
    const int rows = joint.num_constraints();
    if (rows == 0) continue;
    const JointMatrix<double> free = FreeResponse(kinematics, Masses::kGeometric, index);
    auto block = scaling.B.middleRows(joint.row, rows);
    block = Eigen::LLT<Eigen::MatrixXd>(free).matrixL().solve(Eigen::MatrixXd(block));
    for (int i = 0; i < rows; ++i) scaling.rows.row(joint.row + i) /= std::sqrt(free(i, i));
  }
  for (int c = 0; c < G.rows(); ++c) {
    const int row = mechanism.num_rows() + c;
    const double scale = std::sqrt(FreeResponseOf(kinematics, Masses::kGeometric, c));
    scaling.B.row(row) /= scale;
    scaling.rows.row(row) /= scale;
  }
  return scaling;
}

double Largest(const Eigen::VectorXd& singular_values) {
  return std::max(singular_values[0], std::sqrt(DirectionWeights<double>::kMinResponse));
}

int Rank(const Eigen::VectorXd& singular_values) {
  const double least = kRankRatio * Largest(singular_values);
  return static_cast<int>((singular_values.array() > least).count());
}

}  // namespace

template <class Space>
LoopSpectrum SpectrumOfLoops(const Kinematics<Space, double>& kinematics) {
  const Scaling scaling = Scale(kinematics);
  LoopSpectrum spectrum;
  if (scaling.B.size() == 0) return spectrum;
  spectrum.singular_values = Eigen::BDCSVD<Eigen::MatrixXd>(scaling.B).singularValues();
  spectrum.largest = Largest(spectrum.singular_values);
  spectrum.rank = Rank(spectrum.singular_values);
  return spectrum;
}

template <class Space>
ScaledLoops ScaleLoops(const Kinematics<Space, double>& kinematics) {
  Scaling scaling = Scale(kinematics);
  ScaledLoops scaled;
  scaled.B = std::move(scaling.B);
  scaled.rows = std::move(scaling.rows);
  const Eigen::Index n = scaled.B.cols();
  Eigen::MatrixXd null = Eigen::MatrixXd::Identity(n, n);
  if (scaled.B.size() > 0) {
    const Eigen::BDCSVD<Eigen::MatrixXd> svd(scaled.B, Eigen::ComputeFullV);
    scaled.singular_values = svd.singularValues();
    scaled.rank = Rank(scaled.singular_values);
    null = svd.matrixV().rightCols(n - scaled.rank);
  }
  scaled.to_u = null;  // no columns where nothing can move, which a triangular solve does not take
  if (null.cols() > 0) scaling.L.matrixU().solveInPlace(scaled.to_u);
  return scaled;
}

template LoopSpectrum SpectrumOfLoops(const Kinematics<Planar, double>&);
template LoopSpectrum SpectrumOfLoops(const Kinematics<Spatial, double>&);
template ScaledLoops ScaleLoops(const Kinematics<Planar, double>&);
template ScaledLoops ScaleLoops(const Kinematics<Spatial, double>&);

}  // namespace loopbench
