// Prescribed motions of a system: whether its accelerations follow them, and what they ask of
// singular configurations (docs/numerics.md, section 3).
#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "mechanism/algebra/instantiate.h"
#include "mechanism/formulation/system.h"
#include "mechanism/loops/scaled_loops.h"

namespace loopbench {

namespace {

/// The largest mismatch of a constraint [rad, or mechanism lengths].
template <class Space>
double ClosureError(const Kinematics<Space, double>& at) {
  double e = 0.0;
  for (int index : at.mechanism().constraints()) {
    const Velocity<Space, double> miss = at.ConstraintMismatch(index);
    e = std::max({e, miss.angular.norm(), miss.linear.norm() / at.mechanism().length()});
  }
  return e;
}

/// Near a singular position, at the distance sigma on a branch, constraints look like x y = 0. With
/// a closure error e it is x y = e, which turns off the branch where sigma^2 is of the size of e.
/// Here sigma^2 / e, sigma being the last of `rank` singular values of the loops.
template <class Space>
double MarginOfBranch(const Kinematics<Space, double>& at, int rank) {
  const Mechanism<Space, double>& mechanism = at.mechanism();
  const int last = mechanism.num_rows() - LoopRank(mechanism, 0) + rank - 1;
  if (last < 0) return std::numeric_limits<double>::infinity();
  const LoopSpectrum loops = SpectrumOfLoops(at);
  const double sigma = loops.singular_values[last] / loops.largest;
  return sigma * sigma / ClosureError(at);
}

}  // namespace

/// Rank as conditioning() counts it, of directions that are not softened at all. Double only: other
/// scalars have no spectrum.
template <class Space, class S>
int System<Space, S>::FirmRank([[maybe_unused]] const Kinematics<Space, S>& at) const {
  if constexpr (std::is_same_v<S, double>) {
    const LoopSpectrum loops = SpectrumOfLoops(at);
    // at a distance of 2e-3 rounding of positions makes 4 eps / 2e-3^3 = 1e-7 of accelerations, a
    // tenth of what a followed motion may miss; drift softens 2e-4 and, loop after loop, some more
    const double least = 10.0 * kSoftening * loops.largest;
    const auto firm = static_cast<int>((loops.singular_values.array() > least).count());
    return LoopRank(mechanism_, mechanism_.num_rows() - firm);
  }
  return 0;
}

template <class Space, class S>
bool System<Space, S>::IsSingular() const {
  return solver_->conditioning().is_near_singular && FirmRank(kinematics()) < drives_->usual_rank();
}

/// Steps ahead along the speeds by some widths of softening: constraints that depend on each other
/// everywhere do so there but for the square of that, those of a singular start do not.
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
  Kinematics<Space, S> there(mechanism_);
  there.SetTime(kinematics().time() + step);
  there.UpdatePosition(ahead);
  drives_->NoteRank(FirmRank(there));
}

/// Pivots, of the size of sigma or of its square, say when to look.
template <class Space, class S>
bool System<Space, S>::IsOffBranch() const {
  constexpr double kBent = 10.0, kNear = 100.0;
  if (options_.enforcement == Enforcement::kPosition ||
      options_.solver != SolverKind::kRankRevealing) {
    return false;
  }
  if constexpr (std::is_same_v<S, double>) {
    if (solver_->conditioning().rcond > kNear * std::sqrt(ClosureError(kinematics()))) return false;
    return MarginOfBranch(kinematics(), drives_->usual_rank()) < kBent;
  }
  return false;
}

template <class Space, class S>
Outcome System<Space, S>::JudgeDrives() {
  const Conditioning& found = solver_->conditioning();
  const bool is_accepted = kinematics().time() == accepted_t_;
  const bool is_projected = options_.enforcement == Enforcement::kPosition;
  if (is_projected && found.is_near_singular && !is_accepted) return Outcome::kFinished;
  if (drives_->has_left_branch()) return Outcome::kSingular;
  bool is_passage = false, is_start = false;
  if (is_accepted && options_.solver == SolverKind::kRankRevealing && mechanism_.num_u() > 0) {
    is_start = drives_->usual_rank() == 0;
    if (is_start && found.smallest_weight < 1.0) NoteRankAhead();
    const bool has_left = drives_->NoteRank(found.rank);  // a singular start
    is_passage = is_projected && (has_left || IsSingular());
  }
  const bool follows = drives_->Followed(kinematics(), udot_, *feedback_);
  if (!is_passage) return follows ? Outcome::kFinished : Outcome::kInconsistentMotion;
  // speeds of a start are exact, so that those of a branch leave nothing
  const bool goes_on =
      is_start ? follows : drives_->DecidesBranch(kinematics(), kinematics().softening());
  return goes_on ? Outcome::kFinished : Outcome::kSingular;
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
  bool is_passage = is_singular || IsSingular();
  if constexpr (std::is_same_v<S, double>) {
    // y = e / sigma across the branch makes accelerations of e / sigma^2, beyond a millionth
    is_passage =
        is_passage || (!is_projected && MarginOfBranch(kinematics(), drives_->usual_rank()) < 1e6);
  }
  if (is_passage) {
    return "the prescribed motions pass a singular configuration or a dead end, where errors of "
           "this level decide the branch; level position keeps it";
  }
  return "the prescribed motions contradict each other or the loops at joint \"" +
         mechanism_.joint_names()[static_cast<std::size_t>(drives_->worst_joint())] + '"' +
         (solver_->conditioning().smallest_weight < 1.0
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
