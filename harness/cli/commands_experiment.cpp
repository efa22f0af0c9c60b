// list, check: what experiment and mechanism files hold.
#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "harness/analysis/model_warnings.h"
#include "harness/cli/commands.h"
#include "harness/config/benchmark_reader.h"
#include "harness/config/mechanism_reader.h"
#include "harness/json/file_kind.h"
#include "harness/judge/claims_reader.h"
#include "harness/judge/failure_map_reader.h"
#include "harness/record/json_object.h"
#include "harness/record/measures.h"
#include "harness/run/run_case.h"
#include "harness/suite/precision_cases.h"
#include "harness/suite/start_check.h"
#include "harness/tables/fit.h"
#include "harness/text/config_error.h"
#include "harness/text/terminal.h"
#include "harness/timing/time_cases.h"

namespace loopbench::harness {

namespace {

/// A condition on a key that no case has would silently match nothing.
void RequireKeys(const std::vector<Experiment>& experiments, const Selection& filter) {
  if (filter.empty()) return;
  std::vector<std::string> known;
  for (const Experiment& experiment : experiments) {
    for (const Case& one : Expand(experiment)) {
      for (const auto& [key, value] : one.keys.items()) {
        if (std::ranges::find(known, key) == known.end()) known.push_back(key);
      }
    }
  }
  for (const Condition& condition : filter) {
    if (std::ranges::find(known, condition.key) != known.end()) continue;
    const bool is_measured = FindMeasure(condition.key) != nullptr;
    throw ConfigError(fmt::format(
        "--filter {}: no such key{}; cases have {}", condition.key,
        is_measured ? " before a run, which measures it (table, plot and tradeoff choose by it: "
                      "--where)"
                    : "",
        fmt::join(known, ", ")));
  }
}

bool Passes(const Experiment& experiment, const Selection& filter) {
  return std::ranges::any_of(Expand(experiment),
                             [&](const Case& one) { return Matches(one.keys, filter); });
}

/// The cases that pass, each with "runs".
std::vector<Record> CaseRows(const std::vector<Experiment>& experiments, const Selection& filter) {
  std::vector<Record> rows;
  for (const Experiment& experiment : experiments) {
    for (const Case& one : SelectCases(experiment, filter)) {
      Record& row = rows.emplace_back(one.keys);
      // an ensemble comes on top of the unperturbed run
      row.Set("runs", std::int64_t{one.ensemble > 1 ? one.ensemble + 1 : 1});
    }
  }
  return rows;
}

/// Runs that are no cases.
struct OtherRuns {
  explicit OtherRuns(const std::vector<Experiment>& experiments) {
    for (const Experiment& experiment : experiments) {
      timings += CountTimings(experiment);
      rungs += CountRungs(experiment);
    }
  }
  std::size_t timings = 0, rungs = 0;
};

JsonObject CaseDocument(const std::filesystem::path& path,
                        const std::vector<Experiment>& experiments, const Selection& filter) {
  const OtherRuns others(experiments);
  std::vector<JsonObject> cases;
  for (const Record& row : CaseRows(experiments, filter)) cases.emplace_back(row);
  return JsonObject()
      .Add("file", path.string())
      .Add("name", experiments.front().name)
      .Add("comment", experiments.front().comment)
      .Add("combinations", Count(experiments.size()))
      .Add("timings", Count(others.timings))
      .Add("runs_in_several_scalars", Count(others.rungs))
      .Add("cases", cases);
}

Table CaseTable(const std::vector<Experiment>& experiments, const Selection& filter) {
  Table table;
  table.title = experiments.front().name;
  if (!experiments.front().comment.empty()) table.title += ": " + experiments.front().comment;
  for (const char* key : {"mechanism", "formulation", "enforcement", "coordinates", "solver"}) {
    table.columns.push_back({key, key, Format::kText, {}});
  }
  for (const auto& [name, value] : experiments.front().parameters.items()) {
    Format format = Format::kText;
    if (std::holds_alternative<double>(value)) format = Format::kShortest;
    if (std::holds_alternative<std::int64_t>(value)) format = Format::kInteger;
    table.columns.push_back({name, name, format, {}});
  }
  const bool has_threads = std::ranges::any_of(experiments, [](const Experiment& experiment) {
    return std::ranges::any_of(experiment.columns,
                               [](const Column& column) { return column.threads > 1; });
  });
  if (has_threads) table.columns.push_back({"threads", "threads", Format::kInteger, {}});
  const auto any = [&experiments](auto has) { return std::ranges::any_of(experiments, has); };
  const bool has_integrators =
      any([](const Experiment& experiment) { return experiment.integrators.size() > 1; });
  const bool has_steps =
      any([](const Experiment& experiment) { return !experiment.fixed_steps.empty(); });
  if (has_integrators) table.columns.push_back({"integrator", "integrator", Format::kText, {}});
  table.columns.push_back({"rtol", "rtol", Format::kShortest, {}});
  if (has_steps) table.columns.push_back({"step", "step [s]", Format::kShortest, {}});
  table.columns.push_back({"horizon", "horizon [s]", Format::kShortest, {}});
  table.columns.push_back({"runs", "runs", Format::kInteger, {}});
  table.rows = CaseRows(experiments, filter);
  const OtherRuns others(experiments);
  table.notes = {fmt::format("{} cases and {} timings", table.rows.size(), others.timings)};
  if (others.rungs > 0) {
    table.notes.front() += fmt::format(", {} runs in several scalars", others.rungs);
  }
  if (experiments.size() > 1) {
    table.notes.front() += fmt::format(" in {} combinations", experiments.size());
  }
  return table;
}

/// What check says of a file that is sound: a sentence for people, and the same for programs.
struct Checked {
  std::string sentence;
  JsonObject document;
  std::vector<std::string> warnings = {};
};

/// What looks wrong about sound numbers; no reason to refuse them.
void AddUnitWarnings(const std::filesystem::path& path, const MechanismDescription& description,
                     Checked* checked) {
  for (const Warning& warning : FindUnitWarnings(description)) {
    PrintError("warning: {}: {}: {}\n", path.string(), description.name, warning.text);
    checked->warnings.push_back(fmt::format("{}: {}", description.name, warning.text));
  }
}

/// Throws ConfigError with all faults of starts, each with the file and the way around.
void RefuseFaults(const std::filesystem::path& path, const std::vector<std::string>& faults) {
  std::string text;
  for (const std::string& fault : faults) {
    if (fault.empty()) continue;
    text += fmt::format("{}{}: {}", text.empty() ? "" : "\n", path.string(), fault);
  }
  if (!text.empty()) throw ConfigError(text + "\n(--no-assembly leaves this check out)");
}

Checked CheckExperiment(const std::filesystem::path& path, const CheckCommand& command) {
  const std::vector<Experiment> experiments = ReadExperiments(path, command.files.settings);
  Checked checked;
  for (const ExperimentScene& scene : experiments.front().scenes) {
    AddUnitWarnings(path, scene.mechanism.description, &checked);
  }
  std::size_t cases = 0;
  for (const Experiment& experiment : experiments) {
    cases += Expand(experiment).size();
    CheckLadders(experiment);
  }
  if (command.assembly) RefuseFaults(path, StartFaults(experiments));
  const std::string& name = experiments.front().name;
  checked.sentence = fmt::format(
      "experiment \"{}\", {} cases{}", name, cases,
      experiments.size() > 1 ? fmt::format(" in {} combinations", experiments.size()) : "");
  checked.document.Add("kind", std::string("experiment"))
      .Add("name", name)
      .Add("cases", Count(cases))
      .Add("combinations", Count(experiments.size()));
  return checked;
}

Checked CheckMechanism(const std::filesystem::path& path, const CheckCommand& command) {
  if (!command.files.settings.empty()) {
    throw ConfigError(fmt::format("{}: --set is for experiments, and this is none", path.string()));
  }
  const MechanismFile file = ReadMechanism(path);
  Checked checked;
  AddUnitWarnings(path, file.description, &checked);
  if (command.assembly) RefuseFaults(path, {StartFault(file.description, command.limits)});
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

/// Throws ConfigError with all mistakes.
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
      of("map", fmt::format("failure map of {} rows and {} columns", rows, map.columns.size()))
          .Add("rows", Count(rows))
          .Add("columns", Count(map.columns.size()));
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

}  // namespace

std::vector<Experiment> ReadSelected(const ExperimentFiles& files) {
  std::vector<Experiment> selected;
  for (const auto& path : files.paths) {
    const std::size_t before = selected.size();
    std::vector<Experiment> experiments = ReadExperiments(path, files.settings);
    if (files.threads > 0) {
      for (Experiment& experiment : experiments) UseThreads(files.threads, experiment);
    }
    RequireKeys(experiments, files.filter);
    for (Experiment& experiment : experiments) {
      if (Passes(experiment, files.filter)) selected.push_back(std::move(experiment));
    }
    if (selected.size() > before) continue;
    throw ConfigError(fmt::format("{}: no case matches {}", path.string(), ToText(files.filter)));
  }
  return selected;
}

int List(const ExperimentFiles& files, bool json) {
  std::vector<JsonObject> documents;
  for (const auto& path : files.paths) {
    const std::vector<Experiment> experiments =
        ReadSelected({{path}, files.settings, files.filter, files.threads});
    for (const Experiment& experiment : experiments) CheckLadders(experiment);
    if (json) {
      documents.push_back(CaseDocument(path, experiments, files.filter));
    } else {
      PrintText(ToScreen(CaseTable(experiments, files.filter)) + "\n");
    }
  }
  if (json) PrintText(JsonObject().Add("experiments", documents).Text() + "\n");
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
      PrintError("{}\n", Lines{error.what()});
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

}  // namespace loopbench::harness
