#include "harness/history/history.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "harness/judge/track.h"
#include "harness/record/measures.h"
#include "harness/record/origin.h"
#include "harness/record/record_json.h"
#include "harness/store/result_store.h"
#include "harness/text/config_error.h"
#include "harness/text/escape.h"
#include "harness/text/files.h"
#include "harness/text/hash.h"

namespace loopbench::harness {
namespace {

constexpr const char* kFile = "history.jsonl";

/// Without the series of a run: those of samples of times stay.
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

/// 2026-11-24, or 2026-11-24T09:30:00Z: dates in UTC are in order as texts.
bool IsDate(const std::string& text) {
  constexpr std::string_view kPattern = "dddd-dd-ddTdd:dd:ddZ";
  if (text.size() != 10 && text.size() != kPattern.size()) return false;
  return std::ranges::equal(text, kPattern.substr(0, text.size()), [](char found, char wanted) {
    return wanted == 'd' ? found >= '0' && found <= '9' : found == wanted;
  });
}

std::filesystem::path FileOf(const std::filesystem::path& folder) { return folder / kFile; }

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
  HistoryEntry entry{line.Text("commit"),
                     line.Text("date"),
                     line.Text("machine"),
                     folder / line.Text("results"),
                     "",
                     ""};
  const auto same = std::ranges::find_if(entries, [&entry](const HistoryEntry& one) {
    return one.commit == entry.commit && one.machine == entry.machine;
  });
  if (same == entries.end()) {
    entries.push_back(std::move(entry));
  } else {
    *same = std::move(entry);  // measured again
  }
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
  for (const Record& line : ReadRecords(FileOf(folder))) Apply(line, folder, &history);
  std::ranges::stable_sort(history.entries, {}, &HistoryEntry::date);
  return history;
}

HistoryEntry AddToHistory(const std::filesystem::path& folder, HistoryEntry entry,
                          const std::vector<Record>& records, bool replaces) {
  if (TrackRecords(records).values.empty()) {
    throw ConfigError("found no record that finished with a measure, expected one to follow");
  }
  if (!IsDate(entry.date)) {
    throw ConfigError(fmt::format(
        "date of commit {}: found \"{}\", expected one in UTC, 2026-11-24 or 2026-11-24T09:30:00Z",
        entry.commit, entry.date));
  }
  entry.machine = MachineOf(records);
  entry.results =
      "results/" + FileName(entry.commit + "-" + Fnv1a(entry.machine).substr(0, 6) + ".jsonl");
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
  std::string text;
  for (const Record& record : records) text += ToJsonLine(Slim(record)) + '\n';
  MakeFolderOf(folder / entry.results);
  WriteFileAtomically(folder / entry.results, text);
  Record line;
  line.Set("kind", std::string("commit"));
  line.Set("commit", entry.commit);
  line.Set("date", entry.date);
  line.Set("machine", entry.machine);
  line.Set("results", entry.results.string());
  lines.Append(line);
  entry.results = folder / entry.results;
  return entry;
}

std::string MarkInHistory(const std::filesystem::path& folder, const std::string& commit,
                          const std::string& mark, const std::string& note) {
  const History history = ReadHistory(folder);
  std::set<std::string> found;
  for (const HistoryEntry& entry : history.entries) {
    if (entry.commit.starts_with(commit)) found.insert(entry.commit);
  }
  if (found.size() != 1) {
    throw ConfigError(fmt::format(
        "{}: found {} commits that begin with \"{}\"{}, expected one", folder.string(),
        found.size(), commit, found.empty() ? "" : fmt::format(" ({})", fmt::join(found, ", "))));
  }
  Record line;
  line.Set("kind", std::string("mark"));
  line.Set("commit", *found.begin());
  line.Set("mark", mark);
  line.Set("note", note);
  ResultStore(FileOf(folder), /*waits=*/true).Append(line);
  return *found.begin();
}

std::optional<HistoryEntry> LastGood(const History& history, const std::string& machine) {
  const bool knows_machine = std::ranges::any_of(
      history.entries, [&machine](const HistoryEntry& one) { return one.machine == machine; });
  std::optional<HistoryEntry> good, last;
  for (const HistoryEntry& entry : history.entries) {
    if (knows_machine && entry.machine != machine) continue;
    if (entry.mark == "good" || entry.mark == "accepted") good = entry;
    if (entry.mark != "bad") last = entry;
  }
  return good ? good : last;
}

}  // namespace loopbench::harness
