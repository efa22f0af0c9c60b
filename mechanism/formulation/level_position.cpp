// Level projection: after each accepted step Newton's method on the position violation, then one
// step on the velocity violation.
#include <algorithm>
#include <limits>

#include "mechanism/algebra/instantiate.h"
#include "mechanism/formulation/level.h"

namespace loopbench {

namespace {

template <class Space, class S>
class PositionLevel final : public Level<Space, S> {
 public:
  explicit PositionLevel(const Mechanism<Space, S>& mechanism)
      // round-off of poses that pass through all bodies
      : goal_(S(4) * std::numeric_limits<S>::epsilon() * S(mechanism.num_bodies())),
        length_(mechanism.length()),
        violation_(VectorX<S>::Zero(mechanism.num_equations())),
        change_(VectorX<S>::Zero(mechanism.num_u())),
        q_(VectorX<S>::Zero(mechanism.num_q())),
        moved_(q_),
        step_(q_),
        u_(change_) {
    this->right_hand_side_ = SpeedsUsed::kGiven;
  }

  bool Project(ConstraintSolver<Space, S>& solver, std::span<S> q, std::span<S> u) override {
    if (!has_constraints()) return false;
    const auto correction = solver.Project(q, u, goal_ * length_);
    if (correction) this->correction_ = *correction;
    return correction.has_value();
  }

  Accepted Accept(FactoredState<Space, S>& state, S) override {
    if (!has_constraints()) return Accepted::kAsItWas;
    Outcome outcome = ProjectPositions(state);
    if (outcome == Outcome::kFinished) outcome = ProjectSpeeds(state);
    const bool finite = state.q().allFinite() && state.u().allFinite();
    return outcome == Outcome::kFinished && finite ? Accepted::kProjected : Accepted::kFailed;
  }

 private:
  bool has_constraints() const { return violation_.size() > 0 && change_.size() > 0; }

  Outcome ProjectPositions(FactoredState<Space, S>& state) {
    const Kinematics<Space, S>& kinematics = state.kinematics();
    const Mechanism<Space, S>& mechanism = state.mechanism();
    const auto size = [&](const Correction<S>& c) {
      return std::max(c.rotation, c.shift / length_);
    };
    Correction<S> now;
    PositionViolation(kinematics, violation_, now);
    Correction<S>& correction = Level<Space, S>::correction_;
    correction = now;
    for (int i = 0; i < kMaxProjections && size(now) > goal_; ++i) {
      if (const Outcome outcome = state.Correct(violation_, change_);
          outcome != Outcome::kFinished) {
        return outcome;
      }
      const S before = size(now);
      q_ = state.q();
      mechanism.Rates(q_, change_, step_);
      moved_ = q_ + step_;
      mechanism.Normalise(moved_);
      state.SetPositions(moved_);
      PositionViolation(kinematics, violation_, now);
      ++correction.iterations;
      if (!(size(now) < before)) {  // round-off, or a regularized direction: unchanged
        state.SetPositions(q_);
        break;
      }
    }
    return Outcome::kFinished;
  }

  Outcome ProjectSpeeds(FactoredState<Space, S>& state) {
    state.SetSpeeds(state.u());
    SpeedViolation(state.kinematics(), violation_);
    if (const Outcome outcome = state.Correct(violation_, change_); outcome != Outcome::kFinished) {
      return outcome;
    }
    u_ = state.u() + change_;
    state.SetSpeeds(u_);
    return Outcome::kFinished;
  }

  S goal_;  ///< of rotations [rad], and of shifts over length_ [m]
  S length_;
  VectorX<S> violation_, change_, q_, moved_, step_, u_;
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
