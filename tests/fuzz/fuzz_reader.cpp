// libFuzzer target of one reader, which the build names (tests/fuzz/README.md).
#include <cstddef>
#include <cstdint>

#include "tests/fuzz/readers.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  loopbench::fuzz::CallReader(LOOPBENCH_FUZZ_KIND, {reinterpret_cast<const char*>(data), size});
  return 0;
}
