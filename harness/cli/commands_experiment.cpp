// list, check: what experiment and mechanism files hold.
#include <fmt/format.h>

#include <algorithm>

#include "harness/analysis/model_warnings.h"
#include "harness/cli/commands.h"
#include "harness/config/benchmark_reader.h"
#include "harness/config/mechanism_reader.h"
#include "harness/json/file_kind.h"
#include "harness/judge/claims_reader.h"
#include "harness/judge/failure_map_reader.h"
#include "harness/record/measures.h"
#include "harness/run/run_case.h"
#include "harness/suite/precision_cases.h"
#include "harness/suite/start_check.h"
#include "harness/tables/table.h"
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
  table.columns.push_back({"ensemble", "runs", Format::kInteger, {}});
  std::size_t timings = 0, rungs = 0;
  for (const Experiment& experiment : experiments) {
    for (const Case& one : SelectCases(experiment, filter)) {
      Record row = one.keys;
      // an ensemble comes on top of the unperturbed run
      row.Set("ensemble", std::int64_t{one.ensemble > 1 ? one.ensemble + 1 : 1});
      table.rows.push_back(row);
    }
    timings += CountTimings(experiment);
    rungs += CountRungs(experiment);
  }
  table.notes = {fmt::format("{} cases and {} timings", table.rows.size(), timings)};
  if (rungs > 0) table.notes.front() += fmt::format(", {} runs in several scalars", rungs);
  if (experiments.size() > 1) {
    table.notes.front() += fmt::format(" in {} combinations", experiments.size());
  }
  return table;
}

/// What looks wrong about sound numbers; no reason to refuse them.
void PrintUnitWarnings(const std::filesystem::path& path, const MechanismDescription& description) {
  for (const Warning& warning : FindUnitWarnings(description)) {
    PrintError("warning: {}: {}: {}\n", path.string(), description.name, warning.text);
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

void CheckExperiment(const std::filesystem::path& path, const CheckCommand& command) {
  const std::vector<Experiment> experiments = ReadExperiments(path, command.files.settings);
  for (const ExperimentScene& scene : experiments.front().scenes) {
    PrintUnitWarnings(path, scene.mechanism.description);
  }
  std::size_t cases = 0;
  for (const Experiment& experiment : experiments) {
    cases += Expand(experiment).size();
    CheckLadders(experiment);
  }
  if (command.assembly) RefuseFaults(path, StartFaults(experiments));
  Print("{}: experiment \"{}\", {} cases{}\n", path.string(), experiments.front().name, cases,
        experiments.size() > 1 ? fmt::format(" in {} combinations", experiments.size()) : "");
}

void CheckMechanism(const std::filesystem::path& path, const CheckCommand& command) {
  if (!command.files.settings.empty()) {
    throw ConfigError(fmt::format("{}: --set is for experiments, and this is none", path.string()));
  }
  const MechanismFile file = ReadMechanism(path);
  PrintUnitWarnings(path, file.description);
  if (command.assembly) RefuseFaults(path, {StartFault(file.description, command.limits)});
  Print("{}: mechanism \"{}\", {} bodies, {} joints\n", path.string(), file.description.name,
        file.description.bodies.size() - 1, file.description.joints.size());
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

int List(const ExperimentFiles& files) {
  for (const auto& path : files.paths) {
    const std::vector<Experiment> experiments =
        ReadSelected({{path}, files.settings, files.filter, files.threads});
    for (const Experiment& experiment : experiments) CheckLadders(experiment);
    PrintText(ToText(CaseTable(experiments, files.filter)) + "\n");
  }
  return 0;
}

int CheckFiles(const CheckCommand& command) {
  int exit_code = 0;
  for (const auto& path : command.files.paths) {
    try {
      switch (KindOfFile(path)) {
        case FileKind::kExperiment:
          CheckExperiment(path, command);
          break;
        case FileKind::kMechanism:
          CheckMechanism(path, command);
          break;
        case FileKind::kClaims:
          Print("{}: {} claims\n", path.string(), ReadClaims(path).size());
          break;
        case FileKind::kMap: {
          const MapRules map = ReadMapRules(path);
          std::size_t rows = 0;
          for (const MapGroup& group : map.groups) rows += group.rows.size();
          Print("{}: failure map of {} rows and {} columns\n", path.string(), rows,
                map.columns.size());
          break;
        }
        case FileKind::kBenchmarks:
          Print("{}: {} groups of benchmarks\n", path.string(), ReadBenchmarks(path).groups.size());
      }
    } catch (const ConfigError& error) {
      PrintError("{}\n", Lines{error.what()});
      exit_code = 2;
    }
  }
  return exit_code;
}

}  // namespace loopbench::harness
