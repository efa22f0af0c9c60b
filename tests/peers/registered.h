// For tests with peers: they are registered once, before any of them; and what Simbody lacks.
#pragma once

#include <map>
#include <string>

#include "peers/register.h"

namespace loopbench::harness::peers_test {

inline const bool kRegistered = (peers::RegisterPeers(), true);

/// Shipped mechanisms that Simbody cannot express here, with the message.
inline const std::map<std::string, std::string> kInexpressible = {
    {"driven-four-bar", "peer/simbody does not have: joint \"OA\": a prescribed motion"},
    {"screw-jack",
     "peer/simbody does not have: joint_torque along joint \"bearing\", which depends on time"}};

}  // namespace loopbench::harness::peers_test
