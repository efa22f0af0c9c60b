// Angles and speeds of bodies from the pins of a spanning tree, and back, in the plane.
//
//   angle of a child = angle of its parent + offset +- q,      also for speeds, without an offset
//
// The tree's joints form runs, each continuing at the end of the previous joint. Sums along a run
// begin at zero; the first parent's value is then added to each. So threads can process runs before
// their start is known, with the same bits.
#pragma once

#include <span>
#include <vector>

#include "mechanism/algebra/lanes.h"
#include "mechanism/algebra/worker_pool.h"
#include "mechanism/model/mechanism.h"

namespace loopbench::odca::pins {

/// Angles of one mechanism (T = double) or of several in lanes (T = Lanes).
template <class T>
class TreeAngles {
 public:
  TreeAngles() = default;
  /// `place_of` is the slot of each body in lists, Ground last; `axes` are the angles of the
  /// requested axes [rad], relative to their bodies. All joints are pins.
  TreeAngles(const Mechanism<Planar, double>& mechanism, const std::vector<int>& place_of,
             const std::vector<double>& axes);
  /// Has the shape of `one`, and its offsets in every lane.
  static TreeAngles Like(const TreeAngles<double>& one);
  /// The offsets of `one` in a lane. False, and nothing is set, where its tree has another shape.
  bool SetOffsets(int lane, const TreeAngles<double>& one);

  /// Angles and speeds by place. Those of Ground must be there, zero.
  void ToBodies(std::span<const T> q, std::span<const T> u, T* angles, T* speeds, WorkerPool& pool);
  /// Sets rates to the joints' rates, from the bodies' values by slot, plus `base` if it is not
  /// empty (it may be `rates`). Returns false if a body's value is not finite.
  TruthOf<T> ToJoints(const T* of_bodies, std::span<const T> base, std::span<T> rates,
                      WorkerPool& pool);

 private:
  /// A tree joint: the places of its bodies, and the child's angle at q = 0 seen from the parent.
  struct Step {
    int u = 0;  ///< index into q, u and rates
    int child = 0, parent = 0;
    double sign = 1.0;
    T offset = {};
  };
  struct Run {
    int first = 0, steps = 0;
    int before = -1;           ///< the run in which its first parent is, -1 for Ground
    T angle = {}, speed = {};  ///< of that
  };
  /// Runs that one thread goes along.
  struct Stretch {
    int first = 0, last = 0;
    T zeros = {};  ///< or not a number
  };

  /// Sums along a run, from the given angle and speed.
  void Walk(const Run& run, T angle, T speed, const T* q, const T* u, T* angles, T* speeds) const;
  /// The part of ToJoints() that one thread does.
  template <bool kAdd>
  T AlongStretch(const Stretch& stretch, const T* of_bodies, const T* base, T* rates) const;

  template <class>
  friend class TreeAngles;
  std::vector<Step> steps_;
  std::vector<Run> runs_;
  std::vector<Stretch> stretches_;
};

}  // namespace loopbench::odca::pins
