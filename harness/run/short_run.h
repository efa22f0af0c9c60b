// A short run of a whole model, to see what hardly moves (mechanism/simplify/model.h).
#pragma once

#include "mechanism/simplify/model.h"

namespace loopbench::harness {

/// Runs the description for `duration` seconds by O-DCA at level position, ode45 at 1e-6, in joint
/// coordinates. A run that ends earlier (its CPU time is `cpu_s`) tells what it saw until then, and
/// why it ended; one that does not begin tells nothing.
ShortRun MakeShortRun(const MechanismDescription& description, double duration, double cpu_s);

}  // namespace loopbench::harness
