#include "tests/contract/allocations.h"

#include <atomic>
#include <cstddef>

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)
#define LOOPBENCH_COUNTS_ALLOCATIONS
#endif

namespace {
std::atomic<long> allocations{0};
}

#ifdef LOOPBENCH_COUNTS_ALLOCATIONS
// Both operator new and Eigen end in malloc; this one stands before the library's.
extern "C" {
void* __libc_malloc(std::size_t size);
void* malloc(std::size_t size) noexcept {
  allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(size);
}
}
#endif

namespace loopbench::testing {

long CountAllocations() {
#ifdef LOOPBENCH_COUNTS_ALLOCATIONS
  return allocations.load();
#else
  return -1;
#endif
}

}  // namespace loopbench::testing
