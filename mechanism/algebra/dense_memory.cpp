#include "mechanism/algebra/dense_memory.h"

#include <cstdio>
#include <cstdlib>

namespace loopbench {

void RequireDense(const std::string& what, double numbers) {
  constexpr double kMost = 1e18;  // bytes: fits size_t, and exceeds every machine
  const double bytes = numbers * static_cast<double>(sizeof(double));
  // volatile: a block that is never used would not be asked for
  void* volatile block = bytes < kMost ? std::malloc(static_cast<std::size_t>(bytes)) : nullptr;
  const bool granted = block != nullptr || bytes == 0.0;
  std::free(block);
  if (granted) return;
  char size[32];
  std::snprintf(size, sizeof size, "%.3g GB", 1e-9 * bytes);
  throw TooDense(what + " requires " + size);
}

}  // namespace loopbench
