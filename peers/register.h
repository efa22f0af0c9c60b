// Gives the peers of harness/config/formulations.cpp their programs.
#pragma once

namespace loopbench::peers {

/// Before loopbench::Main(), once.
void RegisterPeers();

}  // namespace loopbench::peers
