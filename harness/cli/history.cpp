// history: measurements of successive commits.
#include "harness/cli/commands.h"

namespace loopbench::harness {
namespace {

/// Options of all subcommands.
struct PlaceOptions {
  HistoryPlace place;

  std::vector<Option> With(std::vector<Option> options) {
    options.insert(options.end(),
                   {{"--store", "Folder of the history", &place.store},
                    {"--branch", "Git branch that contains the history, instead of a folder",
                     &place.branch, Excludes({"--store"})}});
    return options;
  }
};

struct HistoryAddCommand : PlaceOptions {
  std::filesystem::path results;
  std::string commit, date;
  bool replaces = false;

  std::vector<Option> Options() {
    return With(
        {{"results", "Folder of a run, .jsonl, or JSON of Google Benchmark", &results, kRequired},
         {"--commit", "Commit of the results (default: the one checked out)", &commit},
         {"--date", "ISO 8601 date that orders commits (default: the commit's)", &date},
         {"--replace", "Replace an earlier measurement of this commit", &replaces}});
  }
};

struct HistoryShowCommand : PlaceOptions {
  std::string one, measure;
  std::string format = "text";
  bool json = false;

  std::vector<Option> Options() {
    std::vector<Option> options =
        With({{"--case", "Only cases whose name contains this text", &one},
              {"--measure", "Only measures whose name contains this text", &measure},
              FormatOption(&format, {"text", "csv", "markdown", "json"})});
    options.insert(options.end(), {JsonOption(&json), WideOption()});
    return options;
  }
};

struct HistoryReportCommand : PlaceOptions {
  std::filesystem::path out;
  std::string title = "Measurements over commits";

  std::vector<Option> Options() {
    return With({{"-o,--out", "Output file (default: history.html in the folder)", &out},
                 {"--title", "Page title", &title}});
  }
};

struct HistoryMarkCommand : PlaceOptions {
  Mark mark;

  std::vector<Option> Options() {
    return With({{"commit", "Commit hash or prefix", &mark.commit, kRequired},
                 {"mark", "good and accepted: valid base of comparisons; bad: never a base",
                  &mark.mark, kRequired, OneOf({"good", "accepted", "bad"})},
                 {"--note", "Reason, stored with the mark", &mark.note},
                 {"--keep-accepted", "Keep an existing mark 'accepted' (for automatic jobs)",
                  &mark.keeps_accepted}});
  }
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
    Reject("found no series with \"{}\" in its case and \"{}\" in its measure", command.one,
           command.measure);
  }
  return found;
}

JsonObject FindingsDocument(const History& history, const HistoryFindings& found) {
  std::vector<JsonObject> all, endings;
  for (const EndingChange& change : found.endings) {
    endings.push_back(JsonOf("machine", change.machine, "case", change.one, "measure",
                             change.measure, "commit", history.entries[change.entry].commit,
                             "before", change.before, "after", change.after));
  }
  for (const HistorySeries& one : found.series) {
    std::vector<std::string> commits, unsteady;
    std::vector<double> values;
    for (const HistoryValue& value : one.values) {
      commits.push_back(history.entries[value.entry].commit);
      values.push_back(value.value);
      if (!value.is_steady) unsteady.push_back(commits.back());
    }
    std::vector<JsonObject> steps = Mapped<JsonObject>(one.changes, [&](const LevelChange& change) {
      return JsonOf("commit", commits[change.at], "before", change.before, "after", change.after,
                    "confidence", change.Confidence());
    });
    all.push_back(JsonOf("machine", one.machine, "case", one.one, "measure", one.measure, "unit",
                         one.unit, "commits", commits, "values", values, "at_another_speed",
                         unsteady, "change_points", steps));
  }
  return JsonOf("series", all, "endings", endings);
}

int HistoryAdd(const HistoryAddCommand& command, const Typed&) {
  const std::vector<Record> records = LoadMeasurements(command.results);
  HistoryEntry entry;
  entry.commit = command.commit;
  entry.date = command.date;
  if (entry.commit.empty() || entry.date.empty()) {
    const CheckedOut found = FindCommit(entry.commit.empty() ? "HEAD" : entry.commit);
    if (found.commit.empty()) {
      Reject(
          "history add: found no such commit in a git repository here, expected --commit and "
          "--date");
    }
    entry.commit = found.commit;
    if (entry.date.empty()) entry.date = found.date;
  }
  HistoryEntry added;
  ChangePlace(command.place, /*may_begin=*/true, [&](const OpenHistory& open) {
    std::vector<std::string> torn;
    added = AddToHistory(open.folder, entry, records, command.replaces, &torn);
    PrintWarnings(torn, open);
    return "Measurements of " + ShortCommit(entry.commit);
  });
  Print("added {} of commit {} ({}) on {}\n", WithCount(records.size(), "record"),
        ShortCommit(added.commit), added.date, added.machine);
  return 0;
}

int HistoryShow(const HistoryShowCommand& command, const Typed& typed) {
  const auto [history, all] = ReadFindings(command.place);
  const HistoryFindings found = Chosen(all, command);
  if (command.json) return PrintJson(FindingsDocument(history, found));
  Table steps = StepTable(history, found);
  if (command.format != "text") {
    PrintText(Render(WithProvenance(std::move(steps), typed.line), command.format));
    return 0;
  }
  if (steps.rows.empty()) {
    Print("no steps in {} series over {} entries\n", found.series.size(), history.entries.size());
    if (const auto note = UnsteadyNote(found)) Print("{}\n", *note);
    Print("\n");
  } else {
    PrintText(ToScreen(steps) + "\n");
  }
  Table commits{.title = "Last commits", .columns = Columns("commit, date, machine, mark, note")};
  constexpr std::size_t kLastShown = 10;
  const std::size_t n = history.entries.size(), first = n > kLastShown ? n - kLastShown : 0;
  for (const HistoryEntry& entry : history.entries | std::views::drop(first)) {
    AddRow({ShortCommit(entry.commit), entry.date, entry.machine, entry.mark, entry.note},
           &commits);
  }
  if (first > 0) AddNote(commits.notes, "{} earlier ones", first);
  PrintText(ToScreen(commits) + "\n");
  return 0;
}

int HistoryReport(const HistoryReportCommand& command, const Typed& typed) {
  const auto [history, found] = ReadFindings(command.place);
  const std::string page = HistoryPage(history, found, command.title, Provenance(typed.line));
  const auto out = command.out.empty() ? command.place.store / "history.html" : command.out;
  WriteFileAtomically(out, page);
  Print("wrote {}: {} series over {}, {}, {} kB\n", out.string(), found.series.size(),
        WithCount(history.entries.size(), "entry"), WithCount(found.Steps(), "step"),
        (page.size() + 999) / 1000);
  return 0;
}

int HistoryMark(const HistoryMarkCommand& command, const Typed&) {
  Mark mark;
  ChangePlace(command.place, /*may_begin=*/false, [&](const OpenHistory& open) {
    std::vector<std::string> torn;
    mark = MarkInHistory(open.folder, command.mark, &torn);
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
      Reject("{}: found {}, expected a good one", open.folder.string(),
             history.entries.empty() ? "no commit" : "every commit marked bad");
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
  commands.Add({"history", "Follow measurements over commits and find change points"});
  commands.Add("history add", "Add the results of a commit", HistoryAdd);
  commands.Add("history show", "List change points and recent commits", HistoryShow);
  commands.Add("history report", "Write an HTML page with all change points and charts",
               HistoryReport);
  commands.Add("history mark", "Mark a commit as good, bad or accepted", HistoryMark);
}

}  // namespace loopbench::harness
