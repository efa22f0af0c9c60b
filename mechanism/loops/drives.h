// What prescribed motions do to a mechanism: whether it can follow them, and the power they take.
//
// Drives may ask for what the loops forbid: two cranks of one four-bar, each with a motion of its
// own. Solvers that tolerate redundant constraints then meet them halfway; the accelerations left
// over tell.
#pragma once

#include "mechanism/loops/tree_dynamics.h"

namespace loopbench {

template <class Space, class S>
class Drives {
 public:
  explicit Drives(const Mechanism<Space, S>& mechanism);

  /// Whether accelerations `udot` satisfy every constraint. What is left may be kFollowed of the
  /// largest acceleration in the sum, plus kRoundOff of the largest that forces would give a body
  /// by itself (in a loop that stands still all others are zero), plus as much as drift explains:
  /// redundant constraints of joints that have drifted apart contradict each other by that much.
  /// `feedback`, where not empty, is what constraint accelerations were asked to miss (Baumgarte),
  /// by row. Speeds must be current.
  bool Followed(const Kinematics<Space, S>& kinematics, const VectorX<S>& udot,
                const VectorX<S>& feedback);

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

  static S RelativeMismatch(const Kinematics<Space, S>& kinematics);

  TreeDynamics<Space, S> dynamics_;
  std::vector<Acceleration<Space, S>> A_;
  std::vector<Wrench<Space, S>> F_;
};

}  // namespace loopbench
