// A Record as one line of JSON, and back.
#pragma once

#include <string>
#include <string_view>

#include "harness/record/record.h"

namespace loopbench::harness {

/// The record as one JSON object without line breaks: "format" (file_format.h), keys in the
/// record's order, and behind them its checksum.
///
/// JSON has no NaN and no infinity. A non-finite double is written as null, which reads back as
/// monostate ("not measured"); inside a series it reads back as NaN. Every other value comes back
/// with the same type and the same bits (doubles in shortest round-trip form, "1.0" never "1").
/// Bytes that are not UTF-8 become U+FFFD.
///
/// The line ends with ,"checksum":"16 hexadecimal digits"}: FNV-1a (64 bit) of all bytes before
/// this. It finds whatever changes a line by accident, a flipped bit with certainty; it is no
/// signature.
std::string ToJsonLine(const Record& record);
/// The same object without format and checksum: a row of a table, not of a store.
std::string ToJsonObject(const Record& record);

/// The record that `line` describes, without its format and checksum. A line without them (made by
/// hand) is read as it is; `is_unsealed` tells of one with a format and no checksum, which may have
/// been changed. Throws std::runtime_error that says what was found and what was
/// expected: for another format, a checksum that is not that of the line, anything but one flat
/// JSON object of null, bool, number, string or array of numbers, for a key that occurs twice, and
/// for a value of another type than its key has (measures.h). Linear in the length of the line,
/// whatever it holds.
Record FromJsonLine(std::string_view line, bool* is_unsealed = nullptr);

/// Whether `line` is the beginning of a line that ToJsonLine() wrote of a run's record, and no
/// more: what a crash leaves.
bool IsTornRecord(std::string_view line);

/// 16 hexadecimal digits that name a case: FNV-1a (64 bit) of the canonical JSON of its keys. In
/// the canonical form keys are sorted and there are no spaces, so the order in which keys were set
/// does not matter. A hash, not a signature: it is for finding equal cases, not for security.
std::string CaseId(const Record& canonical_keys);

}  // namespace loopbench::harness
