// Counts the allocations of a program. Linked into benchmark programs only: it replaces malloc.
#pragma once

#include <cstdint>

namespace loopbench::harness {

struct Allocations {
  std::int64_t count = 0;  ///< calls of malloc and its relatives so far
  std::int64_t bytes = 0;  ///< total requested so far; freed bytes are not subtracted
};

Allocations AllocationsSoFar();

/// Checks that an allocation is counted: throws std::runtime_error if another malloc has replaced
/// the counting one. Such a counter would always report zero.
void CheckAllocationsAreCounted();

}  // namespace loopbench::harness
