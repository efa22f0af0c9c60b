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
Point<Lanes> PathSweep::TurnPacks(const Piece& piece) {
  Point<Lanes> at_2 = {};
  Lanes room = Lanes{} + kLargestAngle;
  Lanes speed_before = {}, inverse_before = {};
  for (int i = 0; i < piece.packs; ++i) {
    const int pack = piece.first_pack + i, place = piece.first + i * kLanes;
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
    } else if (piece.has_loops) {
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
PathSweep::At PathSweep::Body(const Piece& piece, int k) const {
  const double speed = speed_[piece.place(k)];
  if (k >= piece.packed()) {
    const int single = piece.first_single + k - piece.packed();
    return {singles_[single], turned_singles_[single], speed};
  }
  const int pack = piece.first_pack + k % piece.packs, lane = k / piece.packs;
  return {LaneOf(pack_kinds_[kind_of_pack_[pack]], lane), LaneOf(turned_packs_[pack], lane), speed};
}
void PathSweep::Set(const Piece& piece, int k, const TurnedLink<double>& turned) {
  if (k >= piece.packed()) {
    turned_singles_[piece.first_single + k - piece.packed()] = turned;
  } else {
    SetLane(turned_packs_[piece.first_pack + k % piece.packs], k / piece.packs, turned);
  }
}

void PathSweep::Close(Piece& piece, int k, bool here, const Point<double>& gap) {
  const int P = here ? k : k - 1;
  At at_P = Body(piece, P);
  const Vector2<double> to_Q = Scaled(1.0 / at_P.link.radius, gap.p);
  if (here) {
    at_P.turned.r1 = at_P.turned.r1 + to_Q;
  } else {
    at_P.turned.r2 = at_P.turned.r2 - to_Q;
  }
  Set(piece, P, at_P.turned);
  const Vector2<double> gap_v = RelativeVelocity(at_P.speed, gap);
  if (k == piece.bodies) {
    piece.gap_v = gap_v;
    piece.gap_w = at_P.speed;
    return;
  }
  At at = Body(piece, k);
  at.turned.gap_v = gap_v;
  at.turned.gap_w = at_P.speed;
  Set(piece, k, at.turned);
}

void PathSweep::Turn(Piece& piece) {
  const Point<Lanes> ends = piece.loops_in_lanes ? TurnPacks<true>(piece) : TurnPacks<false>(piece);
  for (int k = piece.packed(); k < piece.bodies; ++k) {
    const int single = piece.first_single + k - piece.packed();
    const double angle = angle_[piece.place(k)];
    room_ = Min(room_, kLargestAngle - Magnitude(angle));
    turned_singles_[single] = pins::Turn(singles_[single], angle);
  }
  if (!piece.has_loops) return;
  Point<double> at_2 = {};
  const auto start = [&](int k, const Closure<double>& closure) {
    if (closure.follows > 0.0) return at_2;
    const At at = Body(piece, k);
    const Point<double> at_pin = AtPin(at.link, at.turned, at.speed, closure);
    if (IsCut(closure)) Close(piece, k, closure.cut_here > 0.0, at_2 - at_pin);
    return at_pin;
  };
  for (int lane = 0; lane < piece.lanes(); ++lane) {
    const Point<double> at_1 = start(lane * piece.packs, piece.starts[lane]);
    at_2 = LaneOf(ends, lane);
    if (!piece.loops_in_lanes || !piece.stands_alone[lane]) at_2 = at_2 + at_1;
  }
  for (int k = piece.packed(); k < piece.bodies; ++k) {
    const int single = piece.first_single + k - piece.packed();
    const TurnedLink<double> own = turned_singles_[single];  // before gaps move its arms
    const Point<double> at_1 = start(k, single_closures_[single]);
    at_2 = Across(singles_[single], own, speed_[piece.place(k)], at_1);
  }
  if (!piece.ends_at_ground) return;
  if (piece.ground_is_P) {
    piece.gap_v = at_2.v;
  } else {
    Close(piece, piece.bodies, false, {at_2.p - piece.end, at_2.v});
  }
}

template <Pass kPass>
double PathSweep::Up(Piece& piece) {
  OneHandle<double> all = {};
  EndCut<double>* cut = &end_cuts_[piece.first_cut];
  double slack = 0.0;
  const auto join = [&](const TwoHandle<double>& next, double limit) {
    if (cut == &end_cuts_[piece.first_cut]) {
      all = {next.zeta22, next.zeta23};
    } else {
      all = Join(all, next, limit, *cut, slack);
    }
    ++cut;
  };
  if (piece.packs > 0) {
    Lanes slacks = {};
    const auto leaf = [&](int i) {
      const int pack = piece.first_pack + i;
      return Leaf<kPass>(pack_kinds_[kind_of_pack_[pack]], turned_packs_[pack],
                         Load<Lanes>(&speed_[piece.first + i * kLanes]));
    };
    TwoHandle<Lanes> lanes = leaf(0);
    for (int i = 1; i < piece.packs; ++i) {
      const int pack = piece.first_pack + i;
      const Lanes limit = pack_kinds_[kind_of_pack_[pack]].limit;
      lanes = Join(lanes, leaf(i), limit, cuts_[pack], slacks);
    }
    slack = Smallest(slacks);
    const Lanes limits = pack_kinds_[kind_of_pack_[piece.first_pack]].limit;
    for (int lane = 0; lane < kLanes; ++lane) join(LaneOf(lanes, lane), limits[lane]);
  }
  for (int k = 0; k < piece.singles(); ++k) {
    const Link<double>& link = singles_[piece.first_single + k];
    const double speed = speed_[piece.first + piece.packed() + k];
    join(Leaf<kPass>(link, turned_singles_[piece.first_single + k], speed), link.limit);
  }
  if (piece.ends_at_ground) {  // Ground has no response (33, 34)
    const Symmetric2<double> inverse = InverseOf(all.zeta22, piece.end_limit, slack);
    Vector2<double> wanted = kNone;  // of the last body, as TwoHandle::zeta13 of Leaf()
    if (kPass == Pass::kSpeeds) wanted = -piece.gap_v;
    if (kPass == Pass::kAccelerations) wanted = Cross(2.0 * piece.gap_w, piece.gap_v);
    piece.end_force = inverse * (all.zeta23 - wanted);
  }
  return slack;
}

/// From the path's end: the force in the joint before a body, then the body's angular acceleration.
/// Forces on lanes are those in the joints between them.
template <Pass kPass>
void PathSweep::Down(const Piece& piece) {
  const EndCut<double>* cuts = &end_cuts_[piece.first_cut];
  Vector2<double> F2 = piece.ends_at_ground ? -piece.end_force : kNone;
  for (int k = piece.singles() - 1; k >= 0; --k) {
    const int single = piece.first_single + k, node = piece.lanes() + k;
    const Vector2<double> F1 = node == 0 ? kNone : ForceIn(cuts[node], F2);
    alpha_[piece.first + piece.packed() + k] =
        AngularAcceleration<kPass>(turned_singles_[single], F1, F2) / singles_[single].radius;
    F2 = -F1;
  }
  if (piece.packs == 0) return;
  Vector2<Lanes> F1s, F2s;
  for (int lane = kLanes - 1; lane >= 0; --lane) {
    const Vector2<double> F1 = lane == 0 ? kNone : ForceIn(cuts[lane], F2);
    SetLane(F1s, lane, F1);
    SetLane(F2s, lane, F2);
    F2 = -F1;
  }
  for (int i = piece.packs - 1; i >= 0; --i) {
    const int pack = piece.first_pack + i;
    const Vector2<Lanes> F1 = i == 0 ? F1s : ForceIn(cuts_[pack], F1s, F2s);
    const Lanes alpha = AngularAcceleration<kPass>(turned_packs_[pack], F1, F2s);
    Store(alpha / pack_kinds_[kind_of_pack_[pack]].radius, &alpha_[piece.first + i * kLanes]);
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
  for (Piece& piece : pieces_) Turn(piece);
  if (!(room_ >= 0.0)) return false;
  const auto sweep = [&]<Pass kPass>() {
    operations_ += operations_of_pass_;
    double slack = 0.0;
    for (Piece& piece : pieces_) slack = Min(slack, Up<kPass>(piece));
    if (!(slack >= 0.0)) return false;
    for (const Piece& piece : pieces_) Down<kPass>(piece);
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
