#include "harness/suite/start_check.h"

#include <fmt/format.h>

#include <functional>
#include <set>
#include <sstream>

#include "harness/analysis/model_warnings.h"
#include "harness/run/compiled_scene.h"
#include "harness/suite/suite.h"
#include "mechanism/start/assembly.h"

namespace loopbench::harness {
namespace {

/// An answer of a child process: lines of warnings, or one line behind this letter.
constexpr char kFault = '!';

template <class Space>
std::string AnswerIn(const MechanismDescription& description) {
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  const Start<double> start = Assemble<Space>(description, mechanism);
  if (start.outcome == Outcome::kInconsistentStart) return kFault + start.message;
  std::string lines;
  for (const Warning& warning : FindGuessWarnings(description, start.q)) {
    lines += warning.text + '\n';
  }
  return lines;
}

/// A locked start is assembled; that nothing moves is a result.
std::string Answer(const MechanismDescription& description) {
  return description.space == SpaceKind::kPlanar ? AnswerIn<Planar>(description)
                                                 : AnswerIn<Spatial>(description);
}

std::string AnswerOfScene(const Experiment& experiment, const MechanismFile& file) {
  const CompiledScene scene = CompileScene(file.description, file.observe, experiment.compile);
  std::string lines;
  for (const CompiledPart& part : scene.compiled.parts) {
    std::string answer = Answer(part.description);
    if (answer.starts_with(kFault)) return answer;
    lines += answer;
  }
  return lines;
}

StartReport ReportOf(const ProcessLimits& limits, const std::function<std::string()>& answer) {
  StartReport report;
  RunInProcesses(
      1, 1, [&](std::size_t) { return answer(); }, [&](std::size_t) { return limits; },
      [&](std::size_t, const ProcessResult& result) {
        if (result.ending != ProcessEnding::kAnswered) {
          report.faults = {fmt::format("its start was not assembled ({}): {}",
                                       OutcomeOf(result.ending), result.text)};
        } else if (result.text.starts_with(kFault)) {
          report.faults = {
              fmt::format("found a start that cannot be assembled ({}), expected one from which "
                          "every loop closes",
                          result.text.substr(1))};
        } else {
          std::istringstream lines(result.text);
          for (std::string line; std::getline(lines, line);) report.warnings.push_back(line);
        }
      });
  return report;
}

}  // namespace

StartReport CheckStart(const MechanismDescription& description, const ProcessLimits& limits) {
  return ReportOf(limits, [&] { return Answer(description); });
}

StartReport CheckStarts(const std::vector<Experiment>& experiments) {
  StartReport all;
  std::set<std::string> seen;
  for (std::size_t i = 0; i < experiments.size() && all.faults.empty(); ++i) {
    const Experiment& experiment = experiments[i];
    for (const ExperimentScene& scene : experiment.scenes) {
      const MechanismFile& file = scene.mechanism;
      if (!seen.insert(ToString(experiment.compile) + "\n" + file.canonical).second) continue;
      const StartReport report = ReportOf(LimitsOfRuns(experiment.limits, 1),
                                          [&] { return AnswerOfScene(experiment, file); });
      std::string values;
      for (const auto& [name, value] : experiment.parameters.items()) {
        values += fmt::format("{}{} = {}", values.empty() ? "" : ", ", name,
                              experiment.parameters.Text(name));
      }
      if (!values.empty()) values = " (at " + values + ")";
      for (const std::string& fault : report.faults) {
        all.faults.push_back(fmt::format("scene \"{}\": {}{}", scene.name, fault, values));
      }
      for (const std::string& warning : report.warnings) {
        all.warnings.push_back(fmt::format("scene \"{}\": {}{}", scene.name, warning, values));
      }
    }
  }
  return all;
}

}  // namespace loopbench::harness
