// What the files of rules share (claims, robustness maps): words, and selections of records.
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

/// {"key": value, "key": [value, ...]} with at least so many keys (none would select everything):
/// strings, numbers and bools as the texts that a Condition compares with.
Selection ReadSelection(const JsonNode& node, std::size_t least = 0);
Json SelectionSchema(std::size_t least = 0);

template <class T>
FieldValue<T> SelectionOf(Selection T::*member, std::size_t least = 0) {
  return {SelectionSchema(least),
          [=](const JsonNode& node, T& owner) { owner.*member = ReadSelection(node, least); }};
}

/// Labels and ids name results, so each may be there once: reports `owner`'s `key` where `name` is
/// among `taken`, and adds it.
void ReportRepeated(const JsonNode& owner, const std::string& key, const std::string& name,
                    std::vector<std::string>* taken);

}  // namespace loopbench::harness
