// Levels of enforcement: what the right-hand side and accepted steps do about constraints beyond
// accelerations that satisfy them (docs/design.md D3). They are written over any ConstraintSolver.
//
//   acceleration   nothing                                         this class as it is
//   velocity       speeds of the right-hand side satisfy J u = -b  level_velocity.cpp
//   position       Newton's method after each accepted step        level_position.cpp
//   baumgarte      J udot = gamma - feedback                       level_baumgarte.cpp
#pragma once

#include <memory>

#include "mechanism/formulation/factored_state.h"
#include "mechanism/formulation/options.h"

namespace loopbench {

/// What a level made of an accepted step.
enum class Accepted {
  kAsItWas,
  kProjected,    ///< the state was changed
  kModeChanged,  ///< the right-hand side was
  kFailed,       ///< a projection did not succeed: the next evaluation will say why
};

template <class Space, class S>
class Level {
 public:
  virtual ~Level() = default;

  /// Sets the motions to the speeds that the right-hand side uses, from those that the state
  /// carries (ConstraintSolver::CarriedSpeeds()). Positions are current.
  virtual Outcome SetSpeeds(FactoredState<Space, S>& state,
                            const Eigen::Ref<const VectorX<S>>& carried);

  /// What constraint accelerations are asked to miss at the state, by row; empty for nothing.
  /// Stands until the next call.
  virtual const VectorX<S>& Feedback(const Kinematics<Space, S>&) { return nothing_; }

  /// After an accepted step of length h, SetSpeeds() being done.
  virtual Accepted Accept(FactoredState<Space, S>&, S /*h*/) { return Accepted::kAsItWas; }

  /// What derivatives of the right-hand side have to know (forward_jacobian.h): whether SetSpeeds()
  /// changes speeds, and the gains of Feedback().
  bool changes_speeds() const { return changes_speeds_; }
  const BaumgarteGains& gains() const { return gains_; }

  /// What the last Accept() took away; 0 where a level takes nothing.
  const Correction<S>& correction() const { return correction_; }

 protected:
  bool changes_speeds_ = false;
  BaumgarteGains gains_;
  Correction<S> correction_;

 private:
  VectorX<S> nothing_;
};

/// The level that `options` name.
template <class Space, class S>
std::unique_ptr<Level<Space, S>> MakeLevel(const Mechanism<Space, S>& mechanism,
                                           const FormulationOptions& options);

/// 2 alpha e' + beta^2 e of all constraints, added to `rows`; in any scalar, for derivatives too.
template <class Space, class S>
void AddFeedback(const Kinematics<Space, S>& kinematics, const BaumgarteGains& gains,
                 VectorX<S>& rows) {
  for (int index : kinematics.mechanism().constraints()) {
    const Joint<Space, S>& joint = kinematics.mechanism().joints()[index];
    const Velocity<Space, S> mismatch = kinematics.ConstraintMismatch(index);
    const Components<Space, S> speed = kinematics.ConstraintSpeed(index);
    for (int r = 0; r < joint.num_constraints(); ++r) {
      const S e = kinematics.joints()[index].D(r).dot(mismatch);
      rows[joint.row + r] += S(2 * gains.alpha) * speed[r] + S(gains.beta * gains.beta) * e;
    }
  }
}

}  // namespace loopbench
