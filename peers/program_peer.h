// Adapter of a peer's program to the harness.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "harness/exchange/model.h"
#include "harness/integrator/arkode.h"
#include "mechanism/description/description.h"
#include "peers/program.h"

namespace loopbench::peers {

/// Makes a program; throws exchange::Unsupported, or errors of the peer's library for a model that
/// it rejects.
using ProgramFactory = std::function<std::unique_ptr<Program>(const exchange::Model&)>;

/// Throws harness::Inexpressible with the peer's name and its unsupported parts.
std::unique_ptr<harness::Peer> MakeProgramPeer(const std::string& name, const ProgramFactory& make,
                                               const MechanismDescription& description);

}  // namespace loopbench::peers
