// Level projection of accepted steps for mechanisms of pins; level.cpp does it by parts.
// `Sweep` stands for PathSweep and AssemblySweep.
#pragma once

#include <algorithm>
#include <optional>
#include <span>

#include "mechanism/formulation/constraint_solver.h"

namespace loopbench::odca::pins {

struct PinProjection {
  /// As ConstraintSolver::Project().
  template <class Sweep>
  static std::optional<Correction<double>> Of(Sweep& sweep, std::span<double> q,
                                              std::span<double> u, double goal) {
    using GapKind = typename Sweep::GapKind;
    sweep.operations_ = 0;
    auto &moved = sweep.moved_, &speeds = sweep.speeds_;
    std::ranges::copy(q, moved.begin());
    std::ranges::copy(u, speeds.begin());
    std::optional<double> now = GapOf(sweep);
    if (!now) return std::nullopt;
    Correction<double> correction;
    correction.shift = *now;
    for (int i = 0; i<kMaxProjections&& * now> goal; ++i) {
      if (!sweep.FindChange()) return std::nullopt;
      const double before = *now;
      sweep.back_ = moved;
      if (!AddChange(sweep, sweep.back_, moved)) return std::nullopt;
      now = GapOf(sweep);
      if (!now) return std::nullopt;
      ++correction.iterations;
      if (*now < before) continue;
      moved = sweep.back_;  // round-off: as it was
      break;
    }
    if (!TurnTo<GapKind::kSpeeds>(sweep) || !sweep.FindChange()) return std::nullopt;
    if (!AddChange(sweep, speeds, speeds)) return std::nullopt;
    std::ranges::copy(moved, q.begin());
    std::ranges::copy(speeds, u.begin());
    return correction;
  }

 private:
  template <auto kGap, class Sweep>
  static bool TurnTo(Sweep& sweep) {
    sweep.tree_.ToBodies(sweep.moved_, sweep.speeds_, sweep.angle_.data(), sweep.speed_.data(),
                         *sweep.pool_);
    return sweep.template Turn<kGap>();
  }
  /// The largest gap of a cut joint at the positions moved [m], or nothing.
  template <class Sweep>
  static std::optional<double> GapOf(Sweep& sweep) {
    if (!TurnTo<Sweep::GapKind::kPositions>(sweep)) return std::nullopt;
    return sweep.LargestGap();
  }
  template <class Sweep>
  static bool AddChange(Sweep& sweep, std::span<const double> base, std::span<double> sum) {
    return sweep.tree_.ToJoints(sweep.alpha_.data(), base, sum, *sweep.pool_);
  }
};

}  // namespace loopbench::odca::pins
