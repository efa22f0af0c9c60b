#include "mechanism/loops/direction_rows.h"

#include <cmath>

#include "mechanism/algebra/instantiate.h"

namespace loopbench {

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
