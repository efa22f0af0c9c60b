// simplify: models of one problem, from the full one to the simplest.
#include <unistd.h>

#include "harness/cli/commands.h"
#include "harness/judge/analysis.h"
#include "harness/run/run.h"
#include "harness/suite/advise.h"
#include "mechanism/model/mechanism.h"
#include "mechanism/simplify/restart.h"

namespace loopbench::harness {
namespace {

namespace fs = std::filesystem;

/// Names of ways to lump masses, in the order of Lumping.
const std::vector<std::string> kLumpings = {"centre-of-mass", "half", "none"};

/// Returns the default limits: "light-links 0.01, ...".
std::string LimitsText() {
  std::vector<std::string> limits;
  for (const SimplificationRule& idea : SimplificationRules()) {
    if (idea.limit != nullptr) AddNote(limits, "{}={}", idea.name, SimplifyOptions{}.*idea.limit);
  }
  return fmt::format("{}", fmt::join(limits, ", "));
}

struct SimplifyCommand {
  std::filesystem::path mechanism, store, out;
  std::vector<std::string> only, thresholds;
  std::string lumping = kLumpings.front();
  double short_run = 1.0, horizon = 10.0, errors = 0.0;  ///< [s]
  double accept = 0.0;                                   ///< [m]
  bool assembled = false, force = false, only_list = false, all = false;
  ProcessLimits limits = kFileLimits;

  std::vector<Option> Options() {
    return {
        MechanismArgument(&mechanism),
        {"--list", "List possible simplifications (default)", &only_list},
        {"--only", "Rules to apply: NAME[,NAME]", &only, kSplits},
        {"--threshold", "Threshold of a rule, NAME=VALUE; defaults: " + LimitsText(), &thresholds},
        {"--lump-mass", "New place of a light link's mass", &lumping, OneOf(kLumpings)},
        {"--trial-duration", "Duration of the trial run that finds nearly rigid parts [s]; 0: none",
         &short_run, From(0.0, 1e6)},
        {"--verify", "Run all models for this time [s] and report errors of their points; 0: no",
         &errors, From(0.0, 1e6), ShowsDefault(true)},
        {"--max-model-error",
         "Largest acceptable error of a model [m], for its verdict in the store", &accept,
         From(1e-15, 1e6), Needs("--verify")},
        {"--store",
         "Store that receives a record per model: error against the full model, times, verdict "
         "(loopbench table STORE --kind models)",
         &store, Needs("--max-model-error")},
        {"--horizon", "Simulated time of the written experiment [s]", &horizon, From(1e-9, 1e9)},
        WideOption(),
        {"-o,--out", "New folder for the models, an experiment that runs them, and models.md", &out,
         Excludes({"--list"})},
        {"--assembled", "Write the full model with all coordinates of its assembled start",
         &assembled},
        {"--force", "Overwrite files of an existing folder", &force},
        CpuOption(&limits),
        MemoryOption(&limits),
        {"--all", "Print all rows of long tables", &all}};
  }
};

const SimplificationRule& IdeaNamed(const std::string& name, const std::string& option) {
  const auto found = std::ranges::find(SimplificationRules(), name, &SimplificationRule::name);
  if (found != SimplificationRules().end()) return *found;
  std::vector<std::string> names =
      Mapped<std::string>(SimplificationRules(), &SimplificationRule::name);
  const std::string nearest = NearestSpelling(name, names);
  Reject("{} {}: found \"{}\", expected one of {}{}", option, name, name, fmt::join(names, ", "),
         nearest.empty() ? "" : fmt::format(" (did you mean \"{}\"?)", nearest));
}

std::vector<const SimplificationRule*> Chosen(const std::vector<std::string>& only) {
  for (const std::string& name : only) IdeaNamed(name, "--only");
  std::vector<const SimplificationRule*> chosen;
  for (const SimplificationRule& idea : SimplificationRules()) {
    if (only.empty() || Contains(only, idea.name)) chosen.push_back(&idea);
  }
  return chosen;
}

SimplifyOptions LimitsSaid(const SimplifyCommand& command) {
  SimplifyOptions options;
  options.lumping =
      static_cast<Lumping>(std::ranges::find(kLumpings, command.lumping) - kLumpings.begin());
  for (const std::string& text : command.thresholds) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos) {
      Reject("--threshold {}: found no \"=\", expected NAME=VALUE", text);
    }
    const SimplificationRule& idea = IdeaNamed(text.substr(0, equals), "--threshold");
    if (idea.limit == nullptr) {
      Reject("--threshold {}: found a limit, expected none: {} has none", text, idea.name);
    }
    const std::string value = text.substr(equals + 1);
    double number = 0.0;
    const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
    const bool whole = error == std::errc() && end == value.data() + value.size();
    if (!whole || !(number > 0.0) || !std::isfinite(number)) {
      Reject("--threshold {}: found \"{}\", expected a number > 0", text, value);
    }
    options.*idea.limit = number;
  }
  return options;
}

// Files of models, and their records.

std::string Sentence(std::string text) {
  if (!text.empty() && text.back() != '.') text += '.';
  return text;
}

std::string CommentOf(const ProblemModel& model, const std::string& whole) {
  std::string text =
      fmt::format("{} of {}: {}", model.is_exact ? "Exact model" : "Simplified model", whole,
                  Sentence(Joined(model.done, "; ")));
  if (!model.dropped.empty()) text += " Removed: " + Sentence(Joined(model.dropped, "; "));
  if (!model.assumption.empty()) text += fmt::format(" Assumption: {}", Sentence(model.assumption));
  return text;
}

std::string List(const std::vector<std::string>& lines) {
  return Joined(lines, "",
                [](const std::string& line) { return "- " + EscapeMarkdown(line) + "\n"; });
}

std::string LadderName(const ProblemModels& ladder) {
  return ladder.models.front().description.name + "-models";
}

/// Name of the experiment file that runs all models: NAME-models.json.
std::string LadderFileName(const ProblemModels& ladder) {
  return FileName(LadderName(ladder)) + ".json";
}

/// Returns names of bodies of the full model that the other lacks.
std::vector<std::string> RemovedBodies(const MechanismDescription& whole,
                                       const MechanismDescription& simplified) {
  std::vector<std::string> names = Mapped<std::string>(whole.bodies, &BodyDescription::name);
  names.erase(names.begin());  // ground
  std::erase_if(names, [&simplified](const std::string& name) {
    return Contains(simplified.bodies | std::views::drop(1), name, &BodyDescription::name);
  });
  return names;
}

/// Returns a line per removed body: the new places of its points, and the points that no longer
/// exist.
std::vector<std::string> RemovedParts(const MechanismDescription& whole,
                                      const MechanismDescription& simplified) {
  std::vector<std::string> lines;
  for (const std::string& body : RemovedBodies(whole, simplified)) {
    std::vector<std::string> found, lost;
    for (const auto& [point, at] :
         std::ranges::find(whole.bodies, body, &BodyDescription::name)->points) {
      const FoundPoint now = FindPoint(simplified, body, point);
      if (now.body < 0) {
        lost.push_back(point);
      } else {
        AddNote(found, "{} on {}", point,
                now.body == kGround ? "ground" : simplified.bodies[now.body].name);
      }
    }
    AddNote(lines, "body {} is removed{}{}{}{}", body,
            found.empty() ? "" : "; its points: ", Joined(found, ", "),
            lost.empty() ? "" : "; removed points: ", Joined(lost, ", "));
  }
  return lines;
}

std::string PageOf(const ProblemModels& ladder, double horizon, const std::string& typed) {
  const MechanismDescription& whole = ladder.models.front().description;
  std::string page = fmt::format(
      "# Models of {}\n\nWritten by `{}`. `{}` runs all of them for {} s.\n\n"
      "| file | motion | bodies | joints | forces | model error [m] | evaluations |\n"
      "|---|---|---|---|---|---|---|\n",
      EscapeMarkdown(whole.name), EscapeMarkdown(typed), LadderFileName(ladder), horizon);
  for (const ProblemModel& model : ladder.models) {
    page +=
        fmt::format("| {}.json | {} | {} | {} | {} | {} | {} |\n", model.name,
                    model.is_exact ? "the same" : "changed", model.description.bodies.size() - 1,
                    model.description.joints.size(), model.description.forces.size(), model.error,
                    model.rhs_evaluations < 0 ? "" : std::to_string(model.rhs_evaluations));
  }
  if (ladder.models.front().rhs_evaluations >= 0) {
    page +=
        "\n*model error*: the largest distance of a named point from its place in the full model, "
        "at 50 times of an accurate run (multipliers at level projection, dormand-prince at "
        "1e-10); *evaluations*: right-hand sides of that run.\n";
  }
  for (std::size_t i = 1; i < ladder.models.size(); ++i) {
    const ProblemModel& model = ladder.models[i];
    page += fmt::format("\n## {}\n\n{}", model.name, List(model.done));
    if (!model.dropped.empty()) page += fmt::format("\nRemoved:\n\n{}", List(model.dropped));
    if (!model.assumption.empty()) {
      page += fmt::format("\nAssumption: {}\n", EscapeMarkdown(Sentence(model.assumption)));
    }
    const std::vector<std::string> gone = RemovedParts(whole, model.description);
    if (!gone.empty()) page += fmt::format("\nNames:\n\n{}", List(gone));
    if (!model.R_WC.isIdentity(0.0)) {
      const auto axis = [&](int i_axis) {
        const Eigen::Vector3d v = model.R_WC.col(i_axis);
        return fmt::format("({:.6g}, {:.6g}, {:.6g})", v.x() + 0.0, v.y() + 0.0, v.z() + 0.0);
      };
      page += fmt::format("\nIts x, y and z axes are {}, {} and {} in the full model.\n", axis(0),
                          axis(1), axis(2));
    }
  }
  return page;
}

/// Writes NAME.json of all models, the experiment and models.md: complete or not at all. With
/// `force` they atomically replace files in an existing folder.
/// @throws ConfigError if the folder exists and is not empty, unless `force`
void WriteModels(const ProblemModels& ladder, double horizon, const std::string& typed,
                 const std::filesystem::path& folder, bool force) {
  std::error_code error;
  const bool is_there = fs::exists(fs::symlink_status(folder, error)) &&
                        !(fs::is_directory(folder, error) && fs::is_empty(folder, error));
  if (is_there && !force) {
    Reject("{}: found a folder with files, expected a new one; --force puts the models among them",
           folder.string());
  }
  const std::string& whole = ladder.models.front().description.name;
  std::map<std::string, std::string> files;
  LadderFile experiment{LadderName(ladder),
                        fmt::format("Models of {}, the full model first (models.md).", whole),
                        {},
                        horizon};
  for (const ProblemModel& model : ladder.models) {
    const std::string file = model.name + ".json";
    const std::string comment =
        &model == &ladder.models.front() ? "The full model." : CommentOf(model, whole);
    files[file] = MechanismText(model.description, model.observe, comment);
    experiment.mechanisms.push_back(file);
  }
  const std::string run = LadderFileName(ladder);
  files[run] = LadderText(experiment);
  files["models.md"] = PageOf(ladder, horizon, typed);
  fs::path target = folder;
  if (!target.has_filename()) target = target.parent_path();  // "out/"
  const Unfinished fresh{fs::path(target).concat(fmt::format(".new-{}", ::getpid()))};
  for (const auto& [name, text] : files) WriteFileAtomically(fresh.path() / name, text);
  ReadExperiments(fresh.path() / run);
  if (is_there) {
    for (const auto& [name, text] : files) WriteFileAtomically(folder / name, text);
    return;
  }
  fs::rename(fresh.path(), target, error);
  if (error) {
    Reject<std::runtime_error>("cannot make '{}': {}", target.string(), error.message());
  }
}

/// Runs all models for `horizon` seconds with small steps, each with at most `cpu_s`, and sets
/// their errors.
void MeasureErrors(double horizon, double cpu_s, ProblemModels* ladder) {
  const MechanismDescription& whole = ladder->models.front().description;
  Track truth;
  for (ProblemModel& model : ladder->models) {
    const bool is_whole = &model == &ladder->models.front();
    Track track = TrackOf(model.description, model.R_WC, whole, horizon, cpu_s);
    model.rhs_evaluations = track.rhs_evaluations;
    model.worst = track.failure;
    if (is_whole) truth = std::move(track);
    if (is_whole || !model.worst.empty()) continue;
    if (!truth.failure.empty()) {
      model.worst = "the full model: " + truth.failure;
      continue;
    }
    const ModelError error = Compare(truth, track);
    model.error = error.points > 0 ? fmt::format("{:.1e}", error.distance) : "";
    model.worst = error.points > 0 ? error.point : "no point in common";
  }
}

struct ModelQuestion {
  double horizon = 0.0;  ///< [s]
  double accept = 0.0;   ///< largest acceptable error of a model [m]
  double cpu_s = 0.0;    ///< limit of one integration [s]
  std::string what;      ///< "my.json: --store", for messages
};

constexpr int kRepeats = 20;  ///< timed runs of each model; the fastest counts

Choice Alike() {
  return {.method = {.formulation = "odca", .enforcement = Enforcement::kPosition}, .rtol = 1e-8};
}

/// Model with data on its motion, and its runs. Not movable: its parts refer to each other.
struct JudgedModel {
  const ProblemModel& model;
  CertainMotion certain;
  std::unique_ptr<TrialProblem> problem = nullptr;  ///< the bench refers to it
  std::unique_ptr<TrialBench> bench = nullptr;
  Trial trial = {};
  std::string fault = "";  ///< reason why there are no runs
};

/// Runs the model once if its motion is certified to the end.
std::unique_ptr<JudgedModel> Examined(const ProblemModel& model, double horizon,
                                      const ModelQuestion& question) {
  auto judged = std::make_unique<JudgedModel>(JudgedModel{
      model, MakeCertainMotion(model.description, horizon, question.cpu_s, question.what)});
  const Reference& reference = judged->certain.reference;
  if (judged->certain.horizon < horizon || !(horizon > 0.0)) {
    judged->fault =
        reference.message.empty()
            ? fmt::format("its motion is certified until {} s only", judged->certain.horizon)
            : reference.message;
    return judged;
  }
  judged->problem = std::make_unique<TrialProblem>(TrialProblem{
      .user = model.description, .reference = reference, .horizon = horizon, .points = {}});
  try {
    judged->bench = MakeTrialBench(*judged->problem);
    judged->trial = judged->bench->Try(Alike(), question.cpu_s);
  } catch (const std::runtime_error& error) {
    judged->fault = error.what();
    judged->bench = nullptr;
  }
  return judged;
}

Record KeysOf(const MechanismFile& file, const ProblemModel& model, const ModelQuestion& question) {
  const Choice alike = Alike();
  Record keys;
  Put(keys, "kind", "model", "mechanism", file.description.name, "model", model.name, "formulation",
      alike.method.formulation, "enforcement", alike.method.enforcement, "coordinates",
      alike.method.coordinates, "integrator", alike.integrator, "rtol", alike.rtol, "horizon",
      question.horizon);
  SetCaseId(&keys, Fnv1a(fmt::format("{}|{}|{}", file.canonical,
                                     MechanismText(model.description, model.observe, ""),
                                     question.accept)));
  return keys;
}

void WriteRun(const JudgedModel& judged, Record& record) {
  const Trial& trial = judged.trial;
  const MechanismDescription& description = judged.model.description;
  const bool has_run = judged.bench != nullptr;
  Put(record, "outcome", has_run ? ToString(trial.outcome) : "unsupported", "message", judged.fault,
      "model_motion", judged.model.is_exact ? "the same" : "changed", "bodies",
      description.bodies.size() - 1, "joints", description.joints.size());
  if (!has_run) return;
  Put(record, "error_position_max", trial.error, "steps", trial.steps, "rhs_evaluations",
      trial.rhs_evaluations, "wall_s", trial.wall_s);
}

/// Writes the error of the model relative to the full model, and whether it is accepted.
void WriteVerdict(const MechanismFile& file, const JudgedModel& whole, const JudgedModel& judged,
                  const ModelQuestion& question, Record& record) {
  if (&judged == &whole) return record.Set("model_verdict", std::string("full model"));
  record.Set("model_accepts", question.accept);
  const auto conclude = [&](const std::string& verdict) { record.Set("model_verdict", verdict); };
  if (!judged.fault.empty()) return conclude("rejected: " + judged.fault);
  const CausedError caused = ErrorOfModel(file.description, whole.certain.reference, judged.model,
                                          judged.certain.reference, {});
  record.Set("model_points", std::int64_t{caused.points});
  if (caused.points == 0) return conclude("rejected: it has no point of the full model");
  const double certified =
      whole.certain.reference.Certified().position + judged.certain.reference.Certified().position;
  Put(record, "model_error", caused.largest, "model_error_at", caused.point, "reference_error",
      certified, "reference_valid_until", caused.until);
  const bool accepted = caused.largest + certified <= question.accept;
  conclude(fmt::format("{} at {} m", accepted ? "accepted" : "rejected", question.accept));
}

/// Returns a record of kind "model" (docs/reference/records.md) per model. All run alike (O-DCA,
/// level projection, joint coordinates, ode45 at 1e-8), without observers and in turn. The error of
/// a model is the largest distance of a named point between its certified motion and the full
/// model's. Acceptance adds both certificates to the error. A model that cannot be judged is
/// rejected with the reason.
std::vector<Record> RecordsOfModels(const MechanismFile& file, const ProblemModels& models,
                                    const ModelQuestion& question) {
  std::vector<std::unique_ptr<JudgedModel>> all;
  all.push_back(Examined(models.models.front(), question.horizon, question));
  // if the full motion is not certified to the end, all models are compared up to its trust horizon
  const double until = all.front()->certain.horizon;
  if (until > 0.0 && until < question.horizon) {
    all.front() = Examined(models.models.front(), until, question);
  }
  for (std::size_t i = 1; i < models.models.size(); ++i) {
    all.push_back(Examined(models.models[i], until, question));
  }
  const MachineState machine = ReadMachineState();
  // the full model again, last: apparent difference of equal models
  Trial again = all.front()->trial;
  for (int i = 0; i < kRepeats; ++i) {
    for (const auto& judged : all) {
      const bool ran = judged->bench != nullptr && judged->trial.outcome == Outcome::kFinished;
      if (ran) judged->bench->Remeasure(&judged->trial);
    }
    if (all.front()->bench != nullptr) all.front()->bench->Remeasure(&again);
  }
  const Trial& whole = all.front()->trial;
  const double spread = AaSpread({whole.wall_s}, {again.wall_s});
  std::vector<Record> records;
  for (const auto& one : all) {
    const JudgedModel& judged = *one;
    Record record = KeysOf(file, judged.model, question);
    WriteRun(judged, record);
    WriteVerdict(file, *all.front(), judged, question, record);
    const bool is_part = judged.model.name.starts_with("islands");
    const Trial& trial = judged.trial;
    const bool both_finished =
        whole.outcome == Outcome::kFinished && trial.outcome == Outcome::kFinished;
    if (judged.bench != nullptr && !is_part && both_finished) {
      Put(record, "model_rhs_ratio",
          static_cast<double>(trial.rhs_evaluations) / static_cast<double>(whole.rhs_evaluations),
          "model_wall_ratio", trial.wall_s / whole.wall_s);
    }
    Put(record, "aa_spread_wall", spread, "load1", machine.load1, "processors", machine.processors,
        "governor", machine.governor, "noise", NoiseReasons(machine, std::nan(""), spread));
    Put(record, "id", RunId(record), "version", CodeVersion());
    Stamp(record);
    records.push_back(std::move(record));
  }
  return records;
}

void PrintIdea(const SimplificationRule& idea, const Simplified& simplified,
               const SimplifyOptions& options, const ExplainView& view) {
  const std::string title = fmt::format("{}: {}{}", idea.name, idea.sentence,
                                        idea.is_exact ? "" : " (changes the motion)");
  Table table{.columns = Columns("what=candidate, number, taken, why=because")};
  for (const Candidate& candidate : simplified.candidates) {
    const char* taken = candidate.taken ? "yes" : "no";
    AddRow({candidate.what,
            std::isnan(candidate.number) ? "" : fmt::format("{:.3g}", candidate.number),
            idea.limit == nullptr ? "" : taken, candidate.why},
           &table);
  }
  if (table.rows.empty()) {
    Print("\n{}\n", title);
  } else {
    PrintSection(title, table, view);
    if (idea.limit != nullptr) {
      Print("  number: {}; taken {} {}\n", idea.number, idea.is_least ? "from" : "up to",
            options.*idea.limit);
    }
  }
  if (!simplified.applies()) Print("  Does not apply: {}.\n", simplified.why_not);
  for (const std::string& lost : simplified.dropped) Print("  Removed: {}.\n", lost);
  if (simplified.applies() && !idea.assumption.empty()) {
    Print("  Assumption: {}.\n", idea.assumption);
  }
}

void PrintModels(const ProblemModels& ladder, const ExplainView& view) {
  Table table{.columns = Columns(
                  "name=model, motion, space, bodies:integer, joints:integer, speeds:integer, "
                  "error=model error [m], worst=at, evaluations:integer, removed")};
  const MechanismDescription& whole = ladder.models.front().description;
  for (const ProblemModel& model : ladder.models) {
    const int speeds =
        model.description.space == SpaceKind::kPlanar
            ? Mechanism<Planar, double>(model.description, Coordinates::kJoint).num_u()
            : Mechanism<Spatial, double>(model.description, Coordinates::kJoint).num_u();
    AddRow(
        {model.name, model.is_exact ? "the same" : "changed", model.description.space,
         model.description.bodies.size() - 1, model.description.joints.size(), speeds, model.error,
         model.worst, model.rhs_evaluations < 0 ? Value() : Value(model.rhs_evaluations),
         fmt::format("{}", fmt::join(RemovedBodies(whole, model.description), ", "))},
        &table);
  }
  PrintSection("Models", table, view);
  Print(
      "  speeds: joint coordinates without loop constraints. removed: bodies of the full model.\n");
  if (ladder.models.front().rhs_evaluations >= 0) {
    Print(
        "  model error: the largest distance of a named point from its place in the full model.\n");
  }
}

/// Returns `part` of the available CPU time.
double PartOfTime(const SimplifyCommand& command, double part) {
  constexpr double kAnyTime = 600.0;
  return command.limits.cpu_s > 0.0 ? part * command.limits.cpu_s : kAnyTime;
}

/// Returns motion data of the full model for the rules that need it.
ShortRun LookAt(const MechanismDescription& whole,
                const std::vector<const SimplificationRule*>& ideas,
                const SimplifyCommand& command) {
  const bool looks = std::ranges::any_of(ideas, [](const SimplificationRule* idea) {
    return idea->name == "constant-parts" || idea->name == "stiff-springs";
  });
  if (!looks || !(command.short_run > 0.0)) return {};
  const ShortRun run = MakeShortRun(whole, command.short_run, PartOfTime(command, 0.5));
  Print("  Trial run: {:.3g} s; the largest rate of motion is {:.3g} rad/s.\n", run.duration,
        run.rate);
  if (!run.message.empty()) Print("  Trial run: {}.\n", run.message);
  return run;
}

/// Stores and prints the error and cost of each model.
void PrintVerdicts(const SimplifyCommand& command, const MechanismFile& file,
                   const ProblemModels& ladder, const ExplainView& view) {
  const std::vector<Record> records = RecordsOfModels(
      file, ladder,
      {.horizon = command.errors,
       .accept = command.accept,
       .cpu_s = PartOfTime(command, 0.3) / static_cast<double>(ladder.models.size()),
       .what = command.mechanism.string() + ": --store"});
  ResultStore store(command.store);
  for (const Record& record : records) store.Append(record);
  Table table = MakeTable(records, {.kind = "models", .compact = true});
  table.title.clear();
  PrintSection("Compared with the certified motion of the full model", table, view);
  Print("  {} in {}\n", WithCount(records.size(), "record"), store.file().string());
}

int SimplifyFile(const SimplifyCommand& command, const ExplainView& view,
                 const std::string& typed) {
  const std::vector<const SimplificationRule*> ideas = Chosen(command.only);
  const SimplifyOptions options = LimitsSaid(command);
  MechanismFile file = ReadMechanism(command.mechanism);
  std::string why;
  MechanismDescription assembled = WithAssembledStart(file.description, &why);
  if (!why.empty()) {
    Reject("{}: its initial assembly fails: {}", command.mechanism.string(), why);
  }
  if (command.assembled) file.description = std::move(assembled);
  Print("{} ({})\n", file.description.name, command.mechanism.string());
  const ShortRun run = LookAt(file.description, ideas, command);
  ProblemModels ladder = MakeModels(file, ideas, run, options);
  std::vector<std::string_view> idle;
  for (const auto& [idea, simplified] : ladder.ideas) {
    if (simplified.why_not == kNothingOfTheKind) {
      idle.push_back(idea->name);
    } else {
      PrintIdea(*idea, simplified, options, view);
    }
  }
  if (!idle.empty()) Print("\nThere is nothing for: {}.\n", fmt::join(idle, ", "));
  const bool any = ladder.models.size() > 1;
  if (!command.store.empty()) {
    PrintVerdicts(command, file, ladder, view);
  } else if (any && command.errors > 0.0) {
    const auto count = static_cast<double>(ladder.models.size());
    MeasureErrors(command.errors, PartOfTime(command, 0.3) / count, &ladder);
  }
  if (any) {
    PrintModels(ladder, view);
  } else {
    Print("\n{} cannot be simplified: no rule applies.\n", file.description.name);
  }
  if (command.out.empty()) return 0;
  if (!any && !command.assembled) {
    Reject("{}: found nothing to simplify, so nothing is written to {}", command.mechanism.string(),
           command.out.string());
  }
  WriteModels(ladder, command.horizon, typed, command.out, command.force);
  Print("\n{}: written. loopbench run {} runs all of them.\n", command.out.string(),
        (command.out / LadderFileName(ladder)).string());
  return 0;
}

int SimplifyInChild(const SimplifyCommand& command, const Typed& typed) {
  return PrintFromChild(command.mechanism.string(), command.limits,
                        [&] { return SimplifyFile(command, {.all = command.all}, typed.line); });
}

}  // namespace

void AddSimplify(Commands& commands) {
  std::string rules = "Rules; only those with a threshold change the motion:\n";
  for (const SimplificationRule& rule : SimplificationRules()) {
    rules += fmt::format("  {:16} {}\n", rule.name, rule.sentence);
    if (rule.limit != nullptr) rules += fmt::format("  {:16} threshold: {}\n", "", rule.number);
  }
  commands.Add("simplify", "Generate simpler models of a mechanism and measure their errors",
               SimplifyInChild, rules + "\n");
}

}  // namespace loopbench::harness
