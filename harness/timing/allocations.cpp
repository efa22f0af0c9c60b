#include "harness/timing/allocations.h"

#include <atomic>
#include <cstddef>

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

}  // namespace loopbench::harness
