// list and check: files before a run.
#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "harness/analysis/model_warnings.h"
#include "harness/cli/command_line.h"
#include "harness/cli/commands.h"
#include "harness/config/benchmarks.h"
#include "harness/config/mechanism_reader.h"
#include "harness/config/options.h"
#include "harness/json/file_kind.h"
#include "harness/judge/claims.h"
#include "harness/judge/robustness_map.h"
#include "harness/record/measures.h"
#include "harness/record/record.h"
#include "harness/run/run_case.h"
#include "harness/suite/estimate.h"
#include "harness/suite/reference_cases.h"
#include "harness/suite/workload.h"
#include "harness/tables/fit.h"
#include "harness/text/files.h"
#include "harness/text/terminal.h"
#include "harness/timing/time_cases.h"

namespace loopbench::harness {
namespace {

struct CheckCommand {
  ExperimentFiles files;
  bool no_assembly = false;  ///< do not assemble the starts of mechanisms and problems
  ProcessLimits limits = kFileLimits;
  bool json = false;
};

/// Returns the cases that match, each with "runs".
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

/// Runs that are no cases. In a long sweep, each combination counts as many as the shown ones.
struct OtherRuns {
  OtherRuns(const Overview& overview, const Selection& filter) {
    for (const Experiment& experiment : overview.experiments) {
      timings += CountTimings(experiment, filter);
      rungs += CountRungs(experiment);
    }
    timings = timings * overview.combinations / overview.experiments.size();
    rungs = rungs * overview.combinations / overview.experiments.size();
  }
  std::size_t timings = 0, rungs = 0;
};

/// Prints all cases, one per line and group by group: a long sweep is never completely in memory.
void PrintCaseDocument(const Overview& overview, const ExperimentFiles& files) {
  const OtherRuns others(overview, files.filter);
  std::string head = JsonObject()
                         .Add("file", files.paths.front().string())
                         .Add("name", overview.experiments.front().name)
                         .Add("comment", overview.experiments.front().comment)
                         .Add("combinations", Count(overview.combinations))
                         .Add("timings", Count(others.timings))
                         .Add("precision_runs", Count(others.rungs))
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

/// Number of combinations of a long sweep in a table.
constexpr std::size_t kShown = 16;

Table CaseTable(const Overview& overview, const Selection& filter) {
  const std::size_t step =
      overview.is_sample ? std::max<std::size_t>(1, overview.experiments.size() / kShown) : 1;
  std::vector<Experiment> experiments;
  for (std::size_t i = 0; i < overview.experiments.size(); i += step) {
    experiments.push_back(overview.experiments[i]);
  }
  Table table;
  table.title = experiments.front().name;
  if (!experiments.front().comment.empty()) table.title += ": " + experiments.front().comment;
  for (const char* key : {"mechanism", "formulation", "enforcement", "coordinates", "solver"}) {
    table.columns.push_back({key, key});
  }
  for (const auto& [name, value] : experiments.front().parameters.items()) {
    Format format = Format::kText;
    if (std::holds_alternative<double>(value)) format = Format::kShortest;
    if (std::holds_alternative<std::int64_t>(value)) format = Format::kInteger;
    table.columns.push_back({name, name, format, {}});
  }
  const bool has_threads = std::ranges::any_of(experiments, [](const Experiment& experiment) {
    return std::ranges::any_of(experiment.methods,
                               [](const Method& method) { return method.threads > 1; });
  });
  if (has_threads) table.columns.push_back({"threads", "threads", Format::kInteger});
  const bool has_executions = std::ranges::any_of(experiments, [](const Experiment& experiment) {
    return std::ranges::any_of(experiment.methods, [](const Method& method) {
      return method.execution != Execution::kLibrary;
    });
  });
  if (has_executions) table.columns.push_back({"execution", "execution"});
  const auto any = [&experiments](auto has) { return std::ranges::any_of(experiments, has); };
  const bool has_integrators =
      any([](const Experiment& experiment) { return experiment.integrators.size() > 1; });
  const bool has_steps =
      any([](const Experiment& experiment) { return !experiment.fixed_steps.empty(); });
  if (has_integrators) table.columns.push_back({"integrator", "integrator"});
  table.columns.push_back({"rtol", "rtol", Format::kShortest});
  if (has_steps) table.columns.push_back({"step", "step [s]", Format::kShortest});
  table.columns.push_back({"horizon", "horizon [s]", Format::kShortest});
  table.columns.push_back({"runs", "runs", Format::kInteger});
  table.rows = CaseRows(experiments, filter);
  const OtherRuns others(overview, filter);
  table.notes = {fmt::format("{} cases and {} timings", overview.cases(), others.timings)};
  if (others.rungs > 0) {
    table.notes.front() += fmt::format(", {} runs in several scalars", others.rungs);
  }
  if (overview.combinations > 1) {
    table.notes.front() += fmt::format(" in {} combinations", overview.combinations);
  }
  if (overview.is_sample) {
    table.notes.push_back(fmt::format(
        "Shown are the cases of {} combinations spread over all; --filter chooses others, --json "
        "lists every case",
        experiments.size()));
  }
  return table;
}

/// Result of check for a valid file: a sentence for people, and JSON for programs.
struct Checked {
  std::string sentence;
  JsonObject document;
  std::vector<std::string> warnings = {};
};

void AddWarning(const std::filesystem::path& path, const std::string& text, Checked* checked) {
  PrintError("warning: {}: {}\n", path.string(), text);
  checked->warnings.push_back(text);
}

/// Adds warnings on suspicious but valid numbers.
void AddUnitWarnings(const std::filesystem::path& path, const MechanismDescription& description,
                     Checked* checked) {
  for (const Warning& warning : FindUnitWarnings(description)) {
    AddWarning(path, fmt::format("{}: {}", description.name, warning.text), checked);
  }
}

/// Adds the warnings. Throws ConfigError with all faults of starts, each with the file and the
/// remedy.
void AddStarts(const std::filesystem::path& path, const StartReport& report, Checked* checked) {
  for (const std::string& warning : report.warnings) AddWarning(path, warning, checked);
  std::string text;
  for (const std::string& fault : report.faults) {
    text += fmt::format("{}{}: {}", text.empty() ? "" : "\n", path.string(), fault);
  }
  if (!text.empty()) throw ConfigError(text + "\n(--no-assembly leaves this check out)");
}

Checked CheckExperiment(const std::filesystem::path& path, const CheckCommand& command) {
  const Overview overview = MakeOverview(path, {{path}, command.files.settings, {}});
  const std::vector<Experiment>& experiments = overview.experiments;
  Checked checked;
  for (const ExperimentProblem& problem : experiments.front().problems) {
    AddUnitWarnings(path, problem.mechanism.description, &checked);
  }
  for (const Experiment& experiment : experiments) CheckLadders(experiment);
  if (!command.no_assembly) {
    AddStarts(path, CheckStarts(experiments), &checked);
    RequireFreedom(experiments);
  }
  const std::string& name = experiments.front().name;
  checked.sentence = fmt::format("experiment \"{}\", {} cases", name, overview.cases());
  if (overview.combinations > 1) {
    checked.sentence += fmt::format(" in {} combinations", overview.combinations);
  }
  if (overview.is_sample) {
    checked.sentence += fmt::format(
        "; each value of each axis was read, and the starts of {} combinations assembled",
        command.no_assembly ? 0 : experiments.size());
  }
  checked.document.Add("kind", std::string("experiment"))
      .Add("name", name)
      .Add("cases", Count(overview.cases()))
      .Add("combinations", Count(overview.combinations));
  return checked;
}

Checked CheckMechanism(const std::filesystem::path& path, const CheckCommand& command) {
  if (!command.files.settings.empty()) {
    throw ConfigError(fmt::format("{}: --set is for experiments, and this is none", path.string()));
  }
  const MechanismFile file = ReadMechanism(path);
  Checked checked;
  AddUnitWarnings(path, file.description, &checked);
  if (!command.no_assembly) {
    StartReport report = CheckStart(file.description, command.limits);
    for (std::string& warning : report.warnings) warning = file.description.name + ": " + warning;
    AddStarts(path, report, &checked);
    RequireFreedom(file, command.limits);
  }
  const auto& [name, bodies, joints] =
      std::tie(file.description.name, file.description.bodies, file.description.joints);
  checked.sentence =
      fmt::format("mechanism \"{}\", {} bodies, {} joints", name, bodies.size() - 1, joints.size());
  checked.document.Add("kind", std::string("mechanism"))
      .Add("name", name)
      .Add("bodies", Count(bodies.size() - 1))
      .Add("joints", Count(joints.size()));
  return checked;
}

/// Checks a file. Throws ConfigError with all mistakes.
Checked CheckFile(const std::filesystem::path& path, const CheckCommand& command) {
  Checked checked;
  const auto of = [&checked](const char* kind, std::string sentence) -> JsonObject& {
    checked.sentence = std::move(sentence);
    return checked.document.Add("kind", std::string(kind));
  };
  switch (KindOfFile(path)) {
    case FileKind::kExperiment:
      return CheckExperiment(path, command);
    case FileKind::kMechanism:
      return CheckMechanism(path, command);
    case FileKind::kClaims: {
      const std::size_t claims = ReadClaims(path).size();
      of("claims", fmt::format("{} claims", claims)).Add("claims", Count(claims));
      break;
    }
    case FileKind::kMap: {
      const MapRules map = ReadMapRules(path);
      std::size_t rows = 0;
      for (const MapGroup& group : map.groups) rows += group.rows.size();
      of("map", fmt::format("robustness map of {} rows and {} methods", rows, map.columns.size()))
          .Add("rows", Count(rows))
          .Add("methods", Count(map.columns.size()));
      break;
    }
    case FileKind::kBenchmarks: {
      const std::size_t groups = ReadBenchmarks(path).groups.size();
      of("benchmarks", fmt::format("{} groups of benchmarks", groups)).Add("groups", Count(groups));
      break;
    }
    case FileKind::kSeries: {
      const PublishedSeries series = ReadPublishedSeries(path);
      of("series", fmt::format("published series \"{}\", {} quantities at {} times", series.name,
                               series.quantities.size(), series.times.size()))
          .Add("quantities", Count(series.quantities.size()))
          .Add("times", Count(series.times.size()));
    }
  }
  return checked;
}

int List(const ExperimentFiles& files, bool json) {
  if (json) PrintText("{\"experiments\":[");
  bool is_first = true;
  for (const auto& path : files.paths) {
    const ExperimentFiles one = {{path}, files.settings, files.filter, files.threads};
    const Overview overview = MakeOverview(path, one);
    for (const Experiment& experiment : overview.experiments) CheckLadders(experiment);
    if (json) {
      PrintText(is_first ? "" : ",\n");
      PrintCaseDocument(overview, one);
    } else {
      PrintText(ToScreen(CaseTable(overview, files.filter)) + "\n");
    }
    is_first = false;
  }
  if (json) PrintText("]}\n");
  return 0;
}

int ListIntegrators(bool json) {
  Table table;
  table.columns = {{"integrator", "integrator"},
                   {"order", "order", Format::kInteger},
                   {"embedded_order", "embedded", Format::kInteger},
                   {"stages", "stages", Format::kInteger},
                   {"kind", "kind"},
                   {"table", "table of ARKODE"}};
  for (const Profile& profile : Profiles()) {
    const ButcherTable& pair = profile.table;
    const std::string other = pair.name == profile.name ? "" : pair.name;
    AddRow({profile.name, pair.order,
            profile.has_embedding() ? Value(std::int64_t{pair.embedded_order}) : Value(),
            pair.stages(), profile.is_implicit ? "implicit" : "explicit", other},
           &table);
  }
  if (!json) PrintText(ToScreen(table));
  std::vector<JsonObject> rows(table.rows.begin(), table.rows.end());
  if (json) PrintText(JsonObject().Add("integrators", rows).Text() + "\n");
  return 0;
}

int CheckFiles(const CheckCommand& command) {
  std::vector<JsonObject> documents;
  int exit_code = 0;
  for (const auto& path : command.files.paths) {
    JsonObject document;
    document.Add("file", path.string());
    try {
      const Checked checked = CheckFile(path, command);
      if (!command.json) Print("{}: {}\n", path.string(), checked.sentence);
      document.Add("ok", true).Add("found", checked.document).Add("warnings", checked.warnings);
    } catch (const ConfigError& error) {
      PrintError("{}\n", Lines{WithMigrationHint(error.what())});
      document.Add("ok", false).Add("error", std::string(error.what()));
      exit_code = 2;
    }
    documents.push_back(std::move(document));
  }
  if (command.json) {
    PrintText(JsonObject().Add("ok", exit_code == 0).Add("files", documents).Text() + "\n");
  }
  return exit_code;
}

}  // namespace

void AddList(Commands& commands) {
  auto& files = commands.Keep<ExperimentFiles>();
  auto& json = commands.Keep<bool>();
  commands.Add("list", "Show the cases of experiments",
               [&](const Typed&) { return List(files, json); },
               {{"experiment", "Experiment files (JSON)", &files.paths, kRequired},
                FilterOption(&files.filter),
                SetOption(&files.settings),
                WideOption(),
                JsonOption(&json)});
}

void AddIntegrators(Commands& commands) {
  auto& json = commands.Keep<bool>();
  commands.Add("integrators", "List the integrators with their orders and stages",
               [&](const Typed&) { return ListIntegrators(json); },
               {WideOption(), JsonOption(&json)});
}

void AddCheck(Commands& commands) {
  auto& command = commands.Keep<CheckCommand>();
  commands.Add("check", "Validate files and solve for consistent initial conditions",
               [&](const Typed&) { return CheckFiles(command); },
               {{"file", "Files (JSON)", &command.files.paths, kRequired},
                {"--no-assembly", "Read files without assembling mechanisms", &command.no_assembly},
                CpuOption(&command.limits),
                MemoryOption(&command.limits),
                JsonOption(&command.json),
                SetOption(&command.files.settings)});
}

}  // namespace loopbench::harness
