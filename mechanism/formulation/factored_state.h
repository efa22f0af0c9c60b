// A mechanism at one time, position and speed, with a solver's factors of that position.
//
// The kinematics owns (q, u). Levels and the right-hand side read and change them here, solvers
// where permitted. Factors are computed on demand, once per position.
#pragma once

#include <memory>

#include "mechanism/formulation/constraint_solver.h"
#include "mechanism/loops/self_stress.h"

namespace loopbench {

template <class Space, class S>
class FactoredState {
 public:
  /// Both must outlive the object.
  FactoredState(const Mechanism<Space, S>& mechanism, ConstraintSolver<Space, S>& solver)
      : kinematics_(mechanism),
        solver_(solver),
        target_(VectorX<S>::Zero(mechanism.num_equations())),
        change_(VectorX<S>::Zero(mechanism.num_u())),
        stress_(mechanism.released().empty() ? nullptr
                                             : std::make_unique<SelfStress<Space, S>>(mechanism)),
        released_(mechanism.released()) {}

  const VectorX<S>& q() const { return kinematics_.q(); }
  const VectorX<S>& u() const { return kinematics_.u(); }
  /// If the directions released by AcceptReleased() are unsuitable, releases others at this
  /// position.
  void SetPositions(const Eigen::Ref<const VectorX<S>>& q);
  /// Positions must be current.
  void SetSpeeds(const Eigen::Ref<const VectorX<S>>& u) { kinematics_.UpdateVelocity(u); }

  Kinematics<Space, S>& kinematics() { return kinematics_; }
  const Kinematics<Space, S>& kinematics() const { return kinematics_; }
  const Mechanism<Space, S>& mechanism() const { return kinematics_.mechanism(); }
  ConstraintSolver<Space, S>& solver() { return solver_; }

  /// The solver's, unless it has factored the current positions already.
  Outcome Factor();
  /// The solver's mode has changed, or it has factored other positions.
  void ForgetFactors() { factored_version_ = -1; }

  /// A change of speeds with J change = -violation at the current positions.
  Outcome Correct(const VectorX<S>& violation, VectorX<S>& change);

  /// Self-stresses at the current positions; null without redundant constraints.
  SelfStress<Space, S>* stress() const {
    return mechanism().is_redundant() ? stress_.get() : nullptr;
  }
  /// Adds to speeds the share of the released directions (self_stress.h), after Factor().
  void ShareSpeeds(VectorX<S>& u);
  /// Releases the most suitable directions at the current positions from now on. The equations stay
  /// the same to first order in the drift. Directions released for the accuracy of the input stay
  /// as long as they are suitable. Returns true if others replaced them: these are open by about
  /// the accuracy.
  bool AcceptReleased();
  /// Takes over times, positions, speeds and released directions.
  void Follow(const Kinematics<Space, S>& kinematics) {
    kinematics_ = kinematics;
    released_ = kinematics.released();
    ForgetFactors();
  }
  /// Releases the mechanism's choice again: runs do not depend on runs before.
  void ForgetReleased() { released_ = mechanism().released(); }

 private:
  Kinematics<Space, S> kinematics_;
  ConstraintSolver<Space, S>& solver_;
  long factored_version_ = -1;  ///< of the kinematics' positions
  VectorX<S> target_, change_;
  std::unique_ptr<SelfStress<Space, S>> stress_;
  std::vector<Released> released_;  ///< by AcceptReleased()
};

/// Returns D^T times the violations of all constraints by row, then the mismatch of each coupling
/// (num_equations), and the largest violations in `largest`, released directions included. A
/// coupling counts as its first joint's coordinate.
template <class Space, class S>
void PositionViolation(const Kinematics<Space, S>& kinematics, VectorX<S>& violation,
                       Correction<S>& largest);

/// J u + b, by row: D^T (V_Q - V_P) of all constraints, less prescribed rates; then the rate of
/// each coupling (num_equations).
template <class Space, class S>
void SpeedViolation(const Kinematics<Space, S>& kinematics, VectorX<S>& violation);

}  // namespace loopbench
