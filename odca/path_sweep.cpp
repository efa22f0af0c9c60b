// O-DCA for planar mechanisms whose bodies form paths (path_links.h) of pins under gravity:
// computes rates directly from joint coordinates and speeds, in the kernels of pins.h.
//
//   angles and speeds of bodies   along the spanning tree (tree_angles.h)
//   violations of cut joints      along each path
//   up, down                      chain_sweep.h
//
// Other mechanisms of the same shape can fill unused lanes. T = Lanes holds kLanes mechanisms, one
// per lane; T = double holds one.
//
// Pins that close loops must not be degenerate: if Factor() finds a suspicious one, the general
// sweep decides. Its scale is the trace of the free response of the joint's two bodies, which is at
// least the scale of loop_solver.h.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

#include "mechanism/loops/loop_solver.h"
#include "odca/chain_sweep.h"
#include "odca/odca.h"
#include "odca/path_links.h"
#include "odca/tree_angles.h"

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

/// Sets limits in the order of joins: a join closes a loop if both its sides are pinned to Ground.
/// The lighter of two sides determines the response.
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

/// Closure flags are equal in all lanes.
bool Says(double truth) { return truth > 0.0; }
bool Says(const Lanes& truth) { return truth[0] > 0.0; }

/// Imposes a cut joint before a body at its point on Q (pins.h), seen from the body: moves
/// its handle 1 if it is P, and sets the violation. `gap` leads from there to the body before it.
template <bool kOfSpeeds, class T>
LOOPBENCH_INLINE void SetGap(const Closure<T>& closure, const Point<T>& gap, const T& speed,
                             const T& speed_before, TurnedLink<T>& at, T& largest) {
  const T is_cut = closure.cut_here + closure.cut_before;
  at.r1 = at.r1 + Scaled<T>(closure.cut_here * closure.inverse_radius, gap.p);
  if constexpr (kOfSpeeds) {
    at.gap_w = closure.cut_here * speed + closure.cut_before * speed_before;
    at.gap_v = Scaled(is_cut, RelativeVelocity(at.gap_w, gap));
  } else {
    at.gap_v = Scaled(is_cut, gap.p);
    largest = -Min<T>(-largest, -(at.gap_v.x * at.gap_v.x + at.gap_v.y * at.gap_v.y));
  }
}

struct PathKind {
  static constexpr int kRows = pins::kRows;
  static constexpr bool kBeginsFree = true;
  template <class T>
  using Link = pins::Link<T>;

  struct Shape : ChainNodes {
    bool has_loops = false;                            ///< points are followed along it
    bool loops_in_lanes = false;                       ///< so that closures of packs are asked for
    bool ends_at_ground = false, ground_is_P = false;  ///< as in PathLinks

    bool operator==(const Shape&) const = default;
  };
  /// Numbers that depend on the mechanism or on the state.
  template <class T>
  struct OfChain : Shape {
    Vector2<T> end = {};
    HandleForce<T, pins::kRows> end_force = {};  ///< on the last body
    Vector2<T> gap_v = {};                       ///< as of TurnedLink, at that joint
    T gap_w = {}, end_limit = {};
  };
  struct OfGroup {
    int path = 0;
    Closure<Lanes> starts = {};   ///< of its pieces' first bodies, which packs leave open
    bool cuts_starts = false;     ///< any of these joints is cut
    Lanes leads = Lanes{} + 1.0;  ///< 1: ends relative to a piece's start, 0: to its pin
    bool in_turn = false;         ///< any piece starts and ends at the previous one's end
    Point<Lanes> ends = {};       ///< of its pieces (TurnPacks())
    double room = 0.0;
    double largest = 0.0;  ///< square of the largest gap in it, of positions
  };
};

template <class T>
class PathSweep final : public ChainSweep<PathSweep<T>, PathKind, Planar, T> {
  using Sweep = ChainSweep<PathSweep<T>, PathKind, Planar, T>;
  using Sweep::chains_, Sweep::groups_, Sweep::packs_, Sweep::cuts_, Sweep::singles_;
  using Sweep::end_cuts_, Sweep::num_pieces_, Sweep::packed_, Sweep::operations_, Sweep::pool_;
  using Sweep::kIsOne;
  using typename Sweep::Chain, typename Sweep::Group;
  friend Sweep;
  template <class>
  friend class PathSweep;

 public:
  static std::unique_ptr<PathSweep> Make(const Mechanism<Planar, double>& mechanism, int threads,
                                         int bodies_of_group) {
    if (!HasOnlyPins(mechanism) || !mechanism.forces().empty()) return nullptr;
    std::vector<PathLinks> paths;
    for (const Path& path : FindPaths(mechanism.num_bodies(), PlanJoints(mechanism))) {
      std::optional<PathLinks> links = MeasurePath(mechanism, path);
      if (!links) return nullptr;
      paths.push_back(std::move(*links));
    }
    if (paths.empty()) return nullptr;
    std::unique_ptr<PathSweep> sweep(new PathSweep);
    sweep->Lay(mechanism, paths, bodies_of_group);
    std::vector<int> place_of(mechanism.num_bodies(), mechanism.num_bodies() - 1);
    std::vector<double> axes(mechanism.num_bodies(), 0.0);
    for (std::size_t p = 0; p < paths.size(); ++p) {
      for (std::size_t k = 0; k < paths[p].path.size(); ++k) {
        const int body = paths[p].path[k].body;
        place_of[body] = sweep->place(sweep->chains_[p], static_cast<int>(k));
        axes[body] = paths[p].axes[k];
      }
    }
    sweep->tree_ = TreeAngles<T>(mechanism, place_of, axes);
    const int bodies = mechanism.num_bodies() - 1, useful = std::max(1, bodies / bodies_of_group);
    sweep->Resize(bodies, mechanism.num_u(), mechanism.length(), std::min(threads, useful));
    return sweep;
  }

  /// Returns null if the pieces of `one` fill the lanes.
  static std::unique_ptr<PathSweep> InLanes(const PathSweep<double>& one) {
    if (!one.groups_.empty()) return nullptr;
    std::unique_ptr<PathSweep> sweep(new PathSweep);
    for (const PathKind::Shape& path : one.chains_) sweep->chains_.push_back({path});
    sweep->singles_.resize(one.singles_.size());
    sweep->single_closures_.resize(one.single_closures_.size());
    sweep->end_cuts_.resize(one.end_cuts_.size());
    sweep->tree_ = TreeAngles<T>(one.tree_);
    sweep->Resize(one.singles_.size(), static_cast<int>(one.num_u()), 1.0, 1);
    for (int lane = 0; lane < kLanes; ++lane) sweep->SetConstants(lane, one);
    return sweep;
  }

  /// Copies the constants of `one` into a lane. Returns false, without change, if its shape
  /// differs.
  bool SetMechanism(int lane, const PathSweep<double>& one) {
    const auto same_closure = [](const Closure<T>& a, const Closure<double>& b) {
      return a.follows[0] == b.follows && a.cut_here[0] == b.cut_here &&
             a.cut_before[0] == b.cut_before;
    };
    if (!std::ranges::equal(chains_, one.chains_, std::equal_to<PathKind::Shape>()) ||
        !std::ranges::equal(single_closures_, one.single_closures_, same_closure) ||
        !tree_.SetOffsets(lane, one.tree_)) {
      return false;
    }
    SetConstants(lane, one);
    return true;
  }

  TruthOf<T> Place(Unknowns unknowns, std::span<const T> q, std::span<const T> u) override {
    tree_.ToBodies(q, u, angle_.data(), speed_.data(), *pool_);
    if constexpr (kIsOne) {
      if (unknowns == Unknowns::kPositions) return TurnAll<false>();
    }
    return TurnAll<true>();
  }
  Correction<double> LargestGap() const override {
    double largest = -Smallest(-largest_);
    for (const Group& group : groups_) largest = std::max(largest, group.largest);
    return {.shift = std::sqrt(largest)};
  }
  TruthOf<T> Find(Unknowns unknowns) override {
    return unknowns == Unknowns::kAccelerations ? this->template Solve<Unknowns::kAccelerations>()
           : unknowns == Unknowns::kCompleted   ? this->template Solve<Unknowns::kCompleted>()
                                                : this->template Solve<Unknowns::kSpeeds>();
  }
  TruthOf<T> AddChange(std::span<const T> base, std::span<T> sum) override {
    return tree_.ToJoints(alpha_.data(), base, sum, *pool_);
  }
  void AddToSpeeds() override {
    this->template ForParts<4096>(speed_.size(), [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) speed_[i] += alpha_[i];
    });
  }

 private:
  void Resize(std::size_t bodies, std::size_t num_u, double length, int threads) {
    turned_singles_.resize(singles_.size());
    angle_.assign(bodies + 1, T{});
    speed_ = alpha_ = angle_;
    this->SetSize(num_u, length, threads);
  }

  void SetConstants(int lane, const PathSweep<double>& one) {
    for (std::size_t i = 0; i < chains_.size(); ++i) {
      SetLane(chains_[i].end, lane, one.chains_[i].end);
      SetLane(chains_[i].end_limit, lane, one.chains_[i].end_limit);
    }
    for (std::size_t k = 0; k < singles_.size(); ++k) {
      SetLane(singles_[k], lane, one.singles_[k]);
      SetLane(single_closures_[k], lane, one.single_closures_[k]);
    }
  }

  void Lay(const Mechanism<Planar, double>& mechanism, std::span<PathLinks> paths,
           int bodies_of_group) {
    std::vector<Link<Lanes>> packs;
    for (PathLinks& path : paths) {
      int groups = std::clamp(static_cast<int>(path.links.size()) / bodies_of_group, 1, kMaxGroups);
      int length = 0;
      for (; groups > 0; groups /= 2) {
        length = LengthOfPieces(path.closures, groups * kLanes);
        if (length > 0) break;
      }
      const int pieces = groups * kLanes, packed = pieces * length;
      SetLimits(mechanism, pieces, length, path);
      const auto pinned = [&](int k) { return path.closures[k].follows == 0.0; };
      Chain& chain = this->AddChain(path.links, pieces, length, packs);
      chain.has_loops = path.has_loops;
      chain.ends_at_ground = path.ends_at_ground;
      chain.ground_is_P = path.ground_is_P;
      chain.end = path.end;
      chain.end_limit = path.end_limit;
      for (int k = 0; k < packed; ++k) {
        if (k % length > 0 && pinned(k)) chain.loops_in_lanes = true;
      }
      for (int piece = 0; piece < pieces; piece += kLanes) {
        LayClosures(path.closures, length, piece, this->group_of(chain.first_piece + piece));
      }
      single_closures_.insert(single_closures_.end(), path.closures.begin() + packed,
                              path.closures.end());
    }
    this->EndChains();
    turned_packs_.resize(packs_.size());
  }

  /// Closures of a group that begins with this piece of its path.
  void LayClosures(const std::vector<Closure<double>>& closures, int length, int piece,
                   Group& group) {
    group.path = static_cast<int>(chains_.size()) - 1;
    for (int i = 0; i < length; ++i) {
      Closure<Lanes>& closure = pack_closures_.emplace_back();
      for (int lane = 0; lane < kLanes; ++lane) {
        const Closure<double>& one = closures[(piece + lane) * length + i];
        SetLane(closure, lane, one);
        if (chains_.back().loops_in_lanes && one.follows == 0.0) group.leads[lane] = 0.0;
        if (i == 0 && IsCut(one)) group.cuts_starts = true;
      }
      if (i > 0) continue;
      group.starts = closure;
      closure.cut_here = closure.cut_before = Lanes{};
    }
    group.in_turn = Any(group.leads * group.starts.follows > 0.0);
  }

  /// Computes the bodies at their angles, with the terms from violations of cut joints. Returns
  /// false for angles beyond kLargestAngle.
  template <bool kOfSpeeds>
  TruthOf<T> TurnAll() {
    if constexpr (kIsOne) {
      pool_->ForEach(static_cast<int>(groups_.size()), [&](int i) {
        if (chains_[groups_[i].path].loops_in_lanes) {
          TurnPacks<true, kOfSpeeds>(groups_[i]);
        } else {
          TurnPacks<false, kOfSpeeds>(groups_[i]);
        }
      });
      for (const Group& group : groups_) {
        if (!(group.room >= 0.0)) return false;
      }
    }
    largest_ = T{};
    TruthOf<T> good = T{} >= 0.0;
    for (Chain& path : chains_) {
      good &= TurnSingles(path) >= 0.0;
      if (!Any(good)) break;
      if (path.has_loops) CloseLoops<kOfSpeeds>(path);
    }
    return good;
  }

  /// Computes the end point of each piece, relative to its start unless it has its own pin.
  template <bool kLoops, bool kOfSpeeds>
  void TurnPacks(Group& group) {
    const bool has_loops = chains_[group.path].has_loops;
    Point<Lanes> at_2 = {};
    Lanes room = Lanes{} + kLargestAngle;
    Lanes speed_before = {}, inverse_before = {}, largest = {};
    for (int pack = group.pack; pack < group.pack + group.length; ++pack) {
      const Link<Lanes>& link = packs_[pack];
      const Lanes speed = Load<Lanes>(&speed_[pack * kLanes]);
      const Lanes angle = Load<Lanes>(&angle_[pack * kLanes]);
      room = Min(room, kLargestAngle - Magnitude(angle));
      TurnedLink<Lanes> at = Turn(link, angle);
      if constexpr (kLoops) {
        const Closure<Lanes>& closure = pack_closures_[pack];
        const Point<Lanes> at_pin = AtPin(link, at, speed, closure);
        const Point<Lanes> gap = at_2 - at_pin;
        const Point<Lanes> at_1 = {at_pin.p + Scaled(closure.follows, gap.p),
                                   at_pin.v + Scaled(closure.follows, gap.v)};
        at_2 = Across(link, at, speed, at_1);
        SetGap<kOfSpeeds>(closure, gap, speed, speed_before, at, largest);
        if (pack > group.pack) {
          Vector2<Lanes>& r2 = turned_packs_[pack - 1].r2;
          r2 = r2 - Scaled(closure.cut_before * inverse_before, gap.p);
        }
        speed_before = speed;
        inverse_before = closure.inverse_radius;
      } else if (has_loops) {
        at_2 = Across(link, at, speed, at_2);
      }
      turned_packs_[pack] = at;
    }
    group.room = Smallest(room);
    group.largest = -Smallest(-largest);
    group.ends = at_2;
  }

  /// Computes the following bodies; returns the remainder up to kLargestAngle.
  T TurnSingles(const Chain& path) {
    T room = T{} + kLargestAngle;
    for (int single = path.first_single; single < path.first_single + path.singles; ++single) {
      const T angle = angle_[packed_ + single];
      room = Min<T>(room, kLargestAngle - Magnitude(angle));
      turned_singles_[single] = Turn(singles_[single], angle);
    }
    return room;
  }

  /// Subtracts `shift` [m] from handle 2 of the body at a place, if that is P of a cut joint.
  void MoveEnd(int place, const Vector2<T>& shift) {
    if constexpr (kIsOne) {
      if (place < packed_) {
        const int pack = place / kLanes, lane = place % kLanes;
        Vector2<Lanes>& r2 = turned_packs_[pack].r2;
        const double inverse_radius = pack_closures_[pack].inverse_radius[lane];
        r2.x[lane] -= inverse_radius * shift.x;
        r2.y[lane] -= inverse_radius * shift.y;
        return;
      }
    }
    Vector2<T>& r2 = turned_singles_[place - packed_].r2;
    r2 = r2 - Scaled(single_closures_[place - packed_].inverse_radius, shift);
  }

  /// Closes loops along the pieces of a group at their first bodies, like TurnPacks() in between.
  /// The body before each first one is one lane before it, in the last pack, or ends the previous
  /// group. `at_2` leads from there to the last body of the group.
  template <bool kOfSpeeds>
  [[gnu::noinline]] void CloseStarts(Group& group, Point<double>& at_2) {
    const Closure<Lanes>& starts = group.starts;
    TurnedLink<Lanes>& turned = turned_packs_[group.pack];
    const int last = group.pack + group.length - 1, first_place = group.pack * kLanes;
    const Lanes speed = Load<Lanes>(&speed_[first_place]);
    const Point<Lanes> at_pin = AtPin(packs_[group.pack], turned, speed, starts);
    Point<Lanes> reached;
    if (group.in_turn) {
      for (int lane = 0; lane < kLanes; ++lane) {
        SetLane(reached, lane, at_2);
        const Point<double> at_1 = starts.follows[lane] > 0.0 ? at_2 : LaneOf(at_pin, lane);
        const double leads = group.leads[lane];
        at_2 =
            LaneOf(group.ends, lane) + Point<double>{Scaled(leads, at_1.p), Scaled(leads, at_1.v)};
      }
    } else {
      const Point<Lanes> ends =
          group.ends + Point<Lanes>{Scaled(group.leads, at_pin.p), Scaled(group.leads, at_pin.v)};
      reached = {{LaneAfter(ends.p.x, at_2.p.x), LaneAfter(ends.p.y, at_2.p.y)},
                 {LaneAfter(ends.v.x, at_2.v.x), LaneAfter(ends.v.y, at_2.v.y)}};
      at_2 = LaneOf(ends, kLanes - 1);
    }
    if (!group.cuts_starts) return;
    const bool is_first = &group == &this->group_of(chains_[group.path].first_piece);
    const Point<Lanes> gap = reached - at_pin;
    const Lanes speed_before =
        LaneAfter(Load<Lanes>(&speed_[last * kLanes]), is_first ? 0.0 : speed_[first_place - 1]);
    Lanes largest = {};
    SetGap<kOfSpeeds>(starts, gap, speed, speed_before, turned, largest);
    group.largest = std::max(group.largest, -Smallest(-largest));
    const Vector2<Lanes> to_Q = Scaled(starts.cut_before, gap.p);
    Vector2<Lanes>& r2 = turned_packs_[last].r2;
    r2 = r2 - Scaled<Lanes>(pack_closures_[last].inverse_radius,
                            {LaneBefore(to_Q.x), LaneBefore(to_Q.y)});
    if (!is_first) MoveEnd(first_place - 1, LaneOf(to_Q, 0));
  }

  template <bool kOfSpeeds>
  void CloseLoops(Chain& path) {
    Point<T> at_2 = {};
    int before = -1;  // place of the previous body
    if constexpr (kIsOne) {
      for (int piece = 0; piece < path.pieces; piece += kLanes) {
        Group& group = this->group_of(path.first_piece + piece);
        CloseStarts<kOfSpeeds>(group, at_2);
        before = (group.pack + group.length) * kLanes - 1;
      }
    }
    T speed_before = before >= 0 ? speed_[before] : T{};
    for (int single = path.first_single; single < path.first_single + path.singles; ++single) {
      const Closure<T>& closure = single_closures_[single];
      TurnedLink<T>& at = turned_singles_[single];
      const TurnedLink<T> own = at;  // before violations move its arms
      const T speed = speed_[packed_ + single];
      Point<T> at_1 = at_2;
      if (!Says(closure.follows)) {
        at_1 = AtPin(singles_[single], at, speed, closure);
        if (Says(closure.cut_here + closure.cut_before)) {
          const Point<T> gap = at_2 - at_1;
          SetGap<kOfSpeeds>(closure, gap, speed, speed_before, at, largest_);
          if (Says(closure.cut_before)) MoveEnd(before, gap.p);
        }
      }
      at_2 = Across(singles_[single], own, speed, at_1);
      speed_before = speed;
      before = packed_ + single;
    }
    if (!path.ends_at_ground) return;
    const Point<T> gap = {at_2.p - path.end, at_2.v};
    path.gap_w = path.ground_is_P ? T{} : speed_before;
    if (!path.ground_is_P) MoveEnd(before, gap.p);
    path.gap_v = kOfSpeeds ? RelativeVelocity(path.gap_w, gap) : gap.p;
    largest_ = Max<T>(largest_, gap.p.x * gap.p.x + gap.p.y * gap.p.y);
  }

  // steps of ChainSweep
  int MotionBefore(const Group&) const { return 0; }
  // inlined for every T: products are fused with the sums of a join, and lanes need the same bits
  template <Unknowns kUnknowns>
  LOOPBENCH_INLINE Free<Lanes> FreeOfPack(int pack, int) const {
    return FreeMotion<kUnknowns>(packs_[pack], turned_packs_[pack],
                                 Load<Lanes>(&speed_[pack * kLanes]));
  }
  template <Unknowns kUnknowns>
  LOOPBENCH_INLINE Free<T> FreeOfSingle(int single) const {
    return FreeMotion<kUnknowns>(singles_[single], turned_singles_[single],
                                 speed_[packed_ + single]);
  }
  LOOPBENCH_INLINE auto ResponseOfPack(int pack) const {
    return ResponseOf(packs_[pack], turned_packs_[pack]);
  }
  LOOPBENCH_INLINE auto ResponseOfSingle(int single) const {
    return ResponseOf(singles_[single], turned_singles_[single]);
  }
  void TurnToNext(int /*place*/, auto& /*all*/) const {}
  template <Unknowns kUnknowns>
  OneHandle<T, kRows> Start(const Chain&) const {
    OneHandle<T, kRows> none = {};
    return none;
  }
  template <Unknowns kUnknowns>
  T End(Chain& path, const OneHandle<T, kRows>& all, T slack) {
    constexpr int kOfEach =
        kResponseWork + FreeMotionWork(kUnknowns) + kAngularAccelerationWork + 1;
    using Work = Operations<kRows>;
    operations_ += path.pieces * this->length(path) * (kOfEach + Work::kJoin + Work::kForceIn) +
                   path.singles * (kOfEach + Work::EndJoin(kRows) + Work::ForceInEnd(kRows));
    if (!path.ends_at_ground) return slack;
    // Ground has no response (33, 34)
    Factors<T, kRows> X = {all.zeta22};
    Factor(X, path.end_limit, slack);
    Vector2<T> wanted = {};  // of the last body, as zeta13 of FreeMotion()
    if (kUnknowns == Unknowns::kSpeeds) wanted = -path.gap_v;
    if (kUnknowns == Unknowns::kAccelerations) wanted = Cross<T>(2.0 * path.gap_w, path.gap_v);
    path.end_force = {wanted.x - all.zeta23[0], wanted.y - all.zeta23[1]};
    X.Solve(path.end_force.at);
    return slack;
  }
  template <Unknowns kUnknowns>
  T Close(T slack) {
    return slack;
  }
  template <Unknowns kUnknowns>
  HandleForce<T, kRows> EndForce(const Chain& path) {
    return path.ends_at_ground ? path.end_force : HandleForce<T, kRows>{};
  }
  template <Unknowns kUnknowns>
  void RespondSingle(int single, const HandleForce<T, kRows>& F1, const HandleForce<T, kRows>& F2) {
    alpha_[packed_ + single] =
        AngularAcceleration<kUnknowns>(turned_singles_[single], F1.at, F2.at) /
        singles_[single].radius;
  }
  template <Unknowns kUnknowns>
  void Respond(const Group&, int pack, const HandleForce<Lanes, kRows>& F1,
               const HandleForce<Lanes, kRows>& F2) {
    const Lanes alpha = AngularAcceleration<kUnknowns>(turned_packs_[pack], F1.at, F2.at);
    Store(alpha / packs_[pack].radius, &alpha_[pack * kLanes]);
  }
  template <class U>
  LOOPBENCH_INLINE HandleForce<U, kRows> Opposite(int /*place*/,
                                                  const HandleForce<U, kRows>& F1) const {
    return {-F1.at[0], -F1.at[1]};
  }

  std::vector<Closure<Lanes>> pack_closures_;
  std::vector<TurnedLink<Lanes>> turned_packs_;
  std::vector<Closure<T>> single_closures_;
  std::vector<TurnedLink<T>> turned_singles_;
  std::vector<T> angle_, speed_, alpha_;  ///< by place; the last one is Ground's
  T largest_ = {};  ///< square of the largest gap, of positions, of all joints outside of groups
  TreeAngles<T> tree_;
};

void Gather(std::span<const double> one, int lane, std::vector<Lanes>& all) {
  for (std::size_t i = 0; i < one.size(); ++i) all[i][lane] = one[i];
}
void Scatter(const std::vector<Lanes>& all, int lane, std::span<double> one) {
  for (std::size_t i = 0; i < one.size(); ++i) one[i] = all[i][lane];
}

}  // namespace

std::unique_ptr<ShortCut<Planar>> MakePathSweep(const Mechanism<Planar, double>& mechanism,
                                                int threads, int bodies_of_group) {
  return PathSweep<double>::Make(mechanism, threads, bodies_of_group);
}

std::unique_ptr<ShortCut<Planar, Lanes>> MakePathLanes(const ShortCut<Planar>& one) {
  return PathSweep<Lanes>::InLanes(static_cast<const PathSweep<double>&>(one));
}

bool SetMechanism(ShortCut<Planar, Lanes>& lanes, int lane, const ShortCut<Planar>& one) {
  return static_cast<PathSweep<Lanes>&>(lanes).SetMechanism(
      lane, static_cast<const PathSweep<double>&>(one));
}

/// A lane: the pending evaluation of its run.
struct PathLane::Run {
  bool is_taken = false, waits = false, was_good = false;
  SpeedsUsed speeds = SpeedsUsed::kGiven;
  std::span<const double> q, u;
  std::span<double> qdot, udot;
};

/// All lanes of mechanisms of one shape. Unused lanes keep stale data; their results are discarded.
class PathLane::All final : public SharedWork {
 public:
  explicit All(const ShortCut<Planar>& one)
      : sweep_(MakePathLanes(one)), q_(one.num_u()), u_(q_), qdot_(q_), udot_(q_) {}
  bool HasLanes() const { return sweep_ != nullptr; }

  /// Returns null if no lane is free or the mechanism differs.
  Run* Take(const ShortCut<Planar>& own) {
    const auto free = std::ranges::find(runs_, false, &Run::is_taken);
    const int lane = static_cast<int>(free - runs_.begin());
    if (free == runs_.end() || !SetMechanism(*sweep_, lane, own)) return nullptr;
    free->is_taken = true;
    return &*free;
  }

  void Do() noexcept override {
    for (const SpeedsUsed speeds : {SpeedsUsed::kGiven, SpeedsUsed::kCompleted}) {
      const auto is_due = [&](const Run& run) { return run.waits && run.speeds == speeds; };
      if (std::ranges::none_of(runs_, is_due)) continue;
      for (int lane = 0; lane < kLanes; ++lane) {
        if (!is_due(runs_[lane])) continue;
        Gather(runs_[lane].q, lane, q_);
        Gather(runs_[lane].u, lane, u_);
      }
      const LaneBits good = sweep_->Evaluate(speeds, nullptr, q_, u_, qdot_, udot_);
      for (int lane = 0; lane < kLanes; ++lane) {
        Run& run = runs_[lane];
        if (!is_due(run)) continue;
        run.waits = false;
        run.was_good = good[lane] != 0;
        Scatter(qdot_, lane, run.qdot);
        Scatter(udot_, lane, run.udot);
      }
    }
  }

 private:
  std::unique_ptr<ShortCut<Planar, Lanes>> sweep_;
  std::array<Run, kLanes> runs_;
  std::vector<Lanes> q_, u_, qdot_, udot_;
};

std::unique_ptr<PathLane> PathLane::Take(SideBySide& beside, const ShortCut<Planar>& own) {
  Run* run = nullptr;
  for (const std::unique_ptr<SharedWork>& work : beside.works) {
    auto* all = dynamic_cast<All*>(work.get());
    if (all != nullptr && run == nullptr) run = all->Take(own);
  }
  if (run == nullptr) {
    auto all = std::make_unique<All>(own);
    if (!all->HasLanes()) return nullptr;
    run = all->Take(own);
    if (run == nullptr) return nullptr;
    beside.works.push_back(std::move(all));
  }
  return std::unique_ptr<PathLane>(new PathLane(beside, *run));
}

PathLane::~PathLane() { run_.is_taken = false; }

bool PathLane::Evaluate(SpeedsUsed speeds, std::span<const double> q, std::span<const double> u,
                        std::span<double> qdot, std::span<double> udot) {
  run_ = {true, true, false, speeds, q, u, qdot, udot};
  beside_.Meet();
  return run_.was_good;
}

}  // namespace loopbench::odca::pins
