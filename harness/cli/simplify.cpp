// simplify: models of one problem, from the full one to the simplest.
#include "harness/cli/commands.h"
#include "harness/run/run.h"
#include "mechanism/model/mechanism.h"
#include "mechanism/simplify/restart.h"

namespace loopbench::harness {
namespace {

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
