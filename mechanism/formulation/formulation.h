// What the three formulations share: a mechanism's state vector and its derivative.
//
// A formulation answers "which accelerations satisfy the joints", and, at velocity level, "which
// speeds do". It is used through
//   Derivative(t, y)   the right-hand side for an integrator, y = (q, speeds of the state),
//   Evaluate(t, q, u)  accelerations alone, for given q and all speeds u,
//   BeginStep(t, y)    at accepted steps, the only call that may project the state or change the
//                      mode (an independent set, angles, gains). Everything else is a pure function
//                      of (t, q, u, mode): calling it in any order gives the same bits.
// After construction O-DCA allocates nothing in any of them, the dense baselines nothing in a
// derivative unless Eigen's workspace for one product exceeds a mebibyte (some 300 unknowns) or,
// in reduction's null space, 48 rows; what BeginStep() does is said by each formulation.
#pragma once

#include <memory>
#include <optional>
#include <string_view>

#include "mechanism/description/outcome.h"
#include "mechanism/formulation/release_review.h"
#include "mechanism/loops/drives.h"

namespace loopbench {

/// At which level the constraints hold in the right-hand side (docs/design.md D3).
enum class Enforcement {
  kAcceleration,  ///< accelerations satisfy the constraints, speeds are integrated as they come
  kVelocity,      ///< speeds used in the right-hand side satisfy them too
  kPosition,      ///< as kAcceleration, and after each accepted step positions, then speeds are
                  ///< projected back to the constraints
  kBaumgarte,     ///< as kAcceleration, with feedback of the mismatch of positions and speeds
};

/// Gains [1/s] of Baumgarte's stabilisation: a mismatch e of positions obeys
/// e'' + 2 alpha e' + beta^2 e = 0 (Baumgarte 1972; alpha = beta damps it critically).
struct BaumgarteGains {
  double alpha = 0.0, beta = 0.0;

  friend bool operator==(const BaumgarteGains&, const BaumgarteGains&) = default;
};

enum class SolverKind {
  kAsPublished,    ///< plain factorisations; a lost pivot ends the run as `singular`
  kRankRevealing,  ///< rank from geometry, degenerating directions softened (loop_solver.h);
                   ///< for reduction: the independent set is chosen, and chosen again when it ages
};

std::string_view ToString(Enforcement enforcement);
std::string_view ToString(SolverKind solver);

struct FormulationOptions {
  Enforcement enforcement = Enforcement::kAcceleration;
  SolverKind solver = SolverKind::kRankRevealing;
  /// kBaumgarte only. Without them alpha = beta = 0.05/h with the longest accepted step h so far:
  /// zero while steps still double from one to the next, set again when h has doubled. Gains near
  /// 1/h hold steps back; gains that follow shorter steps magnify round-off by 1/h^2, which makes
  /// steps shorter still (docs/numerics.md, section 3).
  std::optional<BaumgarteGains> gains = std::nullopt;
};

/// What the last evaluation met.
struct Diagnostics {
  Outcome outcome = Outcome::kFinished;
  int rank = 0;        ///< independent loop constraints: rank of J in joint coordinates
  double rcond = 1.0;  ///< ratio of extreme pivots or eigenvalues of the formulation's own matrix
  double smallest_weight = 1.0;   ///< below 1: some direction was softened
  int worst_joint = -1;           ///< index of the joint behind rcond, -1 when not attributable
  long softened_evaluations = 0;  ///< since the formulation was made
  long mode_changes = 0;          ///< likewise; projections are none
};

/// What a projection of positions found.
template <class S>
struct Correction {
  S shift = S(0), rotation = S(0);
  int iterations = 0;  ///< Newton steps, each with an assembly of its own
};

template <class Space>
class ForwardJacobian;

template <class Space, class S>
class Formulation {
 public:
  /// `mechanism` must outlive the formulation.
  Formulation(const Mechanism<Space, S>& mechanism, FormulationOptions options);
  virtual ~Formulation() = default;
  Formulation(const Formulation&) = delete;
  Formulation& operator=(const Formulation&) = delete;

  const Mechanism<Space, S>& mechanism() const { return mechanism_; }
  const FormulationOptions& options() const { return options_; }

  /// Called once with a consistent start at time t, before anything else.
  virtual Outcome Start(S t, const VectorX<S>& q, const VectorX<S>& u);

  int state_size() const { return mechanism_.num_q() + num_state_speeds(); }
  void ToState(const VectorX<S>& q, const VectorX<S>& u, std::span<S> y) const;

  /// dy/dt. On failure `ydot` is unspecified.
  Outcome Derivative(S t, std::span<const S> y, std::span<S> ydot);

  /// udot for given positions and speeds.
  Outcome Evaluate(S t, const VectorX<S>& q, const VectorX<S>& u, VectorX<S>& udot);

  /// Positions and all speeds of a state at time t; kinematics() is current afterwards.
  Outcome FromState(S t, std::span<const S> y);
  const VectorX<S>& q() const { return q_; }
  const VectorX<S>& u() const { return u_; }
  const VectorX<S>& udot() const { return udot_; }

  /// Accepts the step that ended in `y` at time t. True when the state was projected or the mode
  /// changed, and with it perhaps the state's meaning: then `y` is rewritten and the integrator
  /// must restart. After a projection that failed `y` is as it was; the next evaluation says why.
  bool BeginStep(S t, std::span<S> y);

  /// Power [W] that prescribed motions supply, after a successful evaluation. O(n); 0 without them.
  S DrivePower();

  /// Gains in use (kBaumgarte), zero at other levels.
  const BaumgarteGains& gains() const { return gains_; }

  /// Largest mismatch of points [m] and of rotations [rad] that the last projection found and took
  /// away; 0 at other levels.
  const Correction<S>& correction() const { return correction_; }

  const Kinematics<Space, S>& kinematics() const { return kinematics_; }
  const Diagnostics& diagnostics() const { return diagnostics_; }

 protected:
  /// Speeds that the state carries: all, unless a formulation integrates fewer.
  virtual int num_state_speeds() const { return mechanism_.num_u(); }
  /// Index into u of the i-th speed of the state.
  virtual int state_speed(int i) const { return i; }

  /// Makes u_ satisfy the constraints (positions current, velocity level only).
  virtual Outcome CompleteSpeeds() = 0;
  /// A change of speeds with J change = -violation at the current positions, one row per constraint
  /// row: the smallest in the metric M, unless the formulation has terms of its own. Directions in
  /// which constraints have lost rank are softened as in Accelerations().
  virtual Outcome Correct(const VectorX<S>& violation, VectorX<S>& change) = 0;
  /// udot_ from current positions and speeds; sets diagnostics_. Constraint accelerations are
  /// minus feedback(), not zero.
  virtual Outcome Accelerations() = 0;
  /// Multipliers of all constraint rows after Accelerations(): D lambda is the force on Q.
  virtual void Multipliers(VectorX<S>& lambda) = 0;
  /// Solves M x - J^T lambda = force, J x = target as Accelerations() does for -h and gamma, with
  /// what it factored last. Multipliers() and diagnostics are void until the next evaluation.
  virtual void SolveConstrained(const VectorX<S>& force, const VectorX<S>& target, VectorX<S>& x,
                                VectorX<S>& lambda) = 0;
  /// Chance to change the mode at an accepted state.
  virtual bool ChangeMode() { return false; }

  /// 2 alpha e' + beta^2 e of all constraint rows; empty unless kBaumgarte.
  const VectorX<S>& feedback() const { return feedback_; }

  /// rank of J in joint coordinates, given how many of this set's constraint rows are dependent.
  int LoopRank(int dependent_rows) const;

  const Mechanism<Space, S>& mechanism_;
  FormulationOptions options_;
  Kinematics<Space, S> kinematics_;
  VectorX<S> q_, u_, udot_;
  Diagnostics diagnostics_;

 private:
  friend class ForwardJacobian<Space>;

  /// Newton's method on the mismatch of positions, then one step on that of speeds.
  Outcome Project();
  /// D^T mismatch of all constraints in violation_, its largest parts in `largest`.
  void PositionViolation(Correction<S>& largest);
  /// D^T (V_Q - V_P) of all constraints, less prescribed rates.
  void SpeedViolation(VectorX<S>& violation) const;
  /// Feedback at current positions and speeds.
  void UpdateFeedback();
  /// Gains from the length h of the last step. True when they changed.
  bool ChangeGains(S h);
  /// Releases other directions where those released serve badly by now. True when it did.
  bool ChangeReleased(S h);
  /// Accelerations(), unless nothing is free, and whether prescribed motions can be followed.
  Outcome Solve();

  std::unique_ptr<Drives<Space, S>> drives_;  ///< null without prescribed motions
  VectorX<S> lambda_of_drives_;
  Correction<S> correction_;
  /// Set by BeginStep(): the last stage of a step, its projection and the next evaluation have the
  /// same positions and share what is assembled there. Any other evaluation assembles anew.
  bool at_step_end_ = false;
  VectorX<S> violation_, change_of_state_, moved_, step_;  ///< of projections
  BaumgarteGains gains_;
  S accepted_t_ = S(0), longest_step_ = S(0);  ///< of accepted steps
  VectorX<S> feedback_;
  ReleaseReview<Space, S> review_;
};

}  // namespace loopbench
