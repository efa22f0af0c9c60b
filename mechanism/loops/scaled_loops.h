// Constraints of all loops at one position, scaled so that rank depends on geometry alone.
//
// With M_g = L L^T the mass matrix of unit bodies (loop_solver.h) and K_g K_g^T the free response
// of each cut joint, the singular values of
//
//   B = K_g^-1 J L^-T
//
// lie between 0 and the square root of the number of constraints; those below kRankRatio of the
// largest (which counts as 0.1 at least: between rigid parts all are round-off) count as zero.
// Dense: for analyses before a run.
#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include "mechanism/model/kinematics.h"

namespace loopbench {

/// Ratio at which the weight of direction_weights.h is one half for one joint: 2e-4 sqrt(sqrt(ln
/// 2)).
inline constexpr double kRankRatio = 1.825e-4;

/// The loops' constraints of one position, scaled.
struct ScaledLoops {
  Eigen::MatrixXd B;     ///< K_g^-1 J L^-T
  Eigen::MatrixXd rows;  ///< rows of J L^-T, each over its own free response: joints not mixed
  Eigen::MatrixXd to_u;  ///< null vectors of B as speeds, columns
  Eigen::VectorXd singular_values;
  int rank = 0;
};

/// Singular values of B alone.
struct LoopSpectrum {
  Eigen::VectorXd singular_values;  ///< the largest first
  double largest = 0.0;             ///< reference for comparisons: the first, or at least 0.1
  int rank = 0;
};
template <class Space>
LoopSpectrum SpectrumOfLoops(const Kinematics<Space, double>& kinematics);

/// Positions of `kinematics`, in joint coordinates, must be current, for both.
template <class Space>
ScaledLoops ScaleLoops(const Kinematics<Space, double>& kinematics);

/// Constraints of all cut joints as comparable rows: J L^-T, with L L^T the geometric mass matrix.
/// Each row is divided by the square root of its own free response. Rows are by joint and direction
/// in the joint's own axes, imposed directions before released ones. Always in double.
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
