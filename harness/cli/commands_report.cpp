// The subcommands that read a store: tables and figures of its records.
#include <fmt/format.h>

#include <algorithm>

#include "harness/analysis/doubts.h"
#include "harness/cli/commands.h"
#include "harness/cli/long_table.h"
#include "harness/cli/report.h"
#include "harness/figures/distinct_points.h"
#include "harness/figures/failure_map_figure.h"
#include "harness/figures/figure_recipes.h"
#include "harness/figures/precision_figures.h"
#include "harness/judge/failure_map_csv.h"
#include "harness/judge/failure_map_reader.h"
#include "harness/judge/failure_map_report.h"
#include "harness/record/provenance.h"
#include "harness/store/contents.h"
#include "harness/store/result_store.h"
#include "harness/tables/columns.h"
#include "harness/tables/fit.h"
#include "harness/text/config_error.h"
#include "harness/text/files.h"
#include "harness/text/terminal.h"

namespace loopbench::harness {

namespace {

/// --out is a file when it ends like a figure, else a folder.
std::filesystem::path FileOf(const PlotCommand& command) {
  const std::filesystem::path& out = command.out;
  const std::string ending = out.extension().string();
  if (ending != ".svg" && ending != ".pdf") {
    return out / fmt::format("{}.{}", FileName(command.free.y + "-over-" + command.free.x),
                             command.format.empty() ? "svg" : command.format);
  }
  if (command.format.empty() || ending == "." + command.format) return out;
  throw ConfigError(
      fmt::format("--out {}: found the ending \"{}\", expected \".{}\" as in --format",
                  out.string(), ending, command.format));
}

bool IsFree(const PlotCommand& command) {
  const FreeFigure& free = command.free;
  if ((free.x + free.y + free.group + free.log).empty() && !free.title) return false;
  if (free.x.empty() || free.y.empty()) {
    throw ConfigError("plot: --group, --log and --title need --x KEY and --y KEY");
  }
  return true;
}

int NothingMatches(const PlotCommand& command) {
  PrintError("{}: no records match{}{}\n", command.store.string(), command.where.empty() ? "" : " ",
             ToText(command.where));
  return 2;
}

int DrawFree(const std::vector<Record>& records, const PlotCommand& command) {
  const std::filesystem::path path = FileOf(command);
  const FreeFigureResult result = MakeFreeFigure(records, command.free);
  for (const std::string& remark : result.remarks) PrintError("note: {}\n", remark);
  if (const auto error = WriteFigure(path, result.figure, FigureSizes().at(command.size))) {
    PrintError("{}\n", Lines{*error});
    return 2;
  }
  Print("wrote {}\n", path.string());
  return 0;
}

/// Of a store that is too large to be held.
int DrawMany(const SceneReader& reader, const PlotCommand& command) {
  RequireConditions("--where", command.where, reader.samples());
  RequireKeys(command.free, reader.samples());
  DistinctPoints points(command.free, kMostHeld);
  std::vector<std::string> warnings;
  reader.ForEach(
      [&](std::vector<Record> records) {
        for (const Record& one : Filter(Prepared(std::move(records)), command.where)) {
          points.Add(one);
        }
      },
      &warnings);
  for (const std::string& warning : warnings) PrintError("warning: {}\n", warning);
  if (points.seen() == 0) return NothingMatches(command);
  if (points.cell() > 0.0) {
    PrintError(
        "note: {} of {} records are drawn, and counted below; the others lie within {:.2g} of an "
        "axis of one of them\n",
        points.records().size(), points.seen(), points.cell());
  }
  return DrawFree(points.records(), command);
}

/// failure-map.csv, .md and the picture, which alone may fail: the reason is printed.
int WriteMap(const FailureMap& map, const MapCommand& command, const std::string& typed) {
  const std::filesystem::path stem = command.out / "failure-map";
  Table cells = MapCellTable(map);
  AppendProvenance(cells, typed);
  WriteFileAtomically(stem.string() + ".csv", RenderKept(cells, "csv"));
  WriteFileAtomically(stem.string() + ".md", MapMarkdown(map, Provenance(typed)));
  const std::string picture = stem.string() + "." + command.format;
  const auto error = WriteMapFigure(picture, map, FigureSizes().at(command.size));
  if (error) PrintError("{}\n", Lines{*error});
  Print("wrote {0}.csv, {0}.md{1}\n", stem.string(), error ? "" : ", " + picture);
  return error ? 2 : 0;
}

/// The picture alone, of a map's own CSV.
int RedrawMap(const MapRules& rules, const MapCommand& command) {
  if (command.gate || command.out.empty()) {
    throw ConfigError(
        fmt::format("{}: found a CSV, expected --out and no --gate (only the picture is drawn "
                    "of it), or a store",
                    command.store.string()));
  }
  const FailureMap map = MapFromCsv(rules, ReadTextFile(command.store), command.store.string());
  const std::string picture = (command.out / ("failure-map." + command.format)).string();
  if (const auto error = WriteMapFigure(picture, map, FigureSizes().at(command.size))) {
    PrintError("{}\n", Lines{*error});
    return 2;
  }
  Print("wrote {}\n", picture);
  return 0;
}

/// Without a demand a gate could not fail, and its success would say nothing.
void RequireDemands(const FailureMap& map, const std::filesystem::path& rules) {
  for (const auto& group : map.cells) {
    for (const auto& row : group) {
      if (std::ranges::any_of(row, &MapCell::demanded)) return;
    }
  }
  throw ConfigError(fmt::format(
      "--gate: no cell of {} has to hold, expected a row with \"must_hold\"", rules.string()));
}

}  // namespace

void AppendProvenance(Table& table, const std::string& typed) {
  for (const std::string& note : Provenance(typed)) table.notes.push_back(note);
}

std::string RenderKept(Table table, const std::string& format) {
  if (format == "csv") {
    std::erase_if(table.notes, [](const std::string& note) { return note.starts_with("date: "); });
  }
  return Render(table, format);
}

const std::map<std::string, FigureSize>& FigureSizes() {
  static const std::map<std::string, FigureSize> sizes = {{"one-column", FigureSize::kOneColumn},
                                                          {"two-column", FigureSize::kTwoColumn}};
  return sizes;
}

int DrawAll(const std::vector<NamedFigure>& figures, const std::filesystem::path& folder,
            const std::string& format, FigureSize size) {
  std::size_t written = 0;
  for (const NamedFigure& figure : figures) {
    const auto path = folder / (FileName(figure.name) + "." + format);
    const auto error = WriteFigure(path, figure.figure, size);
    if (error) PrintError("{}\n", Lines{*error});
    written += error ? 0 : 1;
  }
  const bool all = written == figures.size();
  Print("wrote {}{} figure{} to {}\n", written, all ? "" : fmt::format(" of {}", figures.size()),
        figures.size() == 1 ? "" : "s", folder.string());
  return all ? 0 : 2;
}

void WriteTables(const std::vector<Record>& records, const std::filesystem::path& store,
                 const std::string& typed) {
  const bool is_file = store.extension() == ".jsonl";
  for (const std::string kind : {"drift", "precision", "timing"}) {
    Table full = MakeTable(records, {.kind = kind});
    if (full.rows.empty()) continue;
    AppendProvenance(full, typed);
    for (const auto& [format, ending] : {std::pair{"csv", ".csv"}, {"markdown", ".md"}}) {
      std::filesystem::path file = store;
      file = is_file ? file.replace_extension(kind + ending) : file / (kind + ending);
      WriteFileAtomically(file, RenderKept(full, format));
    }
    const Table compact = MakeTable(records, {.kind = kind, .compact = true});
    PrintText(ToScreen(compact) + "\n");
  }
  for (const std::string& note : Provenance(typed)) Print("{}\n", note);
}

int DoubtGate(const std::vector<Record>& rows) {
  std::size_t runs = 0, failed = 0, doubted = 0;
  for (const Record& row : rows) {
    if (row.Text("kind") != "accuracy") continue;
    ++runs;
    failed += HasFailed(row) ? 1 : 0;
    doubted += HasDoubt(row) ? 1 : 0;
  }
  if (runs == 0) {
    throw ConfigError(
        "--gate doubts: found no accuracy run, expected one: such a gate cannot fail");
  }
  if (failed + doubted == 0) return 0;
  PrintError("gate doubts: of {} runs {} did not finish and {} have doubts\n", runs, failed,
             doubted);
  return 1;
}

int PrintTable(const TableCommand& command, const std::string& typed) {
  const Loaded loaded = LoadOrScan(command.store, command.view.where);
  if (loaded.many) return WriteLongTable(command, *loaded.many, typed);
  TableView view = command.view;
  const bool on_terminal = command.format == "text" && command.out.empty();
  // a page is no wider than a terminal
  view.compact = on_terminal || command.format == "latex";
  Table table = MakeTable(loaded.records, view);
  if (table.rows.empty()) {
    PrintError("{}: no {} records match{}{}\n", command.store.string(),
               view.kind.empty() ? "drift" : view.kind, view.where.empty() ? "" : " ",
               ToText(view.where));
    return 2;
  }
  AppendProvenance(table, typed);
  if (on_terminal) {
    PrintText(ToScreen(table));
  } else if (command.out.empty()) {
    PrintText(RenderKept(table, command.format));
  } else {
    WriteFileAtomically(command.out, RenderKept(table, command.format));
    Print("wrote {}\n", command.out.string());
  }
  return command.gate.empty() ? 0 : DoubtGate(table.rows);
}

int Plot(const PlotCommand& command) {
  const bool is_free = IsFree(command);
  const Loaded loaded = LoadOrScan(command.store, command.where);
  if (loaded.many && is_free) return DrawMany(*loaded.many, command);
  if (loaded.many) {
    throw ConfigError(fmt::format(
        "{}: found {} records, expected at most {} that fit into memory for figures of runs: "
        "choose some with --where PARAMETER=..., or draw single values with --x KEY --y KEY",
        command.store.string(), loaded.many->records(), kMostHeld));
  }
  RequireConditions("--where", command.where, loaded.records);
  const std::vector<Record> records = Filter(loaded.records, command.where);
  if (records.empty()) return NothingMatches(command);
  if (is_free) return DrawFree(records, command);
  std::vector<NamedFigure> figures = AllFigures(Filter(records, {Condition{"kind", {"accuracy"}}}));
  for (NamedFigure& figure :
       PrecisionFigures(Filter(records, {Condition{"kind", {"precision"}}}))) {
    figures.push_back(std::move(figure));
  }
  if (figures.empty()) {
    PrintError(
        "{}: no accuracy records with series and none in several scalars match; --x KEY --y "
        "KEY draws other values\n",
        command.store.string());
    return 2;
  }
  return DrawAll(figures, command.out, command.format.empty() ? "svg" : command.format,
                 FigureSizes().at(command.size));
}

int PrintMap(const MapCommand& command, const std::string& typed) {
  const MapRules rules = ReadMapRules(command.rules);
  if (command.store.extension() == ".csv") return RedrawMap(rules, command);
  const std::vector<Record> records = LoadRecords(command.store);
  if (records.empty()) {
    PrintError("{}: no records\n", command.store.string());
    return 2;
  }
  RequireOneContent(records, command.store, "map");
  const FailureMap map = MakeFailureMap(rules, records);
  if (command.gate) RequireDemands(map, command.rules);
  Table table = MapTable(map);
  AppendProvenance(table, typed);
  PrintText(ToScreen(table));
  const int written = command.out.empty() ? 0 : WriteMap(map, command, typed);
  if (!command.gate) return written;
  const std::vector<std::string> broken = BrokenDemands(map);
  for (const std::string& cell : broken) PrintError("must hold: {}\n", cell);
  return broken.empty() ? written : 1;
}

}  // namespace loopbench::harness
