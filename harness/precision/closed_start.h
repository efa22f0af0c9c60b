// A start that closes the loops in a wide scalar.
#pragma once

#include <memory>
#include <string>

#include "harness/precision/scalars.h"
#include "mechanism/description/outcome.h"
#include "mechanism/formulation/system.h"

namespace loopbench::harness {

template <class Space, class S>
struct ClosedStart {
  Outcome outcome = Outcome::kFinished;
  std::string message;
  std::unique_ptr<Mechanism<Space, S>> mechanism;  ///< in joint coordinates
  std::unique_ptr<System<Space, S>> system;  ///< stands at the start; null where there is none
};

/// Assembles the start in double and closes its loops in S: positions, then speeds, by the
/// projection of level `position`.
template <class Space, class S>
ClosedStart<Space, S> CloseStart(const MechanismDescription& description);

}  // namespace loopbench::harness
