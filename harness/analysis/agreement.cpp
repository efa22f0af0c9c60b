#include "harness/analysis/agreement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string_view>
#include <utility>

namespace loopbench::harness {
namespace {

constexpr std::string_view kPrefix = "series.final.";

/// The runs of one scene, horizon and tolerance that ended alike, by index, the largest set first.
using Clusters = std::vector<std::vector<std::size_t>>;

bool HasFinalPoses(const Record& record) {
  return record.Text("kind") == "accuracy" && record.Text("outcome") == "finished" &&
         !record.Text("scene_id").empty() &&
         std::ranges::any_of(record.items(),
                             [](const auto& item) { return item.first.starts_with(kPrefix); });
}

bool EndAlike(const Record& a, const Record& b, double rtol) {
  return DifferenceOf(a, b).largest <= kMostTolerances * rtol;
}

Clusters ClustersOf(std::span<const Record> records, const std::vector<std::size_t>& runs,
                    double rtol) {
  Clusters clusters;
  for (const std::size_t run : runs) {
    const auto fits = [&](const std::vector<std::size_t>& cluster) {
      return std::ranges::all_of(
          cluster, [&](std::size_t other) { return EndAlike(records[run], records[other], rtol); });
    };
    const auto place = std::ranges::find_if(clusters, fits);
    if (place == clusters.end()) {
      clusters.push_back({run});
    } else {
      place->push_back(run);
    }
  }
  std::ranges::stable_sort(clusters, std::greater<>(), &std::vector<std::size_t>::size);
  return clusters;
}

/// Whether runs of different equations all ended alike.
bool Decides(std::span<const Record> records, const Clusters& clusters) {
  if (clusters.size() != 1) return false;
  std::set<std::string> ways;
  for (const std::size_t run : clusters.front()) {
    ways.insert(records[run].Text("enforcement") + " " + records[run].Text("coordinates"));
  }
  return ways.size() > 1;
}

}  // namespace

PoseDifference DifferenceOf(const Record& a, const Record& b) {
  PoseDifference difference;
  for (const auto& [key, value] : a.items()) {
    const auto* pose = std::get_if<std::vector<double>>(&value);
    if (pose == nullptr || !key.starts_with(kPrefix)) continue;
    const std::vector<double>& other = b.Numbers(key);
    if (other.empty()) continue;  // simplified away there
    const std::size_t lengths = pose->size() == 3 ? 2 : 3;
    for (std::size_t i = 0; i < pose->size(); ++i) {
      const double unit = i < lengths ? a.Number("link_length") : 1.0;
      double off = i < other.size() ? std::abs((*pose)[i] - other[i]) / unit : NAN;
      if (std::isnan(off)) off = std::numeric_limits<double>::infinity();
      if (off <= difference.largest) continue;
      difference = {off, key.substr(kPrefix.size())};
    }
  }
  return difference;
}

std::vector<Agreement> CompareFinalPoses(std::span<const Record> records) {
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
    for (const auto& [rtol, runs] : tolerances) {
      const Clusters clusters = ClustersOf(records, runs, rtol);
      for (std::size_t c = 0; c < clusters.size(); ++c) {
        for (const std::size_t run : clusters[c]) {
          if (runs.size() > 1) agreements[run].cluster = static_cast<std::int64_t>(c) + 1;
          agreements[run].doubted =
              decided == nullptr ? clusters.size() > 1 : !EndAlike(records[run], *decided, rtol);
        }
      }
      if (decided == nullptr && Decides(records, clusters)) decided = &records[runs.front()];
    }
  }
  return agreements;
}

}  // namespace loopbench::harness
