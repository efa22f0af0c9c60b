// One part of a run, for as many machines.
#pragma once

#include <cstddef>
#include <string>

namespace loopbench::harness {

/// One of `count` parts: every case is in exactly one.
struct Shard {
  int index = 1, count = 1;
  bool Takes(std::size_t number) const {
    return number % static_cast<std::size_t>(count) == static_cast<std::size_t>(index - 1);
  }
};

/// Reads "k/n" with 1 <= k <= n. Throws ConfigError.
Shard ParseShard(const std::string& text);

}  // namespace loopbench::harness
