// libFuzzer target of the reader of a store's lines (tests/fuzz/README.md).
#include <cstddef>
#include <cstdint>

#include "tests/fuzz/readers.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  loopbench::fuzz::CallReader("record", {reinterpret_cast<const char*>(data), size});
  return 0;
}
