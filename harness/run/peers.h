// The peers of this build (docs/decisions/018): their rows are among the formulations
// (harness/config/formulations.h) in every build, the programs themselves only where CMake has
// LOOPBENCH_PEERS.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "harness/config/experiment.h"
#include "harness/integrator/arkode.h"

namespace loopbench::harness {

/// Makes a peer for a mechanism; it throws Inexpressible.
using PeerFactory = std::function<std::unique_ptr<Peer>(const MechanismDescription&)>;

/// Gives the row of that name its program, before loopbench::Main(). Throws std::invalid_argument
/// for a name that is no peer's or has one already.
void RegisterPeer(const std::string& name, PeerFactory make);

/// Null where the formulation is no peer. Throws Inexpressible, and ConfigError for a peer that
/// this build does not have.
std::unique_ptr<Peer> MakePeer(const std::string& formulation,
                               const MechanismDescription& description);

/// The same with Inexpressible as outcome and message of `result`, which else is as it was.
std::unique_ptr<Peer> TryPeer(const std::string& formulation,
                              const MechanismDescription& description, IntegratorResult* result);

/// Throws ConfigError when a column of an experiment names a peer that this build does not have:
/// files with peers are read everywhere, and run where the peers are.
void RequirePeers(const std::vector<Experiment>& experiments);

}  // namespace loopbench::harness
