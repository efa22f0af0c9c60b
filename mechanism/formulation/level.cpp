// The levels at which constraints are enforced.
#include "mechanism/formulation/level.h"

#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <type_traits>

#include "mechanism/algebra/instantiate.h"
#include "mechanism/description/registration.h"
#include "mechanism/formulation/projection_steps.h"

namespace loopbench {

namespace {

/// Level velocity: speeds of the state are projected inside the right-hand side, or completed where
/// the state carries independent ones only. A state that carries all speeds gets the projected ones
/// after each accepted step: the difference of the two would grow exponentially.
template <class Space, class S>
class VelocityLevel final : public Level<Space, S> {
 public:
  explicit VelocityLevel(const Mechanism<Space, S>& mechanism)
      : u_(VectorX<S>::Zero(mechanism.num_u())),
        change_(u_),
        violation_(VectorX<S>::Zero(mechanism.num_equations())) {
    this->changes_speeds_ = true;
    this->right_hand_side_ = SpeedsUsed::kCompleted;
  }

  Outcome SetSpeeds(FactoredState<Space, S>& state,
                    const Eigen::Ref<const VectorX<S>>& carried) override {
    if (const std::vector<int>* speeds = state.solver().CarriedSpeeds()) {
      for (Eigen::Index i = 0; i < carried.size(); ++i) u_[(*speeds)[i]] = carried[i];
    } else {
      u_ = carried;
    }
    const Outcome outcome = u_.size() > 0 ? Complete(state) : Outcome::kFinished;
    state.SetSpeeds(u_);
    return outcome;
  }

  Accepted Accept(FactoredState<Space, S>& state, S) override {
    const bool carries_all = state.solver().CarriedSpeeds() == nullptr;
    return carries_all && violation_.size() > 0 ? Accepted::kProjected : Accepted::kAsItWas;
  }

 private:
  Outcome Complete(FactoredState<Space, S>& state) {
    if (const Outcome outcome = state.Factor(); outcome != Outcome::kFinished) return outcome;
    if (!state.solver().CompleteSpeeds(state.kinematics(), u_)) {
      state.SetSpeeds(u_);
      SpeedViolation(state.kinematics(), violation_);
      if (const Outcome outcome = state.Correct(violation_, change_);
          outcome != Outcome::kFinished) {
        return outcome;
      }
      u_ += change_;
    }
    state.ShareSpeeds(u_);
    return u_.allFinite() ? Outcome::kFinished : Outcome::kNonFinite;
  }

  VectorX<S> u_, change_, violation_;
};

// Level projection: after each accepted step Newton's method on the position violation, then one
// step on the velocity violation.

/// The steps of projection_steps.h by compiled functions: kInexpressible where one is not compiled.
/// The state changes last.
template <class Space>
class CompiledSteps {
 public:
  CompiledSteps(CompiledDerivative& compiled, const FactoredState<Space, double>& state)
      : compiled_(compiled), q_(state.q()), before_(q_), u_(state.u()) {}

  Outcome Measure(const FactoredState<Space, double>& state, Correction<double>& now) {
    std::array<double, 2> sizes;
    if (!Project(ProjectionStep::kMismatch, state, sizes)) return Outcome::kInexpressible;
    now.rotation = sizes[0];
    now.shift = sizes[1];
    return Outcome::kFinished;
  }
  Outcome Step(const FactoredState<Space, double>& state) {
    before_ = q_;
    return Project(ProjectionStep::kPositions, state, Span(q_)) ? Outcome::kFinished
                                                                : Outcome::kInexpressible;
  }
  void Undo(const FactoredState<Space, double>&) { q_.swap(before_); }
  Outcome CorrectSpeeds(FactoredState<Space, double>& state) {
    if (!Project(ProjectionStep::kSpeeds, state, Span(u_))) return Outcome::kInexpressible;
    state.SetPositions(q_);
    state.SetSpeeds(u_);
    return Outcome::kFinished;
  }

 private:
  static std::span<double> Span(VectorX<double>& x) {
    return {x.data(), static_cast<std::size_t>(x.size())};
  }
  bool Project(ProjectionStep step, const FactoredState<Space, double>& state,
               std::span<double> results) {
    const VectorX<double>& u = state.u();
    return compiled_.Project(step, state.kinematics().time(), Span(q_),
                             {u.data(), static_cast<std::size_t>(u.size())}, results);
  }

  CompiledDerivative& compiled_;
  VectorX<double> q_, before_, u_;
};

template <class Space, class S>
class PositionLevel final : public Level<Space, S> {
 public:
  explicit PositionLevel(const Mechanism<Space, S>& mechanism)
      // round-off of poses that pass through all bodies
      : goal_(S(4) * std::numeric_limits<S>::epsilon() * S(mechanism.num_bodies())),
        length_(mechanism.length()),
        steps_(mechanism) {
    this->right_hand_side_ = SpeedsUsed::kGiven;
  }

  bool Project(ConstraintSolver<Space, S>& solver, std::span<S> q, std::span<S> u) override {
    if (!steps_.has_constraints()) return false;
    const auto correction = solver.Project(q, u, goal_ * length_);
    if (correction) this->correction_ = *correction;
    return correction.has_value();
  }

  bool Project(CompiledDerivative& compiled, FactoredState<Space, S>& state) override {
    if constexpr (std::is_same_v<S, double>) {
      CompiledSteps<Space> steps(compiled, state);
      return steps_.has_constraints() && Iterate(steps, state) == Outcome::kFinished;
    }
    return false;
  }

  Accepted Accept(FactoredState<Space, S>& state, S) override {
    if (!steps_.has_constraints()) return Accepted::kAsItWas;
    const Outcome outcome = Iterate(steps_, state);
    const bool finite = state.q().allFinite() && state.u().allFinite();
    return outcome == Outcome::kFinished && finite ? Accepted::kProjected : Accepted::kFailed;
  }

 private:
  /// Newton's method on positions, then one step on speeds.
  Outcome Iterate(auto& steps, FactoredState<Space, S>& state) {
    const auto size = [&](const Correction<S>& c) {
      return std::max(c.rotation, c.shift / length_);
    };
    Correction<S> now;
    Outcome outcome = steps.Measure(state, now);
    Correction<S> correction = now;
    for (int i = 0; i < kMaxProjections && size(now) > goal_; ++i) {
      const S before = size(now);
      if (outcome == Outcome::kFinished) outcome = steps.Step(state);
      if (outcome == Outcome::kFinished) outcome = steps.Measure(state, now);
      if (outcome != Outcome::kFinished) return outcome;
      ++correction.iterations;
      if (!(size(now) < before)) {  // round-off, or a regularized direction: unchanged
        steps.Undo(state);
        break;
      }
    }
    this->correction_ = correction;
    return outcome == Outcome::kFinished ? steps.CorrectSpeeds(state) : outcome;
  }

  S goal_;  ///< of rotations [rad], and of shifts over length_ [m]
  S length_;
  LibrarySteps<Space, S> steps_;
};

// Level baumgarte: violations of positions and speeds return as constraint accelerations.

/// Automatic gain of Baumgarte stabilisation times the step. Stages violate the constraints more
/// than steps do, and 1/h times that is an error of low order, which grows with this factor. With
/// this value a violation decays within about twenty steps.
constexpr double kGainTimesStep = 0.05;

template <class Space, class S>
class BaumgarteLevel final : public Level<Space, S> {
 public:
  BaumgarteLevel(const Mechanism<Space, S>& mechanism, std::optional<BaumgarteGains> gains)
      : chooses_gains_(!gains), feedback_(VectorX<S>::Zero(mechanism.num_equations())) {
    Level<Space, S>::gains_ = gains.value_or(BaumgarteGains());
  }

  const VectorX<S>& Feedback(const Kinematics<Space, S>& kinematics) override {
    feedback_.setZero();
    AddFeedback(kinematics, Level<Space, S>::gains_, feedback_);
    return feedback_;
  }

  /// Gains from the length of steps, where users gave none (options.h).
  Accepted Accept(FactoredState<Space, S>&, S h) override {
    if (feedback_.size() == 0 || !chooses_gains_) return Accepted::kAsItWas;
    BaumgarteGains& gains = Level<Space, S>::gains_;
    const bool still_growing = h > S(2) * longest_step_;
    longest_step_ = std::max(longest_step_, h);
    const bool fits =
        gains.alpha > 0.0 ? S(gains.alpha) * longest_step_ < S(2 * kGainTimesStep) : still_growing;
    if (fits || !(longest_step_ > S(0))) return Accepted::kAsItWas;
    gains.alpha = gains.beta = static_cast<double>(S(kGainTimesStep) / longest_step_);
    return Accepted::kModeChanged;
  }

 private:
  bool chooses_gains_;
  VectorX<S> feedback_;
  S longest_step_ = S(0);  ///< of accepted steps
};

template <class Space, class S>
class AccelerationLevel final : public Level<Space, S> {
 public:
  AccelerationLevel() {
    this->right_hand_side_ = SpeedsUsed::kGiven;
    this->takes_steps_as_they_are_ = true;
  }
};

}  // namespace

template <class Space, class S>
Outcome Level<Space, S>::SetSpeeds(FactoredState<Space, S>& state,
                                   const Eigen::Ref<const VectorX<S>>& carried) {
  state.SetSpeeds(carried);
  return Outcome::kFinished;
}

template <class Space, class S>
std::deque<LevelFactory<Space, S>>& LevelFactories() {
  using Model = const Mechanism<Space, S>&;
  using Options = const FormulationOptions&;
  static std::deque<LevelFactory<Space, S>> factories = {
      [](Model, Options) { return std::make_unique<AccelerationLevel<Space, S>>(); },
      [](Model model, Options) { return std::make_unique<VelocityLevel<Space, S>>(model); },
      [](Model model, Options) { return std::make_unique<PositionLevel<Space, S>>(model); },
      [](Model model, Options options) {
        return std::make_unique<BaumgarteLevel<Space, S>>(model, options.gains);
      }};
  return factories;
}

template <class Space, class S>
std::unique_ptr<Level<Space, S>> MakeLevel(const Mechanism<Space, S>& mechanism,
                                           const FormulationOptions& options) {
  const auto& factories = LevelFactories<Space, S>();
  const auto index = static_cast<std::size_t>(options.enforcement);
  if (index >= factories.size()) {
    RefuseRow("level", ToString(options.enforcement), "a scalar other than double",
              "double, which levels of other programs are made in");
  }
  return factories[index](mechanism, options);
}

#define LOOPBENCH_INSTANTIATE(Space, S)                                           \
  template class Level<Space, S>;                                                 \
  template std::deque<LevelFactory<Space, S>>& LevelFactories<Space, S>();        \
  template std::unique_ptr<Level<Space, S>> MakeLevel(const Mechanism<Space, S>&, \
                                                      const FormulationOptions&);
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
