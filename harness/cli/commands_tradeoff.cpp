#include "harness/cli/commands_tradeoff.h"

#include <utility>

#include "harness/cli/commands.h"
#include "harness/cli/report.h"
#include "harness/figures/tradeoff_figures.h"
#include "harness/judge/fairness.h"
#include "harness/judge/tradeoff_report.h"
#include "harness/record/provenance.h"
#include "harness/store/contents.h"
#include "harness/tables/fit.h"
#include "harness/text/files.h"
#include "harness/text/terminal.h"

namespace loopbench::harness {
namespace {

/// A store that is a file has its tables beside it.
std::filesystem::path FolderOf(const TradeoffCommand& command) {
  if (!command.out.empty()) return command.out;
  const bool is_file = command.store.extension() == ".jsonl";
  return is_file ? command.store.parent_path() : command.store;
}

void WriteTradeoff(const Tradeoff& tradeoff, const std::filesystem::path& folder,
                   const std::string& typed) {
  const std::string stem = (folder / "tradeoff").string();
  Table rows = TradeoffTable(tradeoff, {.compact = false, .all = true});
  Table cheapest = CheapestTable(tradeoff);
  AppendProvenance(rows, typed);
  AppendProvenance(cheapest, typed);
  WriteFileAtomically(stem + ".csv", RenderKept(rows, "csv"));
  WriteFileAtomically(stem + "-overview.csv", RenderKept(cheapest, "csv"));
  WriteFileAtomically(stem + ".md", TradeoffMarkdown(tradeoff, Provenance(typed)));
}

/// What is printed for people: fronts, overview, and under it what was equal and what was not.
void PrintForPeople(const Tradeoff& tradeoff, const TradeoffCommand& command,
                    const std::string& typed) {
  const Table fronts = TradeoffTable(tradeoff, {.compact = true, .all = command.all});
  PrintText(ToScreen(fronts) + "\n");
  Table overview = OverviewTable(tradeoff);
  overview.notes = FairnessStatement(tradeoff);
  AppendProvenance(overview, typed);
  PrintText(ToScreen(overview) + "\n");
}

}  // namespace

int PrintTradeoff(const TradeoffCommand& command, const std::string& typed) {
  const std::vector<Record> records = LoadRecords(command.store, command.options.where);
  if (records.empty()) {
    PrintError("{}: no records\n", command.store.string());
    return 2;
  }
  RequireOneContent(records, command.store, "tradeoff");
  const Tradeoff tradeoff = MakeTradeoff(records, command.options);
  const std::filesystem::path folder = FolderOf(command);
  WriteTradeoff(tradeoff, folder, typed);
  if (command.format == "text") {
    PrintForPeople(tradeoff, command, typed);
    const std::string stem = (folder / "tradeoff").string();
    Print("wrote {0}.csv, {0}-overview.csv, {0}.md\n", stem);
  } else {
    Table rows = TradeoffTable(tradeoff, {.compact = false, .all = true});
    for (std::string& line : FairnessStatement(tradeoff)) rows.notes.push_back(std::move(line));
    AppendProvenance(rows, typed);
    PrintText(RenderKept(rows, command.format));
  }
  if (command.figures.empty()) return 0;
  return DrawAll(TradeoffFigures(tradeoff), folder / "figures", command.figures,
                 FigureSizes().at(command.size));
}

}  // namespace loopbench::harness
