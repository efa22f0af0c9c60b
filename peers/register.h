// Registers the programs of the peers of harness/config/formulations.cpp.
#pragma once

namespace loopbench::peers {

/// Call once before loopbench::Main().
void RegisterPeers();

}  // namespace loopbench::peers
