// Enforcement levels: treatment of constraints in right-hand side and accepted steps beyond
// accelerations (docs/decisions/003). They are written over any ConstraintSolver.
//
//   acceleration   nothing: this class as it is
//   velocity       speeds of the right-hand side satisfy J u = -b
//   position       Newton's method after each accepted step
//   baumgarte      J udot = gamma - feedback
//
// A program registers a user-defined level before it calls loopbench::Main(); its name is then
// valid wherever "velocity" is:
//
//   RegisterLevel(LevelRowOf<HalfVelocity>({.name = "half-velocity", .sentence = "half of ..."}));
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include "mechanism/formulation/compiled_derivative.h"
#include "mechanism/formulation/factored_state.h"
#include "mechanism/formulation/options.h"

namespace loopbench {

/// Effect of a level on an accepted step.
enum class Accepted {
  kAsItWas,
  kProjected,    ///< the state was changed
  kModeChanged,  ///< the right-hand side was
  kFailed,       ///< a projection did not succeed: the next evaluation gives the reason
};

template <class Space, class S>
class Level {
 public:
  virtual ~Level() = default;

  /// Sets the motions to the speeds that the right-hand side uses, from those that the state
  /// carries (ConstraintSolver::CarriedSpeeds()). Positions are current.
  virtual Outcome SetSpeeds(FactoredState<Space, S>& state,
                            const Eigen::Ref<const VectorX<S>>& carried);

  /// Returns Baumgarte feedback added to the constraint accelerations, one value per constraint
  /// row (num_equations, or num_rows without couplings); empty if none. Valid until the next call.
  virtual const VectorX<S>& Feedback(const Kinematics<Space, S>&) { return nothing_; }

  /// After an accepted step of length h, SetSpeeds() being done.
  virtual Accepted Accept(FactoredState<Space, S>&, S /*h*/) { return Accepted::kAsItWas; }

  /// Projects by a solver's fast path a state given by (q, u) alone, and changes it. Returns false
  /// (the default) if there is none: Accept() is then called.
  virtual bool Project(ConstraintSolver<Space, S>&, std::span<S> /*q*/, std::span<S> /*u*/) {
    return false;
  }

  /// Projects the state by compiled steps, SetSpeeds() being done. Returns false (the default),
  /// with the state as it was, if there are none for its branch: Accept() is then called.
  virtual bool Project(CompiledDerivative&, FactoredState<Space, S>&) { return false; }

  /// Returns the right-hand side's type if a solver may have a fast path for it: level acceleration
  /// or level velocity. Otherwise the right-hand side is computed from its parts.
  std::optional<SpeedsUsed> right_hand_side() const { return right_hand_side_; }

  /// Data for derivatives of the right-hand side (forward_jacobian.h): true if SetSpeeds() makes
  /// speeds satisfy the loops by the solver's Correct(); gains if Feedback() is AddFeedback().
  /// Levels with other changes set LevelTraits::has_derivative to false.
  bool changes_speeds() const { return changes_speeds_; }
  const BaumgarteGains& gains() const { return gains_; }

  /// Returns the correction of the last Accept(); 0 for levels without correction. Records have it
  /// at levels without drift (DriftGrowth::kNone).
  const Correction<S>& correction() const { return correction_; }

  /// Returns true if Accept() never changes a step.
  bool takes_steps_as_they_are() const { return takes_steps_as_they_are_; }

 protected:
  std::optional<SpeedsUsed> right_hand_side_;
  bool changes_speeds_ = false;
  bool takes_steps_as_they_are_ = false;
  BaumgarteGains gains_;
  Correction<S> correction_;

 private:
  VectorX<S> nothing_;
};

/// Makes a level for a mechanism, which must outlive it.
template <class Space, class S>
using LevelFactory = std::function<std::unique_ptr<Level<Space, S>>(const Mechanism<Space, S>&,
                                                                    const FormulationOptions&)>;

/// The level that `options` name. Throws std::invalid_argument for one of another program in
/// another scalar than double.
template <class Space, class S>
std::unique_ptr<Level<Space, S>> MakeLevel(const Mechanism<Space, S>& mechanism,
                                           const FormulationOptions& options);

/// Factories of levels, in the order of Enforcement: all in double, the built-in ones in other
/// scalars. Only RegisterLevel() adds entries.
template <class Space, class S>
std::deque<LevelFactory<Space, S>>& LevelFactories();

/// A level of another program.
struct LevelRow {
  LevelTraits traits;
  LevelFactory<Planar, double> planar;
  LevelFactory<Spatial, double> spatial;
};

/// The row of a class template derived from Level<Space, S>, made from a mechanism and options.
template <template <class Space, class S> class Own>
LevelRow LevelRowOf(LevelTraits traits) {
  const auto make = []<class Space>(const Mechanism<Space, double>& mechanism,
                                    const FormulationOptions& options) {
    return std::unique_ptr<Level<Space, double>>(
        std::make_unique<Own<Space, double>>(mechanism, options));
  };
  return {std::move(traits), make, make};
}

/// Adds a level, not while experiments run, and returns its enumerator. Throws
/// std::invalid_argument for a row that is not sound (registration.h).
Enforcement RegisterLevel(LevelRow row, int alignment = EIGEN_MAX_STATIC_ALIGN_BYTES);

/// 2 alpha e' + beta^2 e of all constraints, added to `rows` (num_equations); in any scalar, for
/// derivatives too.
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
  const int num_rows = kinematics.mechanism().num_rows();
  for (int c = 0; c < static_cast<int>(kinematics.mechanism().couplings().size()); ++c) {
    rows[num_rows + c] += S(2 * gains.alpha) * kinematics.CouplingSpeed(c) +
                          S(gains.beta * gains.beta) * kinematics.CouplingMismatch(c);
  }
}

}  // namespace loopbench
