// What prescribed motions do to a mechanism: whether it can follow them, and the power they take.
//
// Drives may ask for what the loops forbid: two cranks of one four-bar, each with a motion of its
// own. Solvers that tolerate redundant constraints then meet them halfway; the accelerations left
// over tell.
#pragma once

#include <algorithm>
#include <vector>

#include "mechanism/loops/tree_dynamics.h"

namespace loopbench {

template <class Space, class S>
class Drives {
 public:
  explicit Drives(const Mechanism<Space, S>& mechanism);

  /// Whether accelerations `udot` satisfy every constraint. What is left may be kFollowed of the
  /// largest term in the sum (accelerations, and products of speeds, which stand alone where shafts
  /// turn evenly), plus kRoundOff of the largest that forces would give a body by itself (in a loop
  /// that stands still all others are zero), plus as much as drift explains: redundant constraints
  /// of joints that have drifted apart contradict each other by that much. `feedback`, where not
  /// empty, is what constraint accelerations were asked to miss (Baumgarte), by row. Speeds must be
  /// current.
  bool Followed(const Kinematics<Space, S>& kinematics, const VectorX<S>& udot,
                const VectorX<S>& feedback);

  /// Whether the motion decides the branch in a singular configuration, after Followed() there. No
  /// more may be left than errors of speeds leave on a branch, and inertia must outweigh forces:
  /// softened directions have accelerations of their own for as long as the mechanism takes across
  /// the width of softening, and must not be turned by much of it.
  bool DecidesBranch(const Kinematics<Space, S>& kinematics) const;

  /// Notes the rank of the loops' constraints at an accepted step. True where it has grown: a run
  /// that began in a singular configuration has left that.
  bool NoteRank(int rank);
  /// The largest so far.
  int usual_rank() const { return usual_rank_; }

  /// From an accepted step on whose branch closure errors have decided.
  void LeaveBranch() { has_left_branch_ = true; }
  bool has_left_branch() const { return has_left_branch_; }

  /// The constraint that the last Followed() found missed by most.
  int worst_joint() const {
    return static_cast<int>(std::ranges::max_element(missed_) - missed_.begin());
  }

  /// Power [W] that drives put into the mechanism: force along each times its prescribed rate.
  /// Those of cut joints are multipliers (`lambda`, rows as in TreeDynamics::Jacobian()); those of
  /// tree joints are what the bodies outward of them need beyond other forces.
  S Power(const Kinematics<Space, S>& kinematics, const VectorX<S>& udot, const VectorX<S>& lambda);

 private:
  /// Solvers leave some 1e-12 of a consistent system; what is inconsistent leaves much more.
  static constexpr double kFollowed = 1e-6;
  static constexpr double kRoundOff = 1e-10;
  /// Times the relative mismatch of positions and speeds.
  static constexpr double kOfMismatch = 10.0;
  /// Beyond this the mismatch is no drift: speeds that drives contradict miss each other in full.
  /// Stages of a step miss by some 1e-5 at rtol 1e-9; of 68 contradictions in 600 random mechanisms
  /// one missed by less than 1e-2, none by less than this.
  static constexpr double kMostDrift = 1e-3;

  /// Largest residual in a singular configuration, relative to the largest term. Accepted steps
  /// leave up to 0.02 at rtol 1e-4.
  static constexpr double kLeftOnBranch = 0.1;
  /// Largest deflection across the width of softening, relative to that width.
  static constexpr double kTurned = 0.1;

  /// Whether what is left is explained by joints that have come apart.
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
