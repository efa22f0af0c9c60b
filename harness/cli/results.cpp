// table, plot, verdict, map and report: views of the records of a store.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <string>

#include "harness/cli/command_line.h"
#include "harness/cli/commands.h"
#include "harness/figures/figure_recipes.h"
#include "harness/figures/free_figure.h"
#include "harness/figures/judge_figures.h"
#include "harness/json/json_document.h"
#include "harness/judge/claims.h"
#include "harness/judge/reports.h"
#include "harness/judge/robustness_map.h"
#include "harness/record/provenance.h"
#include "harness/report/html.h"
#include "harness/store/result_store.h"
#include "harness/tables/columns.h"
#include "harness/tables/fit.h"
#include "harness/text/files.h"
#include "harness/text/terminal.h"

namespace loopbench::harness {
namespace {

struct PlotCommand {
  std::filesystem::path store;
  std::filesystem::path out;        ///< folder, or a file for a free figure
  std::string format;               ///< svg or pdf; "" for the file's ending, else svg
  std::string size = "two-column";  ///< a name of a FigureSize
  Selection where;
  FreeFigure free;  ///< without x and y the standard figures
};

struct MapCommand {
  std::filesystem::path store, rules;
  std::filesystem::path out;        ///< folder; no files if empty
  std::string format = "svg";       ///< of the picture: svg or pdf
  std::string size = "two-column";  ///< a name of a FigureSize
  bool gate = false;                ///< return 1 if a required cell does not hold
};

struct VerdictCommand {
  std::filesystem::path store, claims, out;
};

/// Returns --out if it ends like a figure file; else it is a folder.
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

/// Draws a figure of a store that is too large for memory.
int DrawMany(const ProblemReader& reader, const PlotCommand& command) {
  RequireConditions("--where", command.where, reader.samples());
  RequireKeys(command.free, reader.samples());
  DistinctPoints points(command.free, kMaxHeld);
  std::vector<std::string> warnings;
  reader.ForEach(
      [&](std::vector<Record> records) {
        for (const Record& one : Filter(LatestWithWarnings(std::move(records)), command.where)) {
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

/// Writes robustness-map.csv, .md and the picture; prints the reason if the picture fails.
int WriteMap(const RobustnessMap& map, const MapCommand& command, const std::string& typed) {
  const std::filesystem::path stem = command.out / "robustness-map";
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

/// Draws only the picture, from the map's own CSV.
int RedrawMap(const MapRules& rules, const MapCommand& command) {
  if (command.gate || command.out.empty()) {
    throw ConfigError(
        fmt::format("{}: found a CSV, expected --out and no --fail-on (only the picture is drawn "
                    "of it), or a store",
                    command.store.string()));
  }
  const RobustnessMap map = MapFromCsv(rules, ReadTextFile(command.store), command.store.string());
  const std::string picture = (command.out / ("robustness-map." + command.format)).string();
  if (const auto error = WriteMapFigure(picture, map, FigureSizes().at(command.size))) {
    PrintError("{}\n", Lines{*error});
    return 2;
  }
  Print("wrote {}\n", picture);
  return 0;
}

/// Throws if there is no demand: the gate could not fail, and success would be meaningless.
void RequireDemands(const RobustnessMap& map, const std::filesystem::path& rules) {
  for (const auto& group : map.cells) {
    for (const auto& row : group) {
      if (std::ranges::any_of(row, &MapCell::demanded)) return;
    }
  }
  throw ConfigError(
      fmt::format("--fail-on required: no cell of {} has to hold, expected a row with \"required\"",
                  rules.string()));
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
  return command.gate.empty() ? 0 : WarningGate(table.rows);
}

int Plot(const PlotCommand& command) {
  const bool is_free = IsFree(command);
  const Loaded loaded = LoadOrScan(command.store, command.where);
  if (loaded.many && is_free) return DrawMany(*loaded.many, command);
  if (loaded.many) {
    throw ConfigError(fmt::format(
        "{}: found {} records, expected at most {} that fit into memory for figures of runs: "
        "choose some with --where PARAMETER=..., or draw single values with --x KEY --y KEY",
        command.store.string(), loaded.many->records(), kMaxHeld));
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
  RequireOneContent(records, command.store, "robustness");
  const RobustnessMap map = MakeRobustnessMap(rules, records);
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

int PrintVerdicts(const VerdictCommand& command, const std::string& typed) {
  const std::vector<Record> records = LoadRecords(command.store);
  RequireOneContent(records, command.store, "check-claims");
  std::vector<ClaimResult> results;
  for (const ClaimRule& rule : ReadClaims(command.claims)) {
    results.push_back(Evaluate(rule, records));
  }
  if (!command.out.empty()) {
    WriteFileAtomically(command.out, ClaimsMarkdown(results, Provenance(typed)));
  }
  Table verdicts = VerdictTable(results);
  verdicts.notes = Provenance(typed);
  PrintText(ToScreen(verdicts) + "\n");
  if (!command.out.empty()) Print("wrote {}\n", command.out.string());
  return 0;
}

}  // namespace

void AddTable(Commands& commands) {
  auto& command = commands.Keep<TableCommand>();
  auto& conditions = commands.Keep<std::vector<std::string>>();
  CLI::App* app = commands.Add("table", "Print a table of stored records", [&](const Typed& typed) {
    command.view.where = ParseSelection(conditions);
    return PrintTable(command, typed.line);
  });
  app->add_option("store", command.store, "Folder of a run, or a .jsonl file")->required();
  app->add_option("--kind", command.view.kind,
                  "Kind of table (default: drift, or the first kind in the store)")
      ->check(CLI::IsMember(
          {"drift", "precision", "timing", "factorial", "models", "references", "all"}));
  AddChoice(app, "--format", &command.format, "Output format",
            {"text", "csv", "markdown", "json", "latex"});
  AddWhere(app, &conditions);
  app->add_option("--columns", command.view.columns, "Keys of records, in this order: a,b,c")
      ->delimiter(',');
  app->add_option("--group", command.view.group, "One table per value of this key");
  app->add_option("--sort", command.view.sort, "Key to sort by");
  app->add_flag("--descending", command.view.descending, "Sort in descending order")
      ->needs("--sort");
  app->add_option("-o,--out", command.out, "Output file (default: the terminal)");
  AddGate(app, &command.gate);
  AddWide(app);
}

void AddPlot(Commands& commands) {
  auto& command = commands.Keep<PlotCommand>();
  auto& conditions = commands.Keep<std::vector<std::string>>();
  CLI::App* app = commands.Add("plot", "Draw the standard figures, or one value against another",
                               [&](const Typed&) {
                                 command.where = ParseSelection(conditions);
                                 return Plot(command);
                               });
  app->add_option("store", command.store, "Folder of a run, or a .jsonl file")->required();
  app->add_option("-o,--out", command.out,
                  "Folder for the figures; with --x and --y also a file's name")
      ->required();
  app->add_option("--format", command.format, "Figure format (default: svg)")
      ->check(CLI::IsMember({"svg", "pdf"}));
  AddSize(app, &command.size);
  AddWhere(app, &conditions);
  app->add_option("--x", command.free.x, "Key of the horizontal axis");
  app->add_option("--y", command.free.y, "Key of the vertical axis");
  app->add_option("--group", command.free.group, "One curve per value of these keys: a,b");
  app->add_option("--log", command.free.log,
                  "Logarithmic axes (default: those that span two decades)")
      ->check(CLI::IsMember({"x", "y", "xy", "none"}));
  app->add_option_function<std::string>(
      "--title", [&command](const std::string& title) { command.free.title = title; },
      "Title, \"\" for none (default: values that all records share)");
}

void AddVerdict(Commands& commands) {
  auto& command = commands.Keep<VerdictCommand>();
  CLI::App* app =
      commands.Add("check-claims", "Compare claims with stored records",
                   [&](const Typed& typed) { return PrintVerdicts(command, typed.line); });
  app->add_option("store", command.store, "Folder of a run, or a .jsonl file")->required();
  app->add_option("--claims", command.claims, "Claims file (JSON)")->required();
  app->add_option("-o,--out", command.out, "Markdown report with all numbers");

  AddWide(app);
}

void AddMap(Commands& commands) {
  auto& command = commands.Keep<MapCommand>();
  CLI::App* app = commands.Add("robustness", "Tabulate which methods pass which stress tests",
                               [&](const Typed& typed) { return PrintMap(command, typed.line); });
  app->add_option("store", command.store,
                  "Folder of a run, a .jsonl file, or robustness-map.csv to draw it again")
      ->required();
  app->add_option("--rules", command.rules, "Rules file (JSON): rows, methods, limits")->required();
  app->add_option("-o,--out", command.out, "Folder for robustness-map.csv, .md and the figure");
  AddChoice(app, "--format", &command.format, "Figure format", {"svg", "pdf"});
  AddSize(app, &command.size);
  app->add_option_function<std::string>(
         "--fail-on", [&command](const std::string&) { command.gate = true; },
         "Exit with status 1 if a required cell fails")
      ->check(CLI::IsMember({"required"}));
  AddWide(app);
}

// report: HTML page of a run.

namespace {

struct ReportCommand {
  std::filesystem::path store;
  std::filesystem::path out;     ///< default report.html in the store's folder
  std::filesystem::path rules;   ///< rules of a robustness map, or none
  std::filesystem::path claims;  ///< or none
};

/// Writes the page; returns 2 if the store has no records, or this program has no pages.
int WriteReport(const ReportCommand& command, const std::string& typed) {
  if (kReportScript.empty()) {
    PrintError("report: this program was built without (cmake -DLOOPBENCH_REPORT=ON needs npm)\n");
    return 2;
  }
  ReportOptions options{
      .store = command.store, .rules_file = command.rules, .claims_file = command.claims};
  if (!command.rules.empty()) options.rules = ReadMapRules(command.rules);
  if (!command.claims.empty()) options.claims = ReadClaims(command.claims);
  const std::vector<Record> records = LoadRecords(command.store);
  if (records.empty()) {
    PrintError("{}: no records\n", command.store.string());
    return 2;
  }
  if (options.rules) RequireOneContent(records, command.store, "robustness");
  if (!options.claims.empty()) RequireOneContent(records, command.store, "check-claims");
  ReportData data = MakeReport(records, options);
  data.provenance = Provenance(typed);
  const std::filesystem::path out =
      command.out.empty() ? StoreFile(command.store).parent_path() / "report.html" : command.out;
  const std::string page = ToHtml(data);
  WriteFileAtomically(out, page);
  Print("wrote {}: {} runs, {} of them failed and {} flagged, {} kB\n", out.string(), data.runs,
        data.failed, data.flagged, (page.size() + 999) / 1000);
  for (const std::string& remark : data.remarks) Print("  {}\n", remark);
  for (const std::string& file : data.changed) PrintError("{}\n", file);
  return data.changed.empty() ? 0 : 2;
}

}  // namespace

void AddReport(Commands& commands) {
  auto& command = commands.Keep<ReportCommand>();
  CLI::App* app =
      commands.Add("report", "Write a self-contained HTML report of a run",
                   [&](const Typed& typed) { return WriteReport(command, typed.line); });
  app->add_option("store", command.store, "Folder with results.jsonl, or a .jsonl file")
      ->required();
  app->add_option("-o,--out", command.out, "Output file (default: report.html in the store)");
  app->add_option("--rules", command.rules, "Rules of a robustness map to include");
  app->add_option("--claims", command.claims, "Claims to include with their verdicts");
}

}  // namespace loopbench::harness
