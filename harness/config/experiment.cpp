#include "harness/config/experiment.h"

#include <fmt/format.h>

#include <algorithm>

namespace loopbench::harness {
namespace {

template <class T>
bool EmptyOrContains(const std::vector<T>& accepted, const T& value) {
  return accepted.empty() || std::find(accepted.begin(), accepted.end(), value) != accepted.end();
}

Case MakeCase(const Experiment& experiment, std::size_t scene, const Column& column,
              double tolerance, double horizon) {
  return {.scene = scene,
          .mechanism = experiment.scenes[scene].name,
          .column = column,
          .integrator = experiment.integrator,
          .rtol = tolerance,
          .atol = tolerance,
          .horizon = horizon,
          .limits = experiment.limits};
}

}  // namespace

std::string ToString(const Column& column) {
  return fmt::format("{}/{}/{}/{}", ToString(column.formulation), ToString(column.enforcement),
                     ToString(column.coordinates), ToString(column.solver));
}

bool Matches(const EnsembleRule& rule, const Case& one) {
  return EmptyOrContains(rule.scenes, one.mechanism) &&
         EmptyOrContains(rule.horizons, one.horizon) &&
         EmptyOrContains(rule.tolerances, one.rtol) &&
         EmptyOrContains(rule.formulations, one.column.formulation) &&
         EmptyOrContains(rule.enforcements, one.column.enforcement) &&
         EmptyOrContains(rule.coordinates, one.column.coordinates) &&
         EmptyOrContains(rule.solvers, one.column.solver);
}

std::vector<Case> Expand(const Experiment& experiment) {
  std::vector<Case> cases;
  for (std::size_t scene = 0; scene < experiment.scenes.size(); ++scene) {
    for (const double horizon : experiment.scenes[scene].horizons) {
      for (const Column& column : experiment.columns) {
        for (const double tolerance : experiment.tolerances) {
          cases.push_back(MakeCase(experiment, scene, column, tolerance, horizon));
        }
      }
    }
  }
  for (Case& one : cases) {
    const auto rule =
        std::find_if(experiment.ensembles.begin(), experiment.ensembles.end(),
                     [&one](const EnsembleRule& candidate) { return Matches(candidate, one); });
    if (rule == experiment.ensembles.end()) continue;
    one.ensemble = rule->size;
    one.seed = rule->seed;
    one.perturb = rule->perturb;
  }
  return cases;
}

std::vector<Case> ExpandTiming(const Experiment& experiment) {
  std::vector<Case> cases;
  const Timing& timing = experiment.timing;
  if (timing.repeats == 0) return cases;
  for (std::size_t scene = 0; scene < experiment.scenes.size(); ++scene) {
    const std::vector<double>& horizons = experiment.scenes[scene].horizons;
    if (horizons.empty()) continue;
    const double horizon =
        timing.horizon > 0.0 ? timing.horizon : *std::min_element(horizons.begin(), horizons.end());
    for (const Column& column : timing.columns) {
      cases.push_back(MakeCase(experiment, scene, column, timing.tolerance, horizon));
    }
  }
  return cases;
}

}  // namespace loopbench::harness
