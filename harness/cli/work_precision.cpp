// tradeoff: cost of accuracy.
#include "harness/judge/work_precision.h"

#include <filesystem>
#include <string>
#include <utility>

#include "harness/cli/command_line.h"
#include "harness/cli/commands.h"
#include "harness/figures/judge_figures.h"
#include "harness/judge/reports.h"
#include "harness/record/provenance.h"
#include "harness/store/result_store.h"
#include "harness/tables/fit.h"
#include "harness/text/files.h"
#include "harness/text/terminal.h"

namespace loopbench::harness {
namespace {

struct WorkPrecisionCommand {
  std::filesystem::path store;
  WorkPrecisionOptions options;
  std::string format = "text";      ///< format of the output: text, csv, markdown, json or latex
  std::filesystem::path out;        ///< folder; default: the store's folder
  std::string figures;              ///< svg or pdf; "" for none
  std::string size = "two-column";  ///< of figures, a name of a FigureSize
  bool all = false;                 ///< print every row, not only the front
};

/// Returns the folder of tables: for a store that is a file, the file's folder.
std::filesystem::path FolderOf(const WorkPrecisionCommand& command) {
  if (!command.out.empty()) return command.out;
  const bool is_file = command.store.extension() == ".jsonl";
  return is_file ? command.store.parent_path() : command.store;
}

void WriteTradeoff(const WorkPrecision& work_precision, const std::filesystem::path& folder,
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

/// Prints fronts, overview and fairness statement; writes tradeoff.csv, tradeoff-overview.csv,
/// tradeoff.md and the figures.
int PrintTradeoff(const WorkPrecisionCommand& command, const std::string& typed) {
  const std::vector<Record> records = LoadRecords(command.store, command.options.where);
  if (records.empty()) {
    PrintError("{}: no records\n", command.store.string());
    return 2;
  }
  RequireOneContent(records, command.store, "work-precision");
  const WorkPrecision work_precision = MakeTradeoff(records, command.options);
  const std::filesystem::path folder = FolderOf(command);
  WriteTradeoff(work_precision, folder, typed);
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
  if (command.figures.empty()) return 0;
  return DrawAll(WorkPrecisionFigures(work_precision), folder / "figures", command.figures,
                 FigureSizes().at(command.size));
}

}  // namespace

void AddTradeoff(Commands& commands) {
  auto& command = commands.Keep<WorkPrecisionCommand>();
  auto& conditions = commands.Keep<std::vector<std::string>>();
  auto& draws = commands.Keep<bool>();
  auto& drawn_as = commands.Keep<std::string>("svg");
  CLI::App* app = commands.Add("work-precision", "Compute work-precision tables and Pareto fronts",
                               [&](const Typed& typed) {
                                 command.options.where = ParseSelection(conditions);
                                 if (draws) command.figures = drawn_as;
                                 return PrintTradeoff(command, typed.line);
                               });
  app->add_option("store", command.store, "Folder of a run, or a .jsonl file")->required();
  WorkPrecisionOptions& options = command.options;
  app->add_option("--error-key", options.error,
                  "Key of the error (default: error_position_max, or an error in the store)");
  app->add_option("--cost-key", options.cost,
                  "Key that is the cost: wall_s (default: the timed median), "
                  "rhs_equivalents, steps, ...");
  app->add_option("--per", options.per, "Keys that make one problem: a,b")
      ->delimiter(',')
      ->capture_default_str();
  app->add_option("--error-levels", options.classes, "Errors that the overview asks for: a,b")
      ->delimiter(',')
      ->check(NumberFrom(0.0, 1e300))
      ->capture_default_str();
  AddWhere(app, &conditions);
  app->add_option("-o,--out", command.out, "Folder (default: that of the store)");
  AddChoice(app, "--format", &command.format, "Output format",
            {"text", "csv", "markdown", "json", "latex"});
  app->add_flag("--all", command.all, "Print all rows, not only Pareto fronts");
  AddWide(app);
  CLI::Option* figures = app->add_flag("--figures", draws, "Draw figures too");
  app->add_option("--figure-format", drawn_as, "svg or pdf")
      ->check(CLI::IsMember({"svg", "pdf"}))
      ->needs(figures)
      ->capture_default_str();
  AddSize(app, &command.size);
}

}  // namespace loopbench::harness
