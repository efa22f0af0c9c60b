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

/// Returns null if the formulation is no external engine. Throws Inexpressible, and ConfigError for
/// an engine that this build does not contain.
std::unique_ptr<Peer> MakePeer(const std::string& formulation,
                               const MechanismDescription& description);

/// Does the same; stores Inexpressible as outcome and message of `result`, otherwise unchanged.
std::unique_ptr<Peer> TryPeer(const std::string& formulation,
                              const MechanismDescription& description, IntegratorResult* result);

/// Throws ConfigError if a method of an experiment names an engine that this build does not
/// contain. Every build can read such files, but not run them.
void RequirePeers(const std::vector<Experiment>& experiments);

}  // namespace loopbench::harness
