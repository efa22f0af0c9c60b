// Common parts of files of rules (claims, robustness maps): texts, and selections of records.
//
// Internal to harness/config.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "harness/json/fields.h"
#include "harness/record/select.h"

namespace loopbench::harness {

inline constexpr const char* kAnyText = "a string that is not empty";

/// {"key": value, "key": [value, ...]} with at least `least` keys (no key would select everything).
/// Strings, numbers and bools become the texts that a Condition compares with.
Selection ReadSelection(const JsonNode& node, std::size_t least = 0);
Json SelectionSchema(std::size_t least = 0);

template <class T>
FieldValue<T> SelectionOf(Selection T::*member, std::size_t least = 0) {
  return {SelectionSchema(least),
          [=](const JsonNode& node, T& owner) { owner.*member = ReadSelection(node, least); }};
}

/// Reports `owner`'s `key` if `name` is in `taken`, and adds the name: labels and ids must be
/// unique.
void ReportRepeated(const JsonNode& owner, const std::string& key, const std::string& name,
                    std::vector<std::string>* taken);

}  // namespace loopbench::harness
