// A description made ready to run by itself, without observers: joint coordinates, loops at level
// position.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "harness/run/run_case.h"
#include "mechanism/start/assembly.h"

namespace loopbench::harness {

template <class Space>
struct ReadyToRun {
  std::unique_ptr<System<Space, double>> system;  ///< null where it does not start
  std::vector<double> y;                          ///< its state at time 0
  std::string failure;                            ///< why it does not start
};

/// `mechanism` is the description in joint coordinates and outlives what comes back.
template <class Space>
ReadyToRun<Space> StartAtLevelPosition(const MechanismDescription& description,
                                       const Mechanism<Space, double>& mechanism,
                                       const std::string& formulation) {
  ReadyToRun<Space> ready;
  const Start<double> start = Assemble<Space>(description, mechanism);
  ready.failure = start.message;
  if (start.outcome != Outcome::kFinished) return ready;
  const Column column{.formulation = formulation, .enforcement = Enforcement::kPosition};
  auto system = MakeFormulation<Space>(column, mechanism);
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

}  // namespace loopbench::harness
