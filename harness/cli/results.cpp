// table, plot, report, robustness, check-claims, work-precision: views of the records of a store.
#include "harness/base/json_document.h"
#include "harness/cli/commands.h"
#include "harness/figures/report.h"

namespace loopbench::harness {
namespace {

struct PlotCommand {
  std::filesystem::path store, out;
  std::string format;  ///< "": by the ending of `out`, else svg
  std::string size = "two-column";
  Selection where;
  FreeFigure free;  ///< without x and y the standard figures

  std::vector<Option> Options() {
    return {
        StoreArgument(&store),
        {"-o,--out", "Folder for the figures; with --x and --y also a file's name", &out,
         kRequired},
        FormatOption(&format, {"svg", "pdf"}, "Figure format (default: svg)"),
        SizeOption(&size),
        WhereOption(&where),
        {"--x", "Key of the horizontal axis", &free.x},
        {"--y", "Key of the vertical axis", &free.y},
        {"--group", "One curve per value of these keys: a,b", &free.group},
        {"--log", "Logarithmic axes (default: those that span two decades)", &free.log,
         OneOf({"x", "y", "xy", "none"})},
        {"--title", "Title, \"\" for none (default: values that all records share)", &free.title},
        {"--label", "Text of an axis (NAME: its key) or curve: NAME=TEXT, repeatable",
         &free.labels}};
  }
};

struct MapCommand {
  std::filesystem::path store, rules, out;
  std::string format = "svg", size = "two-column", gate;

  std::vector<Option> Options() {
    return {
        {"store", "Folder of a run, a .jsonl file, or robustness-map.csv to draw it again", &store,
         kRequired},
        {"--rules", "Rules file (JSON): rows, methods, limits", &rules, kRequired},
        {"-o,--out", "Folder for robustness-map.csv, .md and the figure", &out},
        FormatOption(&format, {"svg", "pdf"}, "Figure format"),
        SizeOption(&size),
        {"--fail-on", "Exit with status 1 if a required cell fails", &gate, OneOf({"required"})},
        WideOption()};
  }
};

struct VerdictCommand {
  std::filesystem::path store, claims, out;

  std::vector<Option> Options() {
    return {StoreArgument(&store),
            {"--claims", "Claims file (JSON)", &claims, kRequired},
            {"-o,--out", "Markdown report with all numbers", &out},
            WideOption()};
  }
};

struct ReportCommand {
  std::filesystem::path store, out, rules, claims;

  std::vector<Option> Options() {
    return {{"store", "Folder with results.jsonl, or a .jsonl file", &store, kRequired},
            {"-o,--out", "Output file (default: report.html in the store)", &out},
            {"--rules", "Rules of a robustness map to include", &rules},
            {"--claims", "Claims to include with their verdicts", &claims}};
  }
};

struct WorkPrecisionCommand {
  std::filesystem::path store, out;
  WorkPrecisionOptions options;
  std::string format = "text", figures = "svg", size = "two-column";
  bool draws = false, all = false;

  std::vector<Option> Options() {
    return {
        StoreArgument(&store),
        {"--error-key", "Key of the error (default: error_position_max, or an error in the store)",
         &options.error},
        {"--cost-key",
         "Key that is the cost: wall_s (default: the timed median), rhs_equivalents, steps, ...",
         &options.cost},
        {"--per", "Keys that make one problem: a,b", &options.per, kSplits},
        {"--error-levels", "Error levels of the overview: a,b", &options.classes, From(0.0, 1e300),
         kSplits},
        WhereOption(&options.where),
        {"-o,--out", "Folder (default: folder of the store)", &out},
        TableFormatOption(&format),
        {"--all", "Print all rows, not only Pareto fronts", &all},
        WideOption(),
        {"--figures", "Draw figures too", &draws},
        {"--figure-format", "svg or pdf", &figures, OneOf({"svg", "pdf"}), Needs("--figures")},
        SizeOption(&size)};
  }
};

/// Returns the size "one-column" or "two-column".
FigureSize SizeNamed(const std::string& name) {
  return name == "one-column" ? FigureSize::kOneColumn : FigureSize::kTwoColumn;
}

/// Draws figures into a folder, as svg or pdf. Returns 2 and prints the reasons if some cannot be
/// drawn.
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
  Print("wrote {}{} to {}\n", all ? "" : fmt::format("{} of ", written),
        WithCount(figures.size(), "figure"), folder.string());
  return all ? 0 : 2;
}

/// Returns --out if it ends like a figure file; else it is a folder.
std::filesystem::path FileOf(const PlotCommand& command) {
  const std::filesystem::path& out = command.out;
  const std::string ending = out.extension().string();
  if (ending != ".svg" && ending != ".pdf") {
    RejectPictures(out, "\".svg\", \".pdf\" or a folder");
    return out / fmt::format("{}.{}", FileName(command.free.y + "-over-" + command.free.x),
                             command.format.empty() ? "svg" : command.format);
  }
  if (command.format.empty() || ending == "." + command.format) return out;
  Reject("--out {}: found the ending \"{}\", expected \".{}\" as in --format", out.string(), ending,
         command.format);
}

/// Loads records, of which there must be some.
std::vector<Record> LoadSome(const std::filesystem::path& store, const Selection& where = {},
                             const char* none = "no records") {
  std::vector<Record> records = LoadRecords(store, where);
  if (records.empty()) Reject("{}: {}", store.string(), none);
  return records;
}

void RequireWritten(const std::optional<std::string>& fault, const std::string& path) {
  if (fault) throw std::runtime_error(*fault);
  Print("wrote {}\n", path);
}

bool IsFree(const PlotCommand& command) {
  const FreeFigure& free = command.free;
  if (free.x.empty() != free.y.empty()) {
    throw ConfigError(free.y.empty() ? "plot: found --x KEY without --y KEY, expected both"
                                     : "plot: found --y KEY without --x KEY, expected both");
  }
  if (!free.x.empty()) return true;
  if (!(free.group + free.log).empty() || free.title || !free.labels.empty()) {
    throw ConfigError("plot: --group, --log, --title and --label need --x KEY and --y KEY");
  }
  return false;
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
  RequireWritten(WriteFigure(path, result.figure, SizeNamed(command.size)), path.string());
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

/// Writes robustness-map.csv, .md and the picture.
int WriteMap(const RobustnessMap& map, const MapCommand& command, const std::string& typed) {
  const std::filesystem::path stem = command.out / "robustness-map";
  WriteFileAtomically(stem.string() + ".csv",
                      RenderKept(WithProvenance(MapCellTable(map), typed), "csv"));
  WriteFileAtomically(stem.string() + ".md", MapMarkdown(map, Provenance(typed)));
  const std::string picture = stem.string() + "." + command.format;
  const auto error = DrawWithGnuplot(picture, DrawMap(map, SizeNamed(command.size)));
  if (error) PrintError("{}\n", Lines{*error});
  Print("wrote {0}.csv, {0}.md{1}\n", stem.string(), error ? "" : ", " + picture);
  return error ? 2 : 0;
}

int RedrawMap(const MapRules& rules, const MapCommand& command) {
  if (!command.gate.empty() || command.out.empty()) {
    Reject(
        "{}: found a CSV, expected --out and no --fail-on (only the picture is drawn of it), or a "
        "store",
        command.store.string());
  }
  const RobustnessMap map = MapFromCsv(rules, ReadTextFile(command.store), command.store.string());
  const std::string picture = (command.out / ("robustness-map." + command.format)).string();
  RequireWritten(DrawWithGnuplot(picture, DrawMap(map, SizeNamed(command.size))), picture);
  return 0;
}

/// Throws if there is no demand: the gate could not fail.
void RequireDemands(const RobustnessMap& map, const std::filesystem::path& rules) {
  for (const auto& group : map.cells) {
    for (const auto& row : group) {
      if (std::ranges::any_of(row, &MapCell::demanded)) return;
    }
  }
  Reject("--fail-on required: no cell of {} has to hold, expected a row with \"required\"",
         rules.string());
}

int PrintTable(const TableCommand& command, const Typed& typed) {
  const Loaded loaded = LoadOrScan(command.store, command.view.where);
  if (loaded.many) return WriteLongTable(command, *loaded.many, typed.line);
  TableView view = command.view;
  const bool on_terminal = command.format == "text" && command.out.empty();
  // a page is no wider than a terminal
  view.compact = on_terminal || command.format == "latex";
  Table table = MakeTable(loaded.records, view);
  if (table.rows.empty()) {
    const auto kind = std::ranges::find(view.where, "kind", &Condition::key);
    PrintError("{}: no {} records match{}{}{}\n", command.store.string(),
               view.kind.empty() ? "drift" : view.kind, view.where.empty() ? "" : " ",
               ToText(view.where),
               view.kind.empty() && kind != view.where.end()
                   ? "; select the kind of records with --kind, for example --kind timing"
                   : "");
    return 2;
  }
  table = WithProvenance(std::move(table), typed.line);
  Deliver(on_terminal ? ToScreen(table) : RenderKept(table, command.format), command.out);
  return command.gate.empty() ? 0 : WarningGate(table.rows);
}

int Plot(const PlotCommand& command, const Typed&) {
  const bool is_free = IsFree(command);
  if (!is_free) RejectPictures(command.out, "a folder; a file needs --x KEY and --y KEY");
  const Loaded loaded = LoadOrScan(command.store, command.where);
  if (loaded.many && is_free) return DrawMany(*loaded.many, command);
  if (loaded.many) {
    Reject(
        "{}: found {} records, expected at most {} that fit into memory for figures of runs: "
        "choose some with --where PARAMETER=..., or draw single values with --x KEY --y KEY",
        command.store.string(), loaded.many->records(), kMaxHeld);
  }
  RequireConditions("--where", command.where, loaded.records);
  const std::vector<Record> records = Filter(loaded.records, command.where);
  if (records.empty()) return NothingMatches(command);
  if (is_free) return DrawFree(records, command);
  std::vector<NamedFigure> figures = AllFigures(Filter(records, {Condition{"kind", {"accuracy"}}}));
  std::ranges::move(PrecisionFigures(Filter(records, {Condition{"kind", {"precision"}}})),
                    std::back_inserter(figures));
  if (figures.empty()) {
    PrintError(
        "{}: no accuracy records with series and none in several scalars match; --x KEY --y KEY "
        "draws other values\n",
        command.store.string());
    return 2;
  }
  return DrawAll(figures, command.out, command.format.empty() ? "svg" : command.format,
                 SizeNamed(command.size));
}

int PrintMap(const MapCommand& command, const Typed& typed) {
  const MapRules rules = ReadMapRules(command.rules);
  if (command.store.extension() == ".csv") return RedrawMap(rules, command);
  const std::vector<Record> records = LoadSome(command.store);
  RequireOneContent(records, command.store, "robustness");
  VerifyFilesOf(records, StoreFile(command.store));
  const RobustnessMap map = MakeRobustnessMap(rules, records);
  if (!command.gate.empty()) RequireDemands(map, command.rules);
  PrintText(ToScreen(WithProvenance(MapTable(map), typed.line)));
  const int written = command.out.empty() ? 0 : WriteMap(map, command, typed.line);
  if (command.gate.empty()) return written;
  const std::vector<std::string> broken = BrokenDemands(map);
  for (const std::string& cell : broken) PrintError("must hold: {}\n", cell);
  return broken.empty() ? written : 1;
}

int PrintVerdicts(const VerdictCommand& command, const Typed& typed) {
  const std::vector<Record> records = LoadSome(command.store, {}, "found no records to judge");
  RequireOneContent(records, command.store, "check-claims");
  VerifyFilesOf(records, StoreFile(command.store));
  std::vector<ClaimResult> results = Mapped<ClaimResult>(
      ReadClaims(command.claims), [&](const ClaimRule& rule) { return Evaluate(rule, records); });
  if (!command.out.empty()) {
    WriteFileAtomically(command.out, ClaimsMarkdown(results, Provenance(typed.line)));
  }
  Table verdicts = VerdictTable(results);
  for (const ClaimResult& result : results) {
    for (const CheckResult& check : result.checks) {
      const bool is_unmeasured = result.verdict == Verdict::kNotMeasured;
      for (const std::string& text : {is_unmeasured ? check.reason : "", check.remark}) {
        if (!text.empty()) AddOnce(verdicts.notes, result.rule.id + ": " + text);
      }
    }
  }
  PrintText(ToScreen(WithProvenance(std::move(verdicts), typed.line)) + "\n");
  if (!command.out.empty()) Print("wrote {}\n", command.out.string());
  return 0;
}

int WriteReport(const ReportCommand& command, const Typed& typed) {
  if (kReportScript.empty()) {
    PrintError("report: this program was built without (cmake -DLOOPBENCH_REPORT=ON needs npm)\n");
    return 2;
  }
  const std::filesystem::path out =
      command.out.empty() ? StoreFile(command.store).parent_path() / "report.html" : command.out;
  RejectPictures(out, "\".html\"");
  ReportOptions options{
      .store = command.store, .rules_file = command.rules, .claims_file = command.claims};
  if (!command.rules.empty()) options.rules = ReadMapRules(command.rules);
  if (!command.claims.empty()) options.claims = ReadClaims(command.claims);
  const std::vector<Record> records = LoadSome(command.store);
  if (options.rules) RequireOneContent(records, command.store, "robustness");
  if (!options.claims.empty()) RequireOneContent(records, command.store, "check-claims");
  ReportData data = MakeReport(records, options);
  data.provenance = Provenance(typed.line);
  const std::string page = ToHtml(data);
  WriteFileAtomically(out, page);
  Print("wrote {}: {} runs, {} of them failed and {} flagged, {} kB\n", out.string(), data.runs,
        data.failed, data.flagged, (page.size() + 999) / 1000);
  for (const std::string& remark : data.remarks) Print("  {}\n", remark);
  for (const std::string& file : data.changed) PrintError("{}\n", file);
  return data.changed.empty() ? 0 : 2;
}

int PrintWorkPrecision(const WorkPrecisionCommand& command, const Typed& typed) {
  const std::vector<Record> records = LoadSome(command.store, command.options.where);
  RequireOneContent(records, command.store, "work-precision");
  const WorkPrecision work_precision = MakeWorkPrecision(records, command.options);
  const bool is_file = command.store.extension() == ".jsonl";
  const std::filesystem::path folder = !command.out.empty() ? command.out
                                       : is_file            ? command.store.parent_path()
                                                            : command.store;
  const std::string stem = (folder / "work-precision").string();
  Table rows = WorkPrecisionTable(work_precision, {.compact = false, .all = true});
  WriteFileAtomically(stem + ".csv", RenderKept(WithProvenance(rows, typed.line), "csv"));
  WriteFileAtomically(stem + "-overview.csv",
                      RenderKept(WithProvenance(CheapestTable(work_precision), typed.line), "csv"));
  WriteFileAtomically(stem + ".md", WorkPrecisionMarkdown(work_precision, Provenance(typed.line)));
  const std::vector<std::string> fairness = FairnessStatement(work_precision);
  if (command.format == "text") {
    const Table fronts = WorkPrecisionTable(work_precision, {.compact = true, .all = command.all});
    PrintText(ToScreen(fronts) + "\n");
    Table overview = OverviewTable(work_precision);
    overview.notes = fairness;
    PrintText(ToScreen(WithProvenance(std::move(overview), typed.line)) + "\n");
    Print("wrote {0}.csv, {0}-overview.csv, {0}.md\n", stem);
  } else {
    rows.AddNotes(fairness);
    PrintText(RenderKept(WithProvenance(std::move(rows), typed.line), command.format));
  }
  if (!command.draws) return 0;
  return DrawAll(WorkPrecisionFigures(work_precision), folder / "figures", command.figures,
                 SizeNamed(command.size));
}

}  // namespace

void RejectPictures(const std::filesystem::path& out, const char* expected) {
  constexpr std::array kPictures = {".svg", ".pdf", ".png", ".jpg", ".jpeg", ".eps", ".gif"};
  const std::string ending = out.extension().string();
  if (!Contains(kPictures, ending)) return;
  if (std::filesystem::is_directory(out)) return;
  Reject("--out {}: found the ending \"{}\", expected {}", out.string(), ending, expected);
}

void AddResults(Commands& commands) {
  commands.Add("table", "Print a table of stored records", PrintTable);
  commands.Add("plot", "Draw the standard figures, or one value against another", Plot);
  commands.Add("report", "Write a self-contained HTML report of a run", WriteReport);
  commands.Add("robustness", "Tabulate which methods pass which stress tests", PrintMap);
  commands.Add("check-claims", "Compare claims with stored records", PrintVerdicts);
  commands.Add("work-precision", "Compute work-precision tables and Pareto fronts",
               PrintWorkPrecision);
}

}  // namespace loopbench::harness
