#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>
#include <string>

#include "harness/cli/command_line.h"
#include "harness/cli/commands.h"
#include "harness/config/formulations.h"
#include "harness/config/mechanism_reader.h"
#include "harness/exchange/export_c.h"
#include "harness/integrator/arkode.h"
#include "harness/isolation/processes.h"
#include "harness/record/provenance.h"
#include "harness/record/record.h"
#include "harness/run/case_identity.h"
#include "harness/text/files.h"
#include "harness/text/numeric_option.h"
#include "harness/text/terminal.h"
#include "mechanism/start/assembly.h"

namespace loopbench::harness {
namespace {

struct GenerateCommand {
  std::filesystem::path mechanism, out;
  std::filesystem::path fmu;  ///< "": none
  std::string formulation = "lagrange", level = "acceleration", coordinates = "joint";
  std::string solver = "rank-revealing";
  double horizon = 10.0;  ///< length of the motion whose branches are generated [s]
  double step = 0.0;      ///< step of the example and of co-simulation [s]; 0: from the motion
  bool json = false;
  ProcessLimits limits = kFileLimits;
};

// integrator of the motion along which branches are recorded
constexpr const char* kProfile = "ode45";
constexpr double kTolerance = 1e-6;
constexpr std::size_t kMinStates = 500, kMaxStates = 2000;

struct Motion {
  generate::RecordingStart start;
  std::vector<exchange::MotionState> states = {};
  Outcome outcome = Outcome::kFinished;
  double t_reached = 0.0;
  double step = 0.0;  ///< for fixed steps
};

/// Returns a quarter of the median step of `states`, at most 1 ms, rounded down to 1, 2, 5 x 10^n.
double StepOf(const std::vector<exchange::MotionState>& states) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < states.size(); ++i) steps.push_back(states[i].t - states[i - 1].t);
  if (steps.empty()) return 1e-3;
  std::ranges::nth_element(steps, steps.begin() + std::ssize(steps) / 2);
  const double step = std::min(1e-3, steps[steps.size() / 2] / 4.0);
  const double decade = std::pow(10.0, std::floor(std::log10(step) + 1e-9));
  return decade * (step >= 5.0 * decade ? 5.0 : step >= 2.0 * decade ? 2.0 : 1.0);
}

/// Returns accepted steps of the motion from the assembled start; the mode of the start is kept, as
/// in generated code.
template <class Space>
Motion Move(const GenerateCommand& command, const generate::RecordingSubject& subject) {
  const Mechanism<Space, double> mechanism(subject.description, subject.coordinates);
  const Start<double> start = Assemble<Space>(subject.description, mechanism);
  if (start.outcome != Outcome::kFinished) {
    throw ConfigError(fmt::format("{}: {}: {}", command.mechanism.string(), ToString(start.outcome),
                                  start.message));
  }
  const auto system = MakeFormulation<Space>(subject.formulation, mechanism, subject.options);
  Motion motion{.start = {0.0, start.q, start.u}};
  motion.outcome = system->Start(0.0, start.q, start.u);
  std::vector<double> y(static_cast<std::size_t>(system->size()));
  system->ToState(start.q, start.u, y);
  IntegratorOptions options;
  options.profile = kProfile;
  options.stop_times = mechanism.stop_times();
  options.max_step = command.horizon / kMinStates;
  options.rtol = options.atol = kTolerance;
  const auto note = [&](double t, std::span<double> state) {
    motion.states.push_back({t, {state.begin(), state.end()}});
    return StepAction::kContinue;
  };
  const IntegratorResult result = Integrate(*system, 0.0, command.horizon, y, options, note);
  motion.outcome = result.outcome;
  motion.t_reached = result.t_reached;
  motion.step = command.step > 0.0 ? command.step : StepOf(motion.states);
  const std::size_t every = motion.states.size() / kMaxStates + 1;
  for (std::size_t i = 0; i * every < motion.states.size(); ++i) {
    std::swap(motion.states[i], motion.states[i * every]);
  }
  motion.states.resize((motion.states.size() + every - 1) / every);
  return motion;
}

int GenerateHere(const GenerateCommand& command) {
  if (!command.fmu.empty()) RequireOutput(command.fmu);
  const MechanismFile file = ReadMechanism(command.mechanism);
  const SimplifiedProblem problem = SimplifyProblem(file.description, file.observe, {});
  const MechanismDescription& description = problem.compiled.parts.front().description;
  std::vector<std::string> lines;
  std::istringstream version(VersionText());
  for (std::string line; std::getline(version, line);) lines.push_back(line);
  exchange::CodeRequest request{
      .subject = {.description = description,
                  .coordinates = *Parse<Coordinates>(command.coordinates),
                  .formulation = command.formulation,
                  .options = {.enforcement = *Parse<Enforcement>(command.level),
                              .solver = *Parse<SolverKind>(command.solver)}},
      .provenance = {lines.at(0) + ", " + lines.at(1),
                     fmt::format("{}: formulation {}, level {}, {} coordinates, solver {}",
                                 command.mechanism.filename().string(), command.formulation,
                                 command.level, command.coordinates, command.solver)}};
  const Motion motion = description.space == SpaceKind::kPlanar
                            ? Move<Planar>(command, request.subject)
                            : Move<Spatial>(command, request.subject);
  request.start = motion.start;
  request.motion = motion.states;
  request.step = motion.step;
  exchange::Code code;
  std::string fmu;
  try {
    code = exchange::MakeCode(request);
    if (!command.fmu.empty()) fmu = exchange::MakeFmu(code, file.description.name, motion.step);
  } catch (const generate::NotCovered& why) {
    throw ConfigError(command.mechanism.string() + ": cannot be generated: " + why.what());
  }
  for (const exchange::CodeFile& part : code.files) {
    WriteFileAtomically(command.out / part.name, part.text);
  }
  if (!fmu.empty()) WriteFileAtomically(command.fmu, fmu);
  std::vector<JsonObject> functions;
  for (const exchange::CodeFunction& function : code.functions) {
    functions.emplace_back()
        .Add("name", function.name)
        .Add("flops", function.operations)
        .Add("branches", std::int64_t{function.branches})
        .Add("states_missed", static_cast<std::int64_t>(function.missed));
  }
  if (command.json) {
    JsonObject document;
    document.Add("file", command.mechanism.string())
        .Add("out", command.out.string())
        .Add("identifier", code.identifier)
        .Add("states", static_cast<std::int64_t>(code.state_names.size()))
        .Add("t_reached", motion.t_reached)
        .Add("functions", functions);
    PrintText(document.Text() + "\n");
    return 0;
  }
  Print("wrote {0}.h, {0}.c, {0}_example.c and CMakeLists.txt to {1}{2}\n", code.identifier,
        command.out.string(), fmu.empty() ? "" : ", and " + command.fmu.string());
  Print("{} states; weighted operations (branches): ", code.state_names.size());
  bool is_first = true;
  for (const exchange::CodeFunction& function : code.functions) {
    Print("{}{} {} ({})", is_first ? "" : ", ", function.name, function.operations,
          function.branches);
    is_first = false;
  }
  Print("\n");
  if (motion.outcome != Outcome::kFinished) {
    Print(
        "warning: the motion ended as {} at t = {:.6g} s of {:.6g} s; branches behind that are "
        "missing\n",
        ToString(motion.outcome), motion.t_reached, command.horizon);
  }
  for (const exchange::CodeFunction& function : code.functions) {
    if (function.missed == 0) continue;
    Print("warning: {}: {} branches do not serve {} of {} states of the motion\n", function.name,
          function.branches, function.missed, motion.states.size());
  }
  return 0;
}

}  // namespace

void AddGenerate(Commands& commands) {
  auto& command = commands.Keep<GenerateCommand>();
  CLI::App* app = commands.Add("generate", "Write a mechanism's equations of motion as C99 or FMU",
                               [&](const Typed&) {
                                 return PrintFromChild(command.mechanism.string(), command.limits,
                                                       [&] { return GenerateHere(command); });
                               });
  app->add_option("mechanism", command.mechanism, "Mechanism file (JSON)")->required();
  app->add_option("-o,--out", command.out, "Folder of the C files")->required();
  app->add_option("--fmu", command.fmu, "File for an FMU (FMI 2.0) of the same code");
  app->add_option("--formulation", command.formulation, "Formulation")
      ->check(CLI::IsMember(FormulationNamesWithoutPeers()))
      ->capture_default_str();
  AddChoice(app, "--enforcement", &command.level, "Level of enforcement",
            {"acceleration", "velocity"});
  AddChoice(app, "--coordinates", &command.coordinates, "Coordinate set", {"joint", "absolute"});
  AddChoice(app, "--solver", &command.solver, "Solver", {"plain", "rank-revealing"});
  app->add_option("--horizon", command.horizon,
                  "Duration of the motion whose branches are generated [s]")
      ->check(NumberFrom(0.0, 1e6))
      ->capture_default_str();
  app->add_option("--step", command.step,
                  "Step of the example and of co-simulation [s] (default: a quarter of the "
                  "median step of ode45 at 1e-6, at most 1e-3)")
      ->check(NumberFrom(1e-9, 1e3));
  AddJson(app, &command.json);
  AddLimits(app, &command.limits);
}

}  // namespace loopbench::harness
