// Where bodies of paths stand in the lists of a PathSweep, and their constants.
#include <algorithm>
#include <map>
#include <string>

#include "mechanism/loops/loop_solver.h"
#include "odca/odca.h"
#include "odca/path_sweep.h"

namespace loopbench::odca::pins {

namespace {

/// Shorter lanes are no faster than one body after another (measured with lanes of one).
constexpr int kShortestLane = 2;

bool IsPin(const Joint<Planar, double>& joint) {
  return joint.kind == &KindOf<Planar, double>(JointType::kRevolute) && joint.num_drives == 0 &&
         joint.num_released == 0;
}

/// Whether points in each lane can be followed from its own first body on: a pinned body stands
/// before the first cut joint in it.
bool LanesStandAlone(const std::vector<Closure<double>>& closures, int packs) {
  for (int start = 0; start < packs * kLanes; start += packs) {
    bool pinned = closures[start].follows == 0.0;
    for (int k = start + 1; k < start + packs; ++k) {
      if (IsCut(closures[k]) && !pinned) return false;
      pinned = pinned || closures[k].follows == 0.0;
    }
  }
  return true;
}

/// The longest lanes that do, 0 for none. Where a sequence of bodies repeats, as crank and coupler
/// of a ladder, lanes of whole periods do: periods of up to eight bodies are found.
int LengthOfLanes(const std::vector<Closure<double>>& closures) {
  constexpr int kTrials = 8;
  const int longest = static_cast<int>(closures.size()) / kLanes;
  for (int packs = longest; packs >= std::max(kShortestLane, longest - kTrials); --packs) {
    if (LanesStandAlone(closures, packs)) return packs;
  }
  return 0;
}

/// Sets limits in the order of joins (PathSweep::Up): a join closes a loop where both its sides are
/// pinned to Ground. The lighter of two sides is what answers.
void SetLimits(const Mechanism<Planar, double>& mechanism, int packs, PathLinks& path) {
  struct Side {
    int bodies = 0;
    bool pinned = false;
    void operator+=(const Side& other) {
      bodies += other.bodies;
      pinned = pinned || other.pinned;
    }
  };
  const auto body = [&](int k) { return Side{1, path.closures[k].follows == 0.0}; };
  const auto join = [&](int k, Side& left, const Side& right) {
    if (left.pinned && right.pinned) {
      path.links[k].limit = ShareOfLimit(std::min(left.bodies, right.bodies)) *
                            LimitOf(mechanism, path.path[k].before);
    }
    left += right;
  };
  Side all;
  const int packed = packs * kLanes;
  for (int start = 0; start < packed; start += packs) {
    Side lane = body(start);
    for (int k = start + 1; k < start + packs; ++k) join(k, lane, body(k));
    join(start, all, lane);
  }
  for (int k = packed; k < static_cast<int>(path.links.size()); ++k) join(k, all, body(k));
  path.end_limit *= ShareOfLimit(all.bodies);
}

}  // namespace

std::unique_ptr<PathSweep> PathSweep::Make(const Mechanism<Planar, double>& mechanism) {
  if (mechanism.num_u() == 0 || !mechanism.forces().empty() ||
      !std::ranges::all_of(mechanism.joints(), IsPin)) {
    return nullptr;
  }
  std::unique_ptr<PathSweep> sweep(new PathSweep);
  std::vector<int> place_of(mechanism.num_bodies(), mechanism.num_bodies() - 1);
  std::vector<double> axes(mechanism.num_bodies(), 0.0);
  for (const Path& path : FindPaths(mechanism.num_bodies(), PlanJoints(mechanism))) {
    std::optional<PathLinks> links = MeasurePath(mechanism, path);
    if (!links) return nullptr;
    sweep->Add(mechanism, *links);
    for (std::size_t k = 0; k < links->path.size(); ++k) {
      place_of[links->path[k].body] = sweep->paths_.back().place(static_cast<int>(k));
      axes[links->path[k].body] = links->axes[k];
    }
  }
  if (sweep->paths_.empty()) return nullptr;
  sweep->AddSteps(mechanism, place_of, axes);
  return sweep;
}

void PathSweep::Add(const Mechanism<Planar, double>& mechanism, PathLinks links) {
  PathPlaces path;
  path.bodies = static_cast<int>(links.links.size());
  path.packs = LengthOfLanes(links.closures);
  path.first = num_places_;
  path.first_pack = static_cast<int>(kind_of_pack_.size());
  path.first_single = static_cast<int>(singles_.size());
  path.first_cut = static_cast<int>(end_cuts_.size());
  path.has_loops = links.has_loops;
  path.ends_at_ground = links.ends_at_ground;
  path.ground_is_P = links.ground_is_P;
  path.end = links.end;
  num_places_ += path.bodies;
  SetLimits(mechanism, path.packs, links);
  path.end_limit = links.end_limit;
  for (int lane = 0; lane < path.lanes(); ++lane) {
    Closure<double>& start = links.closures[lane * path.packs];
    path.starts[lane] = start;
    start.cut_here = start.cut_before = 0.0;  // Turn() sees to these
    for (int k = lane * path.packs; k < (lane + 1) * path.packs; ++k) {
      const bool pinned = links.closures[k].follows == 0.0;
      path.stands_alone[lane] = path.stands_alone[lane] || pinned;
      if (pinned && k > lane * path.packs) path.loops_in_lanes = true;
    }
  }
  std::map<std::string, int> kinds;
  for (int i = 0; i < path.packs; ++i) {
    Link<Lanes> pack;
    Closure<Lanes> closure;
    for (int lane = 0; lane < kLanes; ++lane) {
      SetLane(pack, lane, links.links[lane * path.packs + i]);
      SetLane(closure, lane, links.closures[lane * path.packs + i]);
    }
    const std::string bytes(reinterpret_cast<const char*>(&pack), sizeof(pack));
    const auto [kind, is_new] = kinds.try_emplace(bytes, static_cast<int>(pack_kinds_.size()));
    if (is_new) pack_kinds_.push_back(pack);
    kind_of_pack_.push_back(kind->second);
    pack_closures_.push_back(closure);
  }
  singles_.insert(singles_.end(), links.links.begin() + path.packed(), links.links.end());
  single_closures_.insert(single_closures_.end(), links.closures.begin() + path.packed(),
                          links.closures.end());
  turned_packs_.resize(kind_of_pack_.size());
  cuts_.resize(kind_of_pack_.size());
  turned_singles_.resize(singles_.size());
  end_cuts_.resize(end_cuts_.size() + path.lanes() + path.singles());
  paths_.push_back(path);
}

/// X_PF and X_QM are angles here.
void PathSweep::AddSteps(const Mechanism<Planar, double>& mechanism,
                         const std::vector<int>& place_of, const std::vector<double>& axes) {
  for (const TreeStep& step : mechanism.tree()) {
    const Joint<Planar, double>& joint = mechanism.joints()[step.joint];
    const bool goes_on = !steps_.empty() && steps_.back().child == place_of[step.parent];
    if (goes_on) {
      ++runs_.back();
    } else {
      runs_.push_back(1);
    }
    const double of_bodies = step.sign * (joint.X_PF.angle - joint.X_QM.angle);
    steps_.push_back({.u = joint.u_offset,
                      .child = place_of[step.child],
                      .parent = place_of[step.parent],
                      .sign = static_cast<double>(step.sign),
                      .offset = of_bodies + axes[step.child] - axes[step.parent]});
  }
  angle_.setZero(num_places_ + 1);
  speed_ = alpha_ = angle_;
}

}  // namespace loopbench::odca::pins
