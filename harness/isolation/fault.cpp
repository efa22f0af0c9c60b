#include "harness/isolation/fault.h"

#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <memory>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "harness/record/select.h"

namespace loopbench::harness {

std::optional<std::string> PlantedFault(const Record& keys) {
  const char* planted = std::getenv("LOOPBENCH_FAULT");
  if (planted == nullptr) return std::nullopt;
  const std::string_view text = planted;
  const std::size_t colon = text.find(':');
  const std::string_view fault = text.substr(0, colon);
  if (colon == std::string_view::npos || !Matches(keys, {ParseCondition(text.substr(colon + 1))})) {
    return std::nullopt;
  }
  if (fault == "crash") std::raise(SIGSEGV);
  if (fault == "throw") throw std::logic_error("planted");
  if (fault == "garbage") return "{\"kind\": \"accu\x01\xff";
  if (fault == "memory") {
    std::vector<std::unique_ptr<char[]>> hoard;
    for (;;) hoard.emplace_back(new char[1 << 26]);  // asked for, not touched: quick
  }
  while (fault == "hang") ::pause();
  return std::nullopt;
}

}  // namespace loopbench::harness
