// A Record as one line of JSON, and back.
#pragma once

#include <string>
#include <string_view>

#include "harness/record.h"

namespace loopbench::harness {

/// The record as one JSON object without line breaks, keys in the record's order.
///
/// JSON has no NaN and no infinity. A non-finite double is written as null, which reads back as
/// monostate ("not measured"); inside a series it reads back as NaN. Every other value comes back
/// with the same type and the same bits (doubles in shortest round-trip form, "1.0" never "1").
/// Bytes that are not UTF-8 become U+FFFD.
std::string ToJsonLine(const Record& record);

/// The record that `line` describes. Throws std::runtime_error that says what was found when the
/// line is not one flat JSON object of null, bool, number, string or array of numbers.
Record FromJsonLine(std::string_view line);

/// 16 hexadecimal digits that name a case: FNV-1a (64 bit) of the canonical JSON of its keys. In
/// the canonical form keys are sorted and there are no spaces, so the order in which keys were set
/// does not matter. A hash, not a signature: it is for finding equal cases, not for security.
std::string CaseId(const Record& canonical_keys);

}  // namespace loopbench::harness
