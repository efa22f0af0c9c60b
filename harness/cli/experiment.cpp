// list, check and assemble: files before a run.
#include "harness/base/file_kind.h"
#include "harness/cli/commands.h"
#include "harness/judge/analysis.h"
#include "harness/run/run.h"
#include "mechanism/start/branches.h"

namespace loopbench::harness {
namespace {

struct ListCommand {
  ExperimentFiles files;
  bool json = false;

  std::vector<Option> Options() {
    return {{"experiment", "Experiment files (JSON)", &files.paths, kRequired},
            FilterOption(&files.filter),
            SetOption(&files.settings),
            WideOption(),
            JsonOption(&json)};
  }
};

struct IntegratorsCommand {
  bool json = false;

  std::vector<Option> Options() { return {WideOption(), JsonOption(&json)}; }
};

struct CheckCommand {
  ExperimentFiles files;
  bool no_assembly = false, json = false;
  ProcessLimits limits = kFileLimits;

  std::vector<Option> Options() {
    return {{"file", "Files (JSON)", &files.paths, kRequired},
            {"--no-assembly", "Read files without assembling mechanisms", &no_assembly},
            CpuOption(&limits),
            MemoryOption(&limits),
            JsonOption(&json),
            SetOption(&files.settings)};
  }
};

std::vector<Record> CaseRows(const std::vector<Experiment>& experiments, const Selection& filter) {
  std::vector<Record> rows;
  for (const Experiment& experiment : experiments) {
    for (const Case& one : SelectCases(experiment, filter)) {
      Record& row = rows.emplace_back(one.keys);
      // an ensemble is additional to the unperturbed run
      row.Set("runs", std::int64_t{one.ensemble > 1 ? one.ensemble + 1 : 1});
    }
  }
  return rows;
}

/// Prints all cases, one per line and group by group: a long sweep is never completely in memory.
void PrintCaseDocument(const Overview& overview, const ExperimentFiles& files,
                       const OtherRuns& others) {
  std::string head =
      JsonOf("file", files.paths.front().string(), "name", overview.experiments.front().name,
             "comment", overview.experiments.front().comment, "combinations", overview.combinations,
             "timings", others.timings, "precision_runs", others.rungs)
          .Text();
  head.pop_back();
  PrintText(head + ",\"cases\":[");
  Workload workload(files);
  bool is_first = true;
  for (std::size_t group = 0; group < workload.groups(); ++group) {
    std::string text;
    for (const Record& row : CaseRows(workload.Read(group).experiments, files.filter)) {
      text += (is_first ? "" : ",") + JsonObject(row).Text();
      is_first = false;
    }
    PrintText(text);
  }
  PrintText("]}");
}

Table CaseTable(const Overview& overview, const Selection& filter, const OtherRuns& others) {
  constexpr std::size_t kShown = 16;  // combinations of a long sweep
  const std::size_t step =
      overview.is_sample ? std::max<std::size_t>(1, overview.experiments.size() / kShown) : 1;
  std::vector<Experiment> experiments;
  for (std::size_t i = 0; i < overview.experiments.size(); i += step) {
    experiments.push_back(overview.experiments[i]);
  }
  Table table{.title = experiments.front().name,
              .columns = Columns("mechanism, formulation, enforcement, coordinates, solver")};
  if (!experiments.front().comment.empty()) table.title += ": " + experiments.front().comment;
  for (const auto& [name, value] : experiments.front().parameters.items()) {
    Format format = Format::kText;
    if (std::holds_alternative<double>(value)) format = Format::kShortest;
    if (std::holds_alternative<std::int64_t>(value)) format = Format::kInteger;
    table.columns.push_back({name, name, format, {}});
  }
  std::set<std::string> unused = {"threads", "execution", "integrator", "step"};
  for (const Experiment& one : experiments) {
    for (const Method& method : one.methods) {
      if (method.threads > 1) unused.erase("threads");
      if (method.execution != Execution::kLibrary) unused.erase("execution");
    }
    if (one.integrators.size() > 1) unused.erase("integrator");
    if (!one.fixed_steps.empty()) unused.erase("step");
  }
  for (TableColumn& column :
       Columns("threads:integer, execution, integrator, rtol:shortest, step=step [s]:shortest, "
               "horizon=horizon [s]:shortest, runs:integer")) {
    if (!unused.contains(column.key)) table.columns.push_back(std::move(column));
  }
  table.rows = CaseRows(experiments, filter);
  table.notes = {WithCount(overview.cases(), "case") + " and " +
                 WithCount(others.timings, "timing")};
  if (others.rungs > 0) {
    table.notes.front() += fmt::format(", {} in several scalars", WithCount(others.rungs, "run"));
  }
  if (overview.combinations > 1) {
    table.notes.front() += " in " + WithCount(overview.combinations, "combination");
  }
  if (overview.is_sample) {
    AddNote(table.notes,
            "Shown are the cases of {} combinations spread over all; --filter chooses others, "
            "--json lists every case",
            experiments.size());
  }
  return table;
}

/// Result of check for a valid file: a sentence for people, and JSON for programs.
struct Checked {
  std::filesystem::path path;
  std::string sentence = "";
  JsonObject document = {};
  std::vector<std::string> warnings = {};

  template <class... Members>
  void Set(const std::string& words, const Members&... members) {
    sentence = words;
    Put(document, "kind", members...);
  }
  void Warn(const std::string& text) {
    PrintError("warning: {}: {}\n", path.string(), text);
    warnings.push_back(text);
  }
  void AddUnitWarnings(const MechanismDescription& description) {
    for (const std::string& warning : FindUnitWarnings(description)) {
      Warn(description.name + ": " + warning);
    }
  }
  /// Throws ConfigError with all faults of starts.
  void AddStarts(const StartReport& report) {
    for (const std::string& warning : report.warnings) Warn(warning);
    if (report.faults.empty()) return;
    const auto named = [&](const std::string& fault) { return path.string() + ": " + fault; };
    Reject("{}\n(--no-assembly leaves this check out)", Joined(report.faults, "\n", named));
  }
};

void CheckExperiment(const CheckCommand& command, Checked& checked) {
  const Overview overview =
      MakeOverview(checked.path, {{checked.path}, command.files.settings, {}});
  const std::vector<Experiment>& experiments = overview.experiments;
  for (const ExperimentProblem& problem : experiments.front().problems) {
    checked.AddUnitWarnings(problem.mechanism.description);
  }
  for (const Experiment& experiment : experiments) CheckLadders(experiment);
  if (!command.no_assembly) {
    checked.AddStarts(CheckStarts(experiments));
    RequireFreedom(experiments);
  }
  const std::string& name = experiments.front().name;
  checked.Set(fmt::format("experiment \"{}\", {}", name, WithCount(overview.cases(), "case")),
              "experiment", "name", name, "cases", overview.cases(), "combinations",
              overview.combinations);
  if (overview.combinations > 1) {
    checked.sentence += " in " + WithCount(overview.combinations, "combination");
  }
  if (overview.is_sample) {
    checked.sentence += fmt::format(
        "; each value of each axis was read, and the starts of {} combinations assembled",
        command.no_assembly ? 0 : experiments.size());
  }
}

void CheckMechanism(const CheckCommand& command, Checked& checked) {
  if (!command.files.settings.empty()) {
    Reject("{}: --set is for experiments, and this is none", checked.path.string());
  }
  const MechanismFile file = ReadMechanism(checked.path);
  const MechanismDescription& description = file.description;
  checked.AddUnitWarnings(description);
  if (!command.no_assembly) {
    StartReport report = CheckStart(description, command.limits);
    for (std::string& warning : report.warnings) warning = description.name + ": " + warning;
    checked.AddStarts(report);
    RequireFreedom(file, command.limits);
  }
  const std::size_t bodies = description.bodies.size() - 1, joints = description.joints.size();
  checked.Set(fmt::format("mechanism \"{}\", {}, {}", description.name, WithCount(bodies, "body"),
                          WithCount(joints, "joint")),
              "mechanism", "name", description.name, "bodies", bodies, "joints", joints);
}

/// Throws ConfigError with all mistakes of a file.
Checked CheckFile(const std::filesystem::path& path, const CheckCommand& command) {
  Checked checked{path};
  switch (KindOfFile(path)) {
    case FileKind::kExperiment:
      CheckExperiment(command, checked);
      break;
    case FileKind::kMechanism:
      CheckMechanism(command, checked);
      break;
    case FileKind::kClaims: {
      const std::size_t claims = ReadClaims(path).size();
      checked.Set(WithCount(claims, "claim"), "claims", "claims", claims);
      break;
    }
    case FileKind::kMap: {
      const MapRules map = ReadMapRules(path);
      std::size_t rows = 0;
      for (const MapGroup& group : map.groups) rows += group.rows.size();
      checked.Set(fmt::format("robustness map of {} and {}", WithCount(rows, "row"),
                              WithCount(map.columns.size(), "method")),
                  "map", "rows", rows, "methods", map.columns.size());
      break;
    }
    case FileKind::kBenchmarks: {
      const std::size_t groups = ReadBenchmarks(path).groups.size();
      checked.Set(WithCount(groups, "group") + " of benchmarks", "benchmarks", "groups", groups);
      break;
    }
    case FileKind::kSeries: {
      const PublishedSeries series = ReadPublishedSeries(path);
      checked.Set(fmt::format("published series \"{}\", {} quantities at {} times", series.name,
                              series.quantities.size(), series.times.size()),
                  "series", "quantities", series.quantities.size(), "times", series.times.size());
    }
  }
  return checked;
}

int List(const ListCommand& command, const Typed&) {
  const auto& [files, json] = command;
  if (json) PrintText("{\"experiments\":[");
  bool is_first = true;
  for (const auto& path : files.paths) {
    const ExperimentFiles one = {{path}, files.settings, files.filter, files.threads};
    const Overview overview = MakeOverview(path, one);
    const OtherRuns others(overview, files.filter);
    if (json) {
      PrintText(is_first ? "" : ",\n");
      PrintCaseDocument(overview, one, others);
    } else {
      PrintText(ToScreen(CaseTable(overview, files.filter, others)) + "\n");
    }
    is_first = false;
  }
  if (json) PrintText("]}\n");
  return 0;
}

int ListIntegrators(const IntegratorsCommand& command, const Typed&) {
  Table table{.columns = Columns("integrator, order:integer, embedded_order=embedded:integer, "
                                 "stages:integer, kind, table=table of ARKODE")};
  for (const Profile& profile : Profiles()) {
    const ButcherTable& pair = profile.table;
    const std::string other = pair.name == profile.name ? "" : pair.name;
    AddRow({profile.name, pair.order,
            profile.has_embedding() ? Value(std::int64_t{pair.embedded_order}) : Value(),
            pair.stages(), profile.is_implicit ? "implicit" : "explicit", other},
           &table);
  }
  if (command.json) return PrintJson(JsonOf("integrators", ObjectsOf(table.rows)));
  PrintText(ToScreen(table));
  return 0;
}

int CheckFiles(const CheckCommand& command, const Typed&) {
  std::vector<JsonObject> documents;
  int exit_code = 0;
  for (const auto& path : command.files.paths) {
    JsonObject document = JsonOf("file", path);
    try {
      const Checked checked = CheckFile(path, command);
      if (!command.json) Print("{}: {}\n", path.string(), checked.sentence);
      Put(document, "ok", true, "found", checked.document, "warnings", checked.warnings);
    } catch (const ConfigError& error) {
      PrintError("{}\n", Lines{WithMigrationHint(error.what())});
      Put(document, "ok", false, "error", error.what());
      exit_code = 2;
    }
    documents.push_back(std::move(document));
  }
  if (command.json) PrintJson(JsonOf("ok", exit_code == 0, "files", documents));
  return exit_code;
}

struct AssembleCommand {
  std::filesystem::path mechanism, out;
  int starts = 200;
  bool all = false;
  ProcessLimits limits = kFileLimits;

  std::vector<Option> Options() {
    return {MechanismArgument(&mechanism),
            {"-o,--out", "Folder for a mechanism file per branch", &out},
            {"--starts", "Scattered starts", &starts, From(1, 1e6)},
            WideOption(),
            CpuOption(&limits),
            MemoryOption(&limits),
            {"--all", "Print all rows of long tables", &all}};
  }
};

/// Prints the coordinates of the joints in the tree, a row per branch.
void PrintBranches(const MechanismDescription& description, const Branches& branches,
                   const ExplainView& view) {
  Table table{.columns = Columns("branch:integer, times=starts:integer, distance:shortest")};
  for (std::size_t k = 0; k < branches.found.size(); ++k) {
    const Branch& branch = branches.found[k];
    Record& row = AddRow({k + 1, branch.times, branch.distance}, &table);
    for (const JointValues& values : branch.description.initial.coordinates) {
      const JointDescription& joint = description.joints[values.joint];
      const std::vector<ValueWord> words = ValueWords(joint.type, description.space, false);
      for (std::size_t i = 0; i < values.values.size() && i < words.size(); ++i) {
        const std::string key = fmt::format("{}.{} [{}]", joint.name, words[i].name, words[i].unit);
        if (k == 0) table.columns.push_back({key, key, Format::kShortest});
        row.Set(key, values.values[i]);
      }
    }
  }
  PrintSection("Branches", table, view, "branches");
}

int AssembleFile(const AssembleCommand& command, const ExplainView& view) {
  const MechanismFile file = ReadMechanism(command.mechanism);
  Branches branches;
  try {
    branches = FindBranches(file.description, command.starts);
  } catch (const std::invalid_argument& error) {
    Reject("{}: {}", command.mechanism.string(), error.what());
  }
  if (branches.freedom > 0) {
    Reject(
        "{}: found {} free motions, expected none: list as many coordinates under \"fixed\", so "
        "that positions are isolated",
        command.mechanism.string(), branches.freedom);
  }
  Print("{} ({})\n", file.description.name, command.mechanism.string());
  PrintBranches(file.description, branches, view);
  Print(
      "  {} of {} scattered starts closed. Branch 1 is the start of the file; distance: largest\n"
      "  difference of a body's pose from it [rad, or mean links].\n",
      branches.closed, branches.starts);
  if (branches.movable > 0) {
    Print("  {} of them led to positions that still move, which are not listed.\n",
          branches.movable);
  }
  for (std::size_t k = 0; k < branches.found.size() && !command.out.empty(); ++k) {
    MechanismDescription description = branches.found[k].description;
    description.name = fmt::format("{}-branch-{}", file.description.name, k + 1);
    ObservedQuantities known;
    known.expected = file.observe.expected;
    WriteFileAtomically(command.out / (FileName(description.name) + ".json"),
                        MechanismText(description, known));
  }
  if (!command.out.empty()) {
    Print("\nwrote {} to {}; loopbench view shows them\n", WithCount(branches.found.size(), "file"),
          command.out.string());
  }
  return 0;
}

int AssembleInChild(const AssembleCommand& command, const Typed&) {
  return PrintFromChild(command.mechanism.string(), command.limits,
                        [&] { return AssembleFile(command, {.all = command.all}); });
}

}  // namespace

OtherRuns::OtherRuns(const Overview& overview, const Selection& filter) {
  for (const Experiment& experiment : overview.experiments) {
    CheckLadders(experiment);
    timings += CountTimings(experiment, filter);
    rungs += CountRungs(experiment);
  }
  timings = timings * overview.combinations / overview.experiments.size();
  rungs = rungs * overview.combinations / overview.experiments.size();
}

void AddExperiments(Commands& commands) {
  commands.Add("list", "Show the cases of experiments", List);
  commands.Add("integrators", "List the integrators with their orders and stages", ListIntegrators);
  commands.Add("assemble", "Find all positions that close a mechanism's loops", AssembleInChild);
  commands.Add("check", "Validate files and solve for consistent initial conditions", CheckFiles);
}

}  // namespace loopbench::harness
