#include "harness/history/history.h"

#include <fmt/ranges.h>

#include <cstdlib>
#include <set>

#include "harness/base/record.h"
#include "harness/base/store.h"
#include "harness/base/text.h"

namespace loopbench::harness {
namespace {

constexpr const char* kFile = "history.jsonl";
constexpr const char* kAccepted = "accepted";

/// Returns a record without the time series of its run, but with samples of times.
Record Slim(const Record& record) {
  Record slim;
  for (const auto& [key, value] : record.items()) {
    const Measure* measure = FindMeasure(key);
    const bool is_sample = measure != nullptr && measure->rule == Rule::kTime;
    if (std::holds_alternative<std::vector<double>>(value) && !is_sample) continue;
    slim.Set(key, value);
  }
  return slim;
}

std::string MachineOf(const std::vector<Record>& records) {
  std::set<std::string> machines;
  for (const Record& record : records) machines.insert(OriginOf(record).machine);
  if (machines.size() != 1 || machines.begin()->empty()) {
    throw ConfigError(fmt::format("found results of {}, expected those of one machine",
                                  machines.size() == 1
                                      ? std::string("an unknown machine")
                                      : fmt::format("\"{}\"", fmt::join(machines, "\", \""))));
  }
  return *machines.begin();
}

/// Accepts 2026-11-24 or 2026-11-24T09:30:00Z: UTC dates sort as text.
bool IsDate(const std::string& text) {
  constexpr std::string_view kPattern = "dddd-dd-ddTdd:dd:ddZ";
  if (text.size() != 10 && text.size() != kPattern.size()) return false;
  const auto fits = [](char found, char wanted) {
    return wanted == 'd' ? found >= '0' && found <= '9' : found == wanted;
  };
  if (!std::ranges::equal(text, kPattern.substr(0, text.size()), fits)) return false;
  const auto number = [&text](std::size_t at, std::size_t digits) {
    return at < text.size() ? std::atoi(text.substr(at, digits).c_str()) : 0;
  };
  const std::chrono::year_month_day day(std::chrono::year(number(0, 4)),
                                        std::chrono::month(static_cast<unsigned>(number(5, 2))),
                                        std::chrono::day(static_cast<unsigned>(number(8, 2))));
  return day.ok() && number(11, 2) < 24 && number(14, 2) < 60 && number(17, 2) < 60;
}

std::filesystem::path FileOf(const std::filesystem::path& folder) { return folder / kFile; }

/// Returns a results file by its name in a line. Rejects names outside of the history.
std::filesystem::path ResultsIn(const std::filesystem::path& folder, const std::string& name) {
  const std::filesystem::path path = name, whole = std::filesystem::weakly_canonical(folder);
  const std::filesystem::path end = std::filesystem::weakly_canonical(folder / path);
  const bool is_within = std::ranges::mismatch(whole, end).in1 == whole.end() && whole != end;
  if (path.is_relative() && !Contains(path, "..") && is_within) return folder / path;
  throw ConfigError(fmt::format("{}: \"results\": found \"{}\", expected a path within the history",
                                FileOf(folder).string(), name));
}

void Apply(const Record& line, const std::filesystem::path& folder, History* history) {
  auto& entries = history->entries;
  if (line.Text("kind") == "mark") {
    for (HistoryEntry& entry : entries) {
      if (entry.commit != line.Text("commit")) continue;
      entry.mark = line.Text("mark");
      entry.note = line.Text("note");
    }
    return;
  }
  if (line.Text("kind") != "commit" || line.Text("commit").empty()) {
    throw ConfigError(fmt::format("{}: found a line of kind \"{}\", expected commit or mark",
                                  FileOf(folder).string(), line.Text("kind")));
  }
  for (const char* key : {"date", "machine", "results"}) {
    if (!line.Text(key).empty()) continue;
    throw ConfigError(fmt::format("{}: commit {}: \"{}\": found nothing, expected a text",
                                  FileOf(folder).string(), line.Text("commit"), key));
  }
  HistoryEntry entry{line.Text("commit"), line.Text("date"), line.Text("machine"),
                     ResultsIn(folder, line.Text("results"))};
  const auto same = std::ranges::find_if(entries, [&entry](const HistoryEntry& one) {
    return one.commit == entry.commit && one.machine == entry.machine;
  });
  if (same == entries.end()) {
    entries.push_back(std::move(entry));
    return;
  }
  if (same->mark == kAccepted) {  // measured again: the user's mark remains
    entry.mark = same->mark;
    entry.note = same->note;
  }
  *same = std::move(entry);
}

/// Returns an unused file name, since earlier lines refer to existing files.
std::filesystem::path NewResults(const std::filesystem::path& folder, const HistoryEntry& entry) {
  const std::string stem = FileName(entry.commit + "-" + Fnv1a(entry.machine).substr(0, 6));
  std::filesystem::path results = "results/" + stem + ".jsonl";
  for (int i = 2; std::filesystem::exists(folder / results); ++i) {
    results = fmt::format("results/{}-{}.jsonl", stem, i);
  }
  return results;
}

/// Returns a line of the history with these texts.
Record LineOf(const std::string& kind,
              const std::vector<std::pair<std::string, std::string>>& texts) {
  Record line;
  line.Set("kind", kind);
  for (const auto& [key, text] : texts) line.Set(key, text);
  return line;
}

void RequireSomethingToFollow(const HistoryEntry& entry, const std::vector<Record>& records) {
  const auto has_ended = [](const Record& record) { return !record.Text("outcome").empty(); };
  if (std::ranges::none_of(records, has_ended)) {
    throw ConfigError("found no record with an outcome, expected one to follow");
  }
  if (!IsDate(entry.date)) {
    throw ConfigError(fmt::format(
        "date of commit {}: found \"{}\", expected one in UTC, 2026-11-24 or 2026-11-24T09:30:00Z",
        entry.commit, entry.date));
  }
}

/// Returns the commit with this name, or the only one with this prefix.
std::string CommitNamed(const History& history, const std::string& name,
                        const std::filesystem::path& folder) {
  const auto begins_so = [&name](const std::string& commit) {
    // not within a UTF-8 character
    return !name.empty() && commit.starts_with(name) &&
           !ContinuesCharacter(commit.c_str()[name.size()]);
  };
  std::set<std::string> found;
  for (const HistoryEntry& entry : history.entries) {
    if (entry.commit == name) return name;
    if (begins_so(entry.commit)) found.insert(entry.commit);
  }
  if (found.size() == 1) return *found.begin();
  throw ConfigError(fmt::format("{}: found {} commits that begin with \"{}\"{}, expected one",
                                folder.string(), found.size(), name,
                                found.empty() ? "" : fmt::format(" ({})", fmt::join(found, ", "))));
}

bool IsMarkedGood(const HistoryEntry& entry) {
  return entry.mark == "good" || entry.mark == kAccepted;
}

bool IsNotBad(const HistoryEntry& entry) { return entry.mark != "bad"; }

/// Returns the last such entry of a machine, of any machine if it is "".
std::optional<HistoryEntry> Last(const History& history, bool (*is_such)(const HistoryEntry&),
                                 const std::string& machine = "") {
  std::optional<HistoryEntry> last;
  for (const HistoryEntry& entry : history.entries) {
    if (is_such(entry) && (machine.empty() || entry.machine == machine)) last = entry;
  }
  return last;
}

}  // namespace

std::string ShortCommit(const std::string& commit) {
  const bool is_hash =
      commit.size() >= 40 && commit.find_first_not_of("0123456789abcdef") == std::string::npos;
  return is_hash ? commit.substr(0, 12) : commit;
}

History ReadHistory(const std::filesystem::path& folder) {
  if (!std::filesystem::exists(FileOf(folder))) {
    throw ConfigError(
        fmt::format("{}: no such file, expected a history; the first commit is added "
                    "by loopbench history add",
                    FileOf(folder).string()));
  }
  History history;
  for (const Record& line : ReadRecords(FileOf(folder), &history.warnings)) {
    Apply(line, folder, &history);
  }
  std::ranges::stable_sort(history.entries, {}, &HistoryEntry::date);
  return history;
}

std::vector<Record> ReadResults(const HistoryEntry& entry, std::vector<std::string>* warnings) {
  // with any file name: names once had their ending in the middle
  std::vector<Record> records;
  LineReader reader(entry.results, [&records](Record record, const LinePlace&) {
    records.push_back(std::move(record));
  });
  reader.Feed(ReadFile(entry.results));
  reader.End();
  if (!reader.warning().empty()) warnings->push_back(reader.warning());
  if (records.empty()) {
    throw ConfigError(fmt::format("{}: found no record, expected the results of commit {}",
                                  entry.results.string(), entry.commit));
  }
  records = LatestRecords(records);
  SortRows(&records);
  return records;
}

HistoryEntry AddToHistory(const std::filesystem::path& folder, HistoryEntry entry,
                          const std::vector<Record>& records, bool replaces,
                          std::vector<std::string>* warnings) {
  RequireSomethingToFollow(entry, records);
  entry.machine = MachineOf(records);
  if (warnings != nullptr && std::filesystem::exists(FileOf(folder))) {
    *warnings = ReadHistory(folder).warnings;  // before the store removes the incomplete line
  }
  ResultStore lines(FileOf(folder), /*waits=*/true);  // one writer at a time
  const History history = ReadHistory(folder);
  const bool is_there = std::ranges::any_of(history.entries, [&entry](const HistoryEntry& one) {
    return one.commit == entry.commit && one.machine == entry.machine;
  });
  if (is_there && !replaces) {
    throw ConfigError(fmt::format(
        "{}: found commit {} on this machine, expected another one; --replace takes the new "
        "measurements in its place",
        folder.string(), entry.commit));
  }
  entry.results = NewResults(folder, entry);
  std::string text;
  for (const Record& record : records) text += ToJsonLine(Slim(record)) + '\n';
  WriteFileAtomically(ResultsIn(folder, entry.results.string()), text);
  const Record line = LineOf("commit", {{"commit", entry.commit},
                                        {"date", entry.date},
                                        {"machine", entry.machine},
                                        {"results", entry.results.string()}});
  entry.results = folder / entry.results;
  try {
    lines.Append(line);
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove(entry.results, ignored);
    throw;
  }
  return entry;
}

Mark MarkInHistory(const std::filesystem::path& folder, Mark mark,
                   std::vector<std::string>* warnings) {
  History history = ReadHistory(folder);  // throws if there is no history: marks create none
  if (warnings != nullptr) *warnings = history.warnings;
  mark.commit = CommitNamed(history, mark.commit, folder);
  ResultStore lines(FileOf(folder), /*waits=*/true);
  history = ReadHistory(folder);
  if (mark.keeps_accepted) {
    for (const HistoryEntry& entry : history.entries) {
      if (entry.commit != mark.commit || entry.mark != kAccepted) continue;
      mark.mark = entry.mark;
      mark.note = entry.note;
      return mark;
    }
  }
  lines.Append(LineOf("mark", {{"commit", mark.commit}, {"mark", mark.mark}, {"note", mark.note}}));
  return mark;
}

std::optional<HistoryEntry> LastGood(const History& history, const std::string& machine) {
  std::optional<HistoryEntry> good = Last(history, IsMarkedGood, machine);
  if (good) {
    bool is_behind = false;
    for (const HistoryEntry& entry : history.entries) {
      if (is_behind && entry.mark == kAccepted) good = entry;
      is_behind |= entry.commit == good->commit && entry.machine == machine;
    }
  }
  if (!good) good = Last(history, IsMarkedGood);
  if (!good) good = Last(history, IsNotBad, machine);
  if (!good) good = Last(history, IsNotBad);
  for (const HistoryEntry& entry : history.entries) {
    if (good && entry.commit == good->commit && entry.machine == machine) good = entry;
  }
  return good;
}

std::optional<HistoryEntry> LastGoodOfMachine(const History& history, const std::string& machine) {
  std::optional<HistoryEntry> good = Last(history, IsMarkedGood, machine);
  if (!good) good = Last(history, IsNotBad, machine);
  return good ? good : LastGood(history, machine);
}

}  // namespace loopbench::harness
