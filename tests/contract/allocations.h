// Counts heap allocations of the test binary.
#pragma once

namespace loopbench::testing {

/// Allocations so far in this process; -1 where they cannot be counted (sanitizers own malloc).
long CountAllocations();

}  // namespace loopbench::testing
