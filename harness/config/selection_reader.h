// What the files of rules share (claims, failure maps): words, and selections of records.
//
// Internal to harness/config.
#pragma once

#include <string>
#include <vector>

#include "harness/json/json_reader.h"
#include "harness/record/select.h"

namespace loopbench::harness {

inline constexpr const char* kAnyText = "a string that is not empty";

/// A member that must be a string that is not empty; "" after an error.
std::string RequiredText(const JsonNode& owner, const std::string& key);
/// The same where it may be absent.
std::string OptionalText(const JsonNode& owner, const std::string& key);

/// {"key": value, "key": [value, ...]}: strings, numbers and bools as the texts that a Condition
/// compares with.
Selection ReadSelection(const JsonNode& node);
/// The same for a member that may be absent, but not empty: that would select everything.
Selection OptionalSelection(const JsonNode& owner, const std::string& key);

/// Labels and ids name results, so each may be there once: reports `owner`'s `key` where `name` is
/// among `taken`, and adds it.
void ReportRepeated(const JsonNode& owner, const std::string& key, const std::string& name,
                    std::vector<std::string>* taken);

}  // namespace loopbench::harness
