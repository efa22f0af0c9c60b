#include "mechanism/formulation/system.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "mechanism/algebra/instantiate.h"
#include "mechanism/formulation/coupled_solver.h"
#include "mechanism/formulation/forward_jacobian.h"
#include "mechanism/formulation/passage.h"
#include "mechanism/loops/scaled_loops.h"

namespace loopbench {

namespace {

template <class Space, class S>
void SetRegularization(FactoredState<Space, S>& state, double share) {
  if (state.kinematics().regularization() == share) return;
  state.kinematics().SetRegularization(share);
  state.ForgetFactors();
}

/// The solver itself without couplings and rotors.
template <class Space, class S>
std::unique_ptr<ConstraintSolver<Space, S>> WithCouplings(
    const Mechanism<Space, S>& mechanism, std::unique_ptr<ConstraintSolver<Space, S>> solver,
    SolverKind kind) {
  if (mechanism.couplings().empty() && mechanism.rotors().empty()) return solver;
  return std::make_unique<CoupledSolver<Space, S>>(mechanism, std::move(solver), kind);
}

}  // namespace

template <class Space, class S>
System<Space, S>::System(const Mechanism<Space, S>& mechanism,
                         std::unique_ptr<ConstraintSolver<Space, S>> solver,
                         const FormulationOptions& options)
    : mechanism_(mechanism),
      options_(options),
      solver_(WithCouplings(mechanism, std::move(solver), options.solver)),
      level_(MakeLevel(mechanism, options)),
      state_(mechanism, *solver_),
      dynamics_(mechanism),
      drives_(mechanism.drives().empty() ? nullptr : std::make_unique<Drives<Space, S>>(mechanism)),
      udot_(VectorX<S>::Zero(mechanism.num_u())),
      lambda_(VectorX<S>::Zero(mechanism.num_equations())),
      change_(udot_),
      lambda_change_(lambda_),
      A_(mechanism.released().empty() ? 0 : static_cast<std::size_t>(mechanism.num_bodies())),
      force_(udot_),
      target_(lambda_),
      nothing_(lambda_) {}

template <class Space, class S>
System<Space, S>::~System() = default;

template <class Space, class S>
Outcome System<Space, S>::Start(S t, const VectorX<S>& q, const VectorX<S>& u) {
  Kinematics<Space, S>& kinematics = state_.kinematics();
  kinematics.SetTime(t);
  state_.ForgetReleased();
  kinematics.ForgetSteps();
  kinematics.SetRegularization(kRegularization);
  state_.SetPositions(q);
  state_.SetSpeeds(u);
  kinematics.AcceptStep();
  kinematics.CountTurns();
  accepted_t_ = t;
  state_.AcceptReleased();
  solver_->Start(kinematics);
  state_.ForgetFactors();
  return Outcome::kFinished;
}

template <class Space, class S>
void System<Space, S>::ToState(const VectorX<S>& q, const VectorX<S>& u, std::span<S> y) const {
  std::copy(q.begin(), q.end(), y.begin());
  const int num_q = mechanism_.num_q();
  for (int i = 0; i < num_state_speeds(); ++i) y[num_q + i] = u[state_speed(i)];
}

template <class Space, class S>
Outcome System<Space, S>::FromState(S t, std::span<const S> y) {
  Kinematics<Space, S>& kinematics = state_.kinematics();
  const Eigen::Map<const VectorX<S>> q(y.data(), mechanism_.num_q());
  const Eigen::Map<const VectorX<S>> speeds(y.data() + q.size(), num_state_speeds());
  const bool known = step_end_version_ == kinematics.position_version() && t == kinematics.time() &&
                     std::equal(q.begin(), q.end(), this->q().begin());
  step_end_version_ = -1;
  kinematics.SetTime(t);
  if (!known) {
    kinematics.SetRegularization(kRegularization);
    state_.SetPositions(q);
  }
  return level_->SetSpeeds(state_, speeds);
}

template <class Space, class S>
Outcome System<Space, S>::Look(S t, std::span<const S> y) {
  if (!MayTakeShortCut() || level_->right_hand_side() != SpeedsUsed::kCompleted) {
    return FromState(t, y);
  }
  const auto num_q = static_cast<std::size_t>(mechanism_.num_q());
  const auto num_u = static_cast<std::size_t>(mechanism_.num_u());
  scratch_.resize(num_q + num_u);
  const std::span<S> rates(scratch_);
  state_.kinematics().SetTime(t);
  if (!solver_->RightHandSide(SpeedsUsed::kCompleted, state_.kinematics(), y.first(num_q),
                              y.subspan(num_q, num_u), rates.first(num_q), rates.subspan(num_q))) {
    return FromState(t, y);
  }
  step_end_version_ = -1;
  state_.kinematics().SetRegularization(kRegularization);
  state_.SetPositions(Eigen::Map<const VectorX<S>>(y.data(), mechanism_.num_q()));
  state_.SetSpeeds(Eigen::Map<const VectorX<S>>(rates.data(), mechanism_.num_u()));
  return Outcome::kFinished;
}

template <class Space, class S>
void System<Space, S>::SolveFormed(VectorX<S>* lambda) {
  dynamics_.Bias(kinematics(), force_);
  dynamics_.JacobianBias(kinematics(), target_);
  force_ = -force_;
  target_.head(feedback_->size()) -= *feedback_;
  solver_->Solve(force_, target_, udot_, lambda);
}

template <class Space, class S>
void System<Space, S>::SolveAccelerations(VectorX<S>* lambda) {
  if (shares_ && carried_ == nullptr &&
      solver_->AccelerateWithShare(kinematics(), *feedback_, *state_.stress(), udot_, lambda)) {
    return;
  }
  if (!solver_->Accelerate(kinematics(), *feedback_, udot_, lambda)) SolveFormed(lambda);
  if (carried_ != nullptr) {
    VectorX<S>* multiplier_change = lambda != nullptr ? &lambda_change_ : nullptr;
    if (solver_->TakesWrenches()) {
      solver_->SolveWrenches(*carried_, change_, multiplier_change);
    } else {
      solver_->Solve(*carried_, nothing_, change_, multiplier_change);
    }
    udot_ += change_;
    if (lambda != nullptr) *lambda += lambda_change_;
  }
  if (!shares_) return;
  dynamics_.BodyAccelerations(kinematics(), udot_, A_);
  const VectorX<S>& share = state_.stress()->ShareOfAccelerations(kinematics(), A_);
  solver_->Solve(VectorX<S>(), share, change_, lambda != nullptr ? &lambda_change_ : nullptr);
  udot_ += change_;
  if (lambda != nullptr) *lambda += lambda_change_;
}

template <class Space, class S>
Outcome System<Space, S>::FactorBranch() {
  carried_ = nullptr;
  const Outcome outcome = state_.Factor();
  // prescribed motions do not continue along the present speeds, and have rules of their own
  if (!AtPassage() || drives_ != nullptr) return outcome;
  if (outcome != Outcome::kFinished || !solver_->conditioning().is_regularized) return outcome;
  if (passage_ == nullptr) passage_ = std::make_unique<Passage<Space, S>>(mechanism_, *solver_);
  const Nearby beside = passage_->Look(kinematics());
  state_.ForgetFactors();
  if (beside == Nearby::kRegular) state_.kinematics().SetRegularization(kMinRegularization);
  if (beside == Nearby::kOneBranch) {
    carried_ = &passage_->Force();
    state_.kinematics().SetRegularization(passage_->regularization());
  }
  return state_.Factor();
}

template <class Space, class S>
Outcome System<Space, S>::FindAccelerations(VectorX<S>* lambda) {
  feedback_ = &level_->Feedback(kinematics());
  shares_ = false;
  if (mechanism_.is_redundant() && !level_->changes_speeds() &&
      options_.enforcement != Enforcement::kPosition) {
    const VectorX<S>& turn = state_.stress()->Feedback(kinematics());
    shares_ = feedback_->size() == 0 && !state_.stress()->is_exact();
    if (feedback_->size() > 0) {
      both_ = *feedback_;
      both_.head(turn.size()) += turn;
    }
    feedback_ = feedback_->size() > 0 ? &both_ : &turn;
  }
  if (mechanism_.num_u() == 0) return Outcome::kFinished;
  if (const Outcome outcome = FactorBranch(); outcome != Outcome::kFinished) return outcome;
  SolveAccelerations(lambda);
  return udot_.allFinite() ? Outcome::kFinished : Outcome::kNonFinite;
}

template <class Space, class S>
Outcome System<Space, S>::Accelerate() {
  const bool is_free = mechanism_.num_u() > 0;
  VectorX<S>* lambda = drives_ != nullptr && integrates_work() ? &lambda_ : nullptr;
  lambda_is_current_ = lambda != nullptr || !is_free;
  if (const Outcome outcome = FindAccelerations(lambda); outcome != Outcome::kFinished) {
    return outcome;
  }
  if (is_free && solver_->conditioning().is_regularized) ++regularized_evaluations_;
  return drives_ == nullptr ? Outcome::kFinished : JudgeDrives();
}

/// Impulses satisfy the same equations as accelerations. A jump counts as an additional
/// acceleration of its drive, and the additional accelerations are the changes of speeds.
template <class Space, class S>
bool System<Space, S>::TakeJumps(S t, std::span<S> y) {
  const auto jump_of = [&](const Drive& drive) {
    return S(drive.value.RateJump(static_cast<double>(accepted_t_), static_cast<double>(t)));
  };
  const std::vector<Drive>& drives = mechanism_.drives();
  if (std::ranges::all_of(drives, [&](const Drive& d) { return jump_of(d) == S(0); })) return false;
  Kinematics<Space, S>& kinematics = state_.kinematics();
  kinematics.SetTime(t);
  const std::vector<TimeValue<S>> after = kinematics.drives();
  std::vector<TimeValue<S>> before = after;
  for (std::size_t d = 0; d < drives.size(); ++d) before[d].rate -= jump_of(drives[d]);
  std::vector<TimeValue<S>> pushed = before;
  for (std::size_t d = 0; d < drives.size(); ++d) pushed[d].acceleration += jump_of(drives[d]);
  step_end_version_ = -1;
  kinematics.SetRegularization(kRegularization);
  state_.SetPositions(Eigen::Map<const VectorX<S>>(y.data(), mechanism_.num_q()));
  kinematics.SetDrives(before);
  const Eigen::Map<const VectorX<S>> speeds(y.data() + mechanism_.num_q(), num_state_speeds());
  if (level_->SetSpeeds(state_, speeds) != Outcome::kFinished) return false;
  const S energy = ComputeEnergy(kinematics).kinetic;
  VectorX<S> u = this->u();
  for (const S sign : {S(-1), S(1)}) {
    kinematics.SetDrives(sign > S(0) ? pushed : before);
    state_.SetSpeeds(this->u());
    if (FindAccelerations(nullptr) != Outcome::kFinished) return false;
    u += sign * udot_;
  }
  kinematics.SetDrives(after);
  state_.SetSpeeds(u);
  ToState(q(), u, y);
  const auto work = static_cast<std::size_t>(state_size());
  if (y.size() > work) y[work] += ComputeEnergy(kinematics).kinetic - energy;
  return true;
}

/// Jacobians use the results of Examine().
template <class Space, class S>
bool System<Space, S>::MayTakeShortCut() const {
  const bool shares = mechanism_.is_redundant() && options_.enforcement != Enforcement::kPosition;
  return level_->right_hand_side() && drives_ == nullptr && mechanism_.num_q() > 0 &&
         jacobian_ == nullptr && solver_->CarriedSpeeds() == nullptr && !shares;
}

template <class Space, class S>
Outcome System<Space, S>::Derivative(S t, std::span<const S> y, std::span<S> ydot) {
  if constexpr (std::is_same_v<S, double>) {
    if (compiled_ != nullptr && StaysOnBranch()) {
      by_short_cut_ = false;
      if (!compiled_->Evaluate(t, y, ydot)) return Examine(t, y, ydot);
      derivative_version_ = -1;
      if (compiled_->is_regularized()) ++regularized_evaluations_;
      return outcome_ = Outcome::kFinished;
    }
  }
  if (MayTakeShortCut()) {
    const auto num_q = static_cast<std::size_t>(mechanism_.num_q());
    const auto num_u = static_cast<std::size_t>(mechanism_.num_u());
    state_.kinematics().SetTime(t);
    by_short_cut_ = solver_->RightHandSide(*level_->right_hand_side(), state_.kinematics(),
                                           y.first(num_q), y.subspan(num_q, num_u),
                                           ydot.first(num_q), ydot.subspan(num_q, num_u));
    if (by_short_cut_) {
      PutPower(ydot.subspan(num_q + num_u));
      return outcome_ = Outcome::kFinished;
    }
  }
  return Examine(t, y, ydot);
}

template <class Space, class S>
void System<Space, S>::PutPower(std::span<S> rates) {
  if (rates.empty()) return;
  const Power<S> power = TotalPower();
  rates[0] = power.supplied;
  rates[1] = power.dissipated;
}

template <class Space, class S>
Outcome System<Space, S>::Examine(S t, std::span<const S> y, std::span<S> ydot) {
  derivative_version_ = -1;
  outcome_ = FromState(t, y);
  if (outcome_ == Outcome::kFinished) outcome_ = Accelerate();
  if (outcome_ != Outcome::kFinished) return outcome_;
  const int num_q = mechanism_.num_q(), n = state_size();
  mechanism_.Rates(q(), u(), Eigen::Map<VectorX<S>>(ydot.data(), num_q));
  if (const std::vector<int>* carried = solver_->CarriedSpeeds()) {
    for (int i = num_q; i < n; ++i) ydot[i] = udot_[(*carried)[i - num_q]];
  } else {
    std::copy(udot_.begin(), udot_.end(), ydot.begin() + num_q);
  }
  PutPower(ydot.subspan(n));
  if (jacobian_ != nullptr) {
    derivative_version_ = kinematics().position_version();
    derivative_t_ = t;
    derivative_y_.assign(y.begin(), y.end());
  }
  return outcome_;
}

template <class Space, class S>
Outcome System<Space, S>::Evaluate(S t, const VectorX<S>& q, const VectorX<S>& u,
                                   VectorX<S>& udot) {
  step_end_version_ = -1;
  derivative_version_ = -1;
  state_.kinematics().SetTime(t);
  state_.kinematics().SetRegularization(kRegularization);
  state_.SetPositions(q);
  state_.SetSpeeds(u);
  outcome_ = Accelerate();
  udot = udot_;
  return outcome_;
}

/// In space measured angles continue from the last step's (Kinematics::AcceptStep()).
template <class Space, class S>
bool System<Space, S>::NeedsNoReview() const {
  return Space::kRot == 1 && by_short_cut_ && MayTakeShortCut() && kinematics().released().empty();
}

template <class Space, class S>
bool System<Space, S>::ReplaceReleased() {
  if (!state_.AcceptReleased()) return false;
  if (closing_ == nullptr) {
    closing_ = MakeLevel(mechanism_, FormulationOptions{.enforcement = Enforcement::kPosition});
  }
  state_.ForgetFactors();
  const VectorX<S> q = state_.q(), u = state_.u();
  if (closing_->Accept(state_, S(0)) == Accepted::kFailed) {
    // the level closes them, or reports a failure
    state_.SetPositions(q);
    state_.SetSpeeds(u);
    return true;
  }
  // the smallest change in the metric M keeps the energy to second order in the rounding
  state_.SetSpeeds(u);
  SpeedViolation(kinematics(), target_);
  target_ = -target_;
  if (state_.Factor() == Outcome::kFinished) {
    solver_->Solve(VectorX<S>(), target_, change_, nullptr);
    state_.SetSpeeds(u + change_);
  }
  return true;
}

template <class Space, class S>
bool System<Space, S>::BeginStep(S t, std::span<S> y) {
  const bool jumped = TakeJumps(t, y);
  return ReviewStep(t, y) || jumped;
}

template <class Space, class S>
bool System<Space, S>::ReviewStep(S t, std::span<S> y) {
  bool is_projected =
      MayTakeShortCut() && level_->Project(*solver_, y.first(mechanism_.num_q()),
                                           y.subspan(mechanism_.num_q(), mechanism_.num_u()));
  if (NeedsNoReview() && (is_projected || level_->takes_steps_as_they_are())) {
    accepted_t_ = t;
    return is_projected;
  }
  step_end_version_ = kinematics().position_version();
  if (Look(t, y) != Outcome::kFinished) return false;  // the next evaluation gives the reason
  const S h = t - accepted_t_;
  if (!is_projected && compiled_ != nullptr && StaysOnBranch()) {
    is_projected = level_->Project(*compiled_, state_);
  }
  if (AtPassage() && !is_projected && mechanism_.num_u() > 0) {
    FactorBranch();
    // the remaining constraints of a passage must hold positions, too
    SetRegularization(state_, std::min(kinematics().regularization(), kRegularization));
  }
  const Accepted accepted = is_projected ? Accepted::kProjected : level_->Accept(state_, h);
  SetRegularization(state_, kRegularization);
  if (accepted == Accepted::kFailed) return false;  // as above
  Kinematics<Space, S>& kinematics = state_.kinematics();
  kinematics.AcceptStep();
  accepted_t_ = t;
  const bool changed_rows = ReplaceReleased();
  const bool changed_solver = solver_->Review(kinematics);
  if (changed_solver) state_.ForgetFactors();
  if (drives_ != nullptr && IsOffBranch()) drives_->LeaveBranch();
  const bool changed = changed_solver || changed_rows || accepted == Accepted::kModeChanged;
  if (changed) ++mode_changes_;
  if (compiled_ != nullptr) compiled_->StepAccepted();
  step_end_version_ = kinematics.position_version();
  if (!changed && accepted != Accepted::kProjected) return false;
  ToState(q(), u(), y);
  return true;
}

template <class Space, class S>
const VectorX<S>& System<Space, S>::Multipliers() {
  if (lambda_is_current_) return lambda_;
  lambda_is_current_ = true;
  SolveAccelerations(&lambda_);
  return lambda_;
}

template <class Space, class S>
S System<Space, S>::DrivePower() {
  return drives_ == nullptr ? S(0) : drives_->Power(kinematics(), udot_, Multipliers());
}

template <class Space, class S>
Power<S> System<Space, S>::TotalPower() {
  Power<S> power = AppliedPower(kinematics());
  power.supplied += DrivePower();
  return power;
}

template <class Space, class S>
Diagnostics System<Space, S>::diagnostics() const {
  return {solver_->conditioning(), outcome_, regularized_evaluations_, mode_changes_};
}

template <class Space, class S>
void System<Space, S>::UseJacobian(std::unique_ptr<ForwardJacobian<Space>> jacobian) {
  jacobian_ = std::move(jacobian);
  derivative_version_ = -1;
  scratch_.resize(static_cast<std::size_t>(size()));
  derivative_y_.resize(scratch_.size());
}

template <class Space, class S>
bool System<Space, S>::IsAt(S t, std::span<const S> y) const {
  return derivative_version_ == kinematics().position_version() && t == derivative_t_ &&
         std::ranges::equal(y, derivative_y_);
}

template <class Space, class S>
std::optional<JacobianWork> System<Space, S>::Jacobian(S t, std::span<const S> y,
                                                       std::span<S> jacobian) {
  if (jacobian_ == nullptr) return std::nullopt;
  if constexpr (std::is_same_v<S, double>) {
    if (compiled_ != nullptr && compiled_->Jacobian(t, y, jacobian)) {
      return JacobianWork{.derivatives = 0, .dual_evaluations = 0};
    }
    JacobianWork work{.derivatives = 0, .dual_evaluations = jacobian_->evaluations()};
    if (!IsAt(t, y)) {
      if (Examine(t, y, scratch_) != Outcome::kFinished) return std::nullopt;  // gives the reason
      work.derivatives = 1;
    }
    Eigen::Map<Eigen::MatrixXd> all(jacobian.data(), size(), size() - num_quadratures());
    jacobian_->Evaluate(all.leftCols(state_size()));
    derivative_version_ = -1;  // one Jacobian from one derivative
    return work;
  }
  return std::nullopt;
}

// Prescribed motions: whether accelerations follow them, and their requirements on
// singular configurations (docs/theory/singular-configurations.md).

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

#define LOOPBENCH_INSTANTIATE(Space, S) template class System<Space, S>;
LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
