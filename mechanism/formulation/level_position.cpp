// Level projection: after each accepted step Newton's method on the position violation, then one
// step on the velocity violation.
#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <type_traits>

#include "mechanism/algebra/instantiate.h"
#include "mechanism/formulation/level.h"
#include "mechanism/formulation/projection_steps.h"

namespace loopbench {

namespace {

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

}  // namespace

template <class Space, class S>
std::unique_ptr<Level<Space, S>> MakePositionLevel(const Mechanism<Space, S>& mechanism,
                                                   const FormulationOptions&) {
  return std::make_unique<PositionLevel<Space, S>>(mechanism);
}

#define LOOPBENCH_INSTANTIATE(Space, S)                                                   \
  template std::unique_ptr<Level<Space, S>> MakePositionLevel(const Mechanism<Space, S>&, \
                                                              const FormulationOptions&);
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
