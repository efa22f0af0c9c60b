#include "harness/history/history_steps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

namespace loopbench::harness {
namespace {

/// A level as a cell: counts with all their digits.
Value LevelOf(const HistorySeries& series, double level) {
  const bool is_whole = series.rule == Rule::kCount && level == std::floor(level) && level < 1e15;
  return is_whole ? Value(static_cast<std::int64_t>(level)) : Value(level);
}

}  // namespace

Table StepTable(const History& history, const HistoryFindings& found) {
  Table table;
  table.title = "Steps";
  table.columns = {{"commit", "first commit"},
                   {"date", "date"},
                   {"case", "case"},
                   {"measure", "measure"},
                   {"before", "before", Format::kSeconds},
                   {"after", "after", Format::kSeconds},
                   {"ratio", "ratio", Format::kSeconds},
                   {"confidence", "confidence", Format::kSeconds}};
  std::vector<std::pair<std::size_t, std::vector<Value>>> rows;
  const auto add = [&](std::size_t place, const std::string& one, const std::string& measure,
                       std::vector<Value> rest) {
    const HistoryEntry& entry = history.entries[place];
    std::vector<Value> row = {ShortCommit(entry.commit), entry.date, one, measure};
    row.insert(row.end(), rest.begin(), rest.end());
    rows.push_back({place, std::move(row)});
  };
  for (const EndingChange& change : found.endings) {
    add(change.entry, change.one, change.measure, {change.before, change.after, {}, {}});
  }
  for (const HistorySeries& one : found.series) {
    for (const LevelChange& change : one.changes) {
      add(one.values[change.at].entry, one.one, one.measure,
          {LevelOf(one, change.before), LevelOf(one, change.after),
           change.before > 0.0 ? Value(change.after / change.before) : Value(),
           change.Confidence()});
    }
  }
  std::ranges::stable_sort(rows, std::greater<>(), [](const auto& row) { return row.first; });
  for (const auto& [place, row] : rows) AddRow(row, &table);
  table.notes.push_back(
      fmt::format("{} series over {} entries; confidence: 1 less the number of such steps that "
                  "the noise of all series together would show, at most {}",
                  found.series.size(), history.entries.size(), kFalseAlarms));
  if (const auto note = UnsteadyNote(found)) table.notes.push_back(*note);
  return table;
}

std::optional<std::string> UnsteadyNote(const HistoryFindings& found) {
  std::size_t times = 0, unsteady = 0;
  for (const HistorySeries& one : found.series) {
    unsteady += one.Unsteady();
    times += one.rule == Rule::kTime && one.one != kAllCases ? one.values.size() : 0;
  }
  if (unsteady == 0) return std::nullopt;
  return fmt::format(
      "{} of {} times decide nothing: the machine had another speed than usual (yardstick_ns)",
      unsteady, times);
}

}  // namespace loopbench::harness
