// Positions at which all loops are closed, as near as possible to the guesses of a description.
//
// With e(q) the violation at the cut joints, the coordinates that are not fixed first go from the
// guesses to e = 0 by Levenberg-Marquardt: damping vanishes near a solution, and convergence is
// quadratic. If these steps reach a position near the guesses, it is the result. Otherwise another
// branch may be nearer, or angles may have wound. A search then starts from the guesses and from
// random positions about them and minimises
//
//   |e(q)|^2 + mu^2 |w (q - guess)|^2    over the guessed coordinates, for mu falling to 1e-2
//
// so that guesses are kept first, coordinates without a guess adapt to them, and guesses change
// last. From the position that is found, further steps of this kind with closed loops lead to the
// nearest one: the start is the closed position nearest to the guesses. Angles lie within half a
// turn of their guesses, since whole turns change no pose.
#pragma once

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "mechanism/loops/loop_speeds.h"
#include "mechanism/start/assembly.h"
#include "mechanism/start/least_squares.h"

namespace loopbench {

inline constexpr double kTurn = 2 * std::numbers::pi;  ///< [rad]

/// A number in [0, 1) of 53 random bits: the same number with every standard library.
inline double UnitNumber(std::mt19937_64& generator) {
  return static_cast<double>(generator() >> 11) * 0x1p-53;
}

/// A free coordinate of a joint that is not in the tree.
struct OfCutJoint {
  int joint, component;
};

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

// Guesses of a description, and distances of positions from them. Values that are NaN are not
// given. Tree joints differ from their guesses by coordinates, turns included; quaternions by the
// rotation vector between both. Joints that close loops are measured, angles modulo a turn.

template <class Space>
class Guesses {
 public:
  /// `mechanism` is in joint coordinates. All are kept by reference.
  Guesses(const MechanismDescription& description, const Mechanism<Space, double>& mechanism,
          const AssemblyUnits<Space>& units);

  /// Speeds of fixed joints; and of others with a guess.
  const std::vector<bool>& fixed() const { return fixed_; }
  const std::vector<bool>& guessed() const { return guessed_; }
  /// Free coordinates of cut joints that have values: fixed ones, and others.
  const std::vector<OfCutJoint>& held() const { return held_.free; }
  const std::vector<OfCutJoint>& loose() const { return loose_.free; }
  /// Weights of the differences from guesses, in units: by speed, 1 without a guess; of loose().
  const VectorX<double>& weights() const { return weights_; }
  const VectorX<double>& loose_weights() const { return loose_.weights; }

  /// q less GuessedPositions(), by speed, in units.
  VectorX<double> Apart(const VectorX<double>& q) const;
  /// Like Apart(), with 0 for coordinates without a guess.
  VectorX<double> GuessedApart(const VectorX<double>& q) const;
  /// Deviations of held() and loose() from their values, in units.
  VectorX<double> HeldApart(const Kinematics<Space, double>& at) const { return Apart(held_, at); }
  VectorX<double> LooseApart(const Kinematics<Space, double>& at) const {
    return Apart(loose_, at);
  }

  /// Sum of weighted squares in units. Coordinates without a guess have a weight that decides only
  /// between positions which are equally far from all guesses.
  double SquaredDistance(const Kinematics<Space, double>& at) const;
  /// The largest difference from a guess, in units.
  double Farthest(const Kinematics<Space, double>& at) const;
  std::vector<MissedGuess> Missed(const Kinematics<Space, double>& at) const;

  /// q with whole turns taken off angles that are more than half a turn from their guesses.
  VectorX<double> Unwound(VectorX<double> q) const;

 private:
  /// Cut joints with values.
  struct CutJoints {
    struct Values {
      int joint;
      const double* values;
    };
    std::vector<Values> values;
    std::vector<OfCutJoint> free;  ///< of all of them, in order
    VectorX<double> weights;       ///< of these
  };

  bool IsGiven(const JointKind<Space, double>& kind, const double* values, int speed) const {
    return !std::isnan(
        values[kind.has_quaternion() && speed < 3 ? 0 : speed + kind.num_q - kind.num_u]);
  }
  void SetColumns(const Joint<Space, double>& joint, std::vector<bool>* columns) const;
  VectorX<double> Apart(const CutJoints& cut, const Kinematics<Space, double>& at) const;

  const MechanismDescription& description_;
  const Mechanism<Space, double>& mechanism_;
  const AssemblyUnits<Space>& units_;
  VectorX<double> guess_;
  std::vector<bool> is_held_;          ///< by joint
  std::vector<bool> fixed_, guessed_;  ///< by speed
  VectorX<double> weights_;
  CutJoints held_, loose_;
};

/// The coordinates of the user's joints in the tree, as initial values; 0 for prescribed ones.
template <class Space>
std::vector<JointValues> TreeValues(const Mechanism<Space, double>& mechanism,
                                    const VectorX<double>& q);

/// Sets positions and their residual from the guesses in `start->q`, or outcome and message if the
/// loops do not close. `units` belong to `kinematics`.
template <class Space>
void ClosePositions(const MechanismDescription& description, Kinematics<Space, double>& kinematics,
                    const AssemblyUnits<Space>& units, Start<double>* start);

/// A length that no position exceeds much, in units: the arms of the longest way through the tree,
/// each at least as long as the mechanism, and the arms of cut joints.
template <class Space>
double Extent(const Mechanism<Space, double>& mechanism, const AssemblyUnits<Space>& units);

/// A message names an accuracy of the input that is larger than the stated one by less than this.
inline constexpr double kHintFactor = 100.0;

/// Residuals of a failed assembly: a number per constraint row, then one per coupling and one per
/// entry of `extra`.
struct UnsatisfiedConstraints {
  VectorX<double> rows;                ///< in units
  VectorX<double> units;               ///< [m] or [rad] each
  bool speeds = false;                 ///< of speeds: all of it per second
  std::vector<OfCutJoint> extra = {};  ///< fixed or given
  /// Accuracy of the input with which they are satisfied; the message names it if it is near.
  double accuracy = std::numeric_limits<double>::infinity();
};

/// Names the joints and couplings in conflict with their residuals and units, rods first, then the
/// largest. Also names joints of their loops that the assembly may not move: prescribed, fixed or
/// of given speed. At a least-squares solution the residuals e satisfy J^T e = 0. Joints with a
/// residual contradict each other; joints without one are not involved. Positions of `kinematics`
/// must belong to the residuals.
template <class Space>
std::string DescribeConflict(const MechanismDescription& description,
                             const Kinematics<Space, double>& kinematics,
                             const UnsatisfiedConstraints& unmet);

/// Returns the reason why a mechanism in joint coordinates, compiled from `description`, is locked
/// at the position q, or "" if it is not locked or motions are prescribed. Not analysed above
/// kMaxAnalysedSpeeds unless all constraints are independent (joint_response.h). Locked means that
/// nothing can move, or that a part is in a singular configuration that it cannot leave and would
/// start along infinitesimal motions. A rigid part without such speeds locks nothing: it stays in
/// place regardless of others.
///
/// Constraints may remove every speed. Or they leave infinitesimal motions at a singular
/// configuration: a stretched four-bar's hinges in line could each start to buckle and none may.
/// Then a dozen mixtures of those speeds are followed a small distance. If none reaches another
/// position, and all return or a self-stress forbids motion to second order, nothing moves.
template <class Space>
std::string WhyLocked(const MechanismDescription& description,
                      const Mechanism<Space, double>& mechanism, const VectorX<double>& q);

}  // namespace loopbench
