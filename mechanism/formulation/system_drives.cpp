// Prescribed motions of a system: whether its accelerations follow them, and their requirements on
// singular configurations (docs/theory/singular-configurations.md).
#include <algorithm>
#include <cmath>
#include <type_traits>

#include "mechanism/algebra/instantiate.h"
#include "mechanism/formulation/system.h"
#include "mechanism/loops/scaled_loops.h"

namespace loopbench {

/// Returns the rank as conditioning() counts it, of directions without any regularization. Double
/// only: other scalars have no spectrum.
template <class Space, class S>
int System<Space, S>::FirmRank([[maybe_unused]] const Kinematics<Space, S>& at) const {
  if constexpr (std::is_same_v<S, double>) {
    const LoopSpectrum loops = SpectrumOfLoops(at);
    // one loop is regularized to twice this width, loops closed one by one to somewhat more
    const double least = 10.0 * std::sqrt(DirectionWeights<S>::kTheta) * loops.largest;
    const auto firm = static_cast<int>((loops.singular_values.array() > least).count());
    return LoopRank(mechanism_, mechanism_.num_rows() - firm);
  }
  return 0;
}

template <class Space, class S>
bool System<Space, S>::IsSingular() const {
  return solver_->conditioning().is_regularized && FirmRank(kinematics()) < drives_->usual_rank();
}

/// Steps ahead along the speeds by some widths of regularization. Constraints that are dependent
/// everywhere stay so to second order; constraints of a singular start do not.
template <class Space, class S>
void System<Space, S>::NoteRankAhead() {
  S speed = S(0);
  for (const Velocity<Space, S>& V : kinematics().motions()) {
    speed = std::max({speed, S(V.angular.norm()), S(V.linear.norm() / mechanism_.length())});
  }
  if (!(speed > S(0))) return;
  const S step = S(2e-2) / speed;
  VectorX<S> ahead(mechanism_.num_q());
  mechanism_.Rates(q(), u(), ahead);
  ahead = q() + step * ahead;
  mechanism_.Normalise(ahead);
  Kinematics<Space, S> there = kinematics();  // with the directions released at present
  there.SetTime(kinematics().time() + step);
  there.UpdatePosition(ahead);
  drives_->NoteRank(FirmRank(there));
}

/// Near a singular configuration, at the distance sigma on a branch, constraints look like x y = 0.
/// With a closure error e it is x y = e, which leaves the branch where sigma^2 is of the size of e.
template <class Space, class S>
bool System<Space, S>::IsOffBranch() const {
  if (options_.enforcement == Enforcement::kPosition ||
      options_.solver != SolverKind::kRankRevealing) {
    return false;
  }
  if constexpr (std::is_same_v<S, double>) {
    double e = 0.0;
    for (int index : mechanism_.constraints()) {
      const auto miss = kinematics().Constrained(index, kinematics().ConstraintMismatch(index));
      e = std::max({e, miss.angular.norm(), miss.linear.norm() / mechanism_.length()});
    }
    for (int c = 0; c < std::ssize(mechanism_.couplings()); ++c) {
      const double miss = std::abs(kinematics().OfFirstJoint(c, kinematics().CouplingMismatch(c)));
      e = std::max(e, kinematics().FirstTurns(c) ? miss : miss / mechanism_.length());
    }
    const int rank = mechanism_.num_rows() - LoopRank(mechanism_, 0) + drives_->usual_rank();
    // pivots, of the size of sigma or of its square, decide when to check
    if (rank == 0 || solver_->conditioning().rcond > 100.0 * std::sqrt(e)) return false;
    const LoopSpectrum loops = SpectrumOfLoops(kinematics());
    const double sigma = loops.singular_values[rank - 1] / loops.largest;
    return sigma * sigma < 10.0 * e;
  }
  return false;
}

template <class Space, class S>
Outcome System<Space, S>::JudgeDrives() {
  const Conditioning& found = solver_->conditioning();
  const bool is_accepted = kinematics().time() == accepted_t_;
  const bool is_projected = options_.enforcement == Enforcement::kPosition;
  if (is_projected && found.is_regularized && !is_accepted) return Outcome::kFinished;
  if (drives_->has_left_branch()) return Outcome::kSingular;
  if (is_accepted && options_.solver == SolverKind::kRankRevealing && mechanism_.num_u() > 0) {
    if (found.is_regularized && drives_->usual_rank() == 0) NoteRankAhead();
    const bool has_left = drives_->NoteRank(found.rank);  // a singular start
    if (is_projected && (has_left || IsSingular())) {
      drives_->Followed(kinematics(), udot_, *feedback_);
      return drives_->DecidesBranch(kinematics()) ? Outcome::kFinished : Outcome::kSingular;
    }
  }
  if (drives_->Followed(kinematics(), udot_, *feedback_)) return Outcome::kFinished;
  const bool is_singular = std::is_same_v<S, double> &&  // other scalars have no spectrum
                           options_.solver == SolverKind::kRankRevealing && IsSingular();
  return is_singular ? Outcome::kSingular : Outcome::kInconsistentMotion;
}

template <class Space, class S>
std::string System<Space, S>::Why() const {
  if (outcome_ == Outcome::kSingular) {
    const std::string why = solver_->WhySingular();
    if (!why.empty()) return why;
  }
  if (drives_ == nullptr || options_.solver != SolverKind::kRankRevealing) return {};
  const bool is_projected = options_.enforcement == Enforcement::kPosition;
  const bool is_singular = outcome_ == Outcome::kSingular;
  if (!is_singular && outcome_ != Outcome::kInconsistentMotion) return {};
  if (is_singular && is_projected) {
    return "the prescribed motions decide no branch in a singular configuration: a dead end, a "
           "speed too low for inertia to carry bodies across it, or a start without the speeds of "
           "its branch; keep away from the configuration or pass it faster";
  }
  if (is_singular) {
    return "the prescribed motions pass a singular configuration or a dead end, where errors of "
           "this level decide the branch; in a singular configuration level projection keeps it";
  }
  return "the prescribed motions contradict each other or the loops at joint \"" +
         mechanism_.joint_names()[static_cast<std::size_t>(drives_->worst_joint())] + '"' +
         (solver_->conditioning().is_regularized
              ? ", or start in a singular configuration without the speeds of a branch"
              : "");
}

#define LOOPBENCH_INSTANTIATE(Space, S)                \
  template Outcome System<Space, S>::JudgeDrives();    \
  template bool System<Space, S>::IsOffBranch() const; \
  template std::string System<Space, S>::Why() const;
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
