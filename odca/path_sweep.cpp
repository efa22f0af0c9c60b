#include "odca/path_sweep.h"

#include <algorithm>

namespace loopbench::odca::pins {

namespace {

constexpr Vector2<double> kNone = {0.0, 0.0};

}  // namespace

/// Along a run the parent's values are at hand: to read them back from memory takes twice as long
/// as all the rest.
void PathSweep::SetAngles(const double* q, const double* u) {
  double *angles = angle_.data(), *speeds = speed_.data();
  const Step* step = steps_.data();
  for (const int length : runs_) {
    double angle = angles[step->parent], speed = speeds[step->parent];
    for (const Step* end = step + length; step != end; ++step) {
      angle += step->offset + step->sign * q[step->u];
      speed += step->sign * u[step->u];
      angles[step->child] = angle;
      speeds[step->child] = speed;
    }
  }
}

template <bool kLoops>
Point<Lanes> PathSweep::TurnPacks(const PathPlaces& path) {
  Point<Lanes> at_2 = {};
  Lanes room = Lanes{} + kLargestAngle;
  Lanes speed_before = {}, inverse_before = {};
  for (int i = 0; i < path.packs; ++i) {
    const int pack = path.first_pack + i, place = path.first + i * kLanes;
    const Link<Lanes>& link = pack_kinds_[kind_of_pack_[pack]];
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
      at.gap_w = closure.cut_here * speed + closure.cut_before * speed_before;
      at.gap_v = Scaled(closure.cut_here + closure.cut_before, RelativeVelocity(at.gap_w, gap));
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
  room_ = Min(room_, Smallest(room));
  return at_2;
}

/// What a body's constants and numbers are, wherever it stands.
struct PathSweep::At {
  Link<double> link;
  TurnedLink<double> turned;
  double speed;
};
PathSweep::At PathSweep::Body(const PathPlaces& path, int k) const {
  const double speed = speed_[path.place(k)];
  if (k >= path.packed()) {
    const int single = path.first_single + k - path.packed();
    return {singles_[single], turned_singles_[single], speed};
  }
  const int pack = path.first_pack + k % path.packs, lane = k / path.packs;
  return {LaneOf(pack_kinds_[kind_of_pack_[pack]], lane), LaneOf(turned_packs_[pack], lane), speed};
}
void PathSweep::Set(const PathPlaces& path, int k, const TurnedLink<double>& turned) {
  if (k >= path.packed()) {
    turned_singles_[path.first_single + k - path.packed()] = turned;
  } else {
    SetLane(turned_packs_[path.first_pack + k % path.packs], k / path.packs, turned);
  }
}

void PathSweep::Close(PathPlaces& path, int k, bool here, const Point<double>& gap) {
  const int P = here ? k : k - 1;
  At at_P = Body(path, P);
  const Vector2<double> to_Q = Scaled(1.0 / at_P.link.radius, gap.p);
  if (here) {
    at_P.turned.r1 = at_P.turned.r1 + to_Q;
  } else {
    at_P.turned.r2 = at_P.turned.r2 - to_Q;
  }
  Set(path, P, at_P.turned);
  const Vector2<double> gap_v = RelativeVelocity(at_P.speed, gap);
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

void PathSweep::Turn(PathPlaces& path) {
  const Point<Lanes> ends = path.loops_in_lanes ? TurnPacks<true>(path) : TurnPacks<false>(path);
  for (int k = path.packed(); k < path.bodies; ++k) {
    const int single = path.first_single + k - path.packed();
    const double angle = angle_[path.place(k)];
    room_ = Min(room_, kLargestAngle - Magnitude(angle));
    turned_singles_[single] = pins::Turn(singles_[single], angle);
  }
  if (!path.has_loops) return;
  Point<double> at_2 = {};
  const auto start = [&](int k, const Closure<double>& closure) {
    if (closure.follows > 0.0) return at_2;
    const At at = Body(path, k);
    const Point<double> at_pin = AtPin(at.link, at.turned, at.speed, closure);
    if (IsCut(closure)) Close(path, k, closure.cut_here > 0.0, at_2 - at_pin);
    return at_pin;
  };
  for (int lane = 0; lane < path.lanes(); ++lane) {
    const Point<double> at_1 = start(lane * path.packs, path.starts[lane]);
    at_2 = LaneOf(ends, lane);
    if (!path.loops_in_lanes || !path.stands_alone[lane]) at_2 = at_2 + at_1;
  }
  for (int k = path.packed(); k < path.bodies; ++k) {
    const int single = path.first_single + k - path.packed();
    const TurnedLink<double> own = turned_singles_[single];  // before gaps move its arms
    const Point<double> at_1 = start(k, single_closures_[single]);
    at_2 = Across(singles_[single], own, speed_[path.place(k)], at_1);
  }
  if (!path.ends_at_ground) return;
  if (path.ground_is_P) {
    path.gap_v = at_2.v;
  } else {
    Close(path, path.bodies, false, {at_2.p - path.end, at_2.v});
  }
}

template <Pass kPass>
double PathSweep::Up(PathPlaces& path) {
  OneHandle<double> all = {};
  EndCut<double>* cut = &end_cuts_[path.first_cut];
  double slack = 0.0;
  const auto join = [&](const TwoHandle<double>& next, double limit) {
    if (cut == &end_cuts_[path.first_cut]) {
      all = {next.zeta22, next.zeta23};
    } else {
      all = Join(all, next, limit, *cut, slack);
    }
    ++cut;
  };
  if (path.packs > 0) {
    Lanes slacks = {};
    const auto leaf = [&](int i) {
      const int pack = path.first_pack + i;
      return Leaf<kPass>(pack_kinds_[kind_of_pack_[pack]], turned_packs_[pack],
                         Load<Lanes>(&speed_[path.first + i * kLanes]));
    };
    TwoHandle<Lanes> lanes = leaf(0);
    for (int i = 1; i < path.packs; ++i) {
      const int pack = path.first_pack + i;
      const Lanes limit = pack_kinds_[kind_of_pack_[pack]].limit;
      lanes = Join(lanes, leaf(i), limit, cuts_[pack], slacks);
    }
    slack = Smallest(slacks);
    const Lanes limits = pack_kinds_[kind_of_pack_[path.first_pack]].limit;
    for (int lane = 0; lane < kLanes; ++lane) join(LaneOf(lanes, lane), limits[lane]);
  }
  for (int k = 0; k < path.singles(); ++k) {
    const Link<double>& link = singles_[path.first_single + k];
    const double speed = speed_[path.first + path.packed() + k];
    join(Leaf<kPass>(link, turned_singles_[path.first_single + k], speed), link.limit);
  }
  if (path.ends_at_ground) {  // Ground has no response (33, 34)
    const Symmetric2<double> inverse = InverseOf(all.zeta22, path.end_limit, slack);
    Vector2<double> wanted = kNone;  // of the last body, as TwoHandle::zeta13 of Leaf()
    if (kPass == Pass::kSpeeds) wanted = -path.gap_v;
    if (kPass == Pass::kAccelerations) wanted = Cross(2.0 * path.gap_w, path.gap_v);
    path.end_force = inverse * (all.zeta23 - wanted);
  }
  return slack;
}

/// From the path's end: the force in the joint before a body, then the body's angular acceleration.
/// Forces on lanes are those in the joints between them.
template <Pass kPass>
void PathSweep::Down(const PathPlaces& path) {
  const EndCut<double>* cuts = &end_cuts_[path.first_cut];
  Vector2<double> F2 = path.ends_at_ground ? -path.end_force : kNone;
  for (int k = path.singles() - 1; k >= 0; --k) {
    const int single = path.first_single + k, node = path.lanes() + k;
    const Vector2<double> F1 = node == 0 ? kNone : ForceIn(cuts[node], F2);
    alpha_[path.first + path.packed() + k] =
        AngularAcceleration<kPass>(turned_singles_[single], F1, F2) / singles_[single].radius;
    F2 = -F1;
  }
  if (path.packs == 0) return;
  Vector2<Lanes> F1s, F2s;
  for (int lane = kLanes - 1; lane >= 0; --lane) {
    const Vector2<double> F1 = lane == 0 ? kNone : ForceIn(cuts[lane], F2);
    SetLane(F1s, lane, F1);
    SetLane(F2s, lane, F2);
    F2 = -F1;
  }
  for (int i = path.packs - 1; i >= 0; --i) {
    const int pack = path.first_pack + i;
    const Vector2<Lanes> F1 = i == 0 ? F1s : ForceIn(cuts_[pack], F1s, F2s);
    const Lanes alpha = AngularAcceleration<kPass>(turned_packs_[pack], F1, F2s);
    Store(alpha / pack_kinds_[kind_of_pack_[pack]].radius, &alpha_[path.first + i * kLanes]);
    F2s = -F1;
  }
}

template <bool kAdd>
bool PathSweep::SetRates(double* rates) const {
  const double* alpha = alpha_.data();
  double zeros = 0.0;  // or not a number
  for (const Step& step : steps_) {
    const double rate = step.sign * (alpha[step.child] - alpha[step.parent]);
    rates[step.u] = kAdd ? rates[step.u] + rate : rate;
    zeros += 0.0 * rate;
  }
  return zeros == 0.0;
}

bool PathSweep::Evaluate(SpeedsUsed speeds, std::span<const double> q, std::span<const double> u,
                         std::span<double> qdot, std::span<double> udot) {
  operations_ = 0;
  SetAngles(q.data(), u.data());
  room_ = kLargestAngle;
  for (PathPlaces& path : paths_) Turn(path);
  if (!(room_ >= 0.0)) return false;
  const auto sweep = [&]<Pass kPass>() {
    double slack = 0.0;
    for (PathPlaces& path : paths_) {
      constexpr int kOfEach = Operations::Leaf(kPass) + Operations::kAngularAcceleration + 1;
      operations_ += path.packed() * (kOfEach + Operations::kJoin + Operations::kForceIn) +
                     path.singles() * (kOfEach + Operations::kEndJoin + Operations::kForceInEnd);
      slack = Min(slack, Up<kPass>(path));
    }
    if (!(slack >= 0.0)) return false;
    for (const PathPlaces& path : paths_) Down<kPass>(path);
    return true;
  };
  std::copy_n(u.data(), u.size(), qdot.data());
  if (speeds == SpeedsUsed::kGiven) {
    if (!sweep.operator()<Pass::kAccelerations>()) return false;
  } else {
    if (!sweep.operator()<Pass::kSpeeds>()) return false;
    SetRates<true>(qdot.data());
    speed_ += alpha_;
    if (!sweep.operator()<Pass::kCompleted>()) return false;
  }
  return SetRates<false>(udot.data());
}

}  // namespace loopbench::odca::pins
