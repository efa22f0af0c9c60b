// The equations that all formulations solve by different methods:
//
//   M x - J^T lambda = f,      J x = c
//
// with M(q) the mass matrix of the spanning forest, J(q) the constraints of the cut joints
// (tree_dynamics.h). The right-hand sides define x:
//
//   x              f      c
//   accelerations  -h     gamma, less the feedback of a level (level.h)
//   speeds         0      minus the velocity violation: x is the impulsive velocity correction
//   derivatives    minus derivatives of the left-hand sides (forward_jacobian.h)
//
// A solver implements Factor() and Solve() for the constraints of joints; couplings and
// rotors are added to all solvers alike (coupled_solver.h). The remaining virtual functions are
// optional, with default implementations. The given Kinematics supplies positions, speeds and time.
// The solver keeps no state of the motion. Between calls of Start() or Review() it is a function of
// its arguments: any order of calls gives the same bits. Only Start(), Review() and Counters() may
// allocate.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "mechanism/description/outcome.h"
#include "mechanism/model/kinematics.h"

namespace loopbench {

template <class Space, class S>
class SelfStress;

/// Diagnostics of Factor().
struct Conditioning {
  int rank = 0;                  ///< independent loop constraints: rank of J in joint coordinates
  double rcond = 1.0;            ///< ratio of extreme pivots or eigenvalues of the solver's matrix
  double smallest_weight = 1.0;  ///< below 1: some direction was regularized
  bool is_regularized = false;   ///< the same, decided in the solver's scalar
  int worst_joint = -1;          ///< index of the joint behind rcond, -1 when not attributable
};

/// Newton's method converges in two or three steps from the violation after one accepted step.
inline constexpr int kMaxProjections = 10;

/// A counter of a solver, with its key in records.
struct NamedCount {
  std::string_view name;
  std::int64_t value = 0;
};

/// Speeds in a right-hand side: the state's, or the nearest that satisfy the loops.
enum class SpeedsUsed { kGiven, kCompleted };

/// Largest violations of points [m] and of rotations [rad].
template <class S>
struct Correction {
  S shift = S(0), rotation = S(0);
  int iterations = 0;  ///< Newton steps, each with an assembly of its own
};

template <class Space, class S>
class ConstraintSolver {
 public:
  virtual ~ConstraintSolver() = default;

  /// Computes matrices and factors at the positions of `kinematics`, whose speeds may be outdated;
  /// called once for each position. `kinematics` is constant while the factors are in use. Fills
  /// conditioning_, also on failure.
  virtual Outcome Factor(const Kinematics<Space, S>& kinematics) = 0;

  /// Computes x and, unless null, lambda, from the results of Factor(). Directions in which the
  /// constraints have lost rank are regularized as Factor() found them. `force` (num_u) may be
  /// empty, meaning zero; `target` has num_rows;
  /// with couplings, then one more for each (coupled_solver.h). Without a solution x is not finite.
  virtual void Solve(const VectorX<S>& force, const VectorX<S>& target, VectorX<S>& x,
                     VectorX<S>* lambda) = 0;

  /// Fast path for accelerations at the speeds and time of `kinematics`: f = -h, c = gamma -
  /// feedback (`feedback` empty: zero). If false (the default), h and gamma are formed and given to
  /// Solve(). For solvers that take forces body by body and need neither.
  virtual bool Accelerate(const Kinematics<Space, S>& /*kinematics*/,
                          const VectorX<S>& /*feedback*/, VectorX<S>& /*udot*/,
                          VectorX<S>* /*lambda*/) {
    return false;
  }

  /// Whether forces that replace constraint forces must be given as wrenches to SolveWrenches(),
  /// instead of along the coordinates to Solve() (the default). True if Factor() may regularize
  /// joints of the forest: coordinates do not contain their constraint forces. Needs Accelerate().
  virtual bool TakesWrenches() const { return false; }
  /// Computes x and, unless null, lambda, of wrenches on bodies alone, after Factor(): [moment;
  /// force] at the centres of mass in ground axes, body by body, Ground first.
  virtual void SolveWrenches(const VectorX<S>& /*wrenches*/, VectorX<S>& /*x*/,
                             VectorX<S>* /*lambda*/) {
    throw std::logic_error("a solver that takes wrenches does not solve for them");
  }

  /// Fast path for a whole right-hand side without feedback and drives: qdot and udot at (q, u),
  /// equal to Factor() and Accelerate() up to round-off, after CompleteSpeeds() if requested.
  /// Returns false (the default) if there is none or Factor() must judge the position. Does not
  /// change conditioning(). If true, coordinates have their speeds for rates, and a step that it
  /// ended needs no Review(). `kinematics` has the time. If forces other than gravity act, it is
  /// set to q and the speeds used, which invalidates the results of Factor(); otherwise both are
  /// unchanged.
  virtual bool RightHandSide(SpeedsUsed, Kinematics<Space, S>& /*kinematics*/,
                             std::span<const S> /*q*/, std::span<const S> /*u*/,
                             std::span<S> /*qdot*/, std::span<S> /*udot*/) {
    return false;
  }

  /// Fast path for level projection on an accepted (q, u), in place and by Correct(): Newton steps
  /// until violations are at most `goal` [m] or stop shrinking (at least one if they exceed it),
  /// then one step of speeds. Returns nothing (the default) if there is no fast path or Factor()
  /// must judge the position; (q, u) are then unchanged.
  virtual std::optional<Correction<S>> Project(std::span<S> /*q*/, std::span<S> /*u*/, S /*goal*/) {
    return std::nullopt;
  }

  /// A change x of speeds (or of positions, per time) with J x = c. Here the smallest in the metric
  /// M, which is Solve() without force.
  virtual void Correct(const VectorX<S>& target, VectorX<S>& x) {
    Solve(VectorX<S>(), target, x, nullptr);
  }

  /// Returns the speeds that a state carries, indices into u; null (the default) if all.
  virtual const std::vector<int>* CarriedSpeeds() const { return nullptr; }
  /// Level velocity: fast path that makes all speeds satisfy the constraints, J u + b = 0, from the
  /// state's speeds; the others are outdated. May change the speeds of `kinematics`. If false (the
  /// default), Correct() receives the violation by u. Implement together with CarriedSpeeds().
  virtual bool CompleteSpeeds(Kinematics<Space, S>& /*kinematics*/, VectorX<S>& /*u*/) {
    return false;
  }

  /// Chooses the mode, once at the start, whose positions and speeds are consistent.
  virtual void Start(const Kinematics<Space, S>&) {}
  /// Called at accepted steps, the only other place where the mode may change. Returns true if it
  /// did: factors are then recomputed, and the state may carry other speeds.
  virtual bool Review(const Kinematics<Space, S>&) { return false; }
  /// Appends the choices that make the mode, if there are any.
  virtual void AppendMode(std::vector<int>&) const {}
  /// Makes these choices of a solver of the same mechanism, after Start().
  virtual void TakeMode(std::span<const int>) {}

  /// Returns details of a Factor() that ended as kSingular, for messages; "" (the default) if none.
  virtual std::string WhySingular() const { return {}; }

  /// Returns the solver's additional counters; counts of work start at Factor().
  virtual std::vector<NamedCount> Counters() const { return {}; }

  /// Fast path for accelerations with redundant constraints whose share is missing (self_stress.h):
  /// Accelerate(), then the solution for the share of its accelerations, added.
  virtual bool AccelerateWithShare(const Kinematics<Space, S>& /*kinematics*/,
                                   const VectorX<S>& /*feedback*/, SelfStress<Space, S>& /*stress*/,
                                   VectorX<S>& /*udot*/, VectorX<S>* /*lambda*/) {
    return false;
  }

  const Conditioning& conditioning() const { return conditioning_; }

 protected:
  Conditioning conditioning_;
};

/// rank of J in joint coordinates, given how many of this set's constraint rows are dependent.
template <class Space, class S>
int LoopRank(const Mechanism<Space, S>& mechanism, int dependent_rows) {
  int user_tree_rows = 0;
  if (mechanism.coordinates() == Coordinates::kAbsolute) {
    // every user joint is a constraint here; those of a spanning forest are always independent and
    // convert the speeds of free bodies into joint speeds
    user_tree_rows = mechanism.num_u() - mechanism.num_joint_speeds();
  }
  return mechanism.num_rows() - user_tree_rows - dependent_rows;
}

/// Returns WhySingular() if the rank is uncertain and the deciding dense equations are too large.
template <class Space, class S>
std::string TooLargeToDecide(const Mechanism<Space, S>& mechanism, const Conditioning& found) {
  const int joint = found.worst_joint;
  return "rank is uncertain" +
         (joint < 0 ? std::string() : " at joint \"" + mechanism.joint_names()[joint] + '"') +
         ", and the dense equations that would decide it are too large: " +
         std::to_string(mechanism.num_rows()) + " constraints and " +
         std::to_string(mechanism.num_u()) + " speeds";
}

}  // namespace loopbench
