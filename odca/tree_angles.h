// Angles and speeds of bodies from the pins of a spanning tree, and back, in the plane.
//
//   angle of a child = angle of its parent + offset +- q,      also for speeds, without an offset
//
// The tree's joints form runs, each continuing at the end of the previous joint. Sums along a run
// begin at zero; the first parent's value is then added to each. So threads can process runs before
// their start is known, with the same bits.
#pragma once

#include <algorithm>
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
  /// requested axes [rad], relative to their bodies. All joints are pins: X_PF and X_QM are angles.
  TreeAngles(const Mechanism<Planar, double>& mechanism, const std::vector<int>& place_of,
             const std::vector<double>& axes) {
    std::vector<std::vector<const TreeStep*>> below(place_of.size());  // by body
    for (const TreeStep& step : mechanism.tree()) below[step.parent].push_back(&step);
    std::vector<int> run_of(place_of.size(), -1);  // by body
    std::vector<const TreeStep*> waiting = below[kGround];
    while (!waiting.empty()) {  // depth first, so that runs are long
      const TreeStep& step = *waiting.back();
      waiting.pop_back();
      waiting.insert(waiting.end(), below[step.child].begin(), below[step.child].end());
      const Joint<Planar, double>& joint = mechanism.joints()[step.joint];
      const bool goes_on = !steps_.empty() && steps_.back().child == place_of[step.parent];
      if (!goes_on || runs_.back().steps == kLongest) {
        runs_.push_back({.first = static_cast<int>(steps_.size()), .before = run_of[step.parent]});
      }
      ++runs_.back().steps;
      run_of[step.child] = static_cast<int>(runs_.size()) - 1;
      const double of_bodies = step.sign * (joint.X_PF.angle - joint.X_QM.angle);
      steps_.push_back({.u = joint.u_offset,
                        .child = place_of[step.child],
                        .parent = place_of[step.parent],
                        .sign = static_cast<double>(step.sign),
                        .offset = T{} + (of_bodies + axes[step.child] - axes[step.parent])});
    }
    int steps = kLongest;
    for (int run = 0; run < static_cast<int>(runs_.size()); ++run) {
      if (steps >= kLongest) {
        stretches_.push_back({.first = run});
        steps = 0;
      }
      steps += runs_[run].steps;
      stretches_.back().last = run + 1;
    }
  }
  /// Has the shape of `one`, and its offsets in every lane.
  template <class One>
  explicit TreeAngles(const TreeAngles<One>& one) {
    for (const auto& step : one.steps_) {
      steps_.push_back({step.u, step.child, step.parent, step.sign, T{} + step.offset});
    }
    for (const auto& run : one.runs_) runs_.push_back({run.first, run.steps, run.before});
    for (const auto& all : one.stretches_) stretches_.push_back({all.first, all.last});
  }
  /// Sets the offsets of `one` in a lane. Returns false, without change, if its shape differs.
  bool SetOffsets(int lane, const TreeAngles<double>& one) {
    const auto same = [](const auto& a, const auto& b) {
      return a.u == b.u && a.child == b.child && a.parent == b.parent && a.sign == b.sign;
    };
    if (!std::ranges::equal(steps_, one.steps_, same)) return false;
    for (std::size_t i = 0; i < steps_.size(); ++i) {
      SetLane(steps_[i].offset, lane, one.steps_[i].offset);
    }
    return true;
  }

  /// Angles and speeds by place. Those of Ground must be there, zero.
  void ToBodies(std::span<const T> q, std::span<const T> u, T* angles, T* speeds,
                WorkerPool& pool) {
    const int stretches = static_cast<int>(stretches_.size());
    if (pool.threads() == 1 || stretches < 2) {
      for (const Run& run : runs_) {
        const int parent = steps_[run.first].parent;
        Walk(run, angles[parent], speeds[parent], q.data(), u.data(), angles, speeds);
      }
      return;
    }
    const auto for_runs = [&](const auto& call) {
      pool.ForEach(stretches, [&](int i) {
        for (int run = stretches_[i].first; run < stretches_[i].last; ++run) call(runs_[run]);
      });
    };
    for_runs([&](const Run& run) { Walk(run, T{}, T{}, q.data(), u.data(), angles, speeds); });
    for (Run& run : runs_) {
      if (run.before < 0) continue;
      const int parent = steps_[run.first].parent;
      run.angle = runs_[run.before].angle + angles[parent];
      run.speed = runs_[run.before].speed + speeds[parent];
    }
    for_runs([&](const Run& run) {
      if (run.before < 0) return;
      const Step* step = steps_.data() + run.first;
      for (const Step* end = step + run.steps; step != end; ++step) {
        angles[step->child] += run.angle;
        speeds[step->child] += run.speed;
      }
    });
  }
  /// Sets rates to the joints' rates, from the bodies' values by slot, plus `base` if it is not
  /// empty (it may be `rates`). Returns false if a body's value is not finite.
  TruthOf<T> ToJoints(const T* of_bodies, std::span<const T> base, std::span<T> rates,
                      WorkerPool& pool) {
    pool.ForEach(static_cast<int>(stretches_.size()), [&](int i) {
      Stretch& stretch = stretches_[i];
      stretch.zeros = base.empty()
                          ? AlongStretch<false>(stretch, of_bodies, nullptr, rates.data())
                          : AlongStretch<true>(stretch, of_bodies, base.data(), rates.data());
    });
    T zeros = {};
    for (const Stretch& stretch : stretches_) zeros += stretch.zeros;
    return zeros == 0.0;
  }

 private:
  /// Steps of a stretch, and of the longest run: about 30 us of work.
  static constexpr int kLongest = 4096;

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

  /// Sums along a run, from the given angle and speed. The parent's values are at hand: to read
  /// them back from memory takes twice as long as all the rest.
  LOOPBENCH_INLINE void Walk(const Run& run, T angle, T speed, const T* q, const T* u, T* angles,
                             T* speeds) const {
    T turned = {}, gained = {};
    const Step* step = steps_.data() + run.first;
    for (const Step* end = step + run.steps; step != end; ++step) {
      const double sign = step->sign;
      const int child = step->child;
      turned += step->offset + sign * q[step->u];
      gained += sign * u[step->u];
      angles[child] = angle + turned;
      speeds[child] = speed + gained;
    }
  }
  /// The part of ToJoints() that one thread does.
  template <bool kAdd>
  T AlongStretch(const Stretch& stretch, const T* of_bodies, const T* base, T* rates) const {
    const Run& last = runs_[stretch.last - 1];
    T zeros = {};
    const Step* step = steps_.data() + runs_[stretch.first].first;
    for (const Step* end = steps_.data() + last.first + last.steps; step != end; ++step) {
      const int u = step->u;
      const T rate = step->sign * (of_bodies[step->child] - of_bodies[step->parent]);
      rates[u] = kAdd ? base[u] + rate : rate;
      zeros += 0.0 * rate;
    }
    return zeros;
  }

  template <class>
  friend class TreeAngles;
  std::vector<Step> steps_;
  std::vector<Run> runs_;
  std::vector<Stretch> stretches_;
};

}  // namespace loopbench::odca::pins
