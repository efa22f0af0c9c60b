#include "harness/config/experiment.h"

#include <fmt/format.h>

#include <cmath>

#include "harness/config/experiment_sections.h"

namespace loopbench::harness {
namespace {

template <class T>
bool EmptyOrContains(const std::vector<T>& accepted, const T& value) {
  return accepted.empty() || Contains(accepted, value);
}

/// Step control of a case: a tolerance or a fixed step.
struct StepChoice {
  double tolerance = 0.0, step = 0.0;
};

std::vector<StepChoice> StepChoices(const Experiment& experiment) {
  std::vector<StepChoice> choices;
  for (const double tolerance : experiment.tolerances) choices.push_back({.tolerance = tolerance});
  for (const double step : experiment.fixed_steps) choices.push_back({.step = step});
  return choices;
}

Case MakeCase(const Experiment& experiment, std::size_t problem, const Method& method,
              const StepChoice& choice, double horizon, const std::string& integrator) {
  std::optional<AbsoluteTolerances> atols = experiment.atols;
  if (atols) {
    for (double* tolerance : atols->All()) {
      if (*tolerance == 0.0) *tolerance = choice.tolerance;
    }
  }
  Case one{.problem = problem,
           .mechanism = experiment.problems[problem].name,
           .method = method,
           .integrator = integrator,
           .jacobian = experiment.jacobian,
           .rtol = choice.tolerance,
           .atol = experiment.atol > 0.0 && choice.step == 0.0 ? experiment.atol : choice.tolerance,
           .atols = choice.step == 0.0 ? atols : std::nullopt,
           .integration = experiment.integration,
           .horizon = horizon,
           .step = choice.step,
           .limits = experiment.limits};
  one.keys = CaseKeys(experiment, one);
  return one;
}

/// Returns cases without ensembles. `horizon`: the only one of each problem (0: its shortest);
/// nothing for all. `integrator`: the only one; "": the integrators of each method.
std::vector<Case> ExpandRuns(const Experiment& experiment, const std::vector<Method>& methods,
                             const std::vector<StepChoice>& choices,
                             std::optional<double> horizon = std::nullopt,
                             const std::string& integrator = "") {
  std::vector<Case> cases;
  for (std::size_t problem = 0; problem < experiment.problems.size(); ++problem) {
    std::vector<double> horizons = experiment.problems[problem].horizons;
    if (horizon && !horizons.empty()) {
      horizons = {*horizon > 0.0 ? *horizon : std::ranges::min(horizons)};
    }
    for (const double own : horizons) {
      for (const Method& method : methods) {
        std::vector<std::string> integrators = experiment.integrators;
        if (!integrator.empty()) integrators = {integrator};
        // a placeholder for a peer, which has its own
        if (IsPeer(method) && integrators.size() > 1) integrators.resize(1);
        for (const std::string& name : integrators) {
          for (const StepChoice& choice : choices) {
            cases.push_back(MakeCase(experiment, problem, method, choice, own, name));
          }
        }
      }
    }
  }
  std::erase_if(cases, [&experiment](const Case& one) {
    return std::ranges::any_of(experiment.exclusions, [&one](const Selection& exclusion) {
      return Matches(one.keys, exclusion);
    });
  });
  return cases;
}

}  // namespace

std::string ToString(const Method& method) {
  const std::string gains =
      method.gains ? fmt::format("({}, {})", method.gains->alpha, method.gains->beta) : "";
  const std::string threads = method.threads > 1 ? fmt::format("/{}-threads", method.threads) : "";
  const bool is_library = method.execution == Execution::kLibrary;
  const std::string execution = is_library ? "" : fmt::format("/{}", ToString(method.execution));
  return fmt::format("{}/{}{}/{}/{}{}{}", method.formulation, ToString(method.enforcement), gains,
                     ToString(method.coordinates), ToString(method.solver), threads, execution);
}

Record CaseKeys(const Experiment& experiment, const Case& one) {
  Record keys;
  keys.Set("kind", std::string("accuracy"));
  keys.Set("experiment", experiment.name);
  keys.Set("mechanism", one.mechanism);
  keys.Set("formulation", one.method.formulation);
  keys.Set("enforcement", std::string(ToString(one.method.enforcement)));
  keys.Set("coordinates", std::string(ToString(one.method.coordinates)));
  keys.Set("solver", std::string(ToString(one.method.solver)));
  const FormulationRow* row = FindFormulation(one.method.formulation);
  const bool is_peer = IsPeer(one.method);
  keys.Set("integrator", is_peer ? row->integrator : one.integrator);
  const Profile* profile = FindProfile(one.integrator);
  const bool is_implicit = profile != nullptr && profile->is_implicit && !is_peer;
  if (is_implicit) {
    const auto kind = static_cast<std::size_t>(one.jacobian);
    keys.Set("jacobian", std::string(kNames<JacobianKind>[kind]));
  }
  const bool is_fixed = one.step > 0.0;
  keys.Set("rtol", is_fixed ? Value() : Value(one.rtol));
  keys.Set("atol", is_fixed || one.atols ? Value() : Value(one.atol));
  if (one.atols) {
    AtolFields().Show(*one.atols, [&keys](const std::string& quantity, const Json& value) {
      // a tolerance that is no number has been reported
      keys.Set("atol_" + quantity, value.is_number() ? Value(value.get<double>()) : Value());
    });
  }
  if (is_fixed) keys.Set("step", one.step);
  const Json options = IntegrationFields().Write(one.integration);
  for (const auto& [option, value] : options.items()) {
    if (!UsesOption(option, is_implicit, is_fixed)) continue;
    keys.Set(option, value.is_number_integer() ? Value(value.get<std::int64_t>())
                                               : Value(value.get<double>()));
  }
  keys.Set("horizon", one.horizon);
  if (one.method.gains) {
    keys.Set("alpha", one.method.gains->alpha);
    keys.Set("beta", one.method.gains->beta);
  }
  if (one.method.threads > 1) keys.Set("threads", std::int64_t{one.method.threads});
  if (one.method.execution != Execution::kLibrary) {
    keys.Set("execution", std::string(ToString(one.method.execution)));
  }
  for (const auto& [name, value] : experiment.parameters.items()) keys.Set(name, value);
  return keys;
}

std::string SettingOf(const Case& one) {
  return one.step > 0.0 ? fmt::format("step {}", one.step) : fmt::format("{}", one.rtol);
}

double ExpectedSteps(const Case& one) {
  if (one.step > 0.0) return one.horizon / one.step;
  return one.horizon * std::pow(one.rtol, -0.2);
}

void UseThreads(int threads, Experiment& experiment) {
  const auto use = [threads](std::vector<Method>& methods) {
    std::vector<Method> all;
    for (Method& method : methods) {
      if (!FindFormulation(method.formulation)->is_peer()) method.threads = threads;
      AddOnce(all, method);
    }
    methods = std::move(all);
  };
  use(experiment.methods);
  use(experiment.timing.methods);
  for (TimingFamily& family : experiment.timing.families) use(family.methods);
}

bool Matches(const EnsembleRule& rule, const Case& one) {
  return EmptyOrContains(rule.problems, one.mechanism) &&
         EmptyOrContains(rule.horizons, one.horizon) &&
         EmptyOrContains(rule.tolerances, one.rtol) &&
         EmptyOrContains(rule.formulations, one.method.formulation) &&
         EmptyOrContains(rule.enforcements, one.method.enforcement) &&
         EmptyOrContains(rule.coordinates, one.method.coordinates) &&
         EmptyOrContains(rule.solvers, one.method.solver);
}

bool IsPeer(const Method& method) {
  const FormulationRow* row = FindFormulation(method.formulation);
  return row != nullptr && row->is_peer();
}

std::vector<Case> Expand(const Experiment& experiment) {
  std::vector<Case> cases = ExpandRuns(experiment, experiment.methods, StepChoices(experiment));
  for (Case& one : cases) {
    const auto rule = std::ranges::find_if(
        experiment.ensembles,
        [&one](const EnsembleRule& candidate) { return Matches(candidate, one); });
    if (rule == experiment.ensembles.end()) continue;
    one.ensemble = rule->size;
    one.seed = rule->seed;
    one.perturb = rule->perturb;
    one.between = rule->between;
    one.branch_bound = rule->branch_bound;
  }
  return cases;
}

std::vector<Case> ExpandLadders(const Experiment& experiment) {
  const Precision& precision = experiment.precision;
  if (precision.scalars.empty() || precision.tolerances.empty()) return {};
  // the only integrator available in every scalar
  return ExpandRuns(experiment, experiment.methods, {{.tolerance = precision.tolerances.front()}},
                    precision.horizon, "ode45");
}

std::vector<Case> ExpandTiming(const Experiment& experiment) {
  const Timing& timing = experiment.timing;
  if (timing.repeats == 0) return {};
  if (timing.cases) return ExpandRuns(experiment, experiment.methods, StepChoices(experiment));
  std::vector<Case> cases =
      ExpandRuns(experiment, timing.methods, {{.tolerance = timing.tolerance}}, timing.horizon);
  std::erase_if(cases, [](const Case& one) {
    const Profile* profile = FindProfile(one.integrator);
    return !IsPeer(one.method) && profile != nullptr && !profile->has_embedding();
  });
  return cases;
}

}  // namespace loopbench::harness
