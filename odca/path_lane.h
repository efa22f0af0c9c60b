// Fast path of path_sweep.h for batched runs: each has a lane, and their pending right-hand sides
// are evaluated at once. The bits of a run do not depend on the other runs.
#pragma once

#include <memory>
#include <span>

#include "mechanism/formulation/constraint_solver.h"
#include "mechanism/formulation/side_by_side.h"
#include "odca/path_sweep.h"

namespace loopbench::odca::pins {

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
