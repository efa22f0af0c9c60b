#include "harness/analysis/agreement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "harness/config/formulations.h"

namespace loopbench::harness {
namespace {

constexpr std::string_view kPrefix = "series.final.";

/// The runs of one scene, horizon and tolerance that ended alike, by index, the largest set first.
using Clusters = std::vector<std::vector<std::size_t>>;

bool HasFinalPoses(const Record& record) {
  return record.Text("kind") == "accuracy" && record.Text("outcome") == "finished" &&
         !record.Text("scene_id").empty() && !std::isnan(record.Number("rtol")) &&
         std::ranges::any_of(record.items(),
                             [](const auto& item) { return item.first.starts_with(kPrefix); });
}

const std::vector<double>* PoseOf(const std::string& key, const Value& value) {
  return key.starts_with(kPrefix) ? std::get_if<std::vector<double>>(&value) : nullptr;
}

/// What component i of a pose is measured in: lengths of a link, or rad.
double UnitOf(double link_length, std::size_t size, std::size_t i) {
  return i < (size == 3 ? 2u : 3u) ? link_length : 1.0;
}

bool IsSoft(const Record& record) {
  const FormulationRow* row = FindFormulation(record.Text("formulation"));
  return row != nullptr && row->is_soft;
}

bool EndAlike(const Record& a, const Record& b, double rtol) {
  return DifferenceOf(a, b).largest <= kMostTolerances * rtol;
}

/// Final poses of a set of runs: of each component the least and the largest. A number that is not
/// finite, or is not there, is as far as can be from all others.
class Bounds {
 public:
  /// Whether `run` ends like each of the runs taken so far.
  bool Fit(const Record& run, double rtol) const {
    for (const auto& [key, value] : run.items()) {
      const auto* pose = PoseOf(key, value);
      if (pose == nullptr) continue;
      const auto known = bounds_.find(key);
      if (known == bounds_.end()) continue;  // simplified away there
      const auto& [low, high] = known->second;
      if (low.size() != pose->size()) return false;
      for (std::size_t i = 0; i < pose->size(); ++i) {
        const double off = std::max((*pose)[i] - low[i], high[i] - (*pose)[i]);
        if (!(off / UnitOf(length_, pose->size(), i) <= kMostTolerances * rtol)) return false;
      }
    }
    return true;
  }
  void Take(const Record& run) {
    if (length_ == 0.0) length_ = run.Number("link_length");
    for (const auto& [key, value] : run.items()) {
      const auto* pose = PoseOf(key, value);
      if (pose == nullptr || pose->empty()) continue;
      auto& [low, high] = bounds_.try_emplace(key, *pose, *pose).first->second;
      if (low.size() != pose->size()) low[0] = -kFar, high[0] = kFar;
      for (std::size_t i = 0; i < std::min(low.size(), pose->size()); ++i) {
        const double number = (*pose)[i];
        low[i] = std::isfinite(number) ? std::min(low[i], number) : -kFar;
        high[i] = std::isfinite(number) ? std::max(high[i], number) : kFar;
      }
    }
  }
  PoseDifference Widest() const {
    PoseDifference widest;
    for (const auto& [key, bounds] : bounds_) {
      const auto& [low, high] = bounds;
      for (std::size_t i = 0; i < low.size(); ++i) {
        double off = (high[i] - low[i]) / UnitOf(length_, low.size(), i);
        if (std::isnan(off)) off = kFar;
        if (off > widest.largest) widest = {off, key.substr(kPrefix.size())};
      }
    }
    return widest;
  }

 private:
  static constexpr double kFar = std::numeric_limits<double>::infinity();
  std::map<std::string, std::pair<std::vector<double>, std::vector<double>>> bounds_;
  double length_ = 0.0;
};

Clusters ClustersOf(std::span<const Record> records, const std::vector<std::size_t>& runs,
                    double rtol) {
  Clusters clusters;
  std::vector<Bounds> bounds;
  for (const std::size_t run : runs) {
    const auto place = std::ranges::find_if(
        bounds, [&](const Bounds& cluster) { return cluster.Fit(records[run], rtol); });
    const auto index = static_cast<std::size_t>(place - bounds.begin());
    if (place == bounds.end()) {
      clusters.emplace_back();
      bounds.emplace_back();
    }
    clusters[index].push_back(run);
    bounds[index].Take(records[run]);
  }
  std::ranges::stable_sort(clusters, std::greater<>(), &std::vector<std::size_t>::size);
  return clusters;
}

/// Whether runs of different equations all ended alike, that is in one cluster.
bool Decides(std::span<const Record> records, const Clusters& clusters) {
  if (clusters.size() != 1) return false;
  std::set<std::string> ways;
  for (const std::size_t run : clusters.front()) {
    ways.insert(records[run].Text("enforcement") + " " + records[run].Text("coordinates"));
  }
  return ways.size() > 1;
}

/// Whether its level puts the branch back at every step.
bool KeepsBranches(const Record& record) {
  const auto level = FindLevel(record.Text("enforcement"));
  return level && TraitsOf(*level).growth == DriftGrowth::kNone && !IsPeer(record);
}

/// What runs of one tolerance decide: those of an integrator that all end alike, beside the peers,
/// unless another integrator's all end alike elsewhere. Nothing where none does.
const Record* DecidedBy(std::span<const Record> records, const std::vector<std::size_t>& runs,
                        double rtol) {
  std::set<std::string> integrators;
  for (const std::size_t run : runs) {
    if (!IsPeer(records[run])) integrators.insert(records[run].Text("integrator"));
  }
  const Record* decided = nullptr;
  for (const std::string& integrator : integrators) {
    std::vector<std::size_t> own = runs;
    std::erase_if(own, [&](std::size_t run) {
      return !IsPeer(records[run]) && records[run].Text("integrator") != integrator;
    });
    if (!Decides(records, ClustersOf(records, own, rtol))) continue;
    const Record* witness = &records[own.front()];
    if (decided != nullptr && !EndAlike(*decided, *witness, rtol)) return nullptr;
    if (decided == nullptr) decided = witness;
  }
  return decided;
}

}  // namespace

bool IsPeer(const Record& record) {
  const FormulationRow* row = FindFormulation(record.Text("formulation"));
  return row != nullptr && row->is_peer();
}

PoseDifference LargestDifference(std::span<const Record> runs) {
  Bounds bounds;
  for (const Record& run : runs) bounds.Take(run);
  return bounds.Widest();
}

PoseDifference DifferenceOf(const Record& a, const Record& b) {
  Bounds bounds;
  bounds.Take(a);
  bounds.Take(b);
  return bounds.Widest();
}

std::vector<Agreement> CompareFinalPoses(std::span<const Record> records,
                                         const std::vector<bool>& testifies) {
  // by scene and horizon, then by tolerance, the finest first
  std::map<std::pair<std::string, double>, std::map<double, std::vector<std::size_t>>> scenes;
  for (std::size_t i = 0; i < records.size(); ++i) {
    if (!HasFinalPoses(records[i])) continue;
    scenes[{records[i].Text("scene_id"), records[i].Number("horizon")}][records[i].Number("rtol")]
        .push_back(i);
  }
  std::vector<Agreement> agreements(records.size());
  for (const auto& [scene, tolerances] : scenes) {
    const Record* decided = nullptr;
    for (const auto& [rtol, all] : tolerances) {
      std::vector<std::size_t> runs = all;
      std::erase_if(runs, [&](std::size_t run) { return IsSoft(records[run]); });
      std::vector<std::size_t> witnesses = runs;
      std::erase_if(witnesses, [&](std::size_t run) { return !testifies[run]; });
      if (witnesses.empty()) witnesses = runs;
      const Clusters clusters = ClustersOf(records, runs, rtol);
      if (decided == nullptr) decided = DecidedBy(records, witnesses, rtol);
      const Record* others = decided;  // those that do not give way, where they agree
      if (others == nullptr && clusters.size() == 1) others = &records[clusters.front().front()];
      for (std::size_t c = 0; c < clusters.size(); ++c) {
        for (const std::size_t run : clusters[c]) {
          if (all.size() > 1) agreements[run].cluster = static_cast<std::int64_t>(c) + 1;
          agreements[run].doubted = others == nullptr || !EndAlike(records[run], *others, rtol);
        }
      }
      for (const std::size_t run : all) {
        if (!IsSoft(records[run]) || runs.empty()) continue;
        agreements[run].doubted = others == nullptr || !EndAlike(records[run], *others, rtol);
        agreements[run].cluster =
            agreements[run].doubted ? static_cast<std::int64_t>(clusters.size()) + 1 : 1;
      }
      // a branch is kept by who ends as those do that can keep it
      const bool is_kept = std::ranges::any_of(witnesses, [&](std::size_t run) {
        return testifies[run] && KeepsBranches(records[run]) && !agreements[run].doubted;
      });
      for (const std::size_t run : runs) {
        agreements[run].is_backed = is_kept && !agreements[run].doubted;
      }
    }
  }
  return agreements;
}

std::vector<Agreement> CompareFinalPoses(std::span<const Record> records) {
  return CompareFinalPoses(records, std::vector<bool>(records.size(), true));
}

}  // namespace loopbench::harness
