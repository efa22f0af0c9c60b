#include "harness/commands.h"

#include <fmt/format.h>

#include <map>

#include "harness/config/claims_reader.h"
#include "harness/config/config_error.h"
#include "harness/config/experiment_reader.h"
#include "harness/config/mechanism_reader.h"
#include "harness/provenance.h"
#include "harness/report/claims_report.h"
#include "harness/report/columns.h"
#include "harness/report/factorial.h"
#include "harness/report/figure_recipes.h"
#include "harness/run_case.h"
#include "harness/store/files.h"
#include "harness/store/result_store.h"
#include "harness/timing/time_cases.h"

namespace loopbench::harness {

namespace {

/// Records of one kind, in table order.
std::vector<Record> OfKind(const std::vector<Record>& records, const std::string& kind,
                           const Selection& where) {
  Selection selection = where;
  selection.push_back({"kind", {kind}});
  std::vector<Record> rows = Filter(records, selection);
  SortRows(&rows);
  return rows;
}

Table MakeTable(const std::vector<Record>& records, const std::string& kind, bool compact,
                const Selection& where) {
  if (kind == "timing") {
    return {"Timing",
            compact ? CompactTimingColumns() : TimingColumns(),
            OfKind(records, "timing", where),
            {}};
  }
  const std::vector<Record> rows = OfKind(records, "accuracy", where);
  if (kind == "factorial") {
    FactorialOptions options;
    if (!rows.empty()) {
      // the table is for one tolerance and horizon: those of the first record, unless chosen
      options.rtol = rows.front().Number("rtol");
      options.horizon = rows.front().Number("horizon");
    }
    return FactorialTable(rows, options);
  }
  return {"Drift", compact ? CompactDriftColumns() : DriftColumns(), rows, {}};
}

std::string Render(const Table& table, const std::string& format) {
  if (format == "csv") return ToCsv(table);
  if (format == "markdown") return ToMarkdown(table);
  return ToText(table);
}

void Emit(const std::string& text, const std::filesystem::path& out) {
  if (out.empty()) {
    fmt::print("{}", text);
  } else {
    WriteFileAtomically(out, text);
    fmt::print("wrote {}\n", out.string());
  }
}

std::vector<Record> Load(const std::filesystem::path& store) {
  std::vector<std::string> warnings;
  const std::vector<Record> records = LatestRecords(ReadRecords(store, &warnings));
  for (const std::string& warning : warnings) fmt::print(stderr, "warning: {}\n", warning);
  return records;
}

}  // namespace

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
  {
    ResultStore store(out);
    const std::vector<Record> before = ReadRecords(out);
    for (const Experiment& experiment : experiments) {
      fmt::print(stderr, "{}: {} accuracy cases, {} timings\n", experiment.name,
                 command.suite.accuracy ? SelectCases(experiment, command.suite.filter).size() : 0,
                 command.suite.timing ? CountTimings(experiment) : 0);
      const SuiteCount count = RunSuite(experiment, command.suite, before, store);
      fmt::print(stderr, "{}: {} run now{}, {} were done before\n", experiment.name, count.run,
                 count.failed > 0 ? fmt::format(" ({} not finished)", count.failed) : "",
                 count.skipped);
    }
  }
  const std::vector<Record> records = Load(out);
  for (const std::string kind : {"drift", "timing"}) {
    Table full = MakeTable(records, kind, false, {});
    if (full.rows.empty()) continue;
    full.notes = Provenance(typed);
    WriteFileAtomically(out / (kind + ".csv"), ToCsv(full));
    WriteFileAtomically(out / (kind + ".md"), ToMarkdown(full));
    fmt::print("{}\n", ToText(MakeTable(records, kind, true, {})));
  }
  fmt::print("results in {}\n", out.string());
  return 0;
}

int Merge(const MergeCommand& command) {
  // by id, in the order of the files: of equal cases the last that finished stays
  std::vector<Record> merged;
  std::map<std::string, std::size_t> place;
  std::size_t read = 0;
  const auto finished = [](const Record& record) {
    return record.Text("outcome") == ToString(Outcome::kFinished);
  };
  for (const auto& store : command.stores) {
    for (const Record& record : ReadRecords(store)) {
      ++read;
      const std::string id = record.Text("id");
      const auto [at, is_new] = place.try_emplace(id, merged.size());
      if (id.empty() || is_new) {
        merged.push_back(record);
        continue;
      }
      Record& other = merged[at->second];
      if (finished(record) && finished(other) &&
          record.Text("state_hash") != other.Text("state_hash")) {
        throw std::runtime_error(fmt::format(
            "{}: case {} ({} {}) ended in state {} here and in {} before; one of the stores is not "
            "what it says",
            store.string(), id, record.Text("mechanism"), record.Text("formulation"),
            record.Text("state_hash"), other.Text("state_hash")));
      }
      if (finished(record) || !finished(other)) other = record;
    }
  }
  std::string text;
  for (const Record& record : merged) text += ToJsonLine(record) + '\n';
  ResultStore target(command.out);  // nobody else writes there now
  if (!ReadRecords(command.out).empty()) {
    throw std::runtime_error(
        fmt::format("{}: found records, expected a new store; name it among the "
                    "stores to merge and write to another",
                    command.out.string()));
  }
  WriteFileAtomically(target.file(), text);
  fmt::print("{} records of {} stores are {} cases in {}\n", read, command.stores.size(),
             merged.size(), target.file().string());
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

int PrintTable(const TableCommand& command, const std::string& typed) {
  const bool compact = command.format == "text" && command.out.empty();
  Table table = MakeTable(Load(command.store), command.kind, compact, command.where);
  if (table.rows.empty()) {
    fmt::print(stderr, "{}: no {} records match{}{}\n", command.store.string(), command.kind,
               command.where.empty() ? "" : " ", ToText(command.where));
    return 2;
  }
  if (!compact) table.notes = Provenance(typed);
  Emit(Render(table, command.format), command.out);
  return 0;
}

int Plot(const PlotCommand& command) {
  const std::vector<Record> rows = OfKind(Load(command.store), "accuracy", command.where);
  const std::vector<NamedFigure> figures = AllFigures(rows);
  if (figures.empty()) {
    fmt::print(stderr, "{}: no records with series match\n", command.store.string());
    return 2;
  }
  for (const NamedFigure& figure : figures) {
    const std::filesystem::path path = command.out / (figure.name + ".svg");
    if (const auto error = WriteSvg(path, figure.figure)) {
      fmt::print(stderr, "{}: {}\n", path.string(), *error);
      return 2;
    }
  }
  fmt::print("wrote {} figures to {}\n", figures.size(), command.out.string());
  return 0;
}

int PrintVerdicts(const VerdictCommand& command, const std::string& typed) {
  const std::vector<Record> records = Load(command.store);
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
