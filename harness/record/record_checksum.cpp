#include "harness/record/record_checksum.h"

#include <fmt/format.h>

#include <stdexcept>

#include "harness/record/excerpt.h"
#include "harness/text/hash.h"

namespace loopbench::harness {
namespace {

constexpr std::string_view kKey = "\"checksum\":\"";
constexpr std::size_t kDigits = 16, kSuffix = kKey.size() + kDigits + 2;  // with "}

}  // namespace

std::string WithChecksum(std::string object) {
  object.pop_back();
  if (object.size() > 1) object += ',';
  const std::string checksum = Fnv1a(object);
  return object.append(kKey).append(checksum).append("\"}");
}

bool VerifyChecksum(std::string_view line) {
  if (line.size() <= kSuffix) return false;
  const std::string_view object = line.substr(0, line.size() - kSuffix),
                         end = line.substr(object.size());
  const std::string expected = Fnv1a(object);
  const std::string_view found = end.substr(kKey.size(), kDigits);
  const bool is_named = end.starts_with(kKey);
  if (is_named && found == expected) return true;
  constexpr std::string_view kChanged = "the line was changed after it was written: found ";
  if (is_named) {
    throw std::runtime_error(
        fmt::format("{}checksum \"{}\", expected \"{}\"", kChanged, Excerpt(found), expected));
  }
  if (found == expected) {
    throw std::runtime_error(fmt::format("{}the key {}, expected \"checksum\"", kChanged,
                                         Excerpt(end.substr(0, kKey.size() - 2))));
  }
  return false;
}

}  // namespace loopbench::harness
