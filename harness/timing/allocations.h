// Counts what a program allocates. Linked into benchmark programs only: it replaces malloc.
#pragma once

#include <cstdint>

namespace loopbench::harness {

struct Allocations {
  std::int64_t count = 0;  ///< calls of malloc and its relatives so far
  std::int64_t bytes = 0;  ///< asked for so far; what is freed is not subtracted
};

Allocations AllocationsSoFar();

/// Allocates and looks whether it is counted: throws std::runtime_error when another malloc has
/// taken the place of the counting one. A counter that sees nothing would report zero for ever.
void CheckAllocationsAreCounted();

}  // namespace loopbench::harness
