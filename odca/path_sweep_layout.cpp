// Layout of a PathSweep: slots of bodies in its lists, and their constants.
#include <algorithm>
#include <functional>

#include "mechanism/loops/loop_solver.h"
#include "odca/odca.h"
#include "odca/path_sweep.h"

namespace loopbench::odca::pins {

namespace {

/// Shorter pieces are no faster than one body after another (measured with lanes of one).
constexpr int kShortestPiece = 2;

/// Their pieces are joined one after another.
constexpr int kMaxGroups = 128;

/// Returns true if points in each piece can be followed from its own first body: a pinned body
/// precedes the first cut joint in it.
bool PiecesStandAlone(const std::vector<Closure<double>>& closures, int pieces, int length) {
  for (int start = 0; start < pieces * length; start += length) {
    bool pinned = closures[start].follows == 0.0;
    for (int k = start + 1; k < start + length; ++k) {
      if (IsCut(closures[k]) && !pinned) return false;
      pinned = pinned || closures[k].follows == 0.0;
    }
  }
  return true;
}

/// Returns the longest length of so many such pieces, 0 for none. If a sequence of bodies repeats,
/// like crank and coupler of a ladder, pieces of whole periods qualify: periods of up to eight
/// bodies are found.
int LengthOfPieces(const std::vector<Closure<double>>& closures, int pieces) {
  constexpr int kTrials = 8;
  const int longest = static_cast<int>(closures.size()) / pieces;
  for (int length = longest; length >= std::max(kShortestPiece, longest - kTrials); --length) {
    if (PiecesStandAlone(closures, pieces, length)) return length;
  }
  return 0;
}

/// Sets limits in the order of joins (PathSweep::Up): a join closes a loop if both its sides are
/// pinned to Ground. The lighter of two sides determines the response.
void SetLimits(const Mechanism<Planar, double>& mechanism, int pieces, int length,
               PathLinks& path) {
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
  const int packed = pieces * length;
  for (int start = 0; start < packed; start += length) {
    Side piece = body(start);
    for (int k = start + 1; k < start + length; ++k) join(k, piece, body(k));
    join(start, all, piece);
  }
  for (int k = packed; k < static_cast<int>(path.links.size()); ++k) join(k, all, body(k));
  path.end_limit *= ShareOfLimit(all.bodies);
}

}  // namespace

template <class T>
void PathSweepOf<T>::Resize(int threads) {
  turned_singles_.resize(singles_.size());
  angle_.assign(num_places_ + 1, T{});
  speed_ = alpha_ = angle_;
  pool_ = std::make_unique<WorkerPool>(threads);
}

template <class T>
std::unique_ptr<PathSweepOf<T>> PathSweepOf<T>::Make(const Mechanism<Planar, double>& mechanism,
                                                     int threads, int bodies_of_group) {
  if (!HasOnlyPins(mechanism) || !mechanism.forces().empty()) return nullptr;
  std::unique_ptr<PathSweepOf> sweep(new PathSweepOf);
  std::vector<int> place_of(mechanism.num_bodies(), mechanism.num_bodies() - 1);
  std::vector<double> axes(mechanism.num_bodies(), 0.0);
  for (const Path& path : FindPaths(mechanism.num_bodies(), PlanJoints(mechanism))) {
    std::optional<PathLinks> links = MeasurePath(mechanism, path);
    if (!links) return nullptr;
    sweep->Add(mechanism, *links, bodies_of_group);
    for (std::size_t k = 0; k < links->path.size(); ++k) {
      place_of[links->path[k].body] = sweep->paths_.back().place(static_cast<int>(k));
      axes[links->path[k].body] = links->axes[k];
    }
  }
  if (sweep->paths_.empty()) return nullptr;
  sweep->tree_ = TreeAngles<T>(mechanism, place_of, axes);
  const int useful = std::max(1, sweep->num_places_ / bodies_of_group);
  sweep->SetSize(mechanism);
  sweep->Resize(std::min(threads, useful));
  return sweep;
}

template <class T>
std::unique_ptr<PathSweepOf<T>> PathSweepOf<T>::InLanes(const PathSweepOf<double>& one) {
  if (!one.groups_.empty()) return nullptr;
  std::unique_ptr<PathSweepOf> sweep(new PathSweepOf);
  for (const PathShape& path : one.paths_) sweep->paths_.push_back({path});
  sweep->singles_.resize(one.singles_.size());
  sweep->single_closures_.resize(one.single_closures_.size());
  sweep->end_cuts_.resize(one.end_cuts_.size());
  sweep->num_places_ = one.num_places_;
  sweep->tree_ = TreeAngles<T>::Like(one.tree_);
  sweep->Resize(1);
  for (int lane = 0; lane < kLanes; ++lane) sweep->SetConstants(lane, one);
  return sweep;
}

template <class T>
bool PathSweepOf<T>::SetMechanism(int lane, const PathSweepOf<double>& one) {
  const auto same_closure = [](const Closure<T>& a, const Closure<double>& b) {
    return a.follows[0] == b.follows && a.cut_here[0] == b.cut_here &&
           a.cut_before[0] == b.cut_before;
  };
  if (!one.groups_.empty() || !std::ranges::equal(paths_, one.paths_, std::equal_to<PathShape>()) ||
      !std::ranges::equal(single_closures_, one.single_closures_, same_closure) ||
      !tree_.SetOffsets(lane, one.tree_)) {
    return false;
  }
  SetConstants(lane, one);
  return true;
}

template <class T>
void PathSweepOf<T>::SetConstants(int lane, const PathSweepOf<double>& one) {
  for (std::size_t i = 0; i < paths_.size(); ++i) {
    SetLane(paths_[i].end, lane, one.paths_[i].end);
    SetLane(paths_[i].end_limit, lane, one.paths_[i].end_limit);
  }
  for (std::size_t k = 0; k < singles_.size(); ++k) {
    SetLane(singles_[k], lane, one.singles_[k]);
    SetLane(single_closures_[k], lane, one.single_closures_[k]);
  }
}

template <class T>
void PathSweepOf<T>::Add(const Mechanism<Planar, double>& mechanism, PathLinks links,
                         int bodies_of_group) {
  PathPlaces path;
  path.bodies = static_cast<int>(links.links.size());
  path.groups = std::clamp(path.bodies / bodies_of_group, 1, kMaxGroups);
  while (path.groups > 0) {
    path.packs = LengthOfPieces(links.closures, path.pieces());
    if (path.packs > 0) break;
    path.groups /= 2;
  }
  path.packed = path.packs * path.pieces();
  path.first = num_places_;
  path.first_group = static_cast<int>(groups_.size());
  path.first_pack = packs_.size();
  path.first_single = static_cast<int>(singles_.size());
  path.first_cut = static_cast<int>(end_cuts_.size());
  path.has_loops = links.has_loops;
  path.ends_at_ground = links.ends_at_ground;
  path.ground_is_P = links.ground_is_P;
  path.end = links.end;
  num_places_ += path.bodies;
  SetLimits(mechanism, path.pieces(), path.packs, links);
  path.end_limit = links.end_limit;
  for (int k = 0; k < path.packed; ++k) {
    if (k % path.packs > 0 && links.closures[k].follows == 0.0) path.loops_in_lanes = true;
  }
  AddPacks(path, links);
  singles_.insert(singles_.end(), links.links.begin() + path.packed, links.links.end());
  single_closures_.insert(single_closures_.end(), links.closures.begin() + path.packed,
                          links.closures.end());
  end_cuts_.resize(end_cuts_.size() + path.pieces() + path.singles());
  paths_.push_back(path);
}

template <class T>
void PathSweepOf<T>::AddPacks(const PathPlaces& path, const PathLinks& links) {
  for (int g = 0; g < path.groups; ++g) {
    Group group{};
    group.leads = Lanes{} + 1.0;
    group.path = static_cast<int>(paths_.size());
    group.pack = path.first_pack + g * path.packs;
    group.place = path.first + g * path.packs * kLanes;
    for (int i = 0; i < path.packs; ++i) {
      Link<Lanes> pack;
      Closure<Lanes> closure;
      for (int lane = 0; lane < kLanes; ++lane) {
        const int k = (g * kLanes + lane) * path.packs + i;
        SetLane(pack, lane, links.links[k]);
        SetLane(closure, lane, links.closures[k]);
        if (path.loops_in_lanes && links.closures[k].follows == 0.0) group.leads[lane] = 0.0;
        if (i == 0 && IsCut(links.closures[k])) group.cuts_starts = true;
      }
      if (i == 0) {
        group.starts = closure;
        closure.cut_here = closure.cut_before = Lanes{};
      }
      packs_.Add(pack);
      pack_closures_.push_back(closure);
    }
    group.in_turn = Any(group.leads * group.starts.follows > 0.0);
    groups_.push_back(group);
  }
  turned_packs_.resize(packs_.size());
  cuts_.resize(packs_.size());
}

template std::unique_ptr<PathSweep> PathSweep::Make(const Mechanism<Planar, double>&, int, int);
template std::unique_ptr<PathSweepOf<Lanes>> PathSweepOf<Lanes>::InLanes(const PathSweep&);
template bool PathSweepOf<Lanes>::SetMechanism(int, const PathSweep&);

}  // namespace loopbench::odca::pins
