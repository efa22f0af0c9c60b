// Prescribed motions: whether the mechanism can follow them, and the power they need.
//
// Drivers may contradict the loops: two cranks of one four-bar, each with its own motion. Solvers
// that accept redundant constraints then return a compromise; the residual acceleration reveals it.
#pragma once

#include <algorithm>
#include <vector>

#include "mechanism/loops/tree_dynamics.h"

namespace loopbench {

template <class Space, class S>
class Drives {
 public:
  explicit Drives(const Mechanism<Space, S>& mechanism);

  /// Returns true if accelerations `udot` satisfy every constraint. The residual may be kFollowed
  /// of the largest term in the sum (accelerations, and products of speeds, which dominate if
  /// shafts turn evenly), plus kRoundOff of the largest acceleration of a free body under forces
  /// (in a loop at rest all others are zero), plus the effect of drift: redundant constraints of
  /// joints with drift contradict each other by that much. `feedback`, if not empty, is the
  /// Baumgarte feedback by row. Speeds must be current.
  bool Followed(const Kinematics<Space, S>& kinematics, const VectorX<S>& udot,
                const VectorX<S>& feedback);

  /// Returns true if the motion decides the branch in a singular configuration, after Followed()
  /// there. The residual must be within the effect of speed errors on a branch, and inertia must
  /// outweigh forces. Regularized directions have their own accelerations while the mechanism
  /// crosses the width of regularization; these must not turn it much.
  bool DecidesBranch(const Kinematics<Space, S>& kinematics) const;

  /// Stores the rank of the loops' constraints at an accepted step. Returns true if it has grown: a
  /// run that began in a singular configuration has left it.
  bool NoteRank(int rank);
  /// The largest so far.
  int usual_rank() const { return usual_rank_; }

  /// Called after an accepted step on a branch chosen by closure errors.
  void LeaveBranch() { has_left_branch_ = true; }
  bool has_left_branch() const { return has_left_branch_; }

  /// The constraint that the last Followed() found missed by most.
  int worst_joint() const {
    return static_cast<int>(std::ranges::max_element(missed_) - missed_.begin());
  }

  /// Returns the power [W] that drivers supply: force along each times its prescribed rate. Forces
  /// of cut joints are multipliers (`lambda`, rows as in TreeDynamics::Jacobian()); forces of tree
  /// joints are the loads of the bodies outward of them beyond other forces.
  S Power(const Kinematics<Space, S>& kinematics, const VectorX<S>& udot, const VectorX<S>& lambda);

 private:
  /// Solvers leave about 1e-12 of a consistent system; inconsistent systems leave much more.
  static constexpr double kFollowed = 1e-6;
  static constexpr double kRoundOff = 1e-10;
  /// Factor on the relative violation of positions and speeds.
  static constexpr double kOfMismatch = 10.0;
  /// A larger violation is no drift: contradictory drivers violate speeds in full. Stages of a step
  /// have violations of about 1e-5 at rtol 1e-9. No contradiction of random mechanisms was smaller.
  static constexpr double kMaxDrift = 1e-3;

  /// Largest residual in a singular configuration, relative to the largest term. Accepted steps
  /// leave up to 0.02 at rtol 1e-4.
  static constexpr double kLeftOnBranch = 0.1;
  /// Largest deflection across the width of regularization, relative to that width.
  static constexpr double kTurned = 0.1;

  /// Returns true if constraint drift explains the residual.
  bool IsDrift(const Kinematics<Space, S>& kinematics);

  TreeDynamics<Space, S> dynamics_;
  std::vector<Acceleration<Space, S>> A_;
  std::vector<Wrench<Space, S>> F_;
  std::vector<S> missed_;         ///< residual of each joint's constraint at the last Followed()
  S worst_ = S(0), size_ = S(0);  ///< the largest residual and the largest term there
  S acceleration_ = S(0);         ///< largest of bodies there
  S fastest_ = S(0);              ///< largest speed of bodies so far
  int usual_rank_ = 0;
  bool has_left_branch_ = false;
};

}  // namespace loopbench
