// For tests with peers: they are registered once, before any of them.
#pragma once

#include "peers/register.h"

namespace loopbench::harness::peers_test {

inline const bool kRegistered = (peers::RegisterPeers(), true);

}  // namespace loopbench::harness::peers_test
