// Walk to other positions that satisfy a mechanism's loops.
//
// A single position cannot distinguish a redundant constraint from one lost only there, nor a speed
// of finite motion from an infinitesimal one: at a stretched four-bar two speeds satisfy every
// constraint and no motion does. So the mechanism moves a small distance along an admissible speed,
// and its loops are closed again. Dense: for analyses before a run.
#pragma once

#include <algorithm>
#include <cmath>

#include "mechanism/algebra/decompositions.h"
#include "mechanism/loops/scaled_loops.h"

namespace loopbench {

/// Speeds of the forest above which rank is not analysed: the matrices are dense.
inline constexpr int kMaxAnalysedSpeeds = 2000;

enum class StepKind {
  kMoved,      ///< to another position that closes all loops
  kFellBack,   ///< the only position found nearby is the one it came from
  kNotClosed,  ///< no closed position was found
};

/// A way x opens loops that are singular by x^2 / 2 [rad or lengths]. Returns a way that opens them
/// far beyond the accuracy of rounded input, but on which a regular motion hardly bends.
inline double WayBeyond(double accuracy) { return std::min(0.3, std::sqrt(40.0 * accuracy)); }

template <class Space>
class Excursion {
 public:
  /// Starts at the position q of a mechanism in joint coordinates without prescribed motions, which
  /// must outlive this. Loops count as closed within `accuracy` [rad or lengths] or round-off, and
  /// directions that depend on each other within it have no rank.
  Excursion(const Mechanism<Space, double>& mechanism, const VectorX<double>& q,
            double accuracy = 0.0);

  /// Moves by `distance` (largest coordinate, angles in rad, lengths in mechanism lengths) along a
  /// mixture of all permitted speeds, another one for each `seed` but mostly the last step's
  /// continued, and closes the loops again. The position stays as it was unless it moved.
  StepKind Step(double distance, int seed);

  /// Returns the deviation of the last step from its speed's direction, over the intended distance:
  /// of the order of the distance at a regular position, of order one for an infinitesimal motion.
  double bend() const { return bend_; }
  /// Forgets the direction of the steps so far.
  void TurnAnywhere() { course_.resize(0); }

  const VectorX<double>& q() const { return q_; }
  /// All directions here.
  const DirectionRows& rows() const { return here_; }
  /// Positions are current.
  const Kinematics<Space, double>& kinematics() const { return kinematics_; }
  /// Rank of all directions here, as scaled_loops.h has it.
  int rank() const { return rank_; }
  /// Smallest pivot that counts over the largest: how far this position is from losing rank.
  double conditioning() const { return conditioning_; }
  /// Pivots below this count as zero; at least kRankRatio.
  double rank_ratio() const { return rank_ratio_; }
  /// Returns the largest neglected pivot: a measure of the independence of redundant constraints.
  double excess() const { return excess_; }
  int freedom() const { return mechanism_->num_u() - rank_; }

 private:
  /// Rows and rank at q_.
  void Factor();
  /// Largest of u over its units: rad, or lengths of the mechanism.
  double Size(const VectorX<double>& u) const;
  bool Close(int rank, double distance, const VectorX<double>& u, VectorX<double>& q,
             VectorX<double>& travelled);

  const Mechanism<Space, double>* mechanism_;
  Kinematics<Space, double> kinematics_;
  VectorX<double> q_, units_;  ///< units of speeds: 1, or the mechanism's length
  double rank_ratio_ = 0.0;
  double closed_ = 0.0;  ///< scaled violations below this are round-off [m]
  DirectionRows here_;
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver_;
  VectorX<double> course_;  ///< L^T u of the last step that moved
  bool factored_ = false;   ///< solver_ has here_.rows
  int rank_ = 0;
  double conditioning_ = 1.0, excess_ = 0.0, bend_ = 0.0;
};

}  // namespace loopbench
