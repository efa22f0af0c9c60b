// Agreement of runs: their final poses, and the convergence of finer tolerances.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "harness/base/text.h"
#include "harness/config/formulations.h"
#include "harness/judge/analysis.h"
#include "harness/judge/tables.h"

namespace loopbench::harness {
namespace {

constexpr std::string_view kPrefix = "series.final.";

/// Runs of one problem, horizon and tolerance with equal final poses, by index, largest set first.
using Clusters = std::vector<std::vector<std::size_t>>;

bool HasFinalPoses(const Record& record) {
  return IsFinishedRun(record) && !record.Text("problem_id").empty() &&
         !std::isnan(record.Number("rtol")) &&
         std::ranges::any_of(record.items(),
                             [](const auto& item) { return item.first.starts_with(kPrefix); });
}

const std::vector<double>* PoseOf(const std::string& key, const Value& value) {
  return key.starts_with(kPrefix) ? std::get_if<std::vector<double>>(&value) : nullptr;
}

/// Returns the unit of component i of a pose: link length, or 1 rad.
double UnitOf(double link_length, std::size_t size, std::size_t i) {
  return i < (size == 3 ? 2u : 3u) ? link_length : 1.0;
}

bool IsSoft(const Record& record) {
  const FormulationRow* row = FindFormulation(record.Text("formulation"));
  return row != nullptr && row->is_soft;
}

template <class Choose>
std::vector<std::size_t> Only(std::vector<std::size_t> runs, const Choose& chooses) {
  std::erase_if(runs, std::not_fn(chooses));
  return runs;
}

bool EndAlike(const Record& a, const Record& b, double rtol) {
  return DifferenceOf(a, b).largest <= kMaxTolerances * rtol;
}

/// Final poses of a set of runs: of each component the least and the largest. A number that is not
/// finite, or is not there, is as far as can be from all others.
class Bounds {
 public:
  /// Returns true if `run` has the final pose of each run in the cluster.
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
        if (!(off / UnitOf(length_, pose->size(), i) <= kMaxTolerances * rtol)) return false;
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

/// Returns true if runs of different equations are all in one cluster.
bool Decides(std::span<const Record> records, const Clusters& clusters) {
  if (clusters.size() != 1) return false;
  std::set<std::string> ways;
  for (const std::size_t run : clusters.front()) {
    ways.insert(records[run].Text("enforcement") + " " + records[run].Text("coordinates"));
  }
  return ways.size() > 1;
}

/// Returns true if the run's level restores the branch at every step.
bool KeepsBranches(const Record& record) {
  const auto level = FindLevel(record.Text("enforcement"));
  return level && TraitsOf(*level).growth == DriftGrowth::kNone && !IsPeer(record);
}

/// Returns a run whose final pose decides for its tolerance: all runs of its integrator (and the
/// external engines) agree. Null if none or if another integrator's runs agree elsewhere.
const Record* DecidedBy(std::span<const Record> records, const std::vector<std::size_t>& runs,
                        double rtol) {
  std::set<std::string> integrators;
  for (const std::size_t run : runs) {
    if (!IsPeer(records[run])) integrators.insert(records[run].Text("integrator"));
  }
  const Record* decided = nullptr;
  for (const std::string& integrator : integrators) {
    const std::vector<std::size_t> own = Only(runs, [&](std::size_t run) {
      return IsPeer(records[run]) || records[run].Text("integrator") == integrator;
    });
    if (!Decides(records, ClustersOf(records, own, rtol))) continue;
    const Record* witness = &records[own.front()];
    if (decided != nullptr && !EndAlike(*decided, *witness, rtol)) return nullptr;
    if (decided == nullptr) decided = witness;
  }
  return decided;
}

}  // namespace

PoseDifference LargestDifference(std::span<const Record> runs) {
  Bounds bounds;
  for (const Record& run : runs) bounds.Take(run);
  return bounds.Widest();
}

PoseDifference DifferenceOf(const Record& a, const Record& b) {
  Bounds bounds;
  for (const Record* run : {&a, &b}) bounds.Take(*run);
  return bounds.Widest();
}

std::vector<Agreement> CompareFinalPoses(std::span<const Record> records,
                                         std::vector<bool> testifies) {
  if (testifies.empty()) testifies.assign(records.size(), true);
  // by problem and horizon, then by tolerance, the finest first
  std::map<std::pair<std::string, double>, std::map<double, std::vector<std::size_t>>> problems;
  for (std::size_t i = 0; i < records.size(); ++i) {
    if (!HasFinalPoses(records[i])) continue;
    problems[{records[i].Text("problem_id"), records[i].Number("horizon")}][ToleranceOf(records[i])]
        .push_back(i);
  }
  std::vector<Agreement> agreements(records.size());
  for (const auto& [problem, tolerances] : problems) {
    const Record* decided = nullptr;
    for (const auto& [rtol, all] : tolerances) {
      const auto runs = Only(all, [&](std::size_t run) { return !IsSoft(records[run]); });
      auto witnesses = Only(runs, [&](std::size_t run) { return testifies[run]; });
      if (witnesses.empty()) witnesses = runs;
      const Clusters clusters = ClustersOf(records, runs, rtol);
      if (decided == nullptr) decided = DecidedBy(records, witnesses, rtol);
      // final pose for comparison: the decided one, or the common one
      const Record* others = decided;
      if (others == nullptr && clusters.size() == 1) others = &records[clusters.front().front()];
      for (std::size_t c = 0; c < clusters.size(); ++c) {
        for (const std::size_t run : clusters[c]) {
          if (all.size() > 1) agreements[run].cluster = static_cast<std::int64_t>(c) + 1;
        }
      }
      for (const std::size_t run : all) {
        if (runs.empty()) continue;
        Agreement& agreement = agreements[run];
        agreement.flagged = others == nullptr || !EndAlike(records[run], *others, rtol);
        if (!IsSoft(records[run])) continue;
        agreement.cluster = agreement.flagged ? static_cast<std::int64_t>(clusters.size()) + 1 : 1;
      }
      // a run keeps its branch if it ends like a run whose level restores branches
      const bool is_kept = std::ranges::any_of(witnesses, [&](std::size_t run) {
        return testifies[run] && KeepsBranches(records[run]) && !agreements[run].flagged;
      });
      for (const std::size_t run : runs) {
        agreements[run].is_backed = is_kept && !agreements[run].flagged;
      }
    }
  }
  return agreements;
}

// Tests whether finer tolerances bring a method's runs nearer to one final pose. Convergence fails
// for a wrong derivative, an ignored tolerance, or a motion without a limit.

namespace {

/// Returns all keys that name the case of a run, except its tolerance.
std::string ColumnOf(const Record& record) {
  std::string name = record.Text("problem_id");
  for (const auto& [key, value] : record.items()) {
    if (key == "case_id" || key == "problem_id") break;
    if (key != "rtol" && !key.starts_with("atol")) name += "|" + key + "=" + record.Text(key);
  }
  return name;
}

/// ode45 needs ten steps for smooth motions, at any tolerance.
constexpr double kTrivialSteps = 12.0;

bool SameInEveryBit(const Record& a, const Record& b) {
  return a.Number("steps") > kTrivialSteps && a.Number("steps") == b.Number("steps") &&
         a.Number("rejected") == b.Number("rejected") && !a.Text("state_hash").empty() &&
         a.Text("state_hash") == b.Text("state_hash");
}

/// Returns which records are flagged among finished accuracy runs that differ only in the tolerance
/// (three at least). If a distance from the finest run exceeds kMaxTolerances and has not shrunk by
/// the fourth root of the tolerances' ratio, the finer runs are flagged. So are two runs of more
/// than a dozen steps that are equal in every bit and step: the tolerance had no effect.
std::vector<bool> FlaggedByTolerances(std::span<const Record> records) {
  std::map<std::string, std::vector<std::size_t>> columns;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Record& record = records[i];
    const bool counts =
        IsFinishedRun(record) && !record.Text("problem_id").empty() && ToleranceOf(record) > 0.0;
    if (counts) columns[ColumnOf(record)].push_back(i);
  }
  std::vector<bool> flagged(records.size(), false);
  for (auto& [name, runs] : columns) {
    const auto tolerance = [&](std::size_t run) { return ToleranceOf(records[run]); };
    std::ranges::stable_sort(runs, std::greater<>(), tolerance);
    const auto same = std::ranges::unique(runs, {}, tolerance);
    runs.erase(same.begin(), same.end());
    constexpr std::size_t kFewest = 3;
    if (runs.size() < kFewest) continue;
    const auto flag_from = [&](std::size_t first) {
      for (std::size_t i = first; i < runs.size(); ++i) flagged[runs[i]] = true;
    };
    double off_before = 0.0;  // at the next coarser tolerance
    for (std::size_t i = 0; i + 1 < runs.size(); ++i) {
      const double off = DifferenceOf(records[runs[i]], records[runs.back()]).largest;
      const double before = std::exchange(off_before, off);
      if (SameInEveryBit(records[runs[i]], records[runs[i + 1]])) flag_from(i);
      if (i == 0) continue;
      const double shrunk = std::pow(tolerance(runs[i]) / tolerance(runs[i - 1]), 0.25);
      const bool far = off > kMaxTolerances * tolerance(runs[i]) && off > kRoundOffShare;
      if (far && off > shrunk * before) flag_from(i);
    }
  }
  return flagged;
}

}  // namespace

void SetWarnings(std::vector<Record>* records) {
  std::vector<std::vector<std::string>> own;
  std::vector<bool> testifies;
  for (const Record& record : *records) {
    own.push_back(OwnCodes(record));
    // warnings on ensemble members and exponents do not concern the trajectory itself
    testifies.push_back(std::ranges::all_of(own.back(), [](const std::string& code) {
      return code == kMembersWarning || code == kExponentWarning;
    }));
  }
  const std::vector<Agreement> agreements = CompareFinalPoses(*records, testifies);
  const std::vector<bool> unconverged = FlaggedByTolerances(*records);
  for (std::size_t i = 0; i < records->size(); ++i) {
    Record& record = (*records)[i];
    if (!IsFinishedRun(record)) continue;
    std::vector<std::string>& codes = own[i];
    // the others need not be right; a reference is
    const bool certified = IsCertified(record);
    // runs that end like one whose level restores branches have kept it
    if (agreements[i].is_backed) std::erase(codes, kSingularWarning);
    if (agreements[i].flagged && !certified) codes.emplace_back(kDisagreementWarning);
    if (unconverged[i] && !certified) AddOnce(codes, kRefinementWarning);
    record.Set("warnings", Joined(codes, " "));
    if (agreements[i].cluster > 0) record.Set("agreement", agreements[i].cluster);
  }
}

}  // namespace loopbench::harness
