#include "odca/path_sweep.h"

#include <algorithm>
#include <cmath>

namespace loopbench::odca::pins {

namespace {

/// range(first, size) over parts of `size` numbers.
template <class Range>
void ForRanges(WorkerPool& pool, std::size_t size, const Range& range) {
  constexpr std::size_t kPart = 4096;
  pool.ForEach(static_cast<int>((size + kPart - 1) / kPart), [&](int i) {
    const std::size_t first = static_cast<std::size_t>(i) * kPart;
    range(first, std::min(kPart, size - first));
  });
}

}  // namespace

template <class T>
template <Pass kPass>
void PathSweepOf<T>::UpGroup(Group& group) {
  const int packs = paths_[group.path].packs;
  const auto leaf = [&](int i) {
    const int pack = group.pack + i;
    return Leaf<kPass>(packs_[pack], turned_packs_[pack],
                       Load<Lanes>(&speed_[group.place + i * kLanes]));
  };
  Lanes slack = {};
  TwoHandle<Lanes> all = leaf(0);
  for (int i = 1; i < packs; ++i) {
    const int pack = group.pack + i;
    const Lanes limit = packs_[pack].limit;
    all = Join(all, leaf(i), limit, cuts_[pack], slack);
  }
  group.assemblies = all;
  group.slack = Smallest(slack);
}

template <class T>
template <Pass kPass>
T PathSweepOf<T>::Up(PathPlaces& path) {
  OneHandle<T> all = {};
  EndCut<T>* cut = &end_cuts_[path.first_cut];
  T slack = {};
  const auto join = [&](const TwoHandle<T>& next, const T& limit) {
    if (cut == &end_cuts_[path.first_cut]) {
      all = {next.zeta22, next.zeta23};
    } else {
      all = Join(all, next, limit, *cut, slack);
    }
    ++cut;
  };
  if constexpr (kIsOne) {
    for (int g = path.first_group; g < path.first_group + path.groups; ++g) {
      const Group& group = groups_[g];
      slack = Min(slack, group.slack);
      const Lanes limits = packs_[group.pack].limit;
      for (int lane = 0; lane < kLanes; ++lane) join(LaneOf(group.assemblies, lane), limits[lane]);
    }
  }
  for (int k = 0; k < path.singles(); ++k) {
    const Link<T>& link = singles_[path.first_single + k];
    const T speed = speed_[path.first + path.packed + k];
    join(Leaf<kPass>(link, turned_singles_[path.first_single + k], speed), link.limit);
  }
  if (path.ends_at_ground) {  // Ground has no response (33, 34)
    const Factored2<T> factors = FactorsOf(all.zeta22, path.end_limit, slack);
    Vector2<T> wanted = {};  // of the last body, as TwoHandle::zeta13 of Leaf()
    if (kPass == Pass::kSpeeds) wanted = -path.gap_v;
    if (kPass == Pass::kAccelerations) wanted = Cross<T>(2.0 * path.gap_w, path.gap_v);
    path.end_force = factors * (all.zeta23 - wanted);
  }
  return slack;
}

/// From the path's end: the force in the joint before a body, then the body's angular acceleration.
/// Forces on pieces are those in the joints between them.
template <class T>
template <Pass kPass>
void PathSweepOf<T>::Down(const PathPlaces& path) {
  const EndCut<T>* cuts = &end_cuts_[path.first_cut];
  Vector2<T> F2 = path.ends_at_ground ? -path.end_force : Vector2<T>{};
  for (int k = path.singles() - 1; k >= 0; --k) {
    const int single = path.first_single + k, node = path.pieces() + k;
    const Vector2<T> F1 = node == 0 ? Vector2<T>{} : ForceIn(cuts[node], F2);
    alpha_[path.first + path.packed + k] =
        AngularAcceleration<kPass>(turned_singles_[single], F1, F2) / singles_[single].radius;
    F2 = -F1;
  }
  if constexpr (kIsOne) {
    for (int piece = path.pieces() - 1; piece >= 0; --piece) {
      const Vector2<double> F1 = piece == 0 ? Vector2<double>{} : ForceIn(cuts[piece], F2);
      Group& group = groups_[path.first_group + piece / kLanes];
      SetLane(group.F1, piece % kLanes, F1);
      SetLane(group.F2, piece % kLanes, F2);
      F2 = -F1;
    }
  }
}

template <class T>
template <Pass kPass>
void PathSweepOf<T>::DownGroup(const Group& group) {
  Vector2<Lanes> F2 = group.F2;
  for (int i = paths_[group.path].packs - 1; i >= 0; --i) {
    const int pack = group.pack + i;
    const Vector2<Lanes> F1 = i == 0 ? group.F1 : ForceIn(cuts_[pack], group.F1, F2);
    const Lanes alpha = AngularAcceleration<kPass>(turned_packs_[pack], F1, F2);
    Store(alpha / packs_[pack].radius, &alpha_[group.place + i * kLanes]);
    F2 = -F1;
  }
}

template <class T>
template <Pass kPass>
TruthOf<T> PathSweepOf<T>::Sweep() {
  [[maybe_unused]] const int groups = static_cast<int>(groups_.size());
  if constexpr (kIsOne) pool_->ForEach(groups, [&](int i) { UpGroup<kPass>(groups_[i]); });
  T slack = {};
  for (PathPlaces& path : paths_) {
    constexpr int kOfEach = Operations::Leaf(kPass) + Operations::kAngularAcceleration + 1;
    operations_ += path.packed * (kOfEach + Operations::kJoin + Operations::kForceIn) +
                   path.singles() * (kOfEach + Operations::kEndJoin + Operations::kForceInEnd);
    slack = Min(slack, Up<kPass>(path));
  }
  const TruthOf<T> good = slack >= 0.0;
  if (!Any(good)) return good;
  for (const PathPlaces& path : paths_) Down<kPass>(path);
  if constexpr (kIsOne) pool_->ForEach(groups, [&](int i) { DownGroup<kPass>(groups_[i]); });
  return good;
}

template <class T>
TruthOf<T> PathSweepOf<T>::Evaluate(SpeedsUsed speeds, Kinematics<Planar, double>*,
                                    std::span<const T> q, std::span<const T> u, std::span<T> qdot,
                                    std::span<T> udot) {
  operations_ = 0;
  tree_.ToBodies(q, u, angle_.data(), speed_.data(), *pool_);
  TruthOf<T> good = Turn<GapKind::kSpeeds>();
  if (!Any(good)) return good;
  if (speeds == SpeedsUsed::kGiven) {
    good &= Sweep<Pass::kAccelerations>();
    if (!Any(good)) return good;
    ForRanges(*pool_, u.size(), [&](std::size_t first, std::size_t size) {
      std::ranges::copy(u.subspan(first, size), qdot.begin() + first);
    });
  } else {
    good &= Sweep<Pass::kSpeeds>();
    if (!Any(good)) return good;
    tree_.ToJoints(alpha_.data(), u, qdot, *pool_);
    ForRanges(*pool_, speed_.size(), [&](std::size_t first, std::size_t size) {
      for (std::size_t i = first; i < first + size; ++i) speed_[i] += alpha_[i];
    });
    good &= Sweep<Pass::kCompleted>();
    if (!Any(good)) return good;
  }
  return good & tree_.ToJoints(alpha_.data(), {}, udot, *pool_);
}

template <class T>
bool PathSweepOf<T>::Place(GapKind kind, std::span<const double> q, std::span<const double> u) {
  tree_.ToBodies(q, u, angle_.data(), speed_.data(), *pool_);
  return kind == GapKind::kSpeeds ? Turn<GapKind::kSpeeds>() : Turn<GapKind::kPositions>();
}

template <class T>
Correction<double> PathSweepOf<T>::LargestGap() const {
  double largest = largest_;
  for (const Group& group : groups_) largest = std::max(largest, group.largest);
  return {.shift = std::sqrt(largest)};
}

template <class T>
bool PathSweepOf<T>::AddChange(std::span<const double> base, std::span<double> sum) {
  return tree_.ToJoints(alpha_.data(), base, sum, *pool_);
}

template bool PathSweep::Evaluate(SpeedsUsed, Kinematics<Planar, double>*, std::span<const double>,
                                  std::span<const double>, std::span<double>, std::span<double>);
template bool PathSweep::Place(GapKind, std::span<const double>, std::span<const double>);
template Correction<double> PathSweep::LargestGap() const;
template bool PathSweep::AddChange(std::span<const double>, std::span<double>);
template LaneBits PathSweepOf<Lanes>::Evaluate(SpeedsUsed, Kinematics<Planar, double>*,
                                               std::span<const Lanes>, std::span<const Lanes>,
                                               std::span<Lanes>, std::span<Lanes>);

}  // namespace loopbench::odca::pins
