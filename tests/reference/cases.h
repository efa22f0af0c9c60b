// Cases for tests that run whole simulations: the paper's problems as its experiment file defines
// them, and mechanisms made in code.
#pragma once

#include "harness/config/experiment_reader.h"
#include "harness/run/run.h"
#include "tests/harness/places.h"

namespace loopbench::harness {

/// Keeps addresses out of the test list.
inline void PrintTo(const Method& method, std::ostream* out) { *out << ToString(method); }

}  // namespace loopbench::harness

namespace loopbench::harness::reference {

/// configs/experiments/paper/paper.json.
inline const Experiment& Paper() {
  static const Experiment kPaper = ReadExperiment(kConfigs / "experiments/paper/paper.json");
  return kPaper;
}

/// An experiment with one problem and nothing else.
inline Experiment Single(const MechanismFile& mechanism) {
  Experiment experiment;
  experiment.name = "single";
  experiment.problems.push_back({.name = mechanism.description.name,
                                 .path = {},
                                 .mechanism = mechanism,
                                 .horizons = {},
                                 .tags = {}});
  return experiment;
}

/// The paper's methods as published: level and solver belong to the formulation.
inline Method Published(const std::string& formulation, Coordinates coordinates) {
  return {.formulation = formulation,
          .enforcement =
              formulation == "reduction" ? Enforcement::kVelocity : Enforcement::kAcceleration,
          .coordinates = coordinates,
          .solver = SolverKind::kAsPublished};
}

inline const std::vector<Method>& PublishedMethods() {
  static const std::vector<Method> kMethods = {
      Published("odca", Coordinates::kJoint),      Published("odca", Coordinates::kAbsolute),
      Published("lagrange", Coordinates::kJoint),  Published("lagrange", Coordinates::kAbsolute),
      Published("reduction", Coordinates::kJoint), Published("reduction", Coordinates::kAbsolute)};
  return kMethods;
}

/// A method as part of a test's name: "OdcaAccelerationJointAsPublished".
inline std::string NameOf(const Method& method) {
  std::string name;
  bool upper = true;
  for (const char c : ToString(method)) {
    const bool separator = c == '/' || c == '-';
    if (!separator) name += upper ? static_cast<char>(std::toupper(c)) : c;
    upper = separator;
  }
  return name;
}

/// Another name as part of a test's.
inline std::string WithoutDashes(std::string name) {
  std::erase(name, '-');
  return name;
}

/// Names of parameters as names of tests.
struct NameOfParam {
  std::string operator()(const ::testing::TestParamInfo<Method>& one) const {
    return NameOf(one.param);
  }
  std::string operator()(const ::testing::TestParamInfo<std::string>& one) const {
    return WithoutDashes(one.param);
  }
  std::string operator()(
      const ::testing::TestParamInfo<std::tuple<std::string, Method>>& one) const {
    return WithoutDashes(std::get<0>(one.param) + NameOf(std::get<1>(one.param)));
  }
};

/// Rank-revealing solvers of each formulation at these levels, in these coordinate sets.
inline std::vector<Method> MethodsAt(std::vector<Enforcement> levels,
                                     std::vector<Coordinates> sets = {Coordinates::kJoint,
                                                                      Coordinates::kAbsolute}) {
  std::vector<Method> methods;
  for (const char* formulation : {"odca", "lagrange", "reduction"}) {
    for (const Enforcement level : levels) {
      for (const Coordinates set : sets) {
        methods.push_back({.formulation = formulation, .enforcement = level, .coordinates = set});
      }
    }
  }
  return methods;
}

/// One run of a problem. Ten minutes of CPU time: limits are for suites, a test must not end by one
/// on a busy machine.
inline Case CaseOf(const Experiment& experiment, const std::string& problem, const Method& method,
                   double tolerance, double horizon) {
  const auto it = std::ranges::find(experiment.problems, problem, &ExperimentProblem::name);
  if (it == experiment.problems.end()) throw std::invalid_argument("no problem " + problem);
  Case one{.problem = static_cast<std::size_t>(it - experiment.problems.begin()),
           .mechanism = problem,
           .method = method,
           .integrator = experiment.integrators.front(),
           .rtol = tolerance,
           .atol = tolerance,
           .horizon = horizon,
           .limits = {.cpu_s = 600.0, .steps = 1'000'000}};
  one.keys = CaseKeys(experiment, one);
  return one;
}

using harness::Shipped;
using harness::ShippedNames;

/// A mechanism of configs/experiments/overconstrained/.
inline MechanismFile Overconstrained(const std::string& name) {
  return ReadMechanism(kConfigs / "experiments/overconstrained" / (name + ".json"));
}

/// Whether a record says anything under a key.
inline bool IsSet(const Record& record, std::string_view key) {
  const Value* value = record.Find(key);
  return value != nullptr && !std::holds_alternative<std::monostate>(*value);
}

/// Runs a mechanism as it is.
inline Record RunFile(const MechanismFile& file, const Method& method, double tolerance,
                      double horizon) {
  const Experiment experiment = Single(file);
  return RunCase(experiment, CaseOf(experiment, file.description.name, method, tolerance, horizon));
}
inline Record RunShipped(const std::string& name, const Method& method, double tolerance,
                         double horizon) {
  return RunFile(Shipped(name), method, tolerance, horizon);
}

/// Runs one problem of the paper.
inline Record RunPaper(const std::string& problem, const Method& method, double tolerance,
                       double horizon) {
  return RunCase(Paper(), CaseOf(Paper(), problem, method, tolerance, horizon));
}

}  // namespace loopbench::harness::reference
