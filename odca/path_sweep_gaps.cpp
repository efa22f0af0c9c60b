// Poses of a path's bodies at their angles, and violations of cut joints from points along the
// path.
#include <algorithm>

#include "odca/path_sweep.h"

namespace loopbench::odca::pins {

namespace {

/// Closure flags are equal in all lanes.
bool Says(double truth) { return truth > 0.0; }
bool Says(const Lanes& truth) { return truth[0] > 0.0; }

}  // namespace

template <class T>
template <bool kLoops, GapKind kGap>
void PathSweepOf<T>::TurnPacks(Group& group) {
  const PathPlaces& path = paths_[group.path];
  Point<Lanes> at_2 = {};
  Lanes room = Lanes{} + kLargestAngle;
  Lanes speed_before = {}, inverse_before = {}, largest = {};
  for (int i = 0; i < path.packs; ++i) {
    const int pack = group.pack + i, place = group.place + i * kLanes;
    const Link<Lanes>& link = packs_[pack];
    const Lanes speed = Load<Lanes>(&speed_[place]);
    const Lanes angle = Load<Lanes>(&angle_[place]);
    room = Min(room, kLargestAngle - Magnitude(angle));
    TurnedLink<Lanes> at = pins::Turn(link, angle);
    if constexpr (kLoops) {
      const Closure<Lanes>& closure = pack_closures_[pack];
      const Point<Lanes> at_pin = AtPin(link, at, speed, closure);
      const Point<Lanes> gap = at_2 - at_pin;
      const Point<Lanes> at_1 = {at_pin.p + Scaled(closure.follows, gap.p),
                                 at_pin.v + Scaled(closure.follows, gap.v)};
      at_2 = Across(link, at, speed, at_1);
      at.r1 = at.r1 + Scaled(closure.cut_here * closure.inverse_radius, gap.p);
      if constexpr (kGap == GapKind::kSpeeds) {
        at.gap_w = closure.cut_here * speed + closure.cut_before * speed_before;
        at.gap_v = Scaled(closure.cut_here + closure.cut_before, RelativeVelocity(at.gap_w, gap));
      } else {
        at.gap_v = Scaled(closure.cut_here + closure.cut_before, gap.p);
        largest = -Min(-largest, -(at.gap_v.x * at.gap_v.x + at.gap_v.y * at.gap_v.y));
      }
      if (i > 0) {
        Vector2<Lanes>& r2 = turned_packs_[pack - 1].r2;
        r2 = r2 - Scaled(closure.cut_before * inverse_before, gap.p);
      }
      speed_before = speed;
      inverse_before = closure.inverse_radius;
    } else if (path.has_loops) {
      at_2 = Across(link, at, speed, at_2);
    }
    turned_packs_[pack] = at;
  }
  group.room = Smallest(room);
  group.largest = -Smallest(-largest);
  group.ends = at_2;
}

/// Constants and numbers of a body, independent of their storage.
template <class T>
struct PathSweepOf<T>::At {
  Link<T> link;
  TurnedLink<T> turned;
  T speed;
};
template <class T>
typename PathSweepOf<T>::At PathSweepOf<T>::Body(const PathPlaces& path, int k) const {
  if constexpr (kIsOne) {
    if (k < path.packed) {
      const int pack = path.first_pack + path.pack(k), lane = path.lane(k);
      return {LaneOf(packs_[pack], lane), LaneOf(turned_packs_[pack], lane), speed_[path.place(k)]};
    }
  }
  const int single = path.first_single + k - path.packed;
  return {singles_[single], turned_singles_[single], speed_[path.first + k]};
}
template <class T>
void PathSweepOf<T>::Set(const PathPlaces& path, int k, const TurnedLink<T>& turned) {
  if constexpr (kIsOne) {
    if (k < path.packed) {
      return SetLane(turned_packs_[path.first_pack + path.pack(k)], path.lane(k), turned);
    }
  }
  turned_singles_[path.first_single + k - path.packed] = turned;
}

template <class T>
template <GapKind kGap>
void PathSweepOf<T>::Close(PathPlaces& path, int k, bool here, const Point<T>& gap) {
  const int P = here ? k : k - 1;
  At at_P = Body(path, P);
  const Vector2<T> to_Q = Scaled(1.0 / at_P.link.radius, gap.p);
  if (here) {
    at_P.turned.r1 = at_P.turned.r1 + to_Q;
  } else {
    at_P.turned.r2 = at_P.turned.r2 - to_Q;
  }
  Set(path, P, at_P.turned);
  const Vector2<T> gap_v = kGap == GapKind::kSpeeds ? RelativeVelocity(at_P.speed, gap) : gap.p;
  largest_ = Max<T>(largest_, gap_v.x * gap_v.x + gap_v.y * gap_v.y);
  if (k == path.bodies) {
    path.gap_v = gap_v;
    path.gap_w = at_P.speed;
    return;
  }
  At at = Body(path, k);
  at.turned.gap_v = gap_v;
  at.turned.gap_w = at_P.speed;
  Set(path, k, at.turned);
}

template <class T>
T PathSweepOf<T>::TurnSingles(const PathPlaces& path) {
  T room = T{} + kLargestAngle;
  for (int k = path.packed; k < path.bodies; ++k) {
    const int single = path.first_single + k - path.packed;
    const T angle = angle_[path.first + k];
    room = Min<T>(room, kLargestAngle - Magnitude(angle));
    turned_singles_[single] = pins::Turn(singles_[single], angle);
  }
  return room;
}

/// Closes loops like TurnPacks() in between, except that the body before each first one is one lane
/// before it, in the last pack, or ends the previous group.
template <class T>
template <GapKind kGap>
void PathSweepOf<T>::CloseStarts(Group& group, Point<double>& at_2) {
  const Closure<Lanes>& starts = group.starts;
  TurnedLink<Lanes>& turned = turned_packs_[group.pack];
  const Lanes speed = Load<Lanes>(&speed_[group.place]);
  const Point<Lanes> at_pin = AtPin(packs_[group.pack], turned, speed, starts);
  Point<Lanes> reached;
  if (group.in_turn) {
    for (int lane = 0; lane < kLanes; ++lane) {
      SetLane(reached, lane, at_2);
      const Point<double> at_1 = starts.follows[lane] > 0.0 ? at_2 : LaneOf(at_pin, lane);
      const double leads = group.leads[lane];
      at_2 = LaneOf(group.ends, lane) + Point<double>{Scaled(leads, at_1.p), Scaled(leads, at_1.v)};
    }
  } else {
    const Point<Lanes> ends =
        group.ends + Point<Lanes>{Scaled(group.leads, at_pin.p), Scaled(group.leads, at_pin.v)};
    reached = {{LaneAfter(ends.p.x, at_2.p.x), LaneAfter(ends.p.y, at_2.p.y)},
               {LaneAfter(ends.v.x, at_2.v.x), LaneAfter(ends.v.y, at_2.v.y)}};
    at_2 = LaneOf(ends, kLanes - 1);
  }
  if (!group.cuts_starts) return;
  const PathPlaces& path = paths_[group.path];
  const bool is_first = group.pack == path.first_pack;
  const int last = group.pack + path.packs - 1;
  const Point<Lanes> gap = reached - at_pin;
  turned.r1 = turned.r1 + Scaled(starts.cut_here * starts.inverse_radius, gap.p);
  if constexpr (kGap == GapKind::kSpeeds) {
    const Lanes speed_before =
        LaneAfter(Load<Lanes>(&speed_[group.place + (path.packs - 1) * kLanes]),
                  is_first ? 0.0 : speed_[group.place - 1]);
    turned.gap_w = starts.cut_here * speed + starts.cut_before * speed_before;
    turned.gap_v = Scaled(starts.cut_here + starts.cut_before, RelativeVelocity(turned.gap_w, gap));
  } else {
    turned.gap_v = Scaled(starts.cut_here + starts.cut_before, gap.p);
    const Lanes squares = turned.gap_v.x * turned.gap_v.x + turned.gap_v.y * turned.gap_v.y;
    group.largest = std::max(group.largest, -Smallest(-squares));
  }
  const Vector2<Lanes> to_Q = Scaled(starts.cut_before, gap.p);
  Vector2<Lanes>& r2 = turned_packs_[last].r2;
  r2 = r2 -
       Scaled<Lanes>(pack_closures_[last].inverse_radius, {LaneBefore(to_Q.x), LaneBefore(to_Q.y)});
  if (is_first) return;
  const double inverse_radius = pack_closures_[group.pack - 1].inverse_radius[kLanes - 1];
  Vector2<Lanes>& of_group_before = turned_packs_[group.pack - 1].r2;
  of_group_before.x[kLanes - 1] -= inverse_radius * to_Q.x[0];
  of_group_before.y[kLanes - 1] -= inverse_radius * to_Q.y[0];
}

template <class T>
template <GapKind kGap>
void PathSweepOf<T>::CloseLoops(PathPlaces& path) {
  Point<T> at_2 = {};
  const auto start = [&](int k, const Closure<T>& closure) {
    if (Says(closure.follows)) return at_2;
    const At at = Body(path, k);
    const Point<T> at_pin = AtPin(at.link, at.turned, at.speed, closure);
    const bool cut_here = Says(closure.cut_here);
    if (cut_here || Says(closure.cut_before)) Close<kGap>(path, k, cut_here, at_2 - at_pin);
    return at_pin;
  };
  if constexpr (kIsOne) {
    for (int g = path.first_group; g < path.first_group + path.groups; ++g) {
      CloseStarts<kGap>(groups_[g], at_2);
    }
  }
  for (int k = path.packed; k < path.bodies; ++k) {
    const int single = path.first_single + k - path.packed;
    const TurnedLink<T> own = turned_singles_[single];  // before violations move its arms
    const Point<T> at_1 = start(k, single_closures_[single]);
    at_2 = Across(singles_[single], own, speed_[path.first + k], at_1);
  }
  if (!path.ends_at_ground) return;
  const Point<T> gap = {at_2.p - path.end, at_2.v};
  if (!path.ground_is_P) return Close<kGap>(path, path.bodies, false, gap);
  path.gap_v = kGap == GapKind::kSpeeds ? gap.v : gap.p;
  largest_ = Max<T>(largest_, gap.p.x * gap.p.x + gap.p.y * gap.p.y);
}

template <class T>
template <GapKind kGap>
TruthOf<T> PathSweepOf<T>::Turn() {
  if constexpr (kIsOne) {
    pool_->ForEach(static_cast<int>(groups_.size()), [&](int i) {
      if (paths_[groups_[i].path].loops_in_lanes) {
        TurnPacks<true, kGap>(groups_[i]);
      } else {
        TurnPacks<false, kGap>(groups_[i]);
      }
    });
    for (const Group& group : groups_) {
      if (!(group.room >= 0.0)) return false;
    }
  }
  largest_ = T{};
  TruthOf<T> good = T{} >= 0.0;
  for (PathPlaces& path : paths_) {
    good &= TurnSingles(path) >= 0.0;
    if (!Any(good)) break;
    if (path.has_loops) CloseLoops<kGap>(path);
  }
  return good;
}

template bool PathSweep::Turn<GapKind::kSpeeds>();
template bool PathSweep::Turn<GapKind::kPositions>();
template LaneBits PathSweepOf<Lanes>::Turn<GapKind::kSpeeds>();

}  // namespace loopbench::odca::pins
