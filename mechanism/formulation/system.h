// A mechanism as an ODE: its state and its derivative, by one formulation, which consists of a
// solver (constraint_solver.h) and a level of enforcement (level.h).
//
//   Derivative(t, y)   the right-hand side, y = (q, speeds that the state carries), by whatever way
//                      is the shortest,
//   Examine(t, y)      the same, with all that can be asked about it afterwards,
//   Evaluate(t, q, u)  accelerations alone, for given q and all speeds u,
//   BeginStep(t, y)    at accepted steps, the only call that may project the state or change the
//                      mode (an independent set, angles, gains). Everything else is a pure function
//                      of (t, q, u, mode): calling it in any order gives the same bits.
// After construction O-DCA allocates nothing in any of them. The dense baselines allocate nothing
// in a derivative unless Eigen's workspace for one product exceeds a mebibyte (about 300 unknowns)
// or, in reduction's null space, 48 rows. Each solver documents BeginStep().
#pragma once

#include <memory>
#include <vector>

#include "mechanism/formulation/compiled_derivative.h"
#include "mechanism/formulation/level.h"
#include "mechanism/formulation/ode.h"
#include "mechanism/loops/drives.h"

namespace loopbench {

/// Diagnostics of the last evaluation.
struct Diagnostics : Conditioning {
  Outcome outcome = Outcome::kFinished;
  long regularized_evaluations = 0;  ///< since the system was made
  long mode_changes = 0;             ///< as above; projections do not count
};

template <class Space>
class ForwardJacobian;
template <class Space, class S>
class Passage;

template <class Space, class S>
class System final : public Ode<S> {
 public:
  /// `mechanism` must outlive the system and its solver, which was made for it. Couplings and
  /// rotors are added to the solver (coupled_solver.h).
  System(const Mechanism<Space, S>& mechanism, std::unique_ptr<ConstraintSolver<Space, S>> solver,
         const FormulationOptions& options);
  ~System() override;
  System(const System&) = delete;
  System& operator=(const System&) = delete;

  const Mechanism<Space, S>& mechanism() const { return mechanism_; }
  const FormulationOptions& options() const { return options_; }
  const ConstraintSolver<Space, S>& solver() const { return *solver_; }
  /// Returns the solver, for use of the last factors of Examine() or Evaluate() until the next
  /// call.
  ConstraintSolver<Space, S>& solver() { return *solver_; }
  const Level<Space, S>& level() const { return *level_; }

  /// Continues planar angles of cut joints like another system of the mechanism (Kinematics).
  void TakeWholeTurns(std::span<const double> turns) { state_.kinematics().TakeWholeTurns(turns); }

  /// Called once with a consistent start at time t, before anything else.
  Outcome Start(S t, const VectorX<S>& q, const VectorX<S>& u);

  int state_size() const { return mechanism_.num_q() + num_state_speeds(); }
  void ToState(const VectorX<S>& q, const VectorX<S>& u, std::span<S> y) const;
  int num_state_speeds() const {
    const std::vector<int>* carried = solver_->CarriedSpeeds();
    return carried == nullptr ? mechanism_.num_u() : static_cast<int>(carried->size());
  }
  /// Index into u of the i-th speed of the state.
  int state_speed(int i) const {
    const std::vector<int>* carried = solver_->CarriedSpeeds();
    return carried == nullptr ? i : (*carried)[i];
  }

  /// Appends to the integrator's state the work [J] supplied and the work dissipated since the
  /// start: quadratures, so that the motion has the same bits with and without them.
  void IntegrateWork(bool wanted) { with_work_ = wanted; }
  /// Returns state_size(), plus two with work. If prescribed motions leave no state, only the work
  /// is integrated.
  int size() const override { return state_size() + (integrates_work() ? 2 : 0); }
  int num_quadratures() const override { return with_work_ && state_size() > 0 ? 2 : 0; }

  /// Computes dy/dt, and the rates of work if `ydot` has room for them; unspecified on failure.
  /// After a solver's fast path, kinematics() and everything derived from it are unspecified.
  Outcome Derivative(S t, std::span<const S> y, std::span<S> ydot) override;
  /// Computes the same without a fast path, so with other rounding: kinematics(), udot(),
  /// diagnostics(), multipliers and powers then belong to (t, y).
  Outcome Examine(S t, std::span<const S> y, std::span<S> ydot);

  /// Makes Derivative() evaluate `compiled`, or the code of Examine() if it has no branch. Null
  /// turns both off. In double only, after Start().
  void UseCompiled(std::unique_ptr<CompiledDerivative> compiled) {
    compiled_ = std::move(compiled);
  }
  const CompiledDerivative* compiled() const { return compiled_.get(); }

  /// Sets the Jacobian of this system for Jacobian(), or null for none. After Start().
  void UseJacobian(std::unique_ptr<ForwardJacobian<Space>> jacobian);
  std::optional<JacobianWork> Jacobian(S t, std::span<const S> y, std::span<S> jacobian) override;

  /// udot for given positions and speeds.
  Outcome Evaluate(S t, const VectorX<S>& q, const VectorX<S>& u, VectorX<S>& udot);

  /// Positions and all speeds of a state at time t; kinematics() is current afterwards. `y` may
  /// have more at its end.
  Outcome FromState(S t, std::span<const S> y);
  /// Does the same by the solver's fast path, if any, so with other rounding of the speeds.
  Outcome Look(S t, std::span<const S> y);
  const VectorX<S>& q() const { return state_.q(); }
  const VectorX<S>& u() const { return state_.u(); }
  const VectorX<S>& udot() const { return udot_; }
  const Kinematics<Space, S>& kinematics() const { return state_.kinematics(); }
  /// Self-stresses at the last positions; null without redundant constraints.
  const SelfStress<Space, S>* stress() const { return state_.stress(); }

  /// Accepts the step that ended in `y` at time t. Returns true if the state was projected or the
  /// mode (and perhaps the state's meaning) changed: `y` is then rewritten and the integrator must
  /// restart. If a projection failed, `y` is unchanged; the next evaluation gives the reason.
  bool BeginStep(S t, std::span<S> y);

  /// Multipliers of all constraint rows: lambda by joint, D lambda being the force on Q, then mu by
  /// coupling, ratio mu being the effort along each of its coordinates. The last call must have
  /// been a successful Evaluate() or Examine().
  const VectorX<S>& Multipliers();

  /// Power [W] that prescribed motions supply there. O(n); 0 without them.
  S DrivePower();
  /// Power [W] that enters and leaves the mechanism there: of whatever does work without a
  /// potential, prescribed motions included.
  Power<S> TotalPower();

  Diagnostics diagnostics() const;
  /// More of the outcome of the last evaluation, for messages: configuration and cure; may be "".
  std::string Why() const;

  /// Returns true if usually independent constraints are dependent here and regularized.
  bool IsSingular() const;

 private:
  /// Returns true if a solver may have a fast path for the right-hand side.
  bool MayTakeShortCut() const;
  bool integrates_work() const { return with_work_ || state_size() == 0; }
  /// udot_ at the current state, and whether prescribed motions can be followed.
  Outcome Accelerate();
  /// Computes udot_ and, unless null, lambda.
  Outcome FindAccelerations(VectorX<S>* lambda);
  /// If prescribed speeds have jumped since the last accepted step, changes the speeds in `y` by
  /// the impulses of the joints and adds their work, if `y` includes it. Returns true if they have.
  bool TakeJumps(S t, std::span<S> y);
  /// BeginStep() after jumps.
  bool ReviewStep(S t, std::span<S> y);
  /// Judges the latter. At level projection, whose accepted steps satisfy the constraints, inertia
  /// carries a mechanism across singular configurations; violations at trial stages are not judged.
  Outcome JudgeDrives();
  int FirmRank(const Kinematics<Space, S>& at) const;
  void NoteRankAhead();
  /// Below level projection, at an accepted step: whether closure errors decide the branch.
  bool IsOffBranch() const;
  /// Rates of the works, if they are asked for, at the kinematics' speeds.
  void PutPower(std::span<S> rates);
  /// Factors at the current positions. If directions are regularized, examines positions beside
  /// (passage.h): carries the forces of a branch, or regularizes less at regular positions.
  Outcome FactorBranch();
  /// Returns true until a drive leaves the branch that compiled code has.
  bool StaysOnBranch() const { return drives_ == nullptr || !drives_->has_left_branch(); }
  bool AtPassage() const { return options_.enforcement == Enforcement::kPosition; }
  /// udot_ and, unless null, lambda at the current state, with the shares of released directions.
  void SolveAccelerations(VectorX<S>* lambda);
  /// Solves for accelerations from f and c, for solvers without a fast path.
  void SolveFormed(VectorX<S>* lambda);
  /// Returns true if accepting the last Derivative()'s step changes nothing and needs no data from
  /// it.
  bool NeedsNoReview() const;
  /// FactoredState::AcceptReleased(). Closes joints along directions that are imposed again.
  bool ReplaceReleased();
  /// Returns true if the last evaluation was the derivative at this (t, y).
  bool IsAt(S t, std::span<const S> y) const;

  const Mechanism<Space, S>& mechanism_;
  FormulationOptions options_;
  std::unique_ptr<ConstraintSolver<Space, S>> solver_;
  std::unique_ptr<Level<Space, S>> level_, closing_;  ///< closing_: for ReplaceReleased()
  FactoredState<Space, S> state_;
  TreeDynamics<Space, S> dynamics_;
  std::unique_ptr<Drives<Space, S>> drives_;  ///< null without prescribed motions
  std::unique_ptr<Passage<Space, S>> passage_;
  const VectorX<S>* carried_ = nullptr;  ///< forces of regularized constraints there, or null

  VectorX<S> udot_, lambda_;
  VectorX<S> change_, lambda_change_;  ///< shares of released directions
  std::vector<Acceleration<Space, S>> A_;
  VectorX<S> force_, target_;             ///< f and c of the accelerations
  VectorX<S> nothing_;                    ///< zeros by row
  const VectorX<S>* feedback_ = nullptr;  ///< of the last evaluation
  VectorX<S> both_;                       ///< the level's and that of redundant constraints
  bool lambda_is_current_ = false;
  bool shares_ = false;  ///< whether released directions drift unless self_stress.h corrects udot
  /// Version of the kinematics' positions set by BeginStep(): the last stage of a step, its
  /// projection and the next evaluation have the same positions and share the assembled matrices.
  /// Any other evaluation assembles again.
  long step_end_version_ = -1;
  bool by_short_cut_ = false;  ///< the last Derivative() was
  S accepted_t_ = S(0);
  Outcome outcome_ = Outcome::kFinished;
  long regularized_evaluations_ = 0, mode_changes_ = 0;
  bool with_work_ = false;

  std::unique_ptr<CompiledDerivative> compiled_;
  std::unique_ptr<ForwardJacobian<Space>> jacobian_;
  /// State of the last derivative, for jacobian_: positions' version (-1: none), time, state.
  long derivative_version_ = -1;
  S derivative_t_ = S(0);
  std::vector<S> derivative_y_, scratch_;
};

/// A system with the solver Solver<Space, S>(mechanism, options, more...).
template <template <class, class> class Solver, class Space, class S, class... More>
std::unique_ptr<System<Space, S>> MakeSystem(const Mechanism<Space, S>& mechanism,
                                             const FormulationOptions& options = {},
                                             const More&... more) {
  return std::make_unique<System<Space, S>>(
      mechanism, std::make_unique<Solver<Space, S>>(mechanism, options, more...), options);
}

}  // namespace loopbench
