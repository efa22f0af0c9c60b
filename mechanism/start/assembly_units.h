// Units in which lengths and angles of one mechanism are alike.
#pragma once

#include <cmath>

#include "mechanism/model/kinematics.h"

namespace loopbench {

/// Units of constraint rows and of speeds: 1 for angles, and for lengths a power of two next to the
/// mechanism's own length, which rounds nothing. Whether a direction is a length does not depend on
/// the position.
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
    rows.setOnes(mechanism.num_rows());
    for (int index : mechanism.constraints()) {
      const Joint<Space, double>& joint = mechanism.joints()[index];
      for (int r = 0; r < joint.num_constraints(); ++r) {
        rows[joint.row + r] = Of(kinematics.joints()[index].D(r));
      }
    }
  }

  /// Of a direction: H or D of a joint.
  double Of(const Direction<Space, double>& direction) const {
    return direction.angular.isZero() ? length : 1.0;
  }
};

}  // namespace loopbench
