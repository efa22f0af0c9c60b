// One row of a trajectory: all quantities of the user's mechanism at one time.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "harness/config/experiment.h"
#include "harness/trajectory/body_motion.h"

namespace loopbench::harness {

/// A mechanism at one time, as a run knows it.
struct MomentOfRun {
  double t = 0.0;
  std::vector<BodyMotion> bodies;  ///< by the user's body
  /// By the user's joint: its coordinate where the run follows one, with whole turns, else NaN.
  std::vector<double> followed;
  double supplied = 0.0, dissipated = 0.0;  ///< work since the start [J]; NaN where not known
};

class RowWriter {
 public:
  virtual ~RowWriter() = default;
  /// The quantities of TrajectoryColumns(), in their order. Angles in space and signs of
  /// quaternions go on from the last row: the nearest to those there, or to what is followed.
  virtual void Write(const MomentOfRun& moment, std::vector<double>* row) = 0;
  /// Labels of reactions and drives that were not unique in some row so far, and in how many rows.
  virtual std::vector<std::pair<std::string, std::int64_t>> Open() const = 0;
};

/// Of the user's space. What is given outlives it.
std::unique_ptr<RowWriter> MakeRowWriter(const MechanismDescription& user,
                                         const OutputOptions& output);

}  // namespace loopbench::harness
