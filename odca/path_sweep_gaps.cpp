// Poses of a path's bodies at their angles, and violations of cut joints from points along the
// path.
#include <algorithm>

#include "odca/path_sweep.h"

namespace loopbench::odca::pins {

namespace {

/// Closure flags are equal in all lanes.
bool Says(double truth) { return truth > 0.0; }
bool Says(const Lanes& truth) { return truth[0] > 0.0; }

/// Imposes a cut joint before a body at its point on Q (two_handle.h), seen from the body: moves
/// its handle 1 if it is P, and sets the violation. `gap` leads from there to the body before it.
template <GapKind kGap, class T>
LOOPBENCH_INLINE void SetGap(const Closure<T>& closure, const Point<T>& gap, const T& speed,
                             const T& speed_before, TurnedLink<T>& at, T& largest) {
  const T is_cut = closure.cut_here + closure.cut_before;
  at.r1 = at.r1 + Scaled<T>(closure.cut_here * closure.inverse_radius, gap.p);
  if constexpr (kGap == GapKind::kSpeeds) {
    at.gap_w = closure.cut_here * speed + closure.cut_before * speed_before;
    at.gap_v = Scaled(is_cut, RelativeVelocity(at.gap_w, gap));
  } else {
    at.gap_v = Scaled(is_cut, gap.p);
    largest = -Min<T>(-largest, -(at.gap_v.x * at.gap_v.x + at.gap_v.y * at.gap_v.y));
  }
}

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
      SetGap<kGap>(closure, gap, speed, speed_before, at, largest);
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

/// Subtracts `shift` [m] from handle 2 of body k, if that is P of a cut joint.
template <class T>
void PathSweepOf<T>::MoveEnd(const PathPlaces& path, int k, const Vector2<T>& shift) {
  if constexpr (kIsOne) {
    if (k < path.packed) {
      const int pack = path.first_pack + path.pack(k), lane = path.lane(k);
      Vector2<Lanes>& r2 = turned_packs_[pack].r2;
      const double inverse_radius = pack_closures_[pack].inverse_radius[lane];
      r2.x[lane] -= inverse_radius * shift.x;
      r2.y[lane] -= inverse_radius * shift.y;
      return;
    }
  }
  const int single = path.first_single + k - path.packed;
  Vector2<T>& r2 = turned_singles_[single].r2;
  r2 = r2 - Scaled(single_closures_[single].inverse_radius, shift);
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
  const Lanes speed_before =
      LaneAfter(Load<Lanes>(&speed_[group.place + (path.packs - 1) * kLanes]),
                is_first ? 0.0 : speed_[group.place - 1]);
  Lanes largest = {};
  SetGap<kGap>(starts, gap, speed, speed_before, turned, largest);
  group.largest = std::max(group.largest, -Smallest(-largest));
  const Vector2<Lanes> to_Q = Scaled(starts.cut_before, gap.p);
  Vector2<Lanes>& r2 = turned_packs_[last].r2;
  r2 = r2 -
       Scaled<Lanes>(pack_closures_[last].inverse_radius, {LaneBefore(to_Q.x), LaneBefore(to_Q.y)});
  if (is_first) return;
  const int first = (group.pack - path.first_pack) * kLanes;
  MoveEnd(path, first - 1, LaneOf(to_Q, 0));
}

template <class T>
template <GapKind kGap>
void PathSweepOf<T>::CloseLoops(PathPlaces& path) {
  Point<T> at_2 = {};
  if constexpr (kIsOne) {
    for (int g = path.first_group; g < path.first_group + path.groups; ++g) {
      CloseStarts<kGap>(groups_[g], at_2);
    }
  }
  T speed_before = path.packed > 0 ? speed_[path.place(path.packed - 1)] : T{};
  for (int k = path.packed; k < path.bodies; ++k) {
    const int single = path.first_single + k - path.packed;
    const Closure<T>& closure = single_closures_[single];
    TurnedLink<T>& at = turned_singles_[single];
    const TurnedLink<T> own = at;  // before violations move its arms
    const T speed = speed_[path.first + k];
    Point<T> at_1 = at_2;
    if (!Says(closure.follows)) {
      at_1 = AtPin(singles_[single], at, speed, closure);
      if (Says(closure.cut_here + closure.cut_before)) {
        const Point<T> gap = at_2 - at_1;
        SetGap<kGap>(closure, gap, speed, speed_before, at, largest_);
        if (Says(closure.cut_before)) MoveEnd(path, k - 1, gap.p);
      }
    }
    at_2 = Across(singles_[single], own, speed, at_1);
    speed_before = speed;
  }
  if (!path.ends_at_ground) return;
  const Point<T> gap = {at_2.p - path.end, at_2.v};
  path.gap_w = path.ground_is_P ? T{} : speed_before;
  if (!path.ground_is_P) MoveEnd(path, path.bodies - 1, gap.p);
  path.gap_v = kGap == GapKind::kSpeeds ? RelativeVelocity(path.gap_w, gap) : gap.p;
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
