// Angles and speeds of bodies from those of the pins of a spanning tree, and back, in the plane.
//
//   angle of a child = angle of its parent + offset +- q,      likewise speeds, without an offset
//
// The tree's joints stand in runs, each of which goes on where the joint before it ended. Along a
// run sums begin at zero, and what its first parent has is added to each: so threads can go along
// runs before it is known where these begin, and have the same bits.
#pragma once

#include <span>
#include <vector>

#include "mechanism/algebra/lanes.h"
#include "mechanism/algebra/worker_pool.h"
#include "mechanism/model/mechanism.h"

namespace loopbench::odca::pins {

/// Of one mechanism, T = double, or of some side by side, T = Lanes.
template <class T>
class TreeAngles {
 public:
  TreeAngles() = default;
  /// `place_of` each body, Ground last, is where its numbers stand in lists; `axes` are the angles
  /// of axes on it whose angles are asked for [rad], in those of the body. All joints are pins.
  TreeAngles(const Mechanism<Planar, double>& mechanism, const std::vector<int>& place_of,
             const std::vector<double>& axes);
  /// Has the shape of `one`, and its offsets in every lane.
  static TreeAngles Like(const TreeAngles<double>& one);
  /// The offsets of `one` in a lane. False, and nothing is set, where its tree has another shape.
  bool SetOffsets(int lane, const TreeAngles<double>& one);

  /// Angles and speeds by place. Those of Ground must be there, zero.
  void ToBodies(std::span<const T> q, std::span<const T> u, T* angles, T* speeds, WorkerPool& pool);
  /// rates := those of the joints, from those of bodies by place, added to `base` if it is not
  /// empty (it may be `rates`). False if what comes from bodies is not finite.
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

  /// Along a run, from the given angle and speed on.
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
