// advise: the cheapest method that meets an error bound.
#include "harness/suite/advise.h"

#include "harness/cli/commands.h"
#include "harness/config/formulations.h"
#include "harness/judge/analysis.h"
#include "harness/run/run.h"

namespace loopbench::harness {
namespace {

struct AdviseCommand {
  std::filesystem::path mechanism, out;
  double error = 0.0, budget = 0.0;  ///< 0: not given
  double horizon = 10.0;             ///< [s]
  std::vector<std::string> points;
  std::string format = "text";
  bool simplify = false, generated = false, exhaustive = false;
  ProcessLimits limits = {.cpu_s = 120.0, .memory_mb = 2048.0};

  std::vector<Option> Options() {
    return {
        MechanismArgument(&mechanism),
        {"--max-error", "Largest error of points [m] (default: 1e-6)", &error, From(1e-13, 1e9)},
        {"--budget", "Wall-time budget per simulated second; find the most accurate method",
         &budget, From(1e-9, 1e6), Excludes({"--max-error"})},
        {"--horizon", "Simulated time [s]", &horizon, From(1e-9, 1e9)},
        {"--points", "Points that define the error: BODY.POINT or BODY (default: all)", &points},
        {"--simplify", "Also try simpler models, with their errors and times (loopbench simplify)",
         &simplify, Excludes({"--budget"})},
        {"--generated", "Also time generated code of all formulations with the advice's settings",
         &generated},
        {"--exhaustive", "Try all combinations of formulation, level, integrator and tolerance",
         &exhaustive},
        {"-o,--out", "Experiment file that reproduces the recommendation", &out},
        TableFormatOption(&format),
        CpuOption(&limits),
        MemoryOption(&limits),
        WideOption()};
  }
};

/// Shares of the total CPU time: limit of each of the reference's three witness runs.
constexpr double kWitnessShare = 0.15, kPilotShare = 0.4;

MeasuredPoint PointNamed(const MechanismDescription& user, const std::string& name) {
  const std::size_t dot = name.find('.');
  const std::string body = name.substr(0, dot);
  std::vector<std::string> known;
  for (std::size_t i = 1; i < user.bodies.size(); ++i) {
    known.push_back(user.bodies[i].name);
    for (const auto& [point, at] : user.bodies[i].points) {
      known.push_back(user.bodies[i].name + "." + point);
      if (name == known.back()) return {i, at};
    }
    if (name == user.bodies[i].name) return {i, user.bodies[i].com};
  }
  Reject("--points: found \"{}\", expected BODY (its centre of mass) or BODY.POINT, of: {}", name,
         fmt::join(known, ", "));
}

std::string WhatIsAsked(const AdviseCommand& command) {
  return command.budget > 0.0
             ? fmt::format("at most {} s of wall time per simulated second", command.budget)
             : fmt::format("an error of at most {} m", command.error);
}

Table TableOf(const std::vector<Trial>& trials, const Trial& best) {
  Table table{.columns = Columns(
                  "formulation, enforcement, coordinates=coords, integrator, rtol:scientific, "
                  "step=step [s]:scientific, outcome, error_position_max=error [m]:scientific, "
                  "wall_s=wall [s]:seconds, ratio:exponent")};
  for (const Trial& trial : trials) {
    const auto& [method, integrator, rtol, step] = trial.choice;
    Record& row = AddRow({method.formulation, method.enforcement, method.coordinates, integrator,
                          step > 0.0 ? Value() : Value(rtol), step > 0.0 ? Value(step) : Value(),
                          trial.outcome, std::isfinite(trial.error) ? Value(trial.error) : Value(),
                          trial.wall_s, trial.wall_s / best.wall_s},
                         &table);
    row.Set("warnings", trial.warnings);  // marks the outcome
  }
  EraseEmptyColumns({"rtol", "step"}, &table);
  return table;
}

std::string ExperimentOf(const AdviseCommand& command, const Choice& choice, double horizon,
                         ReferenceOptions reference) {
  reference.cpu_s *= 2;  // reaches the same time on a machine with more load
  const auto folder = std::filesystem::absolute(command.out).parent_path();
  return ExperimentText(
      {.name = "advice for " + command.mechanism.stem().string(),
       .comment = "Asked for " + WhatIsAsked(command) + ".",
       .mechanism = std::filesystem::absolute(command.mechanism).lexically_relative(folder),
       .horizon = horizon,
       .method = choice.method,
       .integrator = choice.integrator,
       .rtol = choice.rtol,
       .step = choice.step,
       .reference = reference});
}

/// Enters the warnings of the written experiment's run and its largest error over all points.
void Examine(const MechanismFile& file, double horizon, const Reference& reference,
             bool has_all_points, Trial& trial) {
  Experiment experiment;
  experiment.name = "advise";
  experiment.problems.push_back({.name = file.description.name,
                                 .path = {},
                                 .mechanism = file,
                                 .horizons = {horizon},
                                 .tags = {}});
  const Choice& choice = trial.choice;
  Case one;
  one.mechanism = file.description.name;
  one.method = choice.method;
  one.integrator = choice.integrator;
  one.rtol = one.atol = choice.step > 0.0 ? 0.0 : choice.rtol;
  one.step = choice.step;
  one.horizon = horizon;
  one.limits.cpu_s = 60.0;
  one.keys = CaseKeys(experiment, one);
  const Record record = RunCase(experiment, one, &reference);
  const bool finished = record.Text("outcome") == "finished";
  trial.warnings = finished ? record.Text("warnings") : record.Text("outcome");
  if (finished && has_all_points) trial.error = record.Number("error_position_max");
}

/// Throws if the points used for errors move by less than the error bound: standing still meets it.
void RequireMotion(const AdviseCommand& command, const MechanismDescription& user,
                   const CertainMotion& certain, const std::vector<MeasuredPoint>& points) {
  const Reference& reference = certain.reference;
  const Compiled compiled = Compile(user, {.islands = false});
  const Measured measured{user, compiled, points};
  const std::string name = command.mechanism.string();
  bool moves = false, turns = false;
  for (std::size_t k = 0; k < reference.NumTrusted(); ++k) {
    const Distance way = DistanceOf(measured, -1, reference.snapshots[k], reference.snapshots[0]);
    const Distance &bound = reference.bounds[k], &first = reference.bounds[0];
    const bool moved = way.position > bound.position + first.position;
    if (moved && way.position > command.error) return;
    moves = moves || moved;
    turns = turns || way.rotation > bound.rotation + first.rotation;
  }
  if (moves) {
    Reject<std::runtime_error>(
        "{}: within {:g} s the measured points move by less than the error bound of {:g} m, so any "
        "method meets it: give the mechanism a speed or a force that moves it, or a smaller "
        "--max-error",
        name, certain.horizon, command.error);
  }
  Reject<std::runtime_error>(
      "{}: {} within {:g} s, so any method is exact there, and there is no advice for a motion: {}",
      name, turns ? "none of the measured points moves" : "no joint moves", certain.horizon,
      turns ? "name others with --points" : "give the mechanism a speed or a force that moves it");
}

std::string WhatWasTried(const Advice& advice) {
  return fmt::format(
      "{} in {:.3g} s{}", WithCount(advice.trials, "method"), advice.pilot_s,
      advice.untried == 0
          ? ""
          : fmt::format(", {} not tried: time limit reached (--cpu-limit)", advice.untried));
}

void PrintAdvice(const AdviseCommand& command, const Advice& advice, const Reference& reference,
                 double horizon) {
  const Trial& best = advice.finalists.front();
  Print("{} over {} s: {}\n\n", command.mechanism.stem().string(), horizon, WhatIsAsked(command));
  if (advice.reached) {
    Print("Recommended: {}\n  error {:.1e} m, {:.3g} s of wall time ({:.3g} times real time)\n",
          ToString(best.choice), best.error, best.wall_s, horizon / best.wall_s);
  } else {
    Print(
        "No method meets the bound{}. The nearest is {}:\n  error {:.1e} m, {:.3g} s of wall "
        "time\n",
        command.budget > 0.0 ? ""
                             : fmt::format(" with a margin of {:.0f} %", 100 * (1 - kErrorShare)),
        ToString(best.choice), best.error, best.wall_s);
  }
  if (!best.warnings.empty()) Print("  flagged: {}\n", best.warnings);
  Print("Dominant error: {}.\n", WhatLimits(best, reference.Certified().position));
  const auto next = std::ranges::find_if(advice.finalists, [&](const Trial& trial) {
    if (advice.reached && command.error > 0.0 && trial.error > command.error) return false;
    return trial.choice.integrator != best.choice.integrator ||
           trial.choice.method.formulation != best.choice.method.formulation;
  });
  if (next != advice.finalists.end()) {
    Print("Runner-up: {}, {:.2f} times the time, error {:.1e} m\n", ToString(next->choice),
          next->wall_s / best.wall_s, next->error);
  }
  if (advice.generated) {
    const Method& method = advice.generated->choice.method;
    Print(
        "Generated code with the same integrator, level and tolerance: {}, {:.2f} times the time, "
        "error {:.1e} m\n",
        method.formulation, advice.generated->wall_s / best.wall_s, advice.generated->error);
  } else if (command.generated) {
    Print("Generated code: no formulation could be generated and finished\n");
  }
  Print("\nFinalists, timed in turn\n\n");
  PrintText(ToScreen(TableOf(advice.finalists, best)));
  std::vector<Trial> finished;
  std::vector<std::string> cut_off;
  for (const Trial& trial : advice.looked_at) {
    if (std::isfinite(trial.error)) {
      finished.push_back(trial);
    } else {
      AddOnce(cut_off, fmt::format("{} ({})", trial.choice.integrator, ToString(trial.outcome)));
    }
  }
  Print("\nThe best of each integrator and level (pilot runs)\n\n");
  PrintText(ToScreen(TableOf(finished, best)));
  if (!cut_off.empty()) {
    Print("\nfailed, or stopped because slower than the best: {}\n", fmt::join(cut_off, ", "));
  }
  Print(
      "\nreference: {} ({}), certified to {:.1e} m until {:g} s\n"
      "pilot: {}\n",
      reference.scalar, reference.witnesses, reference.Certified().position,
      reference.trust_horizon, WhatWasTried(advice));
}

CertainMotion CertainFor(const AdviseCommand& command, const MechanismDescription& user,
                         double horizon) {
  return MakeCertainMotion(user, horizon, kWitnessShare * command.limits.cpu_s,
                           command.mechanism.string() + ": advice");
}

Advice AdviceFor(const AdviseCommand& command, const MechanismFile& file,
                 const CertainMotion& certain, const std::vector<MeasuredPoint>& points,
                 const AdviceRequest& request) {
  const TrialProblem problem{.user = file.description,
                             .reference = certain.reference,
                             .horizon = certain.horizon,
                             .points = points};
  const auto bench = MakeTrialBench(problem);
  const auto find = command.exhaustive ? &Sweep : static_cast<decltype(&Sweep)>(&Advise);
  Advice advice =
      find(request, *bench, certain.horizon, LinkLength(file.description), [&](Trial& trial) {
        Examine(file, certain.horizon, certain.reference, points.empty(), trial);
      });
  if (!command.generated || advice.finalists.empty()) return advice;
  for (const std::string& formulation : FormulationNamesWithoutPeers()) {
    Choice choice = advice.finalists.front().choice;
    choice.method.formulation = formulation;
    choice.method.execution = Execution::kGenerated;
    constexpr double kCpu_s = 60.0;
    Trial trial = bench->Try(choice, kCpu_s);
    if (!std::isfinite(trial.error)) continue;
    bench->Settle(&trial);
    if (!advice.generated || trial.wall_s < advice.generated->wall_s) advice.generated = trial;
  }
  return advice;
}

/// Returns a model's error and savings as a row; `whole` is the time of the full model [s].
Record RowOfModel(const AdviseCommand& command, const MechanismFile& file,
                  const CertainMotion& certain, const ProblemModel& model, double whole) {
  Record row;
  row.Set("model", model.name);
  const auto refuse = [&](const std::string& why) {
    row.Set("verdict", "rejected: " + why);
    return row;
  };
  // the same times as the full model
  const CertainMotion own = CertainFor(command, model.description, certain.horizon);
  if (own.horizon < certain.horizon) {
    return refuse(own.reference.message.empty() ? "its motion is not certified so far"
                                                : own.reference.message);
  }
  const CausedError caused =
      ErrorOfModel(file.description, certain.reference, model, own.reference, command.points);
  if (caused.points == 0 ||
      (!command.points.empty() && caused.points < static_cast<int>(command.points.size()))) {
    return refuse("it does not have the points");
  }
  Put(row, "caused", caused.largest, "point", caused.point);
  // half of the error is reserved for the integrator
  if (!(caused.largest <= command.error / 2)) return refuse("its error is too large");
  const Advice advice = AdviceFor(command, {model.description, model.observe, ""}, own, {},
                                  {.error = command.error - caused.largest,
                                   .budget = std::nullopt,
                                   .cpu_s = kPilotShare * command.limits.cpu_s / 4});
  if (!advice.reached) return refuse("no method reaches the rest of the error");
  const Trial& best = advice.finalists.front();
  return Put(row, "total", caused.largest + best.error, "wall_s", best.wall_s, "ratio",
             best.wall_s / whole, "verdict",
             (best.wall_s < whole ? "saves time: " : "saves none: ") + ToString(best.choice));
}

void PrintModels(const AdviseCommand& command, const MechanismFile& file,
                 const CertainMotion& certain, double whole) {
  std::vector<const SimplificationRule*> ideas;
  for (const SimplificationRule& idea : SimplificationRules()) ideas.push_back(&idea);
  constexpr double kShortRun_s = 1.0;
  const ShortRun run = MakeShortRun(file.description, std::min(kShortRun_s, certain.horizon),
                                    kWitnessShare * command.limits.cpu_s);
  const ProblemModels models = MakeModels(file, ideas, run, {});
  Table table{
      .columns = Columns(
          "model, caused=error it causes [m]:scientific, point=of, total=in all [m]:scientific, "
          "wall_s=wall [s]:seconds, ratio=of the whole's:exponent, verdict=")};
  for (const ProblemModel& model : models.models) {
    if (model.name == "full" || model.name.starts_with("islands")) continue;
    table.rows.push_back(RowOfModel(command, file, certain, model, whole));
  }
  Print("\nSimpler models, compared with the certified motion of the full model\n\n");
  if (table.rows.empty()) {
    Print("  none: nothing can be left out (see loopbench simplify)\n");
    return;
  }
  PrintText(ToScreen(table));
  Print("\nloopbench simplify {} --out FOLDER writes them.\n", command.mechanism.string());
}

int AdviseInChild(const AdviseCommand& command, const MechanismFile& file) {
  const MechanismDescription& user = file.description;
  const std::string name = command.mechanism.string();
  std::vector<MeasuredPoint> points;
  for (const std::string& point : command.points) points.push_back(PointNamed(user, point));
  const CertainMotion certain = CertainFor(command, user, command.horizon);
  if (!(certain.horizon > 0.0)) {
    Reject<std::runtime_error>("{}: there is no certified reference to advise by: {}", name,
                               certain.reference.message);
  }
  RequireMotion(command, user, certain, points);
  std::vector<std::string> shorter;
  if (certain.horizon < command.horizon) {
    AddNote(shorter, "The motion is certified until {:g} s only. Advice is for that.",
            certain.horizon);
  }
  if (!shorter.empty() && command.format == "text") Print("{}\n", shorter.front());
  AdviceRequest request;
  request.cpu_s = kPilotShare * command.limits.cpu_s;
  (command.budget > 0.0 ? request.budget : request.error) =
      command.budget > 0.0 ? command.budget : command.error;
  const Advice advice = AdviceFor(command, file, certain, points, request);
  if (advice.finalists.empty()) {
    Reject<std::runtime_error>("{}: no way of running it finished", name);
  }
  const Trial& best = advice.finalists.front();
  if (command.format == "text") {
    PrintAdvice(command, advice, certain.reference, certain.horizon);
    if (command.simplify) PrintModels(command, file, certain, best.wall_s);
  } else {
    Table table = TableOf(advice.finalists, best);
    table.notes = shorter;
    table.notes.insert(table.notes.begin(), WhatWasTried(advice));
    PrintText(Render(table, command.format));
  }
  if (!command.out.empty()) {
    WriteFileAtomically(command.out,
                        ExperimentOf(command, best.choice, certain.horizon, certain.options));
    PrintError("the experiment that reproduces it: {}\n", command.out.string());
  }
  return advice.reached ? 0 : 1;
}

/// Returns 1 if no method met the requirement.
int GiveAdvice(AdviseCommand& command, const Typed&) {
  constexpr double kUsualError = 1e-6;
  if (command.error == 0.0 && command.budget == 0.0) command.error = kUsualError;
  const MechanismFile file = ReadMechanism(command.mechanism);
  if (!command.out.empty()) RequireOutput(command.out);
  RequireFreedom(file, command.limits);
  return PrintFromChild(command.mechanism.string(), command.limits,
                        [&] { return AdviseInChild(command, file); });
}

}  // namespace

void AddAdvise(Commands& commands) {
  commands.Add("advise", "Recommend the cheapest method that meets an error bound", GiveAdvice);
}

}  // namespace loopbench::harness
