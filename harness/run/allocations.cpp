#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <stdexcept>

#include "harness/run/timing.h"

namespace {

std::atomic<std::int64_t> count = 0, bytes = 0;

void Note(std::size_t size) {
  count.fetch_add(1, std::memory_order_relaxed);
  bytes.fetch_add(static_cast<std::int64_t>(size), std::memory_order_relaxed);
}

}  // namespace

// glibc's own entry points: operator new, Eigen and C libraries all end here.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t number, std::size_t size);
void* __libc_realloc(void* old, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) noexcept {
  Note(size);
  return __libc_malloc(size);
}
void* calloc(std::size_t number, std::size_t size) noexcept {
  Note(number * size);
  return __libc_calloc(number, size);
}
void* realloc(void* old, std::size_t size) noexcept {
  Note(size);
  return __libc_realloc(old, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  Note(size);
  return __libc_memalign(alignment, size);
}
}

namespace loopbench::harness {

Allocations AllocationsSoFar() { return {count.load(), bytes.load()}; }

void CheckAllocationsAreCounted() {
  constexpr std::int64_t kBytes = 12'345;
  const Allocations before = AllocationsSoFar();
  delete[] new char[kBytes];
  void* volatile kept = std::malloc(kBytes);  // nor may the compiler leave it out
  std::free(kept);
  const Allocations after = AllocationsSoFar();
  if (after.count - before.count < 1 || after.bytes - before.bytes < kBytes) {
    throw std::runtime_error("allocations are not counted in this build");
  }
}

}  // namespace loopbench::harness
