// The short cut of path_sweep.h for runs side by side: each has a lane, and the right-hand sides
// that they wait for are evaluated at once. A run has the same bits whoever is beside it.
#pragma once

#include <memory>
#include <span>

#include "mechanism/formulation/constraint_solver.h"
#include "mechanism/formulation/side_by_side.h"
#include "odca/path_sweep.h"

namespace loopbench::odca::pins {

class PathLane {
 public:
  /// A lane for the mechanism of `own` until this is destroyed; `beside` must outlive it.
  /// Null where `own` fills the lanes by itself.
  static std::unique_ptr<PathLane> Take(SideBySide& beside, const PathSweep& own);
  ~PathLane();
  PathLane(const PathLane&) = delete;
  PathLane& operator=(const PathLane&) = delete;

  /// As PathSweep::Evaluate(), when all runs have met.
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
