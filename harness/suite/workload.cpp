#include <numeric>
#include <set>

#include "harness/base/text.h"
#include "harness/run/run.h"
#include "harness/suite/suite.h"

namespace loopbench::harness {

Shard ParseShard(const std::string& text) {
  const auto [index, count] = Quotient<int>(text);
  if (index < 1 || index > count) {
    throw ConfigError(fmt::format("--shard: found \"{}\", expected k/n with 1 <= k <= n <= {}",
                                  text, std::numeric_limits<int>::max()));
  }
  return {*index, *count};
}

std::size_t RunsOf(const Case& entry) {
  return entry.ensemble > 1 ? static_cast<std::size_t>(entry.ensemble) + 1 : 1;
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

/// A rule or filter: conditions on parameters, and the cases that meet the other conditions.
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

/// Adds a case `times` times to its line; lines are in the order of their first case.
void AddTo(std::vector<CaseLine>* lines, const Case& entry, std::size_t times = 1) {
  const std::string method = ToString(entry.method);
  auto line = std::ranges::find_if(*lines, [&](const CaseLine& known) {
    return known.mechanism == entry.mechanism && known.method == method;
  });
  if (line == lines->end()) line = lines->insert(line, {entry.mechanism, method, 0, 0});
  line->cases += times;
  line->runs += times * RunsOf(entry);
}

/// Throws ConfigError for a condition on a key that no case has, since it would match nothing.
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

/// Returns true if any case of the experiment passes.
bool Passes(const Experiment& experiment, const Selection& filter) {
  return std::ranges::any_of(Expand(experiment),
                             [&](const Case& entry) { return Matches(entry.keys, filter); });
}

/// Returns the error of a file without a passing case.
ConfigError NoCase(const ExperimentSource& source, const Selection& filter) {
  return ConfigError(fmt::format("{}: no case matches {}", source.path().string(), ToText(filter)));
}

}  // namespace

/// A sweep with too many combinations to hold in memory at once. Opening it reads enough
/// combinations to contain each value of each axis, so that invalid values are rejected before
/// anything runs. Invalid combinations of values are rejected when they are reached.
class LongSweep {
 public:
  /// Throws ConfigError as the reader, for all combinations read here, and if no case can pass.
  LongSweep(ExperimentSource source, const ExperimentFiles& files, const Shard& shard)
      : source_(std::move(source)),
        filter_(files.filter),
        threads_(files.threads),
        parts_(static_cast<std::size_t>(shard.count)),
        part_(static_cast<std::size_t>(shard.index - 1)) {
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
    group_size_ = std::clamp<std::size_t>(
        std::min(kMaxGroupBodies / bodies, kMaxGroupCases / cases), 1, kLongSweep);
    RequireKeys({first}, filter_);
    source_.CheckExclusions(sample);
    const double step = static_cast<double>(count() - 1) / (kSome - 1);
    for (std::size_t k = 0; k < kSome; ++k) {
      const auto combination = static_cast<std::size_t>(step * static_cast<double>(k) + 0.5);
      if (auto experiment = ReadOne(combination)) some_.push_back(*std::move(experiment));
    }
    // a filter may select combinations between the samples
    for (std::size_t i = 0; i < count() && some_.empty(); ++i) {
      if (auto experiment = ReadOne(i)) some_.push_back(*std::move(experiment));
    }
    if (some_.empty()) throw NoCase(source_, filter_);
  }

  std::size_t count() const { return source_.count(); }
  auto axes() const { return source_.axes(); }
  /// Returns evenly spaced combinations, at most 64, each with at least one passing case.
  const std::vector<Experiment>& some() const { return some_; }
  /// Returns the number of groups of the shard: smaller ones for large mechanisms.
  std::size_t groups() const {
    const std::size_t mine = (count() + parts_ - part_ - 1) / parts_;
    return (mine + group_size_ - 1) / group_size_;
  }

  /// Reads the combinations of a group that have passing cases, with their numbers behind `first`.
  ExperimentGroup Read(std::size_t group, std::int64_t first) {
    ExperimentGroup read;
    read.name = fmt::format("group {} of {}", group + 1, groups());
    read.is_sharded = true;
    for (std::size_t i = group * group_size_; i < (group + 1) * group_size_; ++i) {
      const std::size_t combination = i * parts_ + part_;
      if (combination >= count()) break;
      auto experiment = ReadOne(combination);
      if (!experiment) continue;
      read.experiments.push_back(*std::move(experiment));
      read.numbers.push_back(first + static_cast<std::int64_t>(combination));
    }
    return read;
  }

  /// Returns a text that identifies the sweep, from its source and its first and last combinations.
  std::string Content() const {
    std::string text = source_.Text();
    for (const Experiment* experiment : {&some_.front(), &some_.back()}) {
      for (const Case& each : Expand(*experiment))
        text += Identified(*experiment, each).keys.Text("case_id");
    }
    return Fnv1a(text);
  }

  /// Counts all passing cases. Takes a microsecond or two per combination if cases differ only in
  /// parameters; otherwise reads each combination.
  std::vector<CaseLine> CountCases() {
    if (are_alike_) {
      Experiment first = source_.Read(0);
      if (threads_ > 0) UseThreads(threads_, first);
      return CountAlike(first);
    }
    std::vector<CaseLine> lines;
    for (std::size_t i = 0; i < count(); ++i) {
      const auto experiment = ReadOne(i);
      if (!experiment) continue;
      for (const Case& passing : SelectCases(*experiment, filter_)) AddTo(&lines, passing);
    }
    return lines;
  }

 private:
  /// Returns nothing if no case passes.
  std::optional<Experiment> ReadOne(std::size_t combination) {
    if (!on_axes_.empty() && !Matches(source_.Parameters(combination), on_axes_)) return {};
    Experiment experiment = source_.Read(combination);
    if (threads_ > 0) UseThreads(threads_, experiment);
    if (!Passes(experiment, filter_)) return {};
    return experiment;
  }

  std::vector<CaseLine> CountAlike(const Experiment& first) const {
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
        for (std::size_t r = 0; r < rules.size(); ++r)
          met[r] = Matches(parameters, rules[r].on_axes);
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

  ExperimentSource source_;
  Selection filter_, on_axes_;  ///< all conditions, and those on parameters only
  int threads_;
  std::size_t parts_, part_;  ///< shards, and this one
  bool are_alike_ = true;     ///< keys of cases differ in parameters only
  std::vector<Experiment> some_;
  std::size_t group_size_ = kLongSweep;
};

namespace {

/// Returns the experiments that pass.
std::vector<Experiment> ReadWhole(ExperimentSource source, const ExperimentFiles& files) {
  std::vector<Experiment> experiments = source.ReadAll();
  if (files.threads > 0) {
    for (Experiment& experiment : experiments) UseThreads(files.threads, experiment);
  }
  RequireKeys(experiments, files.filter);
  std::erase_if(experiments,
                [&](const Experiment& experiment) { return !Passes(experiment, files.filter); });
  if (experiments.empty()) throw NoCase(source, files.filter);
  return experiments;
}

}  // namespace

Workload::Workload(const ExperimentFiles& files, const Shard& shard) {
  std::int64_t number = 0;  // number of the next experiment
  std::string contents;
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
    const auto sweep = std::make_shared<LongSweep>(std::move(source), files, shard);
    if (!first_) first_ = sweep->some().front();
    some_.insert(some_.end(), sweep->some().begin(), sweep->some().end());
    contents += sweep->Content();
    sweeps_.emplace_back(sweep, number);
    number += static_cast<std::int64_t>(sweep->count());
  }
  if (is_long()) some_.insert(some_.end(), whole_.experiments.begin(), whole_.experiments.end());
  content_ = Fnv1a(fmt::format("{} {} {}/{} {} {}", contents, ToText(files.filter), shard.index,
                               shard.count, files.threads, CodeVersion()));
}

std::size_t Workload::groups() const {
  std::size_t all = whole_.experiments.empty() ? 0 : 1;
  for (const auto& [sweep, first] : sweeps_) all += sweep->groups();
  return all;
}

ExperimentGroup Workload::Read(std::size_t group) {
  if (!whole_.experiments.empty() && group-- == 0) return whole_;
  auto part = sweeps_.begin();
  for (; group >= part->first->groups(); ++part) group -= part->first->groups();
  return part->first->Read(group, part->second);
}

Overview MakeOverview(const std::filesystem::path& path, const ExperimentFiles& files) {
  ExperimentSource source(path, files.settings);
  Overview overview;
  if (source.count() > kLongSweep) {
    LongSweep sweep(std::move(source), files, {});
    overview.experiments = sweep.some();
    overview.combinations = sweep.count();
    overview.is_sample = true;
    overview.axes = sweep.axes();
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
