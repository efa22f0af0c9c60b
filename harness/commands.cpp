#include "harness/commands.h"

#include <fmt/format.h>

#include "harness/config/claims_reader.h"
#include "harness/provenance.h"
#include "harness/report/claims_report.h"
#include "harness/report/columns.h"
#include "harness/report/factorial.h"
#include "harness/report/figure_recipes.h"
#include "harness/run_case.h"
#include "harness/store/files.h"
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
  std::vector<Record> records = ReadRecords(store, &warnings);
  for (const std::string& warning : warnings) fmt::print(stderr, "warning: {}\n", warning);
  return records;
}

}  // namespace

int Run(const RunCommand& command, const std::string& typed) {
  // read everything first: a mistake in the last file must not cost the runs of the first
  const std::vector<Experiment> experiments =
      ReadSelected({command.experiments, command.settings, command.suite.filter});
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
