// Guesses of a description, and distances of positions from them. Values that are NaN are not
// given.
//
// Tree joints differ from their guesses by coordinates, turns included; quaternions by the rotation
// vector between both. Joints that close loops are measured, angles modulo a turn.
#pragma once

#include <cmath>
#include <numbers>

#include "mechanism/start/assembly.h"
#include "mechanism/start/assembly_units.h"

namespace loopbench {

inline constexpr double kTurn = 2 * std::numbers::pi;  ///< [rad]

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
  bool IsAngle(const Joint<Space, double>& joint, int coordinate) const;
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

}  // namespace loopbench
