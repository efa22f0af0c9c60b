#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <tuple>

#include "harness/base/record.h"
#include "harness/history/history.h"
#include "harness/judge/judge.h"

namespace loopbench::harness {
namespace {

/// Returns the minimum change for each kind of measure, as in `compare` (judge.h). The assumed
/// noise of constant series is a third of this change, so that a single such value is just no
/// outlier.
/// @param most  largest value of the series
Resolution ResolutionOf(Rule rule, double most, double places) {
  switch (rule) {
    case Rule::kTime:
      // below the 2 % that one comparison of two runs can detect: many runs detect more
      return {.noise = 0.002, .least = 0.01, .places = places};
    case Rule::kInstructions:
      return {.noise = std::log(1.02) / 3.0, .least = std::log(1.02), .places = places};
    case Rule::kCount: {
      // any change: half of one count, if logarithms can resolve it
      const double least = std::max(0.5 * std::log1p(1.0 / std::max(most, 1.0)), 1e-13);
      return {.noise = least / 3.0, .least = least, .places = places};
    }
    default:
      return {.noise = std::log(1.05) / 3.0, .least = std::log(1.05), .places = places};
  }
}

/// The common variation is removed from a series if this reduces its noise to less than this share.
constexpr double kQuieter = 0.7;

/// Errors below are round-off and equal (CompareOptions::error_floor).
constexpr double kErrorFloor = 1e-11;

Rule RuleOfTracked(const std::string& measure) {
  for (const std::string& key : {measure, "series." + measure}) {
    const Measure* row = FindMeasure(key);
    if (row != nullptr && row->rule != Rule::kNone) return row->rule;
  }
  return Rule::kNone;
}

/// Returns NaN if no value is steady.
double MedianOfSteady(const HistorySeries& series) {
  std::vector<HistoryValue> steady = series.values;
  std::erase_if(steady, [](const HistoryValue& one) { return !one.is_steady; });
  return Median(Mapped<double>(steady, &HistoryValue::value));
}

/// @param cases  series with medians above 0
HistorySeries Pooled(const std::vector<const HistorySeries*>& cases) {
  HistorySeries pooled{.machine = cases.front()->machine,
                       .one = kAllCases,
                       .measure = cases.front()->measure,
                       .unit = "of the median",
                       .rule = Rule::kTime};
  std::map<std::size_t, std::vector<double>> ratios;
  for (const HistorySeries* one : cases) {
    const double usual = MedianOfSteady(*one);
    for (const HistoryValue& value : one->values) {
      if (value.is_steady) ratios[value.entry].push_back(value.value / usual);
    }
  }
  for (const auto& [entry, values] : ratios) {
    const double middle = Median(values);
    if (!(middle > 0.0)) continue;  // a clock without progress
    pooled.values.push_back({.entry = entry, .value = middle, .upper = middle});
  }
  return pooled;
}

using Key = std::tuple<std::string, std::string, std::string>;  ///< machine, case, measure

void AddValues(const std::string& machine, std::size_t entry, const std::vector<Record>& records,
               std::map<Key, std::size_t>* places, std::vector<HistorySeries>* all) {
  for (const TrackedValue& value : TrackRecords(records).values) {
    const auto [at, is_new] =
        places->try_emplace({machine, value.benchmark, value.measure}, all->size());
    if (is_new) {
      all->push_back({.machine = machine,
                      .one = value.benchmark,
                      .measure = value.measure,
                      .unit = value.unit,
                      .rule = RuleOfTracked(value.measure)});
    }
    (*all)[at->second].values.push_back({entry, value.least, value.upper, value.calibration});
  }
}

/// Adds changes of outcomes and warnings; `last` has the latest ones.
void AddEndings(const std::string& machine, std::size_t entry, const std::vector<Record>& records,
                std::map<Key, std::string>* last, std::vector<EndingChange>* changes) {
  const std::set<std::string> repeated = RepeatedCases(records);  // ambiguous
  for (const Record& record : records) {
    const std::string one = CaseText(record);
    if (repeated.contains(one)) continue;
    for (const char* measure : {"outcome", "warnings"}) {
      if (record.Find(measure) == nullptr) continue;
      std::string now = record.Text(measure);
      const auto [at, is_new] = last->try_emplace({machine, one, measure}, now);
      if (!is_new && at->second != now) {
        changes->push_back({machine, one, measure, entry, at->second, now});
      }
      at->second = std::move(now);
    }
  }
}

/// Returns the lower bound of values, so that logarithms exist; NaN if the measure has no levels.
double FloorOf(const HistorySeries& series) {
  if (series.rule == Rule::kError) return kErrorFloor;
  if (series.rule == Rule::kCount || series.rule == Rule::kInstructions) {
    return 0.5;  // the step from 0 to 1 then equals the step from 1 to 2
  }
  double smallest = std::numeric_limits<double>::quiet_NaN();
  for (const HistoryValue& one : series.values) {
    if (one.value > 0.0) smallest = std::fmin(smallest, one.value);
  }
  return smallest;
}

/// Sets the levels before and after each change of `values`, as medians.
void SetLevels(std::span<const double> values, std::vector<LevelChange>* changes) {
  std::size_t begin = 0;
  for (std::size_t k = 0; k < changes->size(); ++k) {
    LevelChange& change = (*changes)[k];
    const std::size_t end = k + 1 < changes->size() ? (*changes)[k + 1].at : values.size();
    change.before = Median(values.subspan(begin, change.at - begin));
    change.after = Median(values.subspan(change.at, end - change.at));
    begin = change.at;
  }
}

/// Returns the logarithms of times minus their medians between changes.
std::vector<double> VariationOf(std::vector<double> x) {
  const auto places = static_cast<double>(x.size());
  std::vector<LevelChange> changes = FindChanges(x, ResolutionOf(Rule::kTime, 0.0, places));
  changes.push_back({x.size()});
  std::size_t begin = 0;
  for (const LevelChange& change : changes) {
    const auto segment = std::span(x).subspan(begin, change.at - begin);
    const double level = Median(segment);
    for (double& value : segment) value -= level;
    begin = change.at;
  }
  return x;
}

/// Finds the changes of a series. Levels are compared as logarithms.
void FindChangesOf(HistorySeries* series, double places) {
  const double floor = FloorOf(*series);
  if (std::isnan(floor)) return;
  double most = 0.0;
  std::vector<std::size_t> steady;  // indices of steady values
  std::vector<double> values, logarithms, without;
  for (std::size_t i = 0; i < series->values.size(); ++i) {
    const HistoryValue& one = series->values[i];
    if (!one.is_steady) continue;
    most = std::max(most, one.value);
    steady.push_back(i);
    values.push_back(one.value);
    logarithms.push_back(std::log(std::max(one.value, floor)));
    without.push_back(logarithms.back() - std::log(one.common));
  }
  // if cases vary independently, the common part would only add noise of a few cases
  if (NoiseOf(without).LongRun() < kQuieter * NoiseOf(logarithms).LongRun()) {
    logarithms.swap(without);
    for (std::size_t i = 0; i < steady.size(); ++i) {
      values[i] /= series->values[steady[i]].common;
    }
  }
  series->changes = FindChanges(logarithms, ResolutionOf(series->rule, most, places));
  SetLevels(values, &series->changes);
  for (LevelChange& change : series->changes) change.at = steady[change.at];
}

/// Marks times measured at an unusual machine speed. The usual speed is the fastest quarter of up
/// to twenty entries before and after. It survives a month of mostly slow runs, and soon follows a
/// permanent change.
/// @param compilers  by entry: compilers may generate different instructions for the calibration
void MarkUnsteady(const std::vector<std::string>& compilers, std::vector<HistorySeries>* all) {
  constexpr std::size_t kAround = 20;
  using Builder = std::pair<std::string, std::string>;  ///< machine and compiler
  const auto builder = [&compilers](const HistorySeries& one, const HistoryValue& value) {
    return Builder(one.machine, compilers[value.entry]);
  };
  std::map<Builder, std::map<std::size_t, std::vector<double>>> by_machine;
  for (const HistorySeries& one : *all) {
    for (const HistoryValue& value : one.values) {
      if (!(value.calibration > 0.0)) continue;
      by_machine[builder(one, value)][value.entry].push_back(value.calibration);
    }
  }
  std::map<std::pair<Builder, std::size_t>, double> usual;
  for (const auto& [machine, entries] : by_machine) {
    std::vector<double> speeds;
    for (const auto& [entry, calibrations] : entries) speeds.push_back(Median(calibrations));
    std::size_t i = 0;
    for (const auto& [entry, calibrations] : entries) {
      const std::size_t from = i < kAround ? 0 : i - kAround;
      const std::size_t to = std::min(speeds.size(), ++i + kAround);
      usual[{machine, entry}] = Quantile({speeds.begin() + static_cast<std::ptrdiff_t>(from),
                                          speeds.begin() + static_cast<std::ptrdiff_t>(to)},
                                         0.25);
    }
  }
  for (HistorySeries& one : *all) {
    for (HistoryValue& value : one.values) {
      if (!(value.calibration > 0.0)) continue;
      const double speed = value.calibration / usual[{builder(one, value), value.entry}];
      value.is_steady = speed < kOtherSpeed && speed > 1.0 / kOtherSpeed;
    }
  }
}

constexpr std::size_t kFewCases = 3;  ///< with a common variation

/// Sets the variation common to `cases`: the median over cases of their values without their own
/// changes, again without changes. A change of some cases thus never shows in the others.
void SetCommon(const std::vector<HistorySeries*>& cases) {
  std::map<std::size_t, std::vector<double>> at_entry;
  for (const HistorySeries* one : cases) {
    std::vector<std::size_t> entries;
    std::vector<double> logarithms;
    for (const HistoryValue& value : one->values) {
      if (!value.is_steady || !(value.value > 0.0)) continue;
      entries.push_back(value.entry);
      logarithms.push_back(std::log(value.value));
    }
    const std::vector<double> variation = VariationOf(std::move(logarithms));
    for (std::size_t i = 0; i < entries.size(); ++i) at_entry[entries[i]].push_back(variation[i]);
  }
  // a median of three is free of the changes of one
  std::erase_if(at_entry, [](const auto& at) { return at.second.size() < kFewCases; });
  std::vector<double> medians;
  for (const auto& [entry, values] : at_entry) medians.push_back(Median(values));
  const std::vector<double> variation = VariationOf(std::move(medians));
  std::map<std::size_t, double> common;
  std::size_t i = 0;
  for (const auto& [entry, values] : at_entry) common[entry] = std::exp(variation[i++]);
  for (HistorySeries* one : cases) {
    for (HistoryValue& value : one->values) {
      const auto at = common.find(value.entry);
      if (value.is_steady && at != common.end()) value.common = at->second;
    }
  }
}

/// Pools times if a machine has many cases, and sets their common variation.
std::vector<HistorySeries> PoolTimes(std::vector<HistorySeries>* all) {
  constexpr std::size_t kMany = 5;
  std::map<std::pair<std::string, std::string>, std::vector<HistorySeries*>> times;
  for (HistorySeries& one : *all) {
    if (one.rule != Rule::kTime || !(MedianOfSteady(one) > 0.0)) continue;
    times[{one.machine, one.measure}].push_back(&one);
  }
  std::vector<HistorySeries> pooled;
  for (const auto& [key, cases] : times) {
    if (cases.size() < kFewCases) continue;
    HistorySeries pool = Pooled({cases.begin(), cases.end()});
    if (pool.values.empty()) continue;
    SetCommon(cases);
    if (cases.size() >= kMany) pooled.push_back(std::move(pool));
  }
  return pooled;
}

/// Returns the median over a pool's cases of their own changes, as logarithms of median ratios.
double ChangeOfCases(const HistorySeries& pool, const std::vector<HistorySeries>& all,
                     std::size_t begin, std::size_t at, std::size_t end) {
  std::vector<double> changes;
  for (const HistorySeries& one : all) {
    if (one.machine != pool.machine || one.measure != pool.measure || one.one == kAllCases)
      continue;
    std::vector<double> before, after;
    for (const HistoryValue& value : one.values) {
      if (!value.is_steady || value.entry < begin || value.entry >= end) continue;
      (value.entry < at ? before : after).push_back(value.value);
    }
    const double change = std::log(Median(after) / Median(before));
    if (std::isfinite(change)) changes.push_back(change);
  }
  return Median(changes);
}

/// Removes changes of a pool that most cases lack: changes of few cases shift its median, too.
void RequireChangeOfCases(const std::vector<HistorySeries>& all, HistorySeries* pool) {
  const std::vector<double> values = Mapped<double>(pool->values, &HistoryValue::value);
  std::vector<LevelChange>& changes = pool->changes;
  const auto entry_of = [pool](std::size_t i) {
    return i < pool->values.size() ? pool->values[i].entry : pool->values.back().entry + 1;
  };
  for (std::size_t k = 0; k < changes.size();) {
    const std::size_t begin = k == 0 ? 0 : changes[k - 1].at;
    const std::size_t end = k + 1 < changes.size() ? changes[k + 1].at : values.size();
    const double size = std::log(changes[k].after / changes[k].before);
    const double of_cases =
        ChangeOfCases(*pool, all, entry_of(begin), entry_of(changes[k].at), entry_of(end));
    const bool is_large = std::abs(size) >= ResolutionOf(pool->rule, 0.0, 1.0).least;
    if (is_large && of_cases / size >= 0.5) {
      ++k;
      continue;
    }
    changes.erase(changes.begin() + static_cast<std::ptrdiff_t>(k));
    SetLevels(values, &changes);
    k = 0;  // the neighbours have longer segments now
  }
}

/// Returns a level as a cell: counts with all their digits.
Value LevelOf(const HistorySeries& series, double level) {
  const bool is_whole = series.rule == Rule::kCount && level == std::floor(level) && level < 1e15;
  return is_whole ? Value(static_cast<std::int64_t>(level)) : Value(level);
}

}  // namespace

std::size_t HistorySeries::Unsteady() const {
  return static_cast<std::size_t>(std::ranges::count(values, false, &HistoryValue::is_steady));
}

std::size_t HistoryFindings::Steps() const {
  std::size_t steps = endings.size();
  for (const HistorySeries& one : series) steps += one.changes.size();
  return steps;
}

HistoryFindings FindingsOf(const History& history) {
  HistoryFindings found;
  std::map<Key, std::string> endings;
  std::map<Key, std::size_t> places;
  std::vector<std::string> compilers;
  for (std::size_t e = 0; e < history.entries.size(); ++e) {
    const std::vector<Record> records = ReadResults(history.entries[e], &found.warnings);
    AddValues(history.entries[e].machine, e, records, &places, &found.series);
    AddEndings(history.entries[e].machine, e, records, &endings, &found.endings);
    compilers.push_back(records.empty() ? "" : OriginOf(records.front()).compiler);
  }
  MarkUnsteady(compilers, &found.series);
  const std::vector<HistorySeries> pooled = PoolTimes(&found.series);
  found.series.insert(found.series.begin(), pooled.begin(), pooled.end());
  double values = 0.0;
  for (const HistorySeries& one : found.series) values += static_cast<double>(one.values.size());
  for (HistorySeries& one : found.series) {
    FindChangesOf(&one, values);
    if (one.one == kAllCases) RequireChangeOfCases(found.series, &one);
  }
  return found;
}

Table StepTable(const History& history, const HistoryFindings& found) {
  Table table;
  table.title = "Steps";
  table.columns = Columns(
      "commit=first commit, date, case, measure, before:seconds, after:seconds, ratio:seconds, "
      "confidence:seconds");
  std::vector<std::pair<std::size_t, Record>> rows;
  const auto add = [&](std::size_t place, const std::string& one, const std::string& measure,
                       const AnyValue& before, const AnyValue& after, const AnyValue& ratio,
                       const AnyValue& confidence) {
    const HistoryEntry& entry = history.entries[place];
    rows.emplace_back(place, AddRow({ShortCommit(entry.commit), entry.date, one, measure, before,
                                     after, ratio, confidence},
                                    &table));
  };
  for (const EndingChange& change : found.endings) {
    add(change.entry, change.one, change.measure, change.before, change.after, Value(), Value());
  }
  for (const HistorySeries& one : found.series) {
    for (const LevelChange& change : one.changes) {
      add(one.values[change.at].entry, one.one, one.measure, LevelOf(one, change.before),
          LevelOf(one, change.after),
          change.before > 0.0 ? Value(change.after / change.before) : Value(), change.Confidence());
    }
  }
  std::ranges::stable_sort(rows, std::greater<>(), [](const auto& row) { return row.first; });
  for (std::size_t i = 0; i < rows.size(); ++i) table.rows[i] = std::move(rows[i].second);
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
      "{} of {} times decide nothing: the machine had another speed than usual (calibration_ns)",
      unsteady, times);
}

}  // namespace loopbench::harness
