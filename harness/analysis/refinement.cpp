#include "harness/analysis/refinement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>

#include "harness/analysis/agreement.h"

namespace loopbench::harness {
namespace {

/// All that names the case of a run but its tolerance.
std::string ColumnOf(const Record& record) {
  std::string name = record.Text("scene_id");
  for (const auto& [key, value] : record.items()) {
    if (key == "case_id" || key == "scene_id") break;
    if (key != "rtol" && key != "atol") name += "|" + key + "=" + record.Text(key);
  }
  return name;
}

/// ode45 makes ten steps of whatever is smooth: at any tolerance the same.
constexpr double kFewSteps = 12.0;

bool SameInEveryBit(const Record& a, const Record& b) {
  return a.Number("steps") > kFewSteps && a.Number("steps") == b.Number("steps") &&
         a.Number("rejected") == b.Number("rejected") && !a.Text("state_hash").empty() &&
         a.Text("state_hash") == b.Text("state_hash");
}

}  // namespace

std::vector<Refinement> CompareTolerances(std::span<const Record> records) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  std::map<std::string, std::vector<std::size_t>> columns;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Record& record = records[i];
    const bool counts = record.Text("kind") == "accuracy" && record.Text("outcome") == "finished" &&
                        !record.Text("scene_id").empty() && record.Number("rtol") > 0.0;
    if (counts) columns[ColumnOf(record)].push_back(i);
  }
  std::vector<Refinement> refinements(records.size(), {false, kNaN, kNaN});
  for (auto& [name, runs] : columns) {
    const auto rtol = [&](std::size_t run) { return records[run].Number("rtol"); };
    std::ranges::stable_sort(runs, std::greater<>(), rtol);
    const auto same = std::ranges::unique(runs, {}, rtol);
    runs.erase(same.begin(), same.end());
    constexpr std::size_t kFewest = 3;
    if (runs.size() < kFewest) continue;
    const auto doubt_from = [&](std::size_t first) {
      for (std::size_t i = first; i < runs.size(); ++i) refinements[runs[i]].doubted = true;
    };
    for (std::size_t i = 0; i + 1 < runs.size(); ++i) {
      Refinement& own = refinements[runs[i]];
      own.off = DifferenceOf(records[runs[i]], records[runs.back()]).largest;
      if (SameInEveryBit(records[runs[i]], records[runs[i + 1]])) doubt_from(i);
      if (i == 0) continue;
      own.off_before = refinements[runs[i - 1]].off;
      const double shrunk = std::pow(rtol(runs[i]) / rtol(runs[i - 1]), 0.25);
      const bool far = own.off > kMostTolerances * rtol(runs[i]) && own.off > kRoundOffShare;
      if (far && own.off > shrunk * own.off_before) doubt_from(i);
    }
  }
  return refinements;
}

}  // namespace loopbench::harness
