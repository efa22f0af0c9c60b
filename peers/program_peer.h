// A peer's program as the harness runs it.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "harness/exchange/model.h"
#include "harness/integrator/arkode.h"
#include "mechanism/description/description.h"
#include "peers/program.h"

namespace loopbench::peers {

/// Makes a program; throws exchange::NotThere, or whatever the peer's library throws at a model
/// that it refuses.
using ProgramFactory = std::function<std::unique_ptr<Program>(const exchange::Model&)>;

/// Throws harness::Inexpressible with the peer's name and what it does not have.
std::unique_ptr<harness::Peer> MakeProgramPeer(const std::string& name, const ProgramFactory& make,
                                               const MechanismDescription& description);

}  // namespace loopbench::peers
