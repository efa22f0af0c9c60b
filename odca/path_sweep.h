// O-DCA for planar mechanisms whose bodies form paths (paths.h) of pins under gravity: from joint
// coordinates and speeds to their rates at once, in the kernels of two_handle.h.
//
//   angles and speeds of bodies   along the spanning tree, one after another: its depth is theirs
//   gaps of cut joints            along each path
//   up                            a path is cut into kLanes pieces of equal length, which are
//   joined
//                                 body after body side by side; then the pieces, and the few bodies
//                                 that are left over, one after another
//   down                          the same the other way round
//
// A short path has no lanes. The depth is n / kLanes + kLanes: work goes before depth here.
//
// Pins that close loops must not be degenerate: where InverseOf() sees one that may be, Evaluate()
// gives up, and the general sweep decides. Its scale is the trace of the free response of the
// joint's two bodies, which is at least the scale of loop_solver.h.
#pragma once

#include <array>
#include <memory>
#include <span>

#include "mechanism/formulation/constraint_solver.h"
#include "odca/path_links.h"

namespace loopbench::odca::pins {

class PathSweep {
 public:
  /// Null where the mechanism is none of those, or MeasurePath() has nothing for a path of it. It
  /// need not outlive the sweep.
  static std::unique_ptr<PathSweep> Make(const Mechanism<Planar, double>& mechanism);

  /// As ConstraintSolver::RightHandSide(). False near a degenerate position, for angles beyond
  /// kLargestAngle, and for numbers that are not finite. Allocates nothing.
  bool Evaluate(SpeedsUsed speeds, std::span<const double> q, std::span<const double> u,
                std::span<double> qdot, std::span<double> udot);
  /// Multiply-adds of the last evaluation, or what it did of it; angles are not counted.
  long operations() const { return operations_; }

 private:
  /// A path's places in the lists. Its body k stands in lane k / packs of pack k % packs; the last
  /// ones, which fill no pack, come after the packs.
  struct PathPlaces {
    int bodies = 0, packs = 0;
    int first = 0;           ///< place of its first body
    int first_pack = 0;      ///< in lists by pack
    int first_single = 0;    ///< in lists by single body
    int first_cut = 0;       ///< in end_cuts_: one for each lane, if any, and for each single body
    bool has_loops = false;  ///< points are followed along it
    bool loops_in_lanes = false;                       ///< so that closures of packs are asked for
    std::array<Closure<double>, kLanes> starts{};      ///< of the lanes' first bodies
    std::array<bool, kLanes> stands_alone{};           ///< lanes with a pin, if loops_in_lanes
    bool ends_at_ground = false, ground_is_P = false;  ///< as in PathLinks
    Vector2<double> end, end_force;
    Vector2<double> gap_v = {0.0, 0.0};  ///< as of TurnedLink, at that joint
    double gap_w = 0.0, end_limit = 0.0;

    int packed() const { return packs * kLanes; }
    int lanes() const { return packs > 0 ? kLanes : 0; }
    int singles() const { return bodies - packed(); }
    int place(int k) const { return first + (k < packed() ? k % packs * kLanes + k / packs : k); }
  };
  /// A tree joint: the places of its bodies, and the child's angle at q = 0 seen from the parent.
  struct Step {
    int u = 0;  ///< index into q, u and udot
    int child = 0, parent = 0;
    double sign = 1.0, offset = 0.0;
  };

  PathSweep() = default;
  void Add(const Mechanism<Planar, double>& mechanism, PathLinks path);
  void AddSteps(const Mechanism<Planar, double>& mechanism, const std::vector<int>& place_of,
                const std::vector<double>& axes);

  /// Angles and speeds of bodies.
  void SetAngles(const double* q, const double* u);
  /// Joints' rates from those of bodies, or what is to be added. False if one is not finite.
  template <bool kAdd>
  bool SetRates(double* rates) const;
  /// Bodies at their angles, with what the gaps of cut joints add to them.
  void Turn(PathPlaces& path);
  /// Where lanes end, seen from where they start unless they stand alone.
  template <bool kLoops>
  Point<Lanes> TurnPacks(const PathPlaces& path);
  struct At;
  At Body(const PathPlaces& path, int k) const;
  void Set(const PathPlaces& path, int k, const TurnedLink<double>& turned);
  /// The joint before body k, or to Ground after the last one, being cut: `here` if its P is k.
  void Close(PathPlaces& path, int k, bool here, const Point<double>& gap);
  /// The least slack of all joins.
  template <Pass kPass>
  double Up(PathPlaces& path);
  template <Pass kPass>
  void Down(const PathPlaces& path);

  std::vector<PathPlaces> paths_;
  std::vector<Step> steps_;
  std::vector<int> runs_;  ///< lengths of sequences of steps that go on where the one before ended
  std::vector<Link<Lanes>> pack_kinds_;  ///< equal packs share one
  std::vector<int> kind_of_pack_;
  std::vector<Closure<Lanes>> pack_closures_;
  std::vector<TurnedLink<Lanes>> turned_packs_;
  std::vector<Cut<Lanes>> cuts_;
  std::vector<Link<double>> singles_;
  std::vector<Closure<double>> single_closures_;
  std::vector<TurnedLink<double>> turned_singles_;
  std::vector<EndCut<double>> end_cuts_;
  VectorX<double> angle_, speed_, alpha_;  ///< by place; the last one is Ground's
  int num_places_ = 0;
  double room_ = 0.0;  ///< between the largest angle and kLargestAngle
  long operations_ = 0;
};

}  // namespace loopbench::odca::pins
