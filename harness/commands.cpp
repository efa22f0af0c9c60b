#include "harness/commands.h"

#include <fmt/format.h>

#include "harness/config/claims_reader.h"
#include "harness/config/config_error.h"
#include "harness/config/experiment_reader.h"
#include "harness/config/mechanism_reader.h"
#include "harness/provenance.h"
#include "harness/report/claims_report.h"
#include "harness/report/table_view.h"
#include "harness/run_case.h"
#include "harness/store/files.h"
#include "harness/timing/time_cases.h"

namespace loopbench::harness {

std::vector<Record> LoadRecords(const std::filesystem::path& store) {
  std::vector<std::string> warnings;
  std::vector<Record> records = ReadRecords(store, &warnings);
  for (const std::string& warning : warnings) fmt::print(stderr, "warning: {}\n", warning);
  return records;
}

int Run(const RunCommand& command, const std::string& typed) {
  // read everything first: a mistake in the last file must not cost the runs of the first
  std::vector<Experiment> experiments;
  for (const auto& path : command.experiments) {
    experiments.push_back(ReadExperiment(path));
    if (command.suite.accuracy) SelectCases(experiments.back(), command.suite.filter);
  }
  const std::filesystem::path out =
      command.out.empty() ? std::filesystem::path("results/runs") / experiments.front().name
                          : command.out;
  // results appear under their name when they are complete; an interrupted run leaves the old ones
  const std::filesystem::path partial = out / "results.partial.jsonl";
  std::filesystem::remove(partial);
  {
    ResultStore store(partial);
    for (const Experiment& experiment : experiments) {
      fmt::print(stderr, "{}: {} accuracy cases, {} timings\n", experiment.name,
                 command.suite.accuracy ? SelectCases(experiment, command.suite.filter).size() : 0,
                 command.suite.timing ? CountTimings(experiment) : 0);
      RunSuite(experiment, command.suite, store);
    }
  }
  std::filesystem::rename(partial, out / "results.jsonl");
  WriteTables(LoadRecords(out), out, typed);
  fmt::print("results in {}\n", out.string());
  return 0;
}

int List(const std::vector<std::filesystem::path>& experiments, const Selection& filter) {
  for (const auto& path : experiments) {
    const Experiment experiment = ReadExperiment(path);
    Table table;
    table.title = experiment.name + ": " + experiment.comment;
    for (const char* key : {"mechanism", "formulation", "enforcement", "coordinates", "solver"}) {
      table.columns.push_back({key, key, Format::kText, {}});
    }
    table.columns.push_back({"rtol", "rtol", Format::kShortest, {}});
    table.columns.push_back({"horizon", "horizon [s]", Format::kShortest, {}});
    table.columns.push_back({"ensemble", "runs", Format::kInteger, {}});
    for (const Case& one : SelectCases(experiment, filter)) {
      Record row = CaseKeys(experiment, one);
      // an ensemble comes on top of the unperturbed run
      row.Set("ensemble", std::int64_t{one.ensemble > 1 ? one.ensemble + 1 : 1});
      table.rows.push_back(row);
    }
    table.notes = {
        fmt::format("{} cases and {} timings", table.rows.size(), CountTimings(experiment))};
    fmt::print("{}\n", ToText(table));
  }
  return 0;
}

int CheckFiles(const std::vector<std::filesystem::path>& files) {
  int exit_code = 0;
  for (const auto& path : files) {
    // an experiment has scenes, a mechanism has bodies
    const std::string text = ReadFile(path);
    const bool is_experiment = text.find("\"scenes\"") != std::string::npos;
    try {
      if (is_experiment) {
        const Experiment experiment = ReadExperiment(path);
        fmt::print("{}: experiment \"{}\", {} cases\n", path.string(), experiment.name,
                   Expand(experiment).size());
      } else {
        const MechanismFile file = ReadMechanism(path);
        fmt::print("{}: mechanism \"{}\", {} bodies, {} joints\n", path.string(),
                   file.description.name, file.description.bodies.size() - 1,
                   file.description.joints.size());
      }
    } catch (const ConfigError& error) {
      fmt::print(stderr, "{}\n", error.what());
      exit_code = 2;
    }
  }
  return exit_code;
}

int PrintVerdicts(const VerdictCommand& command, const std::string& typed) {
  const std::vector<Record> records = LoadRecords(command.store);
  std::vector<ClaimResult> results;
  for (const ClaimRule& rule : ReadClaims(command.claims)) {
    results.push_back(Evaluate(rule, records));
  }
  if (!command.out.empty()) {
    WriteFileAtomically(command.out, ClaimsMarkdown(results, Provenance(typed)));
  }
  fmt::print("{}\n", ToText(VerdictTable(results)));
  if (!command.out.empty()) fmt::print("wrote {}\n", command.out.string());
  return 0;
}

}  // namespace loopbench::harness
