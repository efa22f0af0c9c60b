#include "harness/precision/witness.h"

#include <algorithm>
#include <concepts>
#include <limits>
#include <memory>

#include "harness/integrator/cpu_time.h"
#include "harness/precision/closed_start.h"
#include "harness/precision/integrator.h"
#include "harness/precision/scalars.h"
#include "lagrange/lagrange.h"
#include "odca/odca.h"

namespace loopbench::harness {
namespace {

template <class Space, class S>
std::unique_ptr<System<Space, S>> Make(std::string_view formulation,
                                       const Mechanism<Space, S>& mechanism) {
  const FormulationOptions options{.enforcement = Enforcement::kPosition,
                                   .solver = SolverKind::kAsPublished};
  if (formulation == "odca") return MakeSystem<odca::Odca>(mechanism, options);
  return MakeSystem<lagrange::Lagrange>(mechanism, options);
}

/// Of Gragg's method: orders 14 and 20.
template <class S>
constexpr int kColumns = std::same_as<S, long double> ? 7 : kMostColumns;

/// Where a step must end, and what for.
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
    if (stop.is_knot) same.t = stop.t;  // what jumps decides
    same.is_time = same.is_time || stop.is_time;
    same.is_knot = same.is_knot || stop.is_knot;
  }
  return stops;
}

template <class Space, class S>
Moment<Space, S> MomentOf(const Kinematics<Space, S>& kinematics) {
  return {kinematics.poses(), kinematics.motions(), ComputeEnergy(kinematics).total()};
}

}  // namespace

template <class Space, class S>
Witness<Space, S> Follow(const MechanismDescription& description, std::string_view formulation,
                         S tolerance, int fewer, const std::vector<double>& times, double cpu_s) {
  Witness<Space, S> witness;
  witness.formulation = formulation;
  witness.tolerance = tolerance;
  const CpuLimit time(cpu_s);
  const auto start = CloseStart<Space, S>(description);
  witness.outcome = start.outcome;
  witness.message = start.message;
  if (witness.outcome != Outcome::kFinished) return witness;
  const auto system = Make<Space, S>(formulation, *start.mechanism);
  witness.outcome = system->Start(S(0), start.system->q(), start.system->u());
  if (witness.outcome != Outcome::kFinished) {
    witness.message = std::string(formulation) + " does not start";
    return witness;
  }
  std::vector<S> y(static_cast<std::size_t>(system->state_size()));
  system->ToState(start.system->q(), start.system->u(), y);
  S end = S(0), last = S(0);  // of the stretch, and the last time that its derivatives see
  const Problem<S> problem{system->state_size(),
                           [&](S t, std::span<const S> state, std::span<S> rates) {
                             return system->Derivative(std::min(t, last), state, rates);
                           },
                           [&](S t, std::span<S> state) { return system->BeginStep(t, state); }};
  const auto keep = [&](S t) {
    witness.outcome = system->FromState(t, y);
    witness.positions.push_back(system->q());
    witness.moments.push_back(MomentOf(system->kinematics()));
  };
  OneStepOptions<S> options{.method = OneStepMethod::kGragg,
                            .tolerance = tolerance,
                            .columns = kColumns<S> - fewer,
                            .longest_step = S(times.back()) / S(10)};
  last = S(times.back());
  system->BeginStep(S(0), y);
  keep(S(0));
  if (y.empty()) {  // prescribed motions leave nothing to integrate
    for (std::size_t i = 1; i < times.size() && witness.outcome == Outcome::kFinished; ++i) {
      keep(S(times[i]));
    }
    return witness;
  }
  for (const Stop& stop : StopsOf(times, start.mechanism->stop_times())) {
    end = S(stop.t);
    last = stop.is_knot ? end * (S(1) - std::numeric_limits<S>::epsilon()) : end;
    options.time_limit_s = cpu_s - time.cpu_s();
    if (options.time_limit_s <= 0.0) {
      witness.outcome = Outcome::kTimeLimit;
      break;
    }
    const OneStepResult result = IntegrateSystem<S>(problem, end, y, options);
    witness.rhs_evaluations += result.rhs_evaluations;
    witness.outcome = result.outcome;
    if (result.outcome != Outcome::kFinished) break;
    if (stop.is_time) keep(end);
    if (witness.outcome != Outcome::kFinished) break;
    options.begin = end;
    options.first_step = S(result.next_step);
  }
  if (witness.outcome != Outcome::kFinished) {
    witness.message =
        std::string(formulation) + " ends at " + std::to_string(double(options.begin)) + " s";
  }
  witness.cpu_s = time.cpu_s();
  return witness;
}

#define LOOPBENCH_INSTANTIATE(SPACE, S)                                                    \
  template Witness<SPACE, S> Follow(const MechanismDescription&, std::string_view, S, int, \
                                    const std::vector<double>&, double);
LOOPBENCH_INSTANTIATE(Planar, long double)
LOOPBENCH_INSTANTIATE(Planar, ::loopbench::Float128)
LOOPBENCH_INSTANTIATE(Spatial, long double)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench::harness
