// history: measurements of successive commits.
#include <fmt/format.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "harness/cli/command_line.h"
#include "harness/history/git.h"
#include "harness/history/history_page.h"
#include "harness/history/history_series.h"
#include "harness/record/provenance.h"
#include "harness/record/record.h"
#include "harness/store/measurements.h"
#include "harness/tables/fit.h"
#include "harness/text/files.h"
#include "harness/text/terminal.h"

namespace loopbench::harness {
namespace {

struct HistoryAddCommand {
  std::filesystem::path results;
  std::string commit, date;  ///< "": from the checked-out commit
  bool replaces = false;
};

struct HistoryShowCommand {
  std::string one, measure;  ///< filters: parts of case and measure names; "": all
  std::string format = "text";
  bool json = false;
};

struct HistoryReportCommand {
  std::filesystem::path out;
  std::string title = "Measurements over commits";
};

void PrintWarnings(const std::vector<std::string>& warnings, const OpenHistory& open) {
  for (const std::string& text : warnings) PrintError("warning: {}\n", open.named(text));
}

/// Reads a history and its findings; prints warnings.
std::pair<History, HistoryFindings> ReadFindings(const HistoryPlace& place) {
  History history;
  HistoryFindings found;
  ReadPlace(place, [&](const OpenHistory& open) {
    history = ReadHistory(open.folder);
    found = FindingsOf(history);
    for (const std::vector<std::string>& warnings : {history.warnings, found.warnings}) {
      PrintWarnings(warnings, open);
    }
  });
  return {history, found};
}

HistoryFindings Chosen(HistoryFindings found, const HistoryShowCommand& command) {
  const auto is_other = [&command](const auto& row) {
    return row.one.find(command.one) == std::string::npos ||
           row.measure.find(command.measure) == std::string::npos;
  };
  const bool has_any = !found.series.empty();
  std::erase_if(found.series, is_other);
  std::erase_if(found.endings, is_other);
  if (has_any && found.series.empty() && found.endings.empty()) {
    throw ConfigError(
        fmt::format("found no series with \"{}\" in its case and \"{}\" in its measure",
                    command.one, command.measure));
  }
  return found;
}

Table CommitTable(const History& history) {
  Table table;
  table.title = "Last commits";
  table.columns = {{"commit", "commit"},
                   {"date", "date"},
                   {"machine", "machine"},
                   {"mark", "mark"},
                   {"note", "note"}};
  constexpr std::size_t kLastShown = 10;
  const std::size_t n = history.entries.size();
  for (std::size_t i = n > kLastShown ? n - kLastShown : 0; i < n; ++i) {
    const HistoryEntry& entry = history.entries[i];
    AddRow({ShortCommit(entry.commit), entry.date, entry.machine, entry.mark, entry.note}, &table);
  }
  if (n > kLastShown) table.notes.push_back(fmt::format("{} earlier ones", n - kLastShown));
  return table;
}

JsonObject FindingsDocument(const History& history, const HistoryFindings& found) {
  std::vector<JsonObject> all, endings;
  for (const EndingChange& change : found.endings) {
    endings.push_back(JsonObject()
                          .Add("machine", change.machine)
                          .Add("case", change.one)
                          .Add("measure", change.measure)
                          .Add("commit", history.entries[change.entry].commit)
                          .Add("before", change.before)
                          .Add("after", change.after));
  }
  for (const HistorySeries& one : found.series) {
    std::vector<std::string> commits, unsteady;
    std::vector<double> values;
    for (const HistoryValue& value : one.values) {
      commits.push_back(history.entries[value.entry].commit);
      values.push_back(value.value);
      if (!value.is_steady) unsteady.push_back(commits.back());
    }
    std::vector<JsonObject> steps;
    for (const LevelChange& change : one.changes) {
      steps.push_back(JsonObject()
                          .Add("commit", commits[change.at])
                          .Add("before", change.before)
                          .Add("after", change.after)
                          .Add("confidence", change.Confidence()));
    }
    all.push_back(JsonObject()
                      .Add("machine", one.machine)
                      .Add("case", one.one)
                      .Add("measure", one.measure)
                      .Add("unit", one.unit)
                      .Add("commits", commits)
                      .Add("values", values)
                      .Add("at_another_speed", unsteady)
                      .Add("change_points", steps));
  }
  return JsonObject().Add("series", all).Add("endings", endings);
}

int HistoryAdd(const HistoryPlace& place, const HistoryAddCommand& command) {
  std::vector<std::string> warnings;
  const std::vector<Record> records = ReadMeasurements(command.results, &warnings);
  for (const std::string& warning : warnings) PrintError("warning: {}\n", warning);
  HistoryEntry entry;
  entry.commit = command.commit;
  entry.date = command.date;
  if (entry.commit.empty() || entry.date.empty()) {
    const CheckedOut found = FindCommit(entry.commit.empty() ? "HEAD" : entry.commit);
    if (found.commit.empty()) {
      throw ConfigError(
          "history add: found no such commit in a git repository here, expected --commit "
          "and --date");
    }
    entry.commit = found.commit;
    if (entry.date.empty()) entry.date = found.date;
  }
  HistoryEntry added;
  ChangePlace(place, /*may_begin=*/true, [&](const OpenHistory& open) {
    std::vector<std::string> torn;
    added = AddToHistory(open.folder, entry, records, command.replaces, &torn);
    PrintWarnings(torn, open);
    return "Measurements of " + ShortCommit(entry.commit);
  });
  Print("added {} records of commit {} ({}) on {}\n", records.size(), ShortCommit(added.commit),
        added.date, added.machine);
  return 0;
}

/// Prints steps, newest first, and the commits. Returns 0.
int HistoryShow(const HistoryPlace& place, const HistoryShowCommand& command,
                const std::string& typed) {
  const auto [history, all] = ReadFindings(place);
  const HistoryFindings found = Chosen(all, command);
  if (command.json) {
    PrintText(FindingsDocument(history, found).Text() + "\n");
    return 0;
  }
  Table steps = StepTable(history, found);
  if (command.format != "text") {
    for (const std::string& line : Provenance(typed)) steps.notes.push_back(line);
    PrintText(Render(steps, command.format));
    return 0;
  }
  if (steps.rows.empty()) {
    Print("no steps in {} series over {} entries\n", found.series.size(), history.entries.size());
    if (const auto note = UnsteadyNote(found)) Print("{}\n", *note);
    Print("\n");
  } else {
    PrintText(ToScreen(steps) + "\n");
  }
  PrintText(ToScreen(CommitTable(history)) + "\n");
  return 0;
}

int HistoryReport(const HistoryPlace& place, const HistoryReportCommand& command,
                  const std::string& typed) {
  const auto [history, found] = ReadFindings(place);
  const std::string page = HistoryPage(history, found, command.title, Provenance(typed));
  const auto out = !command.out.empty()  ? command.out
                   : place.store.empty() ? std::filesystem::path("history.html")
                                         : place.store / "history.html";
  WriteFileAtomically(out, page);
  Print("wrote {}: {} series over {} entries, {} steps, {} kB\n", out.string(), found.series.size(),
        history.entries.size(), found.Steps(), (page.size() + 999) / 1000);
  return 0;
}

int HistoryMark(const HistoryPlace& place, const Mark& wanted) {
  Mark mark;
  ChangePlace(place, /*may_begin=*/false, [&](const OpenHistory& open) {
    std::vector<std::string> torn;
    mark = MarkInHistory(open.folder, wanted, &torn);
    PrintWarnings(torn, open);
    return fmt::format("{} is {}", ShortCommit(mark.commit), mark.mark);
  });
  Print("{} is {}\n", mark.commit, mark.mark);
  return 0;
}

}  // namespace

std::vector<Record> LastGoodRecords(const HistoryPlace& place, const std::string& machine,
                                    bool only_times, std::string* name) {
  std::vector<Record> records;
  ReadPlace(place, [&](const OpenHistory& open) {
    const History history = ReadHistory(open.folder);
    const std::optional<HistoryEntry> good =
        only_times ? LastGoodOfMachine(history, machine) : LastGood(history, machine);
    if (!good) {
      throw ConfigError(
          fmt::format("{}: found {}, expected a good one", open.folder.string(),
                      history.entries.empty() ? "no commit" : "every commit marked bad"));
    }
    *name = fmt::format("BASE: the history's last good state, commit {} of {}{}",
                        ShortCommit(good->commit), good->date,
                        good->mark.empty() ? "" : fmt::format(", marked {}", good->mark));
    std::vector<std::string> warnings = history.warnings;
    records = ReadResults(*good, &warnings);
    PrintWarnings(warnings, open);
  });
  return records;
}

void AddHistory(Commands& commands) {
  auto& place = commands.Keep<HistoryPlace>();
  auto& add = commands.Keep<HistoryAddCommand>();
  auto& show = commands.Keep<HistoryShowCommand>();
  auto& report = commands.Keep<HistoryReportCommand>();
  auto& mark = commands.Keep<Mark>();
  const Option store = {"--store", "Folder of the history", &place.store};
  const Option branch = {"--branch", "Git branch that contains the history, instead of a folder",
                         &place.branch, Excludes({"--store"})};
  commands.Add("history", "Follow measurements over commits and find change points");
  commands.Add(
      "history add", "Add the results of a commit",
      [&](const Typed&) { return HistoryAdd(place, add); },
      {{"results", "Folder of a run, .jsonl, or JSON of Google Benchmark", &add.results, kRequired},
       {"--commit", "Commit of the results (default: the one checked out)", &add.commit},
       {"--date", "ISO 8601 date that orders commits (default: the commit's)", &add.date},
       {"--replace", "Replace an earlier measurement of this commit", &add.replaces},
       store,
       branch});
  commands.Add("history show", "List change points and recent commits",
               [&](const Typed& typed) { return HistoryShow(place, show, typed.line); },
               {{"--case", "Only cases whose name contains this text", &show.one},
                {"--measure", "Only measures whose name contains this text", &show.measure},
                FormatOption(&show.format, {"text", "csv", "markdown", "json"}),
                store,
                branch,
                JsonOption(&show.json),
                WideOption()});
  commands.Add("history report", "Write an HTML page with all change points and charts",
               [&](const Typed& typed) { return HistoryReport(place, report, typed.line); },
               {{"-o,--out", "Output file (default: history.html in the folder)", &report.out},
                {"--title", "Page title", &report.title},
                store,
                branch});
  commands.Add("history mark", "Mark a commit as good, bad or accepted",
               [&](const Typed&) { return HistoryMark(place, mark); },
               {{"commit", "Commit hash or prefix", &mark.commit, kRequired},
                {"mark", "good and accepted: valid base of comparisons; bad: never a base",
                 &mark.mark, kRequired, OneOf({"good", "accepted", "bad"})},
                {"--note", "Reason, stored with the mark", &mark.note},
                {"--keep-accepted", "Keep an existing mark 'accepted' (for automatic jobs)",
                 &mark.keeps_accepted},
                store,
                branch});
}

}  // namespace loopbench::harness
