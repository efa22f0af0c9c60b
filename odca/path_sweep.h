// O-DCA for planar mechanisms whose bodies form paths (path_links.h) of pins under gravity:
// computes rates directly from joint coordinates and speeds, in the kernels of two_handle.h.
//
//   angles and speeds of bodies   along the spanning tree (tree_angles.h)
//   violations of cut joints      along each path
//   up                            a path is cut into groups of kLanes pieces, all of equal length;
//                                 the pieces of a group are joined body after body, side by side,
//                                 then all pieces, and the few bodies that are left over, one after
//                                 another
//   down                          the same the other way round
//
// A short path has no groups, a long one up to kMaxGroups, which threads share. Results depend on
// the mechanism alone, never on the number of threads. The depth is one piece plus the sequence of
// pieces and left-over bodies: total work has priority over depth.
//
// Other mechanisms of the same shape can fill unused lanes. T = Lanes holds kLanes mechanisms, one
// per lane; T = double holds one.
//
// Pins that close loops must not be degenerate: if FactorsOf() finds a suspicious one, Evaluate()
// stops, and the general pass decides. Its scale is the trace of the free response of the joint's
// two bodies, which is at least the scale of loop_solver.h.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

#include "mechanism/algebra/worker_pool.h"
#include "mechanism/formulation/constraint_solver.h"
#include "mechanism/formulation/side_by_side.h"
#include "odca/pack_kinds.h"
#include "odca/path_links.h"
#include "odca/short_cut.h"
#include "odca/tree_angles.h"

namespace loopbench::odca::pins {

struct NoShortCut {
  long operations_ = 0;
};

/// Slots of a path in the lists. Its body k is in lane k / packs of pack k % packs of its group;
/// the last ones, which fill no pack, follow the packs.
struct PathShape {
  int bodies = 0, groups = 0;
  int packs = 0;                ///< of a group
  int packed = 0;               ///< bodies in packs
  int first = 0;                ///< place of its first body
  int first_group = 0;          ///< in groups_
  int first_pack = 0;           ///< in lists by pack
  int first_single = 0;         ///< in lists by single body
  int first_cut = 0;            ///< in end_cuts_: one for each piece and for each single body
  bool has_loops = false;       ///< points are followed along it
  bool loops_in_lanes = false;  ///< so that closures of packs are asked for
  bool ends_at_ground = false, ground_is_P = false;  ///< as in PathLinks

  bool operator==(const PathShape&) const = default;
  int pieces() const { return groups * kLanes; }
  int singles() const { return bodies - packed; }
  /// Returns the pack of body k < packed.
  int pack(int k) const { return k / (packs * kLanes) * packs + k % packs; }
  int lane(int k) const { return k / packs % kLanes; }
  int place(int k) const { return first + (k < packed ? pack(k) * kLanes + lane(k) : k); }
};

template <class T>
class PathSweepOf final
    : public std::conditional_t<std::is_same_v<T, double>, ShortCut<Planar>, NoShortCut> {
  static constexpr bool kIsOne = std::is_same_v<T, double>;

 public:
  /// Enough work for a thread to wait for the others after it.
  static constexpr int kBodiesOfGroup = 2048;

  /// For one mechanism. Returns null if it is not of this type, or MeasurePath() fails for a path.
  /// It need not outlive the sweep. Up to `threads` threads work on it, one for every
  /// `bodies_of_group` bodies.
  static std::unique_ptr<PathSweepOf> Make(const Mechanism<Planar, double>& mechanism,
                                           int threads = 1, int bodies_of_group = kBodiesOfGroup);
  /// Returns a sweep for lanes of mechanisms like `one`, whose constants are in every lane; null if
  /// its own pieces fill the lanes.
  static std::unique_ptr<PathSweepOf> InLanes(const PathSweepOf<double>& one);
  /// For lanes: copies the constants of `one` into a lane. Returns false, without change, if its
  /// shape differs.
  bool SetMechanism(int lane, const PathSweepOf<double>& one);

  /// As ShortCut::Evaluate(), for each lane.
  TruthOf<T> Evaluate(SpeedsUsed speeds, Kinematics<Planar, double>*, std::span<const T> q,
                      std::span<const T> u, std::span<T> qdot, std::span<T> udot);
  int threads() const { return pool_->threads(); }

 private:
  /// Numbers of a path that depend on the mechanism or on the state.
  struct PathPlaces : PathShape {
    Vector2<T> end = {}, end_force = {};
    Vector2<T> gap_v = {};  ///< as of TurnedLink, at that joint
    T gap_w = {}, end_limit = {};
  };
  /// kLanes pieces of a path side by side.
  struct Group {
    int path = 0;
    int pack = 0, place = 0;      ///< its first ones
    Closure<Lanes> starts;        ///< of its pieces' first bodies, which packs leave open
    bool cuts_starts = false;     ///< any of these joints is cut
    Lanes leads;                  ///< 1: ends relative to a piece's start, 0: to its pin
    bool in_turn = false;         ///< any piece starts and ends at the previous one's end
    Point<Lanes> ends;            ///< of its pieces (TurnPacks())
    TwoHandle<Lanes> assemblies;  ///< they are joined to these
    double room = 0.0, slack = 0.0;
    double largest = 0.0;   ///< square of the largest gap in it, of GapKind::kPositions
    Vector2<Lanes> F1, F2;  ///< on these
  };
  template <class>
  friend class PathSweepOf;
  PathSweepOf() = default;
  void Resize(int threads);
  void SetConstants(int lane, const PathSweepOf<double>& one);
  void Add(const Mechanism<Planar, double>& mechanism, PathLinks path, int bodies_of_group);
  void AddPacks(const PathPlaces& path, const PathLinks& links);

  /// Computes the bodies at their angles, with the terms from violations of cut joints. Returns
  /// false for angles beyond kLargestAngle.
  template <GapKind kGap>
  TruthOf<T> Turn();
  /// Computes the end point of each piece, relative to its start unless it has its own pin.
  template <bool kLoops, GapKind kGap>
  void TurnPacks(Group& group);
  /// Computes the following bodies; returns the remainder up to kLargestAngle.
  T TurnSingles(const PathPlaces& path);
  template <GapKind kGap>
  void CloseLoops(PathPlaces& path);
  /// Closes loops along the pieces of a group at their first bodies: `at_2` leads from the body
  /// before the group to its last one.
  template <GapKind kGap>
  void CloseStarts(Group& group, Point<double>& at_2);
  void MoveEnd(const PathPlaces& path, int k, const Vector2<T>& shift);
  /// As in ShortCut, for one mechanism.
  bool Place(GapKind kind, std::span<const double> q, std::span<const double> u);
  Correction<double> LargestGap() const;
  bool FindChange(GapKind) { return Any(Sweep<Pass::kSpeeds>()); }
  bool AddChange(std::span<const double> base, std::span<double> sum);
  /// Computes alpha_, or corrections of speeds. False near a degenerate position.
  template <Pass kPass>
  TruthOf<T> Sweep();
  template <Pass kPass>
  void UpGroup(Group& group);
  /// Joins pieces and single bodies of a path; returns the least slack of all its joins.
  template <Pass kPass>
  T Up(PathPlaces& path);
  template <Pass kPass>
  void Down(const PathPlaces& path);
  template <Pass kPass>
  void DownGroup(const Group& group);

  std::vector<PathPlaces> paths_;
  std::vector<Group> groups_;
  PackKinds<Link> packs_;
  std::vector<Closure<Lanes>> pack_closures_;
  std::vector<TurnedLink<Lanes>> turned_packs_;
  std::vector<Cut<Lanes>> cuts_;
  std::vector<Link<T>> singles_;
  std::vector<Closure<T>> single_closures_;
  std::vector<TurnedLink<T>> turned_singles_;
  std::vector<EndCut<T>> end_cuts_;
  std::vector<T> angle_, speed_, alpha_;  ///< by place; the last one is Ground's
  T largest_ = {};                        ///< as Group::largest, of all joints outside of groups
  int num_places_ = 0;
  TreeAngles<T> tree_;
  std::unique_ptr<WorkerPool> pool_;
  using std::conditional_t<kIsOne, ShortCut<Planar>, NoShortCut>::operations_;  ///< without angles
};

using PathSweep = PathSweepOf<double>;

/// Fast path of batched runs: their pending right-hand sides are evaluated at once, a lane each.
/// The bits of a run do not depend on the other runs.
class PathLane {
 public:
  /// Reserves a lane for the mechanism of `own` until destruction; `beside` must outlive it.
  /// Returns null if `own` fills the lanes alone.
  static std::unique_ptr<PathLane> Take(SideBySide& beside, const PathSweep& own);
  ~PathLane();
  PathLane(const PathLane&) = delete;
  PathLane& operator=(const PathLane&) = delete;

  /// Evaluates like PathSweep::Evaluate(), once all runs have met.
  bool Evaluate(SpeedsUsed speeds, std::span<const double> q, std::span<const double> u,
                std::span<double> qdot, std::span<double> udot);

 private:
  class All;
  PathLane(SideBySide& beside, All& all, int lane) : beside_(beside), all_(all), lane_(lane) {}

  SideBySide& beside_;
  All& all_;
  int lane_;
};

}  // namespace loopbench::odca::pins
