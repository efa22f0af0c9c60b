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

#include <algorithm>
#include <array>
#include <cmath>
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
  Passage(const Mechanism<Space, S>& mechanism, ConstraintSolver<Space, S>& solver)
      : solver_(solver),
        state_(mechanism, solver),
        projection_(
            MakeLevel(mechanism, FormulationOptions{.enforcement = Enforcement::kPosition})),
        dynamics_(mechanism),
        rates_(VectorX<S>::Zero(mechanism.num_q())),
        curve_(rates_),
        there_(rates_),
        moved_(rates_),
        udot_(VectorX<S>::Zero(mechanism.num_u())),
        force_(VectorX<S>::Zero(solver.TakesWrenches() ? Space::kDim * mechanism.num_bodies()
                                                       : mechanism.num_u())),
        change_(force_),
        rows_(VectorX<S>::Zero(mechanism.num_equations())),
        nothing_(rows_) {
    means_.fill(force_);
  }

  /// Looks ahead and behind from the state `at`, whose factors the solver has. Afterwards the
  /// solver has factors of other positions.
  Nearby Look(const Kinematics<Space, S>& at) {
    const Mechanism<Space, S>& mechanism = at.mechanism();
    const S least = S(EigenvalueOf(solver_.conditioning().smallest_weight, at.regularization()));
    S speed = S(0);
    for (const Velocity<Space, S>& V : at.motions()) {
      speed = std::max({speed, S(V.angular.norm()), S(V.linear.norm() / mechanism.length())});
    }
    if (!(speed > S(0))) return Nearby::kUnknown;
    mechanism.Rates(at.q(), at.u(), rates_);
    state_.Follow(at);  // measured angles continue from the same step
    state_.kinematics().SetRegularization(kRegularization);
    state_.ForgetFactors();
    const Nearby beside = Judge(at, least, S(kBeside) / speed);
    if (beside != Nearby::kOneBranch) return beside;
    bool is_known = false;
    for (double side = kNear; side >= kBeside; side /= 2.0) {
      is_known = Interpolate(at, S(side) / speed) || is_known;
      if (!is_known || !is_smooth_) continue;
      is_smooth_ = side == kNear;
      return beside;
    }
    for (double side = 2.0 * kNear; !is_known && side < kFar; side *= 2.0) {
      is_known = Interpolate(at, S(side) / speed);
    }
    is_smooth_ = false;
    return is_known ? beside : Nearby::kUnknown;
  }

  /// Forces of the constraints after Look() with kOneBranch, for Solve() or SolveWrenches().
  const VectorX<S>& Force() const { return force_; }
  /// Share for regularization together with this force.
  double regularization() const { return is_smooth_ ? kSmoothRegularization : kRegularization; }

 private:
  /// Positions that show a passage at a distance are this far away [rad, or mechanism lengths, of
  /// the fastest body], ten widths of regularization.
  static constexpr double kBeside = 2e-3;
  /// Distance of the nearest positions with forces, in these units: smooth forces err by 1e-9.
  /// Other forces use kBeside at least, and up to kFar if nearer positions are regularized.
  static constexpr double kNear = 8e-3, kFar = 4e-2;
  /// Share of the force, or of applied forces if more, by which interpolations with all and with
  /// fewer pairs differ at most if it is smooth.
  static constexpr double kRough = 1e-6;
  /// Weights of regular positions: regularization changes forces by a millionth at most.
  static constexpr double kRegularWeight = 1.0 - 1e-6;
  /// Change of the direction of motion within 2 kBeside. On a smooth branch it is of the size of
  /// kBeside^2; beyond the turning point of a hyperbola it is of the size of one.
  static constexpr double kTurned = 0.02;
  /// Least eigenvalue of regular positions, as a share of kRegularization. The parabola through
  /// three positions at a distance of kBeside has an error of some kBeside^3, 8e-9.
  static constexpr double kPassed = 0.25;
  /// Eigenvalues up to six times this have weights below 1.
  static constexpr double kProbe = 1e-4;

  /// Inverse of the weight in direction_weights.h.
  static double EigenvalueOf(double weight, double share) {
    return share * std::sqrt(-std::log1p(-std::min(weight, 1.0 - 1e-16)));
  }

  static constexpr int kPairs = 3;

  /// Moves to the position at `step` ahead and projects it.
  bool Move(const Kinematics<Space, S>& at, S step) {
    there_ = at.q() + step * (rates_ + step * curve_);
    at.mechanism().Normalise(there_);
    state_.kinematics().SetTime(at.time() + step);
    state_.kinematics().CountTurnsLike(at);
    state_.SetPositions(there_);
    state_.SetSpeeds(at.u());
    return projection_->Accept(state_, S(0)) != Accepted::kFailed &&
           state_.Factor() == Outcome::kFinished;
  }

  /// Least eigenvalue of the loops where Move() ended, as a share of the largest; 6e-4 if more.
  S LeastEigenvalue() {
    state_.kinematics().SetRegularization(kProbe);
    state_.ForgetFactors();
    const bool known = state_.Factor() == Outcome::kFinished;
    state_.kinematics().SetRegularization(kRegularization);
    state_.ForgetFactors();
    return known ? S(EigenvalueOf(solver_.conditioning().smallest_weight, kProbe)) : S(0);
  }

  /// Whether the motion passes at a distance, from positions at -step and step; `least` is the
  /// eigenvalue between.
  Nearby Judge(const Kinematics<Space, S>& at, S least, S step) {
    curve_.setZero();
    const bool may_pass = least > S(kPassed * kRegularization);
    if (!Move(at, -step)) return Nearby::kUnknown;
    moved_ = state_.q() - there_;
    const S before = may_pass ? LeastEigenvalue() : S(0);
    if (!Move(at, step)) return Nearby::kUnknown;
    curve_ = state_.q() - there_;
    if ((curve_ - moved_).norm() > S(2 * kTurned) * step * rates_.norm()) return Nearby::kRegular;
    curve_ = (curve_ + moved_) / (S(2) * step * step);
    if (!may_pass) return Nearby::kOneBranch;
    const S after = LeastEigenvalue();
    // the lowest value of the parabola through the three
    const S bend = (before + after) / S(2) - least, slope = (after - before) / S(2);
    const S lowest = bend > S(0) ? least - slope * slope / (S(4) * bend) : least;
    return lowest > S(kPassed * kRegularization) ? Nearby::kRegular : Nearby::kOneBranch;
  }

  /// Forces of the constraints where Move() ended: M udot + h of the accelerations there, or body
  /// by body. False if a direction is regularized there.
  bool FindForce(VectorX<S>& force) {
    if (solver_.conditioning().smallest_weight < kRegularWeight) return false;
    if (!solver_.Accelerate(state_.kinematics(), VectorX<S>(), udot_, nullptr)) {
      dynamics_.Bias(state_.kinematics(), force);
      dynamics_.JacobianBias(state_.kinematics(), rows_);
      force = -force;
      solver_.Solve(force, rows_, udot_, nullptr);
    }
    if (solver_.TakesWrenches()) {
      const auto wrenches = dynamics_.WrenchesLeft(state_.kinematics(), udot_, nothing_);
      for (std::size_t body = 1; body < wrenches.size(); ++body) {
        const auto first = static_cast<Eigen::Index>(body) * Space::kDim;
        for (int d = 0; d < Space::kDim; ++d) force[first + d] = wrenches[body][d];
      }
    } else {
      dynamics_.Residual(state_.kinematics(), udot_, nothing_, force, rows_);
    }
    return force.allFinite();
  }

  /// Sets force_ from as many pairs of positions at multiples of -step and step as are not
  /// regularized, and is_smooth_. False if there are none.
  bool Interpolate(const Kinematics<Space, S>& at, S step) {
    constexpr double kParts[kPairs][kPairs] = {{1.0}, {4.0 / 3.0, -1.0 / 3.0}, {1.5, -0.6, 0.1}};
    int pairs = 0;
    for (; pairs < kPairs; ++pairs) {
      const S far = S(pairs + 1) * step;
      VectorX<S>& mean = means_[static_cast<std::size_t>(pairs)];
      if (!Move(at, -far) || !FindForce(mean) || !Move(at, far) || !FindForce(change_)) break;
      mean = (mean + change_) / S(2);
    }
    if (pairs == 0) return false;
    const auto sum = [&](int count, VectorX<S>& force) {
      force.setZero();
      for (int k = 0; k < count; ++k) {
        force += S(kParts[count - 1][k]) * means_[static_cast<std::size_t>(k)];
      }
    };
    sum(pairs, force_);
    sum(kPairs - 1, change_);
    const S difference = (change_ - force_).norm();
    dynamics_.Bias(state_.kinematics(), udot_);
    is_smooth_ = pairs == kPairs && difference < S(kRough) * std::max(force_.norm(), udot_.norm());
    return true;
  }

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
