// Short runs: detection of nearly constant coordinates, and errors of simplified models.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "harness/run/run_case.h"
#include "mechanism/simplify/model.h"
#include "mechanism/start/assembly.h"

namespace loopbench::harness {

// A description prepared to run alone, without observers: joint coordinates, loops at level
// projection.

template <class Space>
struct ReadyToRun {
  std::unique_ptr<System<Space, double>> system;  ///< null if it has no start
  std::vector<double> y;                          ///< its state at time 0
  std::string failure;                            ///< why it does not start
};

/// `mechanism` is the description in joint coordinates and outlives the returned object.
template <class Space>
ReadyToRun<Space> StartAtLevelPosition(const MechanismDescription& description,
                                       const Mechanism<Space, double>& mechanism,
                                       const std::string& formulation) {
  ReadyToRun<Space> ready;
  const Start<double> start = Assemble<Space>(description, mechanism);
  ready.failure = start.message;
  if (start.outcome != Outcome::kFinished) return ready;
  const Method method{.formulation = formulation, .enforcement = Enforcement::kPosition};
  auto system = MakeFormulation<Space>(method, mechanism);
  const Outcome outcome = system->Start(0.0, start.q, start.u);
  if (outcome != Outcome::kFinished) {
    ready.failure = ToString(outcome);
    return ready;
  }
  ready.y.assign(static_cast<std::size_t>(system->size()), 0.0);
  system->ToState(start.q, start.u, ready.y);
  ready.system = std::move(system);
  return ready;
}

// A short run of a full model to detect nearly constant coordinates (mechanism/simplify/model.h).

/// Runs the description for `duration` seconds by O-DCA at level projection, ode45 at 1e-6, in
/// joint coordinates. A run that ends earlier (its CPU time is limited to `cpu_s`) returns its data
/// so far and the reason. A run that cannot start returns no data.
ShortRun MakeShortRun(const MechanismDescription& description, double duration, double cpu_s);

// Error and cost of a simplified model relative to the full model (mechanism/simplify/).

/// Named points of bodies at equal times, ground axes [m].
struct Track {
  std::string failure;  ///< reason if there is none
  std::vector<double> times;
  std::vector<std::vector<Eigen::Vector3d>> points;  ///< by time, in the order of `names`
  std::vector<std::string> names;                    ///< "<body>.<point>"
  std::int64_t rhs_evaluations = 0;
};

/// Runs the model by multipliers at level projection, dormand-prince at 1e-10. Steps end at the
/// compared times. `whole` selects the points: points of its bodies by their names in the model
/// (FindPoint), if the model has them.
Track TrackOf(const MechanismDescription& model, const Eigen::Matrix3d& R_WC,
              const MechanismDescription& whole, double horizon, double cpu_s);

struct ModelError {
  double distance = 0.0;  ///< the largest of any common point at any time [m]
  std::string point;      ///< which
  int points = 0;         ///< compared
};
ModelError Compare(const Track& whole, const Track& model);

}  // namespace loopbench::harness
