// Reads the rules of a failure map (configs/experiments/extremes/map.json).
//
// The file is an object
//   {"title", "comment", "columns": [{"label", "select"}], "groups": [{"label", "rows": [row]}]}
// and a row
//   {"label", "select": {key: value or list}, "decides": [demand], "right": ["finished"],
//    "must_hold": "all" or [column labels], "not_applicable": {column label: reason} or a reason,
//    "cases": 1, "why"}
// A group may have all keys of a row too: its "select" and "not_applicable" join those of its rows,
// each of the others stands where a row has none. A demand is
//   {"measure", "limit" or "at_least" or "equal": number, "of": key, "when": ["finished"], "name",
//    "unit"}
// where the number is a multiple of the record's "of", if that is given.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "harness/judge/failure_map.h"

namespace loopbench::harness {

/// Reads a file. Throws ConfigError with all mistakes in it (unknown keys, wrong types, an ending
/// or a column label that does not exist, a label used twice, a row that nothing decides), each
/// with file, JSON Pointer, value found and what was expected.
MapRules ReadMapRules(const std::filesystem::path& path);

/// The same from text; `file` is the name used in messages.
MapRules ParseMapRules(std::string_view text, const std::string& file);

}  // namespace loopbench::harness
