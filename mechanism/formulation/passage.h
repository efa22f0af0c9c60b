// Forces of constraints in a passage through a singular configuration.
//
// In a singular configuration constraints lose a direction. Solvers regularize it
// (direction_weights.h) and lose the force of the constraint in this direction. On one branch
// through the configuration the force is a smooth function of the position nevertheless. Positions
// ahead and behind along the motion determine it: with the means f_k of the forces at distances
// k s and -k s,
//
//   f(0) = (15 f_1 - 6 f_2 + f_3) / 10 + O(s^6).
//
// Solvers add f to the applied forces. Directions that are not regularized compensate it. f is J^T
// lambda, or the constraint wrenches on all bodies for solvers that regularize joints of the
// forest. Round-off e of projected positions causes errors of e / s^3 in f, so s is large; where
// the last term of the sum shows that f is not smooth on this scale, s is smaller.
//
// A motion that passes a singular configuration at a small distance has no such f. It turns, or the
// least eigenvalue of the loops has a minimum above zero. Its positions are regular.
#pragma once

#include <array>
#include <memory>

#include "mechanism/formulation/factored_state.h"
#include "mechanism/formulation/level.h"

namespace loopbench {

/// Shares of the largest eigenvalue (direction_weights.h) for regularization near a singular
/// configuration: at regular positions, within a distance of 2e-5; in a passage with smooth forces,
/// within 3.5e-4, because errors of stages increase with the inverse distance.
inline constexpr double kMinRegularization = 4e-10, kSmoothRegularization = 1.2e-7;

/// Positions ahead of and behind a regularized one.
enum class Nearby {
  kUnknown,    ///< the mechanism rests, or they are regularized, too
  kOneBranch,  ///< they lie on one smooth branch through a singular configuration
  kRegular,    ///< the motion passes a singular configuration at a distance
};

template <class Space, class S>
class Passage {
 public:
  /// Both must outlive the object.
  Passage(const Mechanism<Space, S>& mechanism, ConstraintSolver<Space, S>& solver);

  /// Looks ahead and behind from the state `at`, whose factors the solver has. Afterwards the
  /// solver has factors of other positions.
  Nearby Look(const Kinematics<Space, S>& at);
  /// Forces of the constraints after Look() with kOneBranch, for Solve() or SolveWrenches().
  const VectorX<S>& Force() const { return force_; }
  /// Share for regularization together with this force.
  double regularization() const { return is_smooth_ ? kSmoothRegularization : kRegularization; }

 private:
  static constexpr int kPairs = 3;

  /// Moves to the position at `step` ahead and projects it.
  bool Move(const Kinematics<Space, S>& at, S step);
  /// Least eigenvalue of the loops where Move() ended, as a share of the largest; 6e-4 if more.
  S LeastEigenvalue();
  /// Whether the motion passes at a distance, from positions at -step and step; `least` is the
  /// eigenvalue between.
  Nearby Judge(const Kinematics<Space, S>& at, S least, S step);
  /// Forces of the constraints where Move() ended. False if a direction is regularized there.
  bool FindForce(VectorX<S>& force);
  /// Sets force_ from as many pairs of positions at multiples of -step and step as are not
  /// regularized, and is_smooth_. False if there are none.
  bool Interpolate(const Kinematics<Space, S>& at, S step);

  ConstraintSolver<Space, S>& solver_;
  FactoredState<Space, S> state_;
  std::unique_ptr<Level<Space, S>> projection_;
  TreeDynamics<Space, S> dynamics_;
  VectorX<S> rates_, curve_;  ///< q(t) = q + t rates + t^2 curve
  VectorX<S> there_, moved_, udot_, force_, change_, rows_, nothing_;
  std::array<VectorX<S>, kPairs> means_;  ///< f_1, f_2, f_3
  bool is_smooth_ = false;
};

}  // namespace loopbench
