// table, plot, report, robustness, check-claims, work-precision: views of the records of a store.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <string>
#include <utility>

#include "harness/cli/command_line.h"
#include "harness/cli/commands.h"
#include "harness/figures/figure_recipes.h"
#include "harness/figures/free_figure.h"
#include "harness/figures/judge_figures.h"
#include "harness/json/json_document.h"
#include "harness/judge/claims.h"
#include "harness/judge/reports.h"
#include "harness/judge/robustness_map.h"
#include "harness/judge/work_precision.h"
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
  std::string gate;                 ///< "required": return 1 if a required cell does not hold
};

struct VerdictCommand {
  std::filesystem::path store, claims, out;
};

/// Rejects a folder that is named like a picture and does not exist.
void RequireFolder(const std::filesystem::path& out, const char* expected) {
  constexpr std::array kPictures = {".svg", ".pdf", ".png", ".jpg", ".jpeg", ".eps", ".gif"};
  const std::string ending = out.extension().string();
  if (std::ranges::find(kPictures, ending) == kPictures.end()) return;
  if (std::filesystem::is_directory(out)) return;
  throw ConfigError(fmt::format("--out {}: found the ending \"{}\", expected {}", out.string(),
                                ending, expected));
}

/// Returns --out if it ends like a figure file; else it is a folder.
std::filesystem::path FileOf(const PlotCommand& command) {
  const std::filesystem::path& out = command.out;
  const std::string ending = out.extension().string();
  if (ending != ".svg" && ending != ".pdf") {
    RequireFolder(out, "\".svg\", \".pdf\" or a folder");
    return out / fmt::format("{}.{}", FileName(command.free.y + "-over-" + command.free.x),
                             command.format.empty() ? "svg" : command.format);
  }
  if (command.format.empty() || ending == "." + command.format) return out;
  throw ConfigError(
      fmt::format("--out {}: found the ending \"{}\", expected \".{}\" as in --format",
                  out.string(), ending, command.format));
}

/// Loads records, of which there must be some.
std::vector<Record> LoadSome(const std::filesystem::path& store, const Selection& where = {}) {
  std::vector<Record> records = LoadRecords(store, where);
  if (records.empty()) throw ConfigError(fmt::format("{}: no records", store.string()));
  return records;
}

/// Throws if a figure could not be written.
void RequireWritten(const std::optional<std::string>& fault, const std::string& path) {
  if (fault) throw std::runtime_error(*fault);
  Print("wrote {}\n", path);
}

bool IsFree(const PlotCommand& command) {
  const FreeFigure& free = command.free;
  if ((free.x + free.y + free.group + free.log).empty() && !free.title && free.labels.empty()) {
    return false;
  }
  if (free.x.empty() || free.y.empty()) {
    throw ConfigError("plot: --group, --log, --title and --label need --x KEY and --y KEY");
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
  RequireWritten(WriteFigure(path, result.figure, FigureSizes().at(command.size)), path.string());
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
  if (!command.gate.empty() || command.out.empty()) {
    throw ConfigError(
        fmt::format("{}: found a CSV, expected --out and no --fail-on (only the picture is drawn "
                    "of it), or a store",
                    command.store.string()));
  }
  const RobustnessMap map = MapFromCsv(rules, ReadTextFile(command.store), command.store.string());
  const std::string picture = (command.out / ("robustness-map." + command.format)).string();
  RequireWritten(WriteMapFigure(picture, map, FigureSizes().at(command.size)), picture);
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
  Deliver(on_terminal ? ToScreen(table) : RenderKept(table, command.format), command.out);
  return command.gate.empty() ? 0 : WarningGate(table.rows);
}

int Plot(const PlotCommand& command) {
  const bool is_free = IsFree(command);
  if (!is_free) RequireFolder(command.out, "a folder; a file needs --x KEY and --y KEY");
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
  const std::vector<Record> records = LoadSome(command.store);
  RequireOneContent(records, command.store, "robustness");
  const RobustnessMap map = MakeRobustnessMap(rules, records);
  if (!command.gate.empty()) RequireDemands(map, command.rules);
  Table table = MapTable(map);
  AppendProvenance(table, typed);
  PrintText(ToScreen(table));
  const int written = command.out.empty() ? 0 : WriteMap(map, command, typed);
  if (command.gate.empty()) return written;
  const std::vector<std::string> broken = BrokenDemands(map);
  for (const std::string& cell : broken) PrintError("must hold: {}\n", cell);
  return broken.empty() ? written : 1;
}

int PrintVerdicts(const VerdictCommand& command, const std::string& typed) {
  const std::vector<Record> records = LoadRecords(command.store);
  if (records.empty()) throw ConfigError(command.store.string() + ": found no records to judge");
  RequireOneContent(records, command.store, "check-claims");
  std::vector<ClaimResult> results;
  for (const ClaimRule& rule : ReadClaims(command.claims)) {
    results.push_back(Evaluate(rule, records));
  }
  if (!command.out.empty()) {
    WriteFileAtomically(command.out, ClaimsMarkdown(results, Provenance(typed)));
  }
  Table verdicts = VerdictTable(results);
  for (const ClaimResult& result : results) {
    for (const CheckResult& check : result.checks) {
      if (result.verdict != Verdict::kNotMeasured || check.reason.empty()) continue;
      verdicts.notes.push_back(fmt::format("{}: {}", result.rule.id, check.reason));
    }
  }
  const std::vector<std::string> provenance = Provenance(typed);
  verdicts.notes.insert(verdicts.notes.end(), provenance.begin(), provenance.end());
  PrintText(ToScreen(verdicts) + "\n");
  if (!command.out.empty()) Print("wrote {}\n", command.out.string());
  return 0;
}

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
  const std::vector<Record> records = LoadSome(command.store);
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

void AddResults(Commands& commands) {
  auto& table = commands.Keep<TableCommand>();
  TableView& view = table.view;
  commands.Add(
      "table", "Print a table of stored records",
      [&](const Typed& typed) { return PrintTable(table, typed.line); },
      {StoreArgument(&table.store),
       {"--kind", "Kind of table (default: drift, or the first kind in the store)", &view.kind,
        OneOf({"drift", "precision", "timing", "factorial", "models", "references", "all"})},
       TableFormatOption(&table.format),
       WhereOption(&view.where),
       {"--columns", "Keys of records, in this order: a,b,c", &view.columns, kSplits},
       {"--group", "One table per value of this key", &view.group},
       {"--sort", "Key to sort by", &view.sort},
       {"--descending", "Sort in descending order", &view.descending, Needs("--sort")},
       OutOption(&table.out),
       GateOption(&table.gate),
       WideOption()});
  auto& plot = commands.Keep<PlotCommand>();
  commands.Add("plot", "Draw the standard figures, or one value against another",
               [&](const Typed&) { return Plot(plot); },
               {StoreArgument(&plot.store),
                {"-o,--out", "Folder for the figures; with --x and --y also a file's name",
                 &plot.out, kRequired},
                FormatOption(&plot.format, {"svg", "pdf"}, "Figure format (default: svg)"),
                SizeOption(&plot.size),
                WhereOption(&plot.where),
                {"--x", "Key of the horizontal axis", &plot.free.x},
                {"--y", "Key of the vertical axis", &plot.free.y},
                {"--group", "One curve per value of these keys: a,b", &plot.free.group},
                {"--log", "Logarithmic axes (default: those that span two decades)", &plot.free.log,
                 OneOf({"x", "y", "xy", "none"})},
                {"--title", "Title, \"\" for none (default: values that all records share)",
                 &plot.free.title},
                {"--label", "Text of an axis (NAME: its key) or curve: NAME=TEXT, repeatable",
                 &plot.free.labels}});
  auto& report = commands.Keep<ReportCommand>();
  commands.Add("report", "Write a self-contained HTML report of a run",
               [&](const Typed& typed) { return WriteReport(report, typed.line); },
               {{"store", "Folder with results.jsonl, or a .jsonl file", &report.store, kRequired},
                {"-o,--out", "Output file (default: report.html in the store)", &report.out},
                {"--rules", "Rules of a robustness map to include", &report.rules},
                {"--claims", "Claims to include with their verdicts", &report.claims}});
}

void AddVerdicts(Commands& commands) {
  auto& map = commands.Keep<MapCommand>();
  commands.Add(
      "robustness", "Tabulate which methods pass which stress tests",
      [&](const Typed& typed) { return PrintMap(map, typed.line); },
      {{"store", "Folder of a run, a .jsonl file, or robustness-map.csv to draw it again",
        &map.store, kRequired},
       {"--rules", "Rules file (JSON): rows, methods, limits", &map.rules, kRequired},
       {"-o,--out", "Folder for robustness-map.csv, .md and the figure", &map.out},
       FormatOption(&map.format, {"svg", "pdf"}, "Figure format"),
       SizeOption(&map.size),
       {"--fail-on", "Exit with status 1 if a required cell fails", &map.gate, OneOf({"required"})},
       WideOption()});
  auto& claims = commands.Keep<VerdictCommand>();
  commands.Add("check-claims", "Compare claims with stored records",
               [&](const Typed& typed) { return PrintVerdicts(claims, typed.line); },
               {StoreArgument(&claims.store),
                {"--claims", "Claims file (JSON)", &claims.claims, kRequired},
                {"-o,--out", "Markdown report with all numbers", &claims.out},
                WideOption()});
}

namespace {

struct WorkPrecisionCommand {
  std::filesystem::path store;
  WorkPrecisionOptions options;
  std::string format = "text";      ///< format of the output: text, csv, markdown, json or latex
  std::filesystem::path out;        ///< folder; default: the store's folder
  bool draws = false;               ///< draw figures too
  std::string figures = "svg";      ///< svg or pdf
  std::string size = "two-column";  ///< of figures, a name of a FigureSize
  bool all = false;                 ///< print every row, not only the front
};

/// Returns the folder of tables: for a store that is a file, the file's folder.
std::filesystem::path FolderOf(const WorkPrecisionCommand& command) {
  if (!command.out.empty()) return command.out;
  const bool is_file = command.store.extension() == ".jsonl";
  return is_file ? command.store.parent_path() : command.store;
}

void WriteWorkPrecision(const WorkPrecision& work_precision, const std::filesystem::path& folder,
                        const std::string& typed) {
  const std::string stem = (folder / "work-precision").string();
  Table rows = WorkPrecisionTable(work_precision, {.compact = false, .all = true});
  Table cheapest = CheapestTable(work_precision);
  AppendProvenance(rows, typed);
  AppendProvenance(cheapest, typed);
  WriteFileAtomically(stem + ".csv", RenderKept(rows, "csv"));
  WriteFileAtomically(stem + "-overview.csv", RenderKept(cheapest, "csv"));
  WriteFileAtomically(stem + ".md", WorkPrecisionMarkdown(work_precision, Provenance(typed)));
}

/// Prints fronts and overview for people, then which conditions were equal and which were not.
void PrintForPeople(const WorkPrecision& work_precision, const WorkPrecisionCommand& command,
                    const std::string& typed) {
  const Table fronts = WorkPrecisionTable(work_precision, {.compact = true, .all = command.all});
  PrintText(ToScreen(fronts) + "\n");
  Table overview = OverviewTable(work_precision);
  overview.notes = FairnessStatement(work_precision);
  AppendProvenance(overview, typed);
  PrintText(ToScreen(overview) + "\n");
}

/// Prints fronts, overview and fairness statement; writes work-precision.csv,
/// work-precision-overview.csv, work-precision.md and the figures.
int PrintWorkPrecision(const WorkPrecisionCommand& command, const std::string& typed) {
  const std::vector<Record> records = LoadSome(command.store, command.options.where);
  RequireOneContent(records, command.store, "work-precision");
  const WorkPrecision work_precision = MakeWorkPrecision(records, command.options);
  const std::filesystem::path folder = FolderOf(command);
  WriteWorkPrecision(work_precision, folder, typed);
  if (command.format == "text") {
    PrintForPeople(work_precision, command, typed);
    const std::string stem = (folder / "work-precision").string();
    Print("wrote {0}.csv, {0}-overview.csv, {0}.md\n", stem);
  } else {
    Table rows = WorkPrecisionTable(work_precision, {.compact = false, .all = true});
    for (std::string& line : FairnessStatement(work_precision))
      rows.notes.push_back(std::move(line));
    AppendProvenance(rows, typed);
    PrintText(RenderKept(rows, command.format));
  }
  if (!command.draws) return 0;
  return DrawAll(WorkPrecisionFigures(work_precision), folder / "figures", command.figures,
                 FigureSizes().at(command.size));
}

}  // namespace

void AddWorkPrecision(Commands& commands) {
  auto& command = commands.Keep<WorkPrecisionCommand>();
  WorkPrecisionOptions& options = command.options;
  commands.Add(
      "work-precision", "Compute work-precision tables and Pareto fronts",
      [&](const Typed& typed) { return PrintWorkPrecision(command, typed.line); },
      {StoreArgument(&command.store),
       {"--error-key", "Key of the error (default: error_position_max, or an error in the store)",
        &options.error},
       {"--cost-key",
        "Key that is the cost: wall_s (default: the timed median), rhs_equivalents, steps, ...",
        &options.cost},
       {"--per", "Keys that make one problem: a,b", &options.per, kSplits},
       {"--error-levels", "Errors that the overview asks for: a,b", &options.classes,
        From(0.0, 1e300), kSplits},
       WhereOption(&options.where),
       {"-o,--out", "Folder (default: that of the store)", &command.out},
       TableFormatOption(&command.format),
       {"--all", "Print all rows, not only Pareto fronts", &command.all},
       WideOption(),
       {"--figures", "Draw figures too", &command.draws},
       {"--figure-format", "svg or pdf", &command.figures, OneOf({"svg", "pdf"}),
        Needs("--figures")},
       SizeOption(&command.size)});
}

}  // namespace loopbench::harness
