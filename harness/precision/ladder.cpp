#include "harness/precision/ladder.h"

#include <cmath>
#include <limits>

#include "harness/base/text.h"
#include "harness/precision/exact.h"
#include "lagrange/lagrange.h"
#include "mechanism/formulation/system.h"
#include "odca/odca.h"
#include "reduction/reduction.h"

namespace loopbench::harness {

namespace {

/// One entry per formulation of kLadderFormulations, in their order.
template <class S>
std::unique_ptr<System<Planar, S>> Make(const Method& method,
                                        const Mechanism<Planar, S>& mechanism) {
  const FormulationOptions options{.enforcement = method.enforcement, .solver = method.solver};
  if (method.formulation == "odca") return MakeSystem<odca::Odca>(mechanism, options);
  if (method.formulation == "lagrange") return MakeSystem<lagrange::Lagrange>(mechanism, options);
  if (method.formulation == "reduction")
    return MakeSystem<reduction::Reduction>(mechanism, options);
  throw std::invalid_argument("no ladder of formulation " + method.formulation);
}

/// Calls `use` with the type of a scalar.
template <class Use>
auto WithScalar(Scalar scalar, const Use& use) {
  switch (scalar) {
    case Scalar::kFloat:
      return use.template operator()<float>();
    case Scalar::kDouble:
      return use.template operator()<double>();
    case Scalar::kLongDouble:
      return use.template operator()<long double>();
    case Scalar::kFloat128:
      break;
  }
  return use.template operator()<Float128>();
}

/// A run and its final state.
struct Ended {
  SweepLevel rung;
  VectorX<Float128> centres;
};

template <class S>
Ended Climb(const LadderTask& task, Exact& exact, Scalar scalar, OneStepMethod method,
            double tolerance) {
  const CpuLimit time(task.limits.cpu_s);
  const Mechanism<Planar, S> mechanism(task.description, task.method.coordinates);
  const auto formulation = Make<S>(task.method, mechanism);
  Ended ended;
  SweepLevel& rung = ended.rung;
  rung.scalar = scalar;
  rung.tolerance = tolerance;
  const VectorX<S> q = exact.q().template cast<S>(), u = exact.u().template cast<S>();
  rung.outcome = formulation->Start(S(0), q, u);
  if (rung.outcome != Outcome::kFinished) return ended;
  std::vector<S> y(static_cast<std::size_t>(formulation->state_size()));
  formulation->ToState(q, u, y);
  Float128 t_at = 0;     // of the last accepted state
  VectorX<Float128> at;  // its positions
  Float128 drift = 0;
  const Problem<S> system{
      formulation->state_size(),
      [&](S t, std::span<const S> state, std::span<S> rates) {
        return formulation->Derivative(t, state, rates);
      },
      [&](S t, std::span<S> state) {
        const bool rewritten = formulation->BeginStep(t, state);
        at =
            Eigen::Map<const VectorX<S>>(state.data(), mechanism.num_q()).template cast<Float128>();
        t_at = Float128(t);
        drift = std::max(drift, exact.Drift(t_at, at));
        return rewritten;
      }};
  static_cast<OneStepResult&>(rung) = IntegrateSystem<S>(system, S(task.horizon), y,
                                                         {.method = method,
                                                          .tolerance = S(tolerance),
                                                          .step_limit = task.limits.steps,
                                                          .time_limit_s = task.limits.cpu_s});
  rung.drift = static_cast<double>(drift);
  rung.error = std::numeric_limits<double>::quiet_NaN();
  ended.centres = exact.Centres(t_at, at);
  rung.wall_s = time.wall_s();
  rung.cpu_s = time.cpu_s();
  return ended;
}

double Distance(const Ended& a, const Ended& b) {
  if (a.rung.outcome != Outcome::kFinished || b.rung.outcome != Outcome::kFinished) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const VectorX<Float128> apart = a.centres - b.centres;
  Float128 largest = 0;
  for (int i = 0; i < apart.size(); i += Planar::kLin) {
    largest = std::max(largest, Float128(apart.segment<Planar::kLin>(i).norm()));
  }
  return static_cast<double>(largest);
}

double Epsilon(Scalar scalar) {
  return WithScalar(
      scalar, []<class S>() { return static_cast<double>(std::numeric_limits<S>::epsilon()); });
}

/// Returns the run that judges `own`: at the same tolerance the widest that finished, or for the
/// widest the next narrower; nullptr if there is none.
const SweepLevel* JudgeOf(const std::vector<SweepLevel>& rungs, const SweepLevel& own) {
  const SweepLevel *widest = &own, *narrower = nullptr;
  for (const SweepLevel& rung : rungs) {
    if (rung.tolerance != own.tolerance || rung.outcome != Outcome::kFinished) continue;
    if (rung.scalar > widest->scalar) widest = &rung;
    if (rung.scalar >= own.scalar) continue;
    if (narrower == nullptr || rung.scalar > narrower->scalar) narrower = &rung;
  }
  return widest == &own ? narrower : widest;
}

void Judge(std::vector<SweepLevel>& rungs) {
  for (SweepLevel& own : rungs) {
    const SweepLevel* other = JudgeOf(rungs, own);
    if (own.outcome != Outcome::kFinished || other == nullptr) continue;
    if (other->scalar > own.scalar) {
      own.error_ruled_by = DominatedBy(own.error, other->error);
      own.drift_ruled_by = DominatedBy(own.drift, other->drift);
      continue;
    }
    // no wider scalar: round-off from the narrower one by the ratio of eps, within a walk's scatter
    const double walk = 10 * Epsilon(own.scalar) / Epsilon(other->scalar);
    if (own.error > walk * other->error) own.error_ruled_by = "truncation";
    if (own.drift > walk * other->drift) own.drift_ruled_by = "truncation";
  }
}

}  // namespace

std::string_view DominatedBy(double own, double widest) {
  if (std::isnan(own) || std::isnan(widest)) return "";
  return own > 2 * widest || own < widest / 2 ? "round-off" : "truncation";
}

Ladder RunLadder(const LadderTask& task) {
  Exact exact(task.description, task.method.coordinates);
  Ladder ladder;
  ladder.start = exact.outcome();
  ladder.message = exact.message();
  if (ladder.start != Outcome::kFinished) return ladder;
  LadderTask unregularized = task;
  unregularized.method = {"lagrange", Enforcement::kPosition, Coordinates::kJoint,
                          SolverKind::kAsPublished};
  Exact in_joints(task.description, Coordinates::kJoint);
  const auto reference_at = [&](double tolerance) {
    return Climb<Float128>(unregularized, in_joints, Scalar::kFloat128, OneStepMethod::kGragg,
                           tolerance);
  };
  const Ended reference = reference_at(task.precision.reference);
  ladder.reference = reference.rung;
  ladder.reference.error = Distance(reference, reference_at(1e4 * task.precision.reference));
  for (const Scalar scalar : task.precision.scalars) {
    for (const double tolerance : task.precision.tolerances) {
      Ended ended = WithScalar(scalar, [&]<class S>() {
        return Climb<S>(task, exact, scalar, OneStepMethod::kDormandPrince, tolerance);
      });
      ended.rung.error = Distance(ended, reference);
      ladder.rungs.push_back(ended.rung);
    }
  }
  Judge(ladder.rungs);
  return ladder;
}

}  // namespace loopbench::harness
