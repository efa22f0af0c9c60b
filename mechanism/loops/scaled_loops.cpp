#include "mechanism/loops/scaled_loops.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "mechanism/algebra/decompositions.h"
#include "mechanism/algebra/factors.h"
#include "mechanism/algebra/instantiate.h"
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

namespace {

/// Transforms directions of a joint to its own axes: some may be given in ground axes
/// (Kinematics::Release()).
template <class Space, class S>
MatrixX<S> ToOwnAxes(const Kinematics<Space, S>& kinematics, const Joint<Space, S>& joint,
                     const JointState<Space, S>& state) {
  const int size = joint.num_directions();
  const bool own = joint.kind->basis != nullptr || joint.num_drives > 0 || joint.num_released > 0;
  if (own) return MatrixX<S>::Identity(size, size);
  const Rotation<Space, S> R = kinematics.poses()[joint.from].R * joint.X_PF.R;
  MatrixX<S> T(size, size);
  for (int i = 0; i < size; ++i) {
    const auto axis = Direction<Space, S>::Unit(joint.kind->axes[joint.kind->num_u + i]);
    const Direction<Space, S> D_F = Rotate(R, axis);
    for (int j = 0; j < size; ++j) T(i, j) = D_F.dot(state.D(j));
  }
  return T;
}

}  // namespace

template <class Space, class S>
DirectionRows RowsOfDirections(const Kinematics<Space, S>& kinematics) {
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  TreeDynamics<Space, S> dynamics(mechanism);
  DirectionRows result;
  int size = 0;
  for (int index : mechanism.constraints()) {
    result.first.push_back(size);
    result.count.push_back(mechanism.joints()[index].num_directions());
    size += result.count.back();
  }
  const int of_joints = size;
  size += static_cast<int>(mechanism.couplings().size());
  MatrixX<S> M;
  dynamics.MassMatrix(kinematics, Masses::kGeometric, M);
  result.mass.compute(M.template cast<double>().eval());
  result.rows.setZero(size, mechanism.num_u());
  result.mismatch.setZero(size);
  if (result.rows.size() == 0) return result;
  MatrixX<S> J = MatrixX<S>::Zero(size, mechanism.num_u());
  for (std::size_t c = 0; c < result.first.size(); ++c) {
    const int index = mechanism.constraints()[c];
    const MatrixX<S> T =
        ToOwnAxes(kinematics, mechanism.joints()[index], kinematics.joints()[index]);
    auto rows = J.middleRows(result.first[c], result.count[c]);
    dynamics.JacobianOf(kinematics, index, rows);
    rows = T * MatrixX<S>(rows);
    const MatrixX<S> free =
        T * FreeResponse(kinematics, Masses::kGeometric, index, true) * T.transpose();
    const Components<Space, S> all =
        kinematics.joints()[index].Along(kinematics.ConstraintMismatch(index), result.count[c]);
    const MatrixX<S> e = T * all.head(result.count[c]);
    result.free.push_back(free.template cast<double>());
    for (int i = 0; i < result.count[c]; ++i) {
      const double scale = std::sqrt(static_cast<double>(free(i, i)));
      const int row = result.first[c] + i;
      result.rows.row(row) = rows.row(i).template cast<double>() / scale;
      result.mismatch[row] = static_cast<double>(e(i, 0)) / scale;
    }
  }
  MatrixX<S> G;
  dynamics.CouplingJacobian(kinematics, G);
  for (int c = 0; c < G.rows(); ++c) {
    const double scale =
        std::sqrt(static_cast<double>(FreeResponseOf(kinematics, Masses::kGeometric, c)));
    result.rows.row(of_joints + c) = G.row(c).template cast<double>() / scale;
    result.mismatch[of_joints + c] = static_cast<double>(kinematics.CouplingMismatch(c)) / scale;
  }
  result.rows = result.mass.matrixL().solve(result.rows.transpose()).transpose();
  return result;
}

#define LOOPBENCH_INSTANTIATE(Space, S) \
  template DirectionRows RowsOfDirections(const Kinematics<Space, S>&);
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
