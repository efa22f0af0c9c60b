// The equations that all formulations solve, each in its own way:
//
//   M x - J^T lambda = f,      J x = c
//
// with M(q) the mass matrix of the spanning forest, J(q) the constraints of the cut joints
// (tree_dynamics.h). What x is, the right-hand sides say:
//
//   x              f      c
//   accelerations  -h     gamma, less the feedback of a level (level.h)
//   speeds         0      minus what they miss: x is the change that mends them, by impulses
//   derivatives    minus those of the left-hand sides (forward_jacobian.h)
//
// A solver writes Factor() and Solve(); all other functions say something of it that is not the
// rule, and nobody who has nothing to say need write them. It sees positions, speeds and time
// through the Kinematics that it is given, keeps no state of the motion, and between two calls of
// Start() or Review() is a function of its arguments: any order of calls gives the same bits.
// Nothing may allocate but Start(), Review() and Counters().
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "mechanism/description/outcome.h"
#include "mechanism/model/kinematics.h"

namespace loopbench {

/// What Factor() found.
struct Conditioning {
  int rank = 0;                  ///< independent loop constraints: rank of J in joint coordinates
  double rcond = 1.0;            ///< ratio of extreme pivots or eigenvalues of the solver's matrix
  double smallest_weight = 1.0;  ///< below 1: some direction was softened
  int worst_joint = -1;          ///< index of the joint behind rcond, -1 when not attributable
};

/// Newton converges in two or three steps from what one accepted step leaves.
inline constexpr int kMostProjections = 10;

/// Something that a solver counts, under the key that it has in records.
struct NamedCount {
  std::string_view name;
  std::int64_t value = 0;
};

/// Which speeds a right-hand side uses: those of the state, or the nearest that satisfy the loops.
enum class SpeedsUsed { kGiven, kCompleted };

/// Largest mismatches of points [m] and of rotations [rad].
template <class S>
struct Correction {
  S shift = S(0), rotation = S(0);
  int iterations = 0;  ///< Newton steps, each with an assembly of its own
};

template <class Space, class S>
class ConstraintSolver {
 public:
  virtual ~ConstraintSolver() = default;

  /// Matrices and factors at the positions of `kinematics`, whose speeds may be out of date; called
  /// once for each position. `kinematics` stands as it is while the factors are in use. Fills
  /// conditioning_, also where it fails.
  virtual Outcome Factor(const Kinematics<Space, S>& kinematics) = 0;

  /// x and, unless null, lambda, with what Factor() made. Directions in which the constraints have
  /// lost rank are softened as it found them. `force` (num_u) may be empty, which is zero; `target`
  /// has num_rows. Where there is no solution x is not finite.
  virtual void Solve(const VectorX<S>& force, const VectorX<S>& target, VectorX<S>& x,
                     VectorX<S>* lambda) = 0;

  /// Short cut for accelerations at the speeds and time of `kinematics`: f = -h, c = gamma -
  /// feedback (`feedback` empty: zero). False, as here: then h and gamma are formed and given to
  /// Solve(). For solvers that take forces body by body and need neither.
  virtual bool Accelerate(const Kinematics<Space, S>& kinematics, const VectorX<S>& feedback,
                          VectorX<S>& udot, VectorX<S>* lambda);

  /// Short cut for a whole right-hand side without feedback and drives: qdot and udot at (q, u), as
  /// Factor() and Accelerate() would have it but for round-off, after CompleteSpeeds() if asked
  /// for. False, as here, where there is none or the position is one that Factor() should judge.
  /// Does not change conditioning(). Where it is true, coordinates have their speeds for rates, and
  /// a step that it ended needs no Review(). `kinematics` has the time, and is brought to q and the
  /// speeds used where forces other than gravity act, which puts what Factor() made out of use;
  /// elsewhere both stand as they were.
  virtual bool RightHandSide(SpeedsUsed speeds, Kinematics<Space, S>& kinematics,
                             std::span<const S> q, std::span<const S> u, std::span<S> qdot,
                             std::span<S> udot);

  /// Short cut for what level projection does to an accepted (q, u), in place and by Correct():
  /// Newton steps until mismatches are at most `goal` [m], one at least where they are more, or no
  /// longer shrink, then one of speeds. Nothing, as here, where there is no short cut or the
  /// position is one that Factor() should judge: then (q, u) are as they were.
  virtual std::optional<Correction<S>> Project(std::span<S> q, std::span<S> u, S goal);

  /// A change x of speeds (or of positions, per time) with J x = c. Here the smallest in the metric
  /// M, which is Solve() without force.
  virtual void Correct(const VectorX<S>& target, VectorX<S>& x);

  /// Speeds that a state carries, indices into u; null, as here, where it carries all.
  virtual const std::vector<int>* CarriedSpeeds() const { return nullptr; }
  /// Level velocity: short cut that makes all speeds satisfy the constraints, J u + b = 0, from
  /// those that the state carries; the others are out of date. The speeds of `kinematics` may be
  /// changed. False, as here: then Correct() has what u misses. To be written with CarriedSpeeds().
  virtual bool CompleteSpeeds(Kinematics<Space, S>& kinematics, VectorX<S>& u);

  /// For what is chosen (the mode), once at the start, whose positions and speeds are consistent.
  virtual void Start(const Kinematics<Space, S>& kinematics);
  /// At accepted steps, the only other place where the mode may change. True when it did: factors
  /// are made anew then, and the state may carry other speeds.
  virtual bool Review(const Kinematics<Space, S>& kinematics);

  /// More of a Factor() that ended as kSingular, for messages; "", as here, where there is no more.
  virtual std::string WhySingular() const { return {}; }

  /// What the solver counts beside; since Factor() where it counts work.
  virtual std::vector<NamedCount> Counters() const { return {}; }

  const Conditioning& conditioning() const { return conditioning_; }

 protected:
  Conditioning conditioning_;
};

/// rank of J in joint coordinates, given how many of this set's constraint rows are dependent.
template <class Space, class S>
int LoopRank(const Mechanism<Space, S>& mechanism, int dependent_rows);

/// WhySingular() where rank is in doubt and the dense equations that would decide it are too large.
template <class Space, class S>
std::string TooLargeToDecide(const Mechanism<Space, S>& mechanism, const Conditioning& found);

}  // namespace loopbench
