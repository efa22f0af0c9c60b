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

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
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

/// q less g of a joint, by the speeds of its kind: of a quaternion the rotation vector from g to q.
template <class Space>
std::array<double, 6> Difference(const JointKind<Space, double>& kind, const double* q,
                                 const double* g) {
  std::array<double, 6> apart{};
  const int rotations = kind.has_quaternion() ? 3 : 0, shift = kind.num_q - kind.num_u;
  for (int i = rotations; i < kind.num_u; ++i) apart[i] = q[i + shift] - g[i + shift];
  if (rotations == 0) return apart;
  const Eigen::Quaterniond from(g[0], g[1], g[2], g[3]), to(q[0], q[1], q[2], q[3]);
  const Eigen::AngleAxisd turn(to.normalized() * from.normalized().conjugate());
  Eigen::Vector3d::Map(apart.data()) = turn.angle() * turn.axis();
  return apart;
}

/// Guesses of a description, and distances of positions from them. Values that are NaN are not
/// given. Tree joints differ from their guesses by coordinates, turns included; quaternions by the
/// rotation vector between both. Joints that close loops are measured, angles modulo a turn.
template <class Space>
class Guesses {
 public:
  /// `mechanism` is in joint coordinates. All are kept by reference.
  Guesses(const MechanismDescription& description, const Mechanism<Space, double>& mechanism,
          const AssemblyUnits<Space>& units)
      : description_(description),
        mechanism_(mechanism),
        units_(units),
        guess_(GuessedPositions(description, mechanism)),
        is_held_(description.joints.size(), false),
        fixed_(mechanism.num_u(), false),
        guessed_(mechanism.num_u(), false),
        weights_(VectorX<double>::Ones(mechanism.num_u())) {
    for (int index : description.initial.held) {
      is_held_[index] = true;
      SetColumns(mechanism.joints()[index], &fixed_);
    }
    // A link is about twice as long as the distances in length(). Weights do not depend on the unit
    // of length, which is a power of two.
    const double per_link = units.length / (2.0 * mechanism.length());
    for (const JointValues& values : description.initial.coordinates) {
      const Joint<Space, double>& joint = mechanism.joints()[values.joint];
      const auto weight = [&](int coordinate) {
        return values.weight * (joint.kind->axes[coordinate] < Space::kRot ? 1.0 : per_link);
      };
      if (joint.in_tree()) {
        if (!is_held_[values.joint]) SetColumns(joint, &guessed_);
        mechanism.ForEachFree(joint, joint.kind->num_u, [&](int i, int free) {
          weights_[joint.u_offset + free] = weight(i);
        });
        continue;
      }
      if (joint.num_u() == 0) continue;  // prescribed
      CutJoints& cut = is_held_[values.joint] ? held_ : loose_;
      cut.values.push_back({values.joint, values.values.data()});
      mechanism.ForEachFree(joint, joint.kind->num_u, [&](int i, int free) {
        if (!IsGiven(*joint.kind, values.values.data(), i)) return;
        cut.free.push_back({values.joint, free});
        cut.weights.conservativeResize(cut.weights.size() + 1);
        cut.weights[cut.weights.size() - 1] = weight(i);
      });
    }
  }

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
  VectorX<double> Apart(const VectorX<double>& q) const {
    VectorX<double> apart(mechanism_.num_u());
    for (const TreeStep& step : mechanism_.tree()) {
      const Joint<Space, double>& joint = mechanism_.joints()[step.joint];
      double at[7] = {}, guess[7] = {};
      mechanism_.ForEachFree(joint, joint.kind->num_q, [&](int i, int free) {
        at[i] = q[joint.q_offset + free];
        guess[i] = guess_[joint.q_offset + free];
      });
      const std::array<double, 6> all = Difference<Space>(*joint.kind, at, guess);
      mechanism_.ForEachFree(joint, joint.kind->num_u,
                             [&](int i, int free) { apart[joint.u_offset + free] = all[i]; });
    }
    return apart.cwiseQuotient(units_.columns);
  }

  /// Like Apart(), with 0 for coordinates without a guess.
  VectorX<double> GuessedApart(const VectorX<double>& q) const {
    VectorX<double> apart = Apart(q);
    for (int i = 0; i < mechanism_.num_u(); ++i) {
      if (!guessed_[i]) apart[i] = 0.0;
    }
    return apart;
  }

  /// Deviations of held() and loose() from their values, in units.
  VectorX<double> HeldApart(const Kinematics<Space, double>& at) const { return Apart(held_, at); }
  VectorX<double> LooseApart(const Kinematics<Space, double>& at) const {
    return Apart(loose_, at);
  }

  /// Sum of weighted squares in units. Coordinates without a guess have a weight that decides only
  /// between positions which are equally far from all guesses.
  double SquaredDistance(const Kinematics<Space, double>& kinematics) const {
    const VectorX<double> all = Apart(kinematics.q());
    double sum = LooseApart(kinematics).cwiseProduct(loose_.weights).squaredNorm();
    for (int i = 0; i < mechanism_.num_u(); ++i) {
      const double difference = (guessed_[i] ? weights_[i] : kUnguessed) * all[i];
      sum += difference * difference;
    }
    return sum;
  }

  /// The largest difference from a guess, in units.
  double Farthest(const Kinematics<Space, double>& kinematics) const {
    double farthest = 0.0;
    for (const VectorX<double>& apart : {GuessedApart(kinematics.q()), LooseApart(kinematics)}) {
      if (apart.size() > 0) farthest = std::max(farthest, apart.cwiseAbs().maxCoeff());
    }
    return farthest;
  }

  std::vector<MissedGuess> Missed(const Kinematics<Space, double>& kinematics) const {
    const VectorX<double> apart = Apart(kinematics.q()), cut = LooseApart(kinematics);
    const double link = 2.0 * mechanism_.length();  // between its ends: twice from its middle
    std::vector<MissedGuess> missed;
    Eigen::Index row = 0;
    for (const JointValues& values : description_.initial.coordinates) {
      const Joint<Space, double>& joint = mechanism_.joints()[values.joint];
      if (is_held_[values.joint]) continue;
      const int shift = joint.kind->num_q - joint.kind->num_u;
      Eigen::Vector3d turn = Eigen::Vector3d::Zero();
      mechanism_.ForEachFree(joint, joint.kind->num_u, [&](int i, int free) {
        const Direction<Space, double>& H = kinematics.joints()[values.joint].H(free);
        const double by =
            units_.Of(H) * (joint.in_tree() ? apart[joint.u_offset + free] : cut[row++]);
        if (shift > 0 && i < 3) {
          turn[i] = by;
        } else if (std::abs(by) > kFarGuess * (H.angular.isZero() ? link : 1.0)) {
          missed.push_back({values.joint, i + shift, values.values[i + shift], by});
        }
      });
      if (turn.norm() > kFarGuess) missed.push_back({values.joint, -1, 0.0, turn.norm()});
    }
    return missed;
  }

  /// q with whole turns taken off angles that are more than half a turn from their guesses.
  VectorX<double> Unwound(VectorX<double> q) const {
    const VectorX<double> apart = Apart(q);
    for (const TreeStep& step : mechanism_.tree()) {
      const Joint<Space, double>& joint = mechanism_.joints()[step.joint];
      mechanism_.ForEachFree(joint, joint.kind->num_u, [&](int i, int free) {
        if (!joint.kind->IsAngle(i)) return;
        q[joint.q_offset + free] -= kTurn * std::round(apart[joint.u_offset + free] / kTurn);
      });
    }
    return q;
  }

 private:
  /// Weight of the distance of a coordinate without a guess from 0.
  static constexpr double kUnguessed = 1e-3;

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
  void SetColumns(const Joint<Space, double>& joint, std::vector<bool>* columns) const {
    for (int i = 0; joint.in_tree() && i < joint.num_u(); ++i) {
      (*columns)[joint.u_offset + i] = true;
    }
  }

  VectorX<double> Apart(const CutJoints& cut, const Kinematics<Space, double>& kinematics) const {
    VectorX<double> apart(static_cast<Eigen::Index>(cut.free.size()));
    Eigen::Index row = 0;
    for (const auto& [index, values] : cut.values) {
      const Joint<Space, double>& joint = mechanism_.joints()[index];
      double at[7] = {};
      joint.kind->coordinates(kinematics.MeasuredPose(joint), at, joint.kind->parameter);
      std::array<double, 6> all = Difference<Space>(*joint.kind, at, values);
      mechanism_.ForEachFree(joint, joint.kind->num_u,
                             [&, index = index, given = values](int i, int free) {
                               if (joint.kind->IsAngle(i)) all[i] = std::remainder(all[i], kTurn);
                               const double unit = units_.Of(kinematics.joints()[index].H(free));
                               if (IsGiven(*joint.kind, given, i)) apart[row++] = all[i] / unit;
                             });
    }
    return apart;
  }

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
                                    const VectorX<double>& q) {
  std::vector<JointValues> list;
  for (const TreeStep& step : mechanism.tree()) {
    const Joint<Space, double>& joint = mechanism.joints()[step.joint];
    if (joint.description < 0 || joint.num_q() == 0) continue;
    std::vector<double> values(joint.kind->num_q, 0.0);
    mechanism.ForEachFree(joint, joint.kind->num_q,
                          [&](int i, int free) { values[i] = q[joint.q_offset + free]; });
    list.push_back({joint.description, std::move(values)});
  }
  return list;
}

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
