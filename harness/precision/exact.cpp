#include "harness/precision/exact.h"

#include <cmath>
#include <concepts>
#include <limits>

#include "harness/base/text.h"
#include "harness/precision/integrator.h"
#include "lagrange/lagrange.h"
#include "mechanism/start/assembly.h"
#include "odca/odca.h"

namespace loopbench::harness {

template <class Space, class S>
ClosedStart<Space, S> CloseStart(const MechanismDescription& description) {
  ClosedStart<Space, S> closed;
  const Mechanism<Space, double> in_double(description, Coordinates::kJoint);
  const Start<double> start = Assemble<Space>(description, in_double);
  closed.outcome = start.outcome;
  closed.message = start.message;
  if (closed.outcome != Outcome::kFinished) return closed;
  closed.mechanism = std::make_unique<Mechanism<Space, S>>(description, Coordinates::kJoint);
  closed.system =
      MakeSystem<lagrange::Lagrange>(*closed.mechanism, {.enforcement = Enforcement::kPosition});
  const VectorX<S> q = start.q.template cast<S>(), u = start.u.template cast<S>();
  closed.outcome = closed.system->Start(S(0), q, u);
  std::vector<S> y(static_cast<std::size_t>(closed.system->state_size())), ydot(y.size());
  if (closed.outcome == Outcome::kFinished) {
    closed.system->ToState(q, u, y);
    closed.system->BeginStep(S(0), y);
    // the outcome is a failure if the projection failed
    closed.outcome = closed.system->Derivative(S(0), y, ydot);
  }
  if (closed.outcome != Outcome::kFinished) {
    closed.message = "the start does not close in the wide scalar";
  }
  return closed;
}

Exact::Exact(const MechanismDescription& description, Coordinates coordinates)
    : mechanism_(description, coordinates), kinematics_(mechanism_) {
  const auto start = CloseStart<Planar, Float128>(description);
  outcome_ = start.outcome;
  message_ = start.message;
  if (outcome_ != Outcome::kFinished) return;
  q_ = start.system->q();
  u_ = start.system->u();
  if (coordinates != Coordinates::kJoint) {
    q_ = start.system->kinematics().CoordinatesIn(mechanism_);
    kinematics_.UpdatePosition(q_);
    u_ = start.system->kinematics().SpeedsIn(kinematics_);
  }
  kinematics_.UpdatePosition(q_);
  kinematics_.UpdateVelocity(u_);
  kinematics_.AcceptStep();
  kinematics_.CountTurns();
}

Float128 Exact::Drift(const Float128& t, const VectorX<Float128>& q) {
  kinematics_.SetTime(t);
  kinematics_.UpdatePosition(q);
  Float128 largest = 0;
  for (int index : mechanism_.constraints()) {
    const JointState<Planar, Float128>& state = kinematics_.joints()[index];
    const int all = state.directions();
    // free directions of a joint have no violation
    const Direction<Planar, Float128> constrained =
        state.Sum(state.Along(kinematics_.ConstraintMismatch(index), all), all);
    largest = std::max(largest, constrained.linear.norm());
  }
  for (int c = 0; c < std::ssize(mechanism_.couplings()); ++c) {
    const Float128 by = abs(kinematics_.OfFirstJoint(c, kinematics_.CouplingMismatch(c)));
    largest = std::max(largest, kinematics_.FirstTurns(c) ? by * mechanism_.length() : by);
  }
  return largest;
}

VectorX<Float128> Exact::Centres(const Float128& t, const VectorX<Float128>& q) {
  kinematics_.SetTime(t);
  kinematics_.UpdatePosition(q);
  VectorX<Float128> centres(Planar::kLin * (mechanism_.num_bodies() - 1));
  for (int body = 1; body < mechanism_.num_bodies(); ++body) {
    centres.segment<Planar::kLin>(Planar::kLin * (body - 1)) = kinematics_.poses()[body].p.eigen();
  }
  return centres;
}

namespace {

template <class S>
struct WitnessOptions {
  std::string_view formulation;  ///< "lagrange" or "odca"
  S tolerance = S(0);
  /// Number of extrapolation columns fewer than usual. If the times alone decide the steps,
  /// integrations with equal columns round alike and would not detect it.
  int fewer = 0;
  PutBack put_back = PutBack::kAtSteps;
  double cpu_s = 0.0;
};

/// The reference's tolerance in eps of the scalar: the round-off limit of the extrapolation
/// (integrator.h), with a margin. At a tenth of this tolerance, steps begin to be rejected for
/// rounding alone. Near singular configurations rounding grows with the inverse square of the
/// distance: no stage may come nearer than sqrt(eps / tolerance), 1e-6 in float128. Steps that
/// shrink for truncation have stages as near as 1e-5; at 1e10 eps some crossings of a kite fail.
template <class S>
constexpr double Tightest(PutBack put_back) {
  if (put_back == PutBack::kAtStages) return std::same_as<S, long double> ? 1e7 : 1e12;
  return std::same_as<S, long double> ? 1e3 : 1e6;
}
/// Tolerances of the other integrations over the reference's: multipliers', O-DCA's.
constexpr double kLooser = 30.0, kBetween = 5.0;
/// The looser integration's error is about kLooser times the reference's, so their distance alone
/// would suffice; the factor two covers the sum of round-off of all three.
constexpr double kSafety = 2.0;

template <class Space, class S>
std::unique_ptr<System<Space, S>> Make(std::string_view formulation, SolverKind solver,
                                       const Mechanism<Space, S>& mechanism) {
  const FormulationOptions options{.enforcement = Enforcement::kPosition, .solver = solver};
  if (formulation == "odca") return MakeSystem<odca::Odca>(mechanism, options);
  return MakeSystem<lagrange::Lagrange>(mechanism, options);
}

/// A system as it is integrated, with derivatives by PutBack.
template <class Space, class S>
class Followed {
 public:
  Followed(const Mechanism<Space, S>& mechanism, const WitnessOptions<S>& options)
      : mechanism_(mechanism),
        options_(options),
        system_(Make<Space, S>(options.formulation, SolverKind::kAsPublished, mechanism)) {}

  System<Space, S>& system() { return *system_; }

  Outcome Derivative(S t, std::span<const S> y, std::span<S> rates) {
    if (options_.put_back == PutBack::kAtSteps) return system_->Derivative(t, y, rates);
    stage_.assign(y.begin(), y.end());
    system_->BeginStep(t, stage_);
    const Outcome outcome = system_->Derivative(t, stage_, rates);
    const bool goes_on_from_here = t == accepted_t_;
    return outcome == Outcome::kSingular && goes_on_from_here ? Regularized(t, y, rates) : outcome;
  }

  bool Accept(S t, std::span<S> y) {
    accepted_t_ = t;
    return system_->BeginStep(t, y);
  }

  /// Returns the problem for IntegrateSystem() with times up to `last`. Both must outlive it.
  Problem<S> Until(const S& last) {
    return {system_->state_size(),
            [&](S t, std::span<const S> y, std::span<S> rates) {
              return Derivative(std::min(t, last), y, rates);
            },
            [&](S t, std::span<S> y) { return Accept(t, y); }};
  }

 private:
  Outcome Regularized(S t, std::span<const S> y, std::span<S> rates) {
    if (regularized_ == nullptr) {
      regularized_ = Make<Space, S>(options_.formulation, SolverKind::kRankRevealing, mechanism_);
      regularized_->Start(t, system_->q(), system_->u());
    }
    return regularized_->Derivative(t, y, rates);
  }

  const Mechanism<Space, S>& mechanism_;
  const WitnessOptions<S>& options_;
  std::unique_ptr<System<Space, S>> system_, regularized_;
  std::vector<S> stage_;
  S accepted_t_ = S(0);
};

/// Gragg's method with orders 14 and 20.
template <class S>
constexpr int kColumns = std::same_as<S, long double> ? 7 : kMaxColumns;

/// Maximum halvings of a step that runs into a singular configuration.
constexpr int kMaxFailures = 40;
/// Limits for a stretch without a singular configuration: this many steps, and a multiple of the
/// longest stretch before it. Near a singular configuration steps shrink with the distance, over a
/// hundred a stretch; beyond it a lost motion needed 17 000. The first stretch has its own limit.
constexpr std::int64_t kFewSteps = 1000, kManyTimes = 10, kFirstStretch = 100'000;

/// Time at which a step must end, and the reason.
struct Stop {
  double t;
  bool is_time = false;  ///< one of the times asked for
  bool is_knot = false;  ///< something jumps there
};

/// Both lists behind the start as one; close ones are one.
std::vector<Stop> StopsOf(const std::vector<double>& times, const std::vector<double>& knots) {
  std::vector<Stop> all;
  for (std::size_t i = 1; i < times.size(); ++i) all.push_back({times[i], true, false});
  for (const double knot : knots) {
    if (knot > 0.0 && knot < times.back()) all.push_back({knot, false, true});
  }
  std::ranges::stable_sort(all, {}, &Stop::t);
  std::vector<Stop> stops;
  const double close = 100 * std::numeric_limits<double>::epsilon() * times.back();
  for (const Stop& stop : all) {
    if (stops.empty() || stop.t > stops.back().t + close) {
      stops.push_back(stop);
      continue;
    }
    Stop& same = stops.back();
    if (stop.is_knot) same.t = stop.t;  // the jump decides
    same.is_time = same.is_time || stop.is_time;
    same.is_knot = same.is_knot || stop.is_knot;
  }
  return stops;
}

template <class S>
OneStepOptions<S> StepsOf(const WitnessOptions<S>& options, S horizon) {
  const bool at_stages = options.put_back == PutBack::kAtStages;
  return {.method = OneStepMethod::kGragg,
          .tolerance = options.tolerance,
          .columns = kColumns<S> - options.fewer,
          .longest_step = horizon / S(10),
          .most_failures = at_stages ? kMaxFailures : 7,
          .steps_around_failures = at_stages};
}

/// The state at a time that is asked for.
template <class Space, class S>
void Keep(System<Space, S>& system, S t, const std::vector<S>& y, Witness<Space, S>& witness) {
  witness.outcome = system.FromState(t, y);
  witness.positions.push_back(system.q());
  const Kinematics<Space, S>& kinematics = system.kinematics();
  witness.moments.push_back(
      {kinematics.poses(), kinematics.motions(), ComputeEnergy(kinematics).total()});
}

/// Follows the motion by Gragg's method without regularization. Steps end at times and knots.
///
/// With projection at steps alone, a stretch between two times that needs ten times as many steps
/// as any before, and a thousand more, ends the integration: it contains a singular configuration.
/// With projection at stages, failing derivatives lead to smaller steps. From a step that ends in a
/// singular configuration, as from a start there, it continues with the regularized derivative.
template <class Space, class S>
Witness<Space, S> Follow(const MechanismDescription& description, const WitnessOptions<S>& options,
                         const std::vector<double>& times) {
  Witness<Space, S> witness;
  const CpuLimit time(options.cpu_s);
  const auto start = CloseStart<Space, S>(description);
  witness.outcome = start.outcome;
  witness.message = start.message;
  if (witness.outcome != Outcome::kFinished) return witness;
  Followed<Space, S> followed(*start.mechanism, options);
  System<Space, S>& system = followed.system();
  witness.outcome = system.Start(S(0), start.system->q(), start.system->u());
  if (witness.outcome != Outcome::kFinished) {
    witness.message = std::string(options.formulation) + " does not start";
    return witness;
  }
  std::vector<S> y(static_cast<std::size_t>(system.state_size()));
  system.ToState(start.system->q(), start.system->u(), y);
  S last = S(times.back());  // the last time that derivatives of the stretch see
  const Problem<S> problem = followed.Until(last);
  OneStepOptions<S> steps = StepsOf(options, S(times.back()));
  followed.Accept(S(0), y);
  Keep(system, S(0), y, witness);
  if (y.empty()) {  // prescribed motions leave nothing to integrate
    for (std::size_t i = 1; i < times.size() && witness.outcome == Outcome::kFinished; ++i) {
      Keep(system, S(times[i]), y, witness);
    }
    return witness;
  }
  std::int64_t most_steps = 0;
  double reached = 0.0;  // [s]
  for (const Stop& stop : StopsOf(times, start.mechanism->stop_times())) {
    const S end = S(stop.t);
    last = stop.is_knot ? end * (S(1) - std::numeric_limits<S>::epsilon()) : end;
    steps.time_limit_s = options.cpu_s - time.cpu_s();
    if (steps.time_limit_s <= 0.0) {
      witness.outcome = Outcome::kTimeLimit;
      break;
    }
    if (!steps.steps_around_failures) {
      steps.step_limit = most_steps == 0 ? kFirstStretch : kFewSteps + kManyTimes * most_steps;
    }
    const OneStepResult result = IntegrateSystem<S>(problem, end, y, steps);
    most_steps = std::max(most_steps, result.steps);
    witness.rhs_evaluations += result.rhs_evaluations;
    witness.outcome = result.outcome;
    reached = result.t_reached;
    if (result.outcome == Outcome::kFinished && stop.is_time) Keep(system, end, y, witness);
    if (witness.outcome != Outcome::kFinished) break;
    steps.begin = end;
    steps.first_step = S(result.next_step);
  }
  if (witness.outcome != Outcome::kFinished) {
    witness.message = fmt::format("{} ends at {:.6g} s", options.formulation, reached);
  }
  witness.cpu_s = time.cpu_s();
  return witness;
}

template <class Space, class S>
S AngleBetween(const Pose<Space, S>& a, const Pose<Space, S>& b) {
  using std::abs;
  if constexpr (Space::kRot == 1) {
    return abs(a.angle - b.angle);
  } else {
    using std::asin;
    using std::min;
    using std::sqrt;
    S squares = S(0);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        const S off = a.R(i, j) - b.R(i, j);
        squares += off * off;
      }
    }
    return S(2) * asin(min(S(1), S(sqrt(squares / S(8)))));
  }
}

template <class Space, class S>
WideDistance<S> DistanceOf(const Moment<Space, S>& a, const Moment<Space, S>& b) {
  using std::abs;
  using std::max;
  WideDistance<S> d;
  for (std::size_t i = 1; i < a.poses.size(); ++i) {
    d.position = max(d.position, S((a.poses[i].p - b.poses[i].p).norm()));
    d.rotation = max(d.rotation, AngleBetween<Space, S>(a.poses[i], b.poses[i]));
    d.velocity = max(d.velocity, S((a.motions[i].linear - b.motions[i].linear).norm()));
    d.angular_velocity =
        max(d.angular_velocity, S((a.motions[i].angular - b.motions[i].angular).norm()));
  }
  d.energy = abs(a.energy - b.energy);
  return d;
}

template <class S>
constexpr S WideDistance<S>::*kDistances[] = {
    &WideDistance<S>::position, &WideDistance<S>::rotation, &WideDistance<S>::velocity,
    &WideDistance<S>::angular_velocity, &WideDistance<S>::energy};

template <class S>
WideDistance<S> Larger(WideDistance<S> a, const WideDistance<S>& b) {
  for (const auto distance : kDistances<S>) a.*distance = std::max(a.*distance, b.*distance);
  return a;
}

}  // namespace

template <class Space, class S>
Certified<Space, S> Certify(const MechanismDescription& description,
                            const std::vector<double>& times, double cpu_s, PutBack put_back) {
  const S tightest = S(Tightest<S>(put_back)) * std::numeric_limits<S>::epsilon();
  Certified<Space, S> result;
  result.witnesses = put_back == PutBack::kAtStages ? "gragg, stages projected," : "gragg";
  std::vector<double> followed = times;
  const auto follow = [&](const char* formulation, double factor, int fewer) {
    const WitnessOptions<S> options{formulation, S(factor) * tightest, fewer, put_back, cpu_s};
    Witness<Space, S> witness = Follow<Space, S>(description, options, followed);
    result.witnesses += fmt::format(" {} {:.2g}", formulation, double(options.tolerance));
    result.rhs_evaluations += witness.rhs_evaluations;
    result.cpu_s += witness.cpu_s;
    if (witness.outcome != Outcome::kFinished && result.outcome == Outcome::kFinished) {
      result.outcome = witness.outcome;
      result.message = witness.message;
    }
    followed.resize(witness.moments.size());
    return witness;
  };
  result.reference = follow("lagrange", 1.0, 0);
  if (followed.size() < 2) return result;  // nothing moves
  const Witness<Space, S> looser = follow("lagrange", kLooser, 1);
  if (followed.size() < 2) return result;
  const Witness<Space, S> other = follow("odca", kBetween, 2);
  for (std::size_t k = 0; k < followed.size(); ++k) {
    const Moment<Space, S>& own = result.reference.moments[k];
    WideDistance<S> bound = Larger(DistanceOf<Space, S>(own, looser.moments[k]),
                                   DistanceOf<Space, S>(own, other.moments[k]));
    for (const auto distance : kDistances<S>) bound.*distance *= S(kSafety);
    // integrations may agree by chance; the largest bound so far stays
    if (k > 0) bound = Larger(bound, result.bounds.back());
    result.bounds.push_back(bound);
  }
  return result;
}

#define LOOPBENCH_INSTANTIATE(SPACE, S)                                             \
  template ClosedStart<SPACE, S> CloseStart<SPACE, S>(const MechanismDescription&); \
  template Certified<SPACE, S> Certify<SPACE, S>(const MechanismDescription&,       \
                                                 const std::vector<double>&, double, PutBack);
LOOPBENCH_INSTANTIATE(Planar, long double)
LOOPBENCH_INSTANTIATE(Planar, ::loopbench::Float128)
LOOPBENCH_INSTANTIATE(Spatial, long double)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench::harness
