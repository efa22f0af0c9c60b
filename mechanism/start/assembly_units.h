// Units in which lengths and angles of one mechanism are alike, and the rows of its loops in them.
#pragma once

#include <cmath>
#include <vector>

#include "mechanism/loops/loop_speeds.h"
#include "mechanism/start/conflict.h"
#include "mechanism/start/least_squares.h"

namespace loopbench {

/// The worst number of a list in units, without them.
inline double InSi(const VectorX<double>& e, const VectorX<double>& units) {
  Eigen::Index worst = 0;
  e.cwiseAbs().maxCoeff(&worst);
  return std::abs(e[worst]) * units[worst];
}

/// Zeros for speeds that must not change: dense factors leave round-off there.
inline void ClearFixed(const std::vector<bool>& fixed, VectorX<double>* d) {
  for (std::size_t i = 0; i < fixed.size(); ++i) {
    if (fixed[i]) (*d)[static_cast<Eigen::Index>(i)] = 0.0;
  }
}

/// Units of constraint rows and of speeds: 1 for angles, and for lengths the power of two next to
/// the mechanism's length, which causes no rounding. A coupling has the unit of its first joint's
/// coordinate times the ratio. They do not depend on the position.
template <class Space>
struct AssemblyUnits {
  double length = 1.0;            ///< [m]
  VectorX<double> rows, columns;  ///< by constraint row, by speed

  AssemblyUnits() = default;
  /// Positions must be current.
  explicit AssemblyUnits(const Kinematics<Space, double>& kinematics) {
    const Mechanism<Space, double>& mechanism = kinematics.mechanism();
    length = std::exp2(std::round(std::log2(mechanism.length())));
    columns.setOnes(mechanism.num_u());
    for (const TreeStep& step : mechanism.tree()) {
      const JointState<Space, double>& state = kinematics.joints()[step.joint];
      const int offset = mechanism.joints()[step.joint].u_offset;
      for (int i = 0; i < state.num_u; ++i) columns[offset + i] = Of(state.H(i));
    }
    rows.setOnes(mechanism.num_equations());
    for (int index : mechanism.constraints()) {
      const Joint<Space, double>& joint = mechanism.joints()[index];
      for (int r = 0; r < joint.num_constraints(); ++r) {
        rows[joint.row + r] = Of(kinematics.joints()[index].D(r));
      }
    }
    for (int c = 0; mechanism.num_rows() + c < rows.size(); ++c) {
      const auto& [joint, ratio] = mechanism.couplings()[c].parts.front();
      rows[mechanism.num_rows() + c] = std::abs(ratio) * Of(kinematics.joints()[joint].basis[0]);
    }
  }

  /// Unit of a direction: H or D of a joint.
  double Of(const Direction<Space, double>& direction) const {
    return direction.angular.isZero() ? length : 1.0;
  }

  /// Scales all constraint rows and, below them, free coordinates of cut joints.
  VectorX<double> With(const Kinematics<Space, double>& kinematics,
                       const std::vector<OfCutJoint>& cut) const {
    VectorX<double> all(rows.size() + static_cast<Eigen::Index>(cut.size()));
    all.head(rows.size()) = rows;
    Eigen::Index row = rows.size();
    for (const auto& [joint, component] : cut) {
      all[row++] = Of(kinematics.joints()[joint].H(component));
    }
    return all;
  }
};

/// Returns J in units, a row per constraint, then per coupling, then per free coordinate of `cut`;
/// `fixed` speeds have no entries. `row_units` are the units of With().
template <class Space>
SparseRows LoopRows(const Kinematics<Space, double>& kinematics, const AssemblyUnits<Space>& units,
                    const VectorX<double>& row_units, const std::vector<OfCutJoint>& cut,
                    const std::vector<bool>& fixed) {
  const Mechanism<Space, double>& mechanism = kinematics.mechanism();
  std::vector<Eigen::Triplet<double>> entries;
  const auto add = [&](int row, int column, double value) {
    if (fixed[column]) return;
    entries.emplace_back(row, column, value * units.columns[column] / row_units[row]);
  };
  for (int index : mechanism.constraints()) {
    const Joint<Space, double>& joint = mechanism.joints()[index];
    const JointState<Space, double>& state = kinematics.joints()[index];
    ForEachSpeedOfLoop(kinematics, index, [&](int column, const Velocity<Space, double>& V) {
      for (int r = 0; r < joint.num_constraints(); ++r) {
        add(joint.row + r, column, state.D(r).dot(V));
      }
    });
  }
  int row = mechanism.num_rows();
  for (const Coupling<double>& coupling : mechanism.couplings()) {
    for (const auto& [index, ratio] : coupling.parts) {
      ForEachSpeedOfCoordinate(kinematics, index,
                               [&](int column, double rate) { add(row, column, ratio * rate); });
    }
    ++row;
  }
  for (const auto& [index, component] : cut) {
    const double inverse = mechanism.joints()[index].kind->inverse_H_squared;
    const Direction<Space, double> H = kinematics.joints()[index].H(component);
    ForEachSpeedOfLoop(kinematics, index, [&](int column, const Velocity<Space, double>& V) {
      add(row, column, inverse * H.dot(V));
    });
    ++row;
  }
  SparseRows J(row_units.size(), mechanism.num_u());
  J.setFromTriplets(entries.begin(), entries.end());
  return J;
}

}  // namespace loopbench
