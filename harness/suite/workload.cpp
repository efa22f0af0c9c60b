#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include "harness/base/record.h"
#include "harness/base/text.h"
#include "harness/run/run.h"
#include "harness/suite/suite.h"

namespace loopbench::harness {

Shard ParseShard(const std::string& text) {
  Shard shard;
  const char* const end = text.data() + text.size();
  const auto index = std::from_chars(text.data(), end, shard.index);
  const bool has_count = index.ec == std::errc() && index.ptr != end && *index.ptr == '/';
  const auto count = has_count ? std::from_chars(index.ptr + 1, end, shard.count) : index;
  if (!has_count || count.ec != std::errc() || count.ptr != end || shard.index < 1 ||
      shard.index > shard.count) {
    throw ConfigError(fmt::format("--shard: found \"{}\", expected k/n with 1 <= k <= n <= {}",
                                  text, std::numeric_limits<int>::max()));
  }
  return shard;
}
namespace {

constexpr std::size_t kSome = 64;                 ///< combinations of the sample
constexpr std::size_t kEachValue = 2000;          ///< maximum number of tested values of an axis
constexpr std::size_t kMaxGroupBodies = 200'000;  ///< per group: about 100 MB
constexpr std::size_t kMaxGroupCases = 100'000;   ///< per group: about 100 MB of records

bool IsOn(const Condition& condition,
          const std::vector<std::pair<std::string, std::size_t>>& axes) {
  return std::ranges::any_of(axes, [&](const auto& axis) { return axis.first == condition.key; });
}

/// Returns the common content of combinations that are alike.
std::string KeysWithoutParameters(const Experiment& experiment) {
  Experiment bare = experiment;
  bare.parameters = Record();
  bare.exclusions.clear();
  std::string text;
  for (const Case& entry : Expand(bare))
    text += fmt::format("{} {}\n", CaseId(entry.keys), entry.ensemble);
  return text;
}

/// A rule or filter for combinations that are alike: conditions on parameters, and the cases that
/// meet the other conditions.
struct SplitSelection {
  Selection on_axes;
  std::vector<bool> cases;
};

SplitSelection Split(const Selection& selection, const std::vector<Case>& cases,
                     const std::vector<std::pair<std::string, std::size_t>>& axes) {
  SplitSelection split;
  Selection others;
  for (const Condition& condition : selection)
    (IsOn(condition, axes) ? split.on_axes : others).push_back(condition);
  for (const Case& entry : cases) split.cases.push_back(Matches(entry.keys, others));
  return split;
}

}  // namespace

std::size_t RunsOf(const Case& entry) {
  return entry.ensemble > 1 ? static_cast<std::size_t>(entry.ensemble) + 1 : 1;
}

void AddTo(std::vector<CaseLine>* lines, const Case& entry, std::size_t times) {
  const std::string method = ToString(entry.method);
  auto line = std::ranges::find_if(*lines, [&](const CaseLine& known) {
    return known.mechanism == entry.mechanism && known.method == method;
  });
  if (line == lines->end()) line = lines->insert(line, {entry.mechanism, method, 0, 0});
  line->cases += times;
  line->runs += times * RunsOf(entry);
}

void RequireKeys(const std::vector<Experiment>& experiments, const Selection& filter) {
  if (filter.empty()) return;
  std::vector<std::string> known;
  for (const Experiment& experiment : experiments) {
    for (const Case& entry : Expand(experiment)) {
      for (const auto& [key, value] : entry.keys.items()) {
        if (std::ranges::find(known, key) == known.end()) known.push_back(key);
      }
    }
  }
  for (const Condition& condition : filter) {
    if (std::ranges::find(known, condition.key) != known.end()) continue;
    const bool is_measured = FindMeasure(condition.key) != nullptr;
    throw ConfigError(fmt::format(
        "--filter {}: no such key{}; cases have {}", condition.key,
        is_measured
            ? " before a run, which measures it (table, plot and work-precision choose by it: "
              "--where)"
            : "",
        fmt::join(known, ", ")));
  }
}

bool Passes(const Experiment& experiment, const Selection& filter) {
  return std::ranges::any_of(Expand(experiment),
                             [&](const Case& entry) { return Matches(entry.keys, filter); });
}

LongSweep::LongSweep(ExperimentSource source, const ExperimentFiles& files)
    : source_(std::move(source)), filter_(files.filter), threads_(files.threads) {
  for (const Condition& condition : filter_) {
    if (IsOn(condition, source_.axes())) on_axes_.push_back(condition);
  }
  const std::vector<std::size_t> sample = source_.EachValue(kEachValue);
  const Experiment first = source_.Read(0);
  const std::string keys = KeysWithoutParameters(first);
  std::size_t bodies = 1, cases = 1;
  for (const std::size_t combination : sample) {
    const Experiment experiment = source_.Read(combination);
    std::size_t all = 0;
    cases = std::max(cases, Expand(experiment).size());
    for (const ExperimentProblem& problem : experiment.problems)
      all += problem.mechanism.description.bodies.size();
    bodies = std::max(bodies, all);
    are_alike_ = are_alike_ && KeysWithoutParameters(experiment) == keys;
  }
  if (count() > kMaxCases / cases) {
    throw ConfigError(
        fmt::format("{}: found {} combinations of up to {} cases, expected at most {} "
                    "cases in one file",
                    source_.path().string(), count(), cases, kMaxCases));
  }
  group_size_ = std::clamp<std::size_t>(std::min(kMaxGroupBodies / bodies, kMaxGroupCases / cases),
                                        1, kLongSweep);
  RequireKeys({first}, filter_);
  source_.CheckExclusions(sample);
  const double step = static_cast<double>(count() - 1) / (kSome - 1);
  for (std::size_t k = 0; k < kSome; ++k) {
    for (Experiment& experiment :
         ReadOne(static_cast<std::size_t>(step * static_cast<double>(k) + 0.5))) {
      some_.push_back(std::move(experiment));
    }
  }
  // a filter may select combinations between the samples
  for (std::size_t i = 0; i < count() && some_.empty(); ++i) some_ = ReadOne(i);
  if (some_.empty()) {
    throw ConfigError(
        fmt::format("{}: no case matches {}", source_.path().string(), ToText(filter_)));
  }
}

bool LongSweep::ParametersPass(std::size_t combination) const {
  return on_axes_.empty() || Matches(source_.Parameters(combination), on_axes_);
}

std::vector<Experiment> LongSweep::ReadOne(std::size_t combination) {
  if (!ParametersPass(combination)) return {};
  Experiment experiment = source_.Read(combination);
  if (threads_ > 0) UseThreads(threads_, experiment);
  if (!Passes(experiment, filter_)) return {};
  std::vector<Experiment> passing;
  passing.push_back(std::move(experiment));
  return passing;
}

std::vector<Experiment> LongSweep::Read(std::size_t from, std::size_t to, const Shard& shard,
                                        std::vector<std::int64_t>* numbers) {
  std::vector<Experiment> experiments;
  const auto parts = static_cast<std::size_t>(shard.count);
  for (std::size_t i = from; i < to; ++i) {
    const std::size_t combination = i * parts + static_cast<std::size_t>(shard.index - 1);
    if (combination >= count()) break;
    for (Experiment& experiment : ReadOne(combination)) {
      experiments.push_back(std::move(experiment));
      if (numbers != nullptr) numbers->push_back(static_cast<std::int64_t>(combination));
    }
  }
  return experiments;
}

std::vector<CaseLine> LongSweep::CountAlike(const Experiment& first) const {
  Experiment whole = first;
  whole.exclusions.clear();
  const std::vector<Case> cases = Expand(whole);
  const auto axes = source_.axes();
  const SplitSelection filter = Split(filter_, cases, axes);
  std::vector<SplitSelection> rules;
  for (const Selection& rule : first.exclusions) rules.push_back(Split(rule, cases, axes));
  // few combinations of rules occur: count each
  std::map<std::vector<bool>, std::size_t> times;
  std::vector<bool> met(rules.size());
  if (filter.on_axes.empty() && rules.empty()) {
    times[met] = count();
  } else {
    for (std::size_t i = 0; i < count(); ++i) {
      const Record parameters = source_.Parameters(i);
      if (!Matches(parameters, filter.on_axes)) continue;
      for (std::size_t r = 0; r < rules.size(); ++r) met[r] = Matches(parameters, rules[r].on_axes);
      ++times[met];
    }
  }
  std::vector<CaseLine> lines;
  for (std::size_t k = 0; k < cases.size(); ++k) {
    if (!filter.cases[k]) continue;
    std::size_t all = 0;
    for (const auto& [rules_met, number] : times) {
      bool excluded = false;
      for (std::size_t r = 0; r < rules.size(); ++r) {
        excluded = excluded || (rules_met[r] && rules[r].cases[k]);
      }
      if (!excluded) all += number;
    }
    if (all > 0) AddTo(&lines, cases[k], all);
  }
  return lines;
}

std::vector<CaseLine> LongSweep::CountCases() {
  if (are_alike_) {
    Experiment first = source_.Read(0);
    if (threads_ > 0) UseThreads(threads_, first);
    return CountAlike(first);
  }
  std::vector<CaseLine> lines;
  for (std::size_t i = 0; i < count(); ++i) {
    for (const Experiment& experiment : ReadOne(i)) {
      for (const Case& passing : SelectCases(experiment, filter_)) AddTo(&lines, passing);
    }
  }
  return lines;
}
namespace {

/// Returns a text that identifies the sweep, from its source and its first and last combinations.
std::string ContentOf(const LongSweep& sweep) {
  std::string text = sweep.source().Text();
  for (const Experiment* experiment : {&sweep.some().front(), &sweep.some().back()}) {
    for (const Case& each : Expand(*experiment))
      text += Identified(*experiment, each).keys.Text("case_id");
  }
  return Fnv1a(text);
}

/// Returns the experiments that pass.
std::vector<Experiment> ReadWhole(ExperimentSource source, const ExperimentFiles& files) {
  std::vector<Experiment> experiments = source.ReadAll();
  if (files.threads > 0) {
    for (Experiment& experiment : experiments) UseThreads(files.threads, experiment);
  }
  RequireKeys(experiments, files.filter);
  std::erase_if(experiments,
                [&](const Experiment& experiment) { return !Passes(experiment, files.filter); });
  if (experiments.empty()) {
    throw ConfigError(
        fmt::format("{}: no case matches {}", source.path().string(), ToText(files.filter)));
  }
  return experiments;
}

}  // namespace

Workload::Workload(const ExperimentFiles& files, const Shard& shard) : shard_(shard) {
  std::int64_t number = 0;  // number of the next experiment
  std::string contents;
  const auto parts = static_cast<std::size_t>(shard.count);
  for (const auto& path : files.paths) {
    ExperimentSource source(path, files.settings);
    if (source.count() <= kLongSweep) {
      for (Experiment& experiment : ReadWhole(std::move(source), files)) {
        whole_.experiments.push_back(std::move(experiment));
        whole_.numbers.push_back(number++);
      }
      if (!first_) first_ = whole_.experiments.front();
      continue;
    }
    LongSweep sweep(std::move(source), files);
    if (!first_) first_ = sweep.some().front();
    some_.insert(some_.end(), sweep.some().begin(), sweep.some().end());
    contents += ContentOf(sweep);
    const std::size_t mine =
        (sweep.count() + parts - static_cast<std::size_t>(shard.index)) / parts;
    const std::size_t groups = (mine + sweep.group_size() - 1) / sweep.group_size();
    const std::int64_t first_number =
        std::exchange(number, number + static_cast<std::int64_t>(sweep.count()));
    sweeps_.push_back({std::move(sweep), groups, first_number});
  }
  if (is_long()) some_.insert(some_.end(), whole_.experiments.begin(), whole_.experiments.end());
  content_ = Fnv1a(fmt::format("{} {} {}/{} {} {}", contents, ToText(files.filter), shard.index,
                               shard.count, files.threads, CodeVersion()));
}

std::size_t Workload::groups() const {
  std::size_t all = whole_.experiments.empty() ? 0 : 1;
  for (const Part& part : sweeps_) all += part.groups;
  return all;
}

ExperimentGroup Workload::Read(std::size_t group) {
  if (!whole_.experiments.empty() && group-- == 0) return whole_;
  auto part = sweeps_.begin();
  for (; group >= part->groups; ++part) group -= part->groups;
  const std::size_t size = part->sweep.group_size(), from = group * size;
  ExperimentGroup some;
  some.is_sharded = true;
  some.name = fmt::format("group {} of {}", group + 1, part->groups);
  some.experiments = part->sweep.Read(from, from + size, shard_, &some.numbers);
  for (std::int64_t& number : some.numbers) number += part->first_number;
  return some;
}

Overview MakeOverview(const std::filesystem::path& path, const ExperimentFiles& files) {
  ExperimentSource source(path, files.settings);
  Overview overview;
  if (source.count() > kLongSweep) {
    LongSweep sweep(std::move(source), files);
    overview.experiments = sweep.some();
    overview.combinations = sweep.count();
    overview.is_sample = true;
    overview.axes = sweep.source().axes();
    overview.lines = sweep.CountCases();
    return overview;
  }
  overview.experiments = ReadWhole(std::move(source), files);
  overview.combinations = overview.experiments.size();
  for (const auto& [name, value] : overview.experiments.front().parameters.items()) {
    std::set<std::string> values;
    for (const Experiment& experiment : overview.experiments)
      values.insert(experiment.parameters.Text(name));
    overview.axes.emplace_back(name, values.size());
  }
  for (const Experiment& experiment : overview.experiments) {
    for (const Case& each : SelectCases(experiment, files.filter)) AddTo(&overview.lines, each);
  }
  return overview;
}

std::size_t Overview::cases() const {
  return std::accumulate(lines.begin(), lines.end(), std::size_t{0},
                         [](std::size_t all, const CaseLine& line) { return all + line.cases; });
}

}  // namespace loopbench::harness
