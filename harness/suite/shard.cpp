#include "harness/suite/shard.h"

#include <fmt/format.h>

#include <charconv>
#include <limits>

#include "harness/text/config_error.h"

namespace loopbench::harness {

Shard ParseShard(const std::string& text) {
  Shard shard;
  const char* const end = text.data() + text.size();
  const auto index = std::from_chars(text.data(), end, shard.index);
  const bool has_count = index.ec == std::errc() && index.ptr != end && *index.ptr == '/';
  const auto count = has_count ? std::from_chars(index.ptr + 1, end, shard.count) : index;
  if (!has_count || count.ec != std::errc() || count.ptr != end || shard.index < 1 ||
      shard.index > shard.count) {
    throw ConfigError(fmt::format("--shard: found \"{}\", expected k/n with 1 <= k <= n <= {}",
                                  text, std::numeric_limits<int>::max()));
  }
  return shard;
}

}  // namespace loopbench::harness
