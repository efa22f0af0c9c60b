// A mechanism as an integrator sees it: its state and its derivative, by one formulation, which is
// a solver (constraint_solver.h) and a level of enforcement (level.h).
//
//   Derivative(t, y)   the right-hand side, y = (q, speeds that the state carries), by whatever way
//                      is the shortest,
//   Examine(t, y)      the same, with all that can be asked about it afterwards,
//   Evaluate(t, q, u)  accelerations alone, for given q and all speeds u,
//   BeginStep(t, y)    at accepted steps, the only call that may project the state or change the
//                      mode (an independent set, angles, gains). Everything else is a pure function
//                      of (t, q, u, mode): calling it in any order gives the same bits.
// After construction O-DCA allocates nothing in any of them, the dense baselines nothing in a
// derivative unless Eigen's workspace for one product exceeds a mebibyte (some 300 unknowns) or,
// in reduction's null space, 48 rows; what BeginStep() does is said by each solver.
#pragma once

#include <memory>
#include <vector>

#include "mechanism/formulation/compiled_derivative.h"
#include "mechanism/formulation/level.h"
#include "mechanism/formulation/ode.h"
#include "mechanism/loops/drives.h"

namespace loopbench {

/// What the last evaluation met.
struct Diagnostics : Conditioning {
  Outcome outcome = Outcome::kFinished;
  long softened_evaluations = 0;  ///< since the system was made
  long mode_changes = 0;          ///< likewise; projections are none
};

template <class Space>
class ForwardJacobian;

template <class Space, class S>
class System final : public Ode<S> {
 public:
  /// `mechanism` must outlive the system and its solver, which was made for it.
  System(const Mechanism<Space, S>& mechanism, std::unique_ptr<ConstraintSolver<Space, S>> solver,
         const FormulationOptions& options);
  ~System() override;
  System(const System&) = delete;
  System& operator=(const System&) = delete;

  const Mechanism<Space, S>& mechanism() const { return mechanism_; }
  const FormulationOptions& options() const { return options_; }
  const ConstraintSolver<Space, S>& solver() const { return *solver_; }
  /// To solve with the factors of the last Examine() or Evaluate(), as long as nothing else is
  /// asked.
  ConstraintSolver<Space, S>& solver() { return *solver_; }
  const Level<Space, S>& level() const { return *level_; }

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

  /// From now on the integrator's state ends with the work [J] supplied and the work dissipated
  /// since the start: quadratures, so that the motion has the same bits with and without them.
  void IntegrateWork(bool wanted) { with_work_ = wanted; }
  /// state_size(), and two with work. Where prescribed motions leave no state, the work itself is
  /// what is integrated.
  int size() const override { return state_size() + (integrates_work() ? 2 : 0); }
  int num_quadratures() const override { return with_work_ && state_size() > 0 ? 2 : 0; }

  /// dy/dt, with that of the works where `ydot` has room for them. On failure it is unspecified.
  /// Where the solver has a short cut, nothing else is known of (t, y) afterwards, and what
  /// kinematics() and all that follows from it are of is not said.
  Outcome Derivative(S t, std::span<const S> y, std::span<S> ydot) override;
  /// The same without a short cut, so with other rounding: kinematics(), udot(), diagnostics(),
  /// multipliers and powers are then those of (t, y).
  Outcome Examine(S t, std::span<const S> y, std::span<S> ydot);

  /// Makes Derivative() evaluate `compiled`, and where that has no branch the text of Examine().
  /// Null: neither. In double only, after Start().
  void UseCompiled(std::unique_ptr<CompiledDerivative> compiled) {
    compiled_ = std::move(compiled);
  }
  const CompiledDerivative* compiled() const { return compiled_.get(); }

  /// The Jacobian that Jacobian() is to give, or null for none. Of this system, after Start().
  void UseJacobian(std::unique_ptr<ForwardJacobian<Space>> jacobian);
  std::optional<JacobianWork> Jacobian(S t, std::span<const S> y, std::span<S> jacobian) override;

  /// udot for given positions and speeds.
  Outcome Evaluate(S t, const VectorX<S>& q, const VectorX<S>& u, VectorX<S>& udot);

  /// Positions and all speeds of a state at time t; kinematics() is current afterwards. `y` may
  /// have more at its end.
  Outcome FromState(S t, std::span<const S> y);
  /// The same by the solver's short cut where it has one, so with other rounding of the speeds.
  Outcome Look(S t, std::span<const S> y);
  const VectorX<S>& q() const { return state_.q(); }
  const VectorX<S>& u() const { return state_.u(); }
  const VectorX<S>& udot() const { return udot_; }
  const Kinematics<Space, S>& kinematics() const { return state_.kinematics(); }
  /// Self-stresses at the last positions; null without redundant constraints.
  const SelfStress<Space, S>* stress() const { return state_.stress(); }

  /// Accepts the step that ended in `y` at time t. True when the state was projected or the mode
  /// changed, and with it perhaps the state's meaning: then `y` is rewritten and the integrator
  /// must restart. After a projection that failed `y` is as it was; the next evaluation says why.
  bool BeginStep(S t, std::span<S> y);

  /// Multipliers lambda of all constraint rows; D lambda is the force on Q. The last call must have
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

 private:
  /// Whether the right-hand side is what a solver may have a short cut for.
  bool MayTakeShortCut() const;
  bool integrates_work() const { return with_work_ || state_size() == 0; }
  /// udot_ at the current state, and whether prescribed motions can be followed.
  Outcome Accelerate();
  /// The latter. At level projection, whose accepted steps end on the constraints, inertia carries
  /// a mechanism across singular configurations; what trial stages miss there is not judged.
  Outcome JudgeDrives();
  /// Whether constraints depend on each other that usually do not.
  bool IsSingular() const;
  int FirmRank(const Kinematics<Space, S>& at) const;
  void NoteRankAhead();
  /// Below level projection, at an accepted step: whether closure errors decide the branch.
  bool IsOffBranch() const;
  /// Rates of the works, if they are asked for, at the kinematics' speeds.
  void PutPower(std::span<S> rates);
  /// udot_ and, unless null, lambda at the current state, with the shares of released directions.
  void SolveAccelerations(VectorX<S>* lambda);
  /// Solves for accelerations from f and c, for solvers without a short cut.
  void SolveFormed(VectorX<S>* lambda);
  /// Whether the step that the last Derivative() ended changes nothing, and nothing has to be known
  /// of it.
  bool NeedsNoReview() const;
  /// Whether the last evaluation was the derivative at this (t, y).
  bool IsAt(S t, std::span<const S> y) const;

  const Mechanism<Space, S>& mechanism_;
  FormulationOptions options_;
  std::unique_ptr<ConstraintSolver<Space, S>> solver_;
  std::unique_ptr<Level<Space, S>> level_;
  FactoredState<Space, S> state_;
  TreeDynamics<Space, S> dynamics_;
  std::unique_ptr<Drives<Space, S>> drives_;  ///< null without prescribed motions

  VectorX<S> udot_, lambda_;
  VectorX<S> change_, lambda_change_;  ///< shares of released directions
  std::vector<Acceleration<Space, S>> A_;
  VectorX<S> force_, target_;             ///< f and c of the accelerations
  const VectorX<S>* feedback_ = nullptr;  ///< of the last evaluation, the level's
  bool lambda_is_current_ = false;
  bool shares_ = false;  ///< whether released directions drift unless self_stress.h corrects udot
  /// Of the kinematics' positions, set by BeginStep(): the last stage of a step, its projection and
  /// the next evaluation have the same positions and share what is assembled there. Any other
  /// evaluation assembles anew.
  long step_end_version_ = -1;
  bool by_short_cut_ = false;  ///< the last Derivative() was
  S accepted_t_ = S(0);
  Outcome outcome_ = Outcome::kFinished;
  long softened_evaluations_ = 0, mode_changes_ = 0;
  bool with_work_ = false;

  std::unique_ptr<CompiledDerivative> compiled_;
  std::unique_ptr<ForwardJacobian<Space>> jacobian_;
  /// Where the last derivative was, for jacobian_: positions' version (-1: nowhere), time, state.
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
