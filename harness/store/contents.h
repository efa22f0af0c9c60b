// Cases that share all keys and differ in what they ran: told apart wherever records are read.
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

/// The records, and in those that share all their keys (what stands before "case_id") with a record
/// of another case_id "content" and, where one of them has it, "set" (what --set changed) moved
/// before "case_id", among the keys: tables then show both as columns, labels name them. Records
/// without a case_id stay as they are.
std::vector<Record> WithContents(std::vector<Record> records);

/// Tells cases apart in both where one of them has to (WithContents() of each): equal cases then
/// have equal keys.
void ShareContents(std::vector<Record>* one, std::vector<Record>* other);

/// Throws std::runtime_error naming the store and one such case: `command` judges all records that
/// match a rule together, and a rule cannot mean two mechanisms at once.
void RequireOneContent(const std::vector<Record>& records, const std::filesystem::path& store,
                       std::string_view command);

}  // namespace loopbench::harness
