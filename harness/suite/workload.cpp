#include "harness/suite/workload.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <set>
#include <utility>

#include "harness/record/provenance.h"
#include "harness/run/case_identity.h"
#include "harness/suite/suite.h"
#include "harness/text/config_error.h"
#include "harness/text/hash.h"

namespace loopbench::harness {
namespace {

/// Of the sweep and what its first and last combinations are made of.
std::string ContentOf(const LongSweep& sweep) {
  std::string text = sweep.source().Text();
  for (const Experiment* one : {&sweep.some().front(), &sweep.some().back()}) {
    for (const Case& each : Expand(*one)) text += Identified(*one, each).keys.Text("case_id");
  }
  return Fnv1a(text);
}

/// Those that pass.
std::vector<Experiment> ReadWhole(ExperimentSource source, const ExperimentFiles& files) {
  std::vector<Experiment> experiments = source.ReadAll();
  if (files.threads > 0) {
    for (Experiment& experiment : experiments) UseThreads(files.threads, experiment);
  }
  RequireKeys(experiments, files.filter);
  std::erase_if(experiments, [&](const Experiment& one) { return !Passes(one, files.filter); });
  if (experiments.empty()) {
    throw ConfigError(
        fmt::format("{}: no case matches {}", source.path().string(), ToText(files.filter)));
  }
  return experiments;
}

}  // namespace

Workload::Workload(const ExperimentFiles& files, const Shard& shard) : shard_(shard) {
  std::int64_t number = 0;  // of the next experiment
  std::string contents;
  const auto parts = static_cast<std::size_t>(shard.count);
  for (const auto& path : files.paths) {
    ExperimentSource source(path, files.settings);
    if (source.count() <= kLongSweep) {
      for (Experiment& one : ReadWhole(std::move(source), files)) {
        whole_.experiments.push_back(std::move(one));
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
    for (const Experiment& one : overview.experiments) values.insert(one.parameters.Text(name));
    overview.axes.emplace_back(name, values.size());
  }
  for (const Experiment& one : overview.experiments) {
    for (const Case& each : SelectCases(one, files.filter)) AddTo(&overview.lines, each);
  }
  return overview;
}

std::size_t Overview::cases() const {
  return std::accumulate(lines.begin(), lines.end(), std::size_t{0},
                         [](std::size_t all, const CaseLine& line) { return all + line.cases; });
}

}  // namespace loopbench::harness
