// One record from the runs of parts that have nothing to do with each other.
#pragma once

#include <span>
#include <vector>

#include "harness/analysis/growth.h"
#include "harness/record/record.h"

namespace loopbench::harness {

/// What one run leaves behind.
struct Run {
  Record record;
  DriftSeries drift;
  /// Of the projections [m] and of the energy balance [J], with the largest kinetic energy [J].
  DriftSeries correction = {}, energy = {};
  double kinetic = 0.0;
  /// The scene's branch combinations (scene.h) at the assembled start [rad]; empty without.
  std::vector<double> branch_start = {};
};

/// Each part has its own steps. Work adds up (steps, evaluations, wall time, rank); drift is the
/// largest of the parts, at each time the largest of what each had last; the worst outcome and the
/// earliest end count; energy errors and the energies that they are compared with add up, upper
/// bounds of the whole's. Series of corrections, energy and angles, which belong to one sequence of
/// steps, stay out.
Run MergeParts(std::span<const Run> parts);

}  // namespace loopbench::harness
