#include "harness/timing/callgrind.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <stdexcept>

namespace loopbench::harness {

namespace {

/// What follows `key` at the start of a line, or nothing.
std::optional<std::string_view> LineAfter(std::string_view text, std::string_view key) {
  for (std::size_t start = 0; start < text.size();) {
    const std::size_t end = std::min(text.find('\n', start), text.size());
    const std::string_view line = text.substr(start, end - start);
    if (line.starts_with(key)) return line.substr(key.size());
    start = end + 1;
  }
  return std::nullopt;
}

}  // namespace

std::int64_t CallgrindInstructions(std::string_view text, const std::string& file) {
  const auto events = LineAfter(text, "events: "), totals = LineAfter(text, "totals: ");
  std::int64_t count = 0;
  bool is_count = false;
  if (totals) {
    const char* const line_end = totals->data() + totals->size();
    const auto [end, error] = std::from_chars(totals->data(), line_end, count);
    // other events may follow
    is_count = error == std::errc() && count >= 0 && (end == line_end || *end == ' ');
  }
  if (!is_count || !events || !events->starts_with("Ir")) {
    throw std::runtime_error(fmt::format(
        "{}: no \"events: Ir\" and \"totals: NUMBER\", expected a file of Callgrind", file));
  }
  return count;
}

}  // namespace loopbench::harness
