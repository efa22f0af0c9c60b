#include "harness/suite/start_check.h"

#include <fmt/format.h>

#include <functional>
#include <set>

#include "harness/run/compiled_scene.h"
#include "harness/suite/suite.h"
#include "mechanism/start/assembly.h"

namespace loopbench::harness {
namespace {

template <class Space>
std::string MessageIn(const MechanismDescription& description) {
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  const Start<double> start = Assemble<Space>(description, mechanism);
  return start.outcome == Outcome::kInconsistentStart ? start.message : "";
}

/// "" or why the start is inconsistent. A locked one is assembled; that nothing moves is a result.
std::string Message(const MechanismDescription& description) {
  return description.space == SpaceKind::kPlanar ? MessageIn<Planar>(description)
                                                 : MessageIn<Spatial>(description);
}

std::string MessageOfScene(const Experiment& experiment, const MechanismFile& file) {
  const CompiledScene scene = CompileScene(file.description, file.observe, experiment.compile);
  for (const CompiledPart& part : scene.compiled.parts) {
    if (std::string message = Message(part.description); !message.empty()) return message;
  }
  return "";
}

std::string FaultOf(const ProcessLimits& limits, const std::function<std::string()>& message) {
  std::string fault;
  RunInProcesses(
      1, 1, [&](std::size_t) { return message(); }, [&](std::size_t) { return limits; },
      [&](std::size_t, const ProcessResult& result) {
        if (result.ending != ProcessEnding::kAnswered) {
          fault = fmt::format("its start was not assembled ({}): {}", OutcomeOf(result.ending),
                              result.text);
        } else if (!result.text.empty()) {
          fault = fmt::format(
              "found a start that cannot be assembled ({}), expected one from which "
              "every loop closes",
              result.text);
        }
      });
  return fault;
}

}  // namespace

std::string StartFault(const MechanismDescription& description, const ProcessLimits& limits) {
  return FaultOf(limits, [&] { return Message(description); });
}

std::vector<std::string> StartFaults(const std::vector<Experiment>& experiments) {
  std::vector<std::string> faults;
  std::set<std::string> seen;
  for (std::size_t i = 0; i < experiments.size() && faults.empty(); ++i) {
    const Experiment& experiment = experiments[i];
    for (const ExperimentScene& scene : experiment.scenes) {
      const MechanismFile& file = scene.mechanism;
      if (!seen.insert(ToString(experiment.compile) + "\n" + file.canonical).second) continue;
      const std::string fault = FaultOf(LimitsOfRuns(experiment.limits, 1),
                                        [&] { return MessageOfScene(experiment, file); });
      if (fault.empty()) continue;
      faults.push_back(fmt::format("scene \"{}\": {}", scene.name, fault));
      std::string values;
      for (const auto& [name, value] : experiment.parameters.items()) {
        values += fmt::format("{}{} = {}", values.empty() ? "" : ", ", name,
                              experiment.parameters.Text(name));
      }
      if (!values.empty()) faults.back() += fmt::format(" (at {})", values);
    }
  }
  return faults;
}

}  // namespace loopbench::harness
