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

/// The record that `line` describes, without its format and checksum. A line without both (made by
/// hand) is accepted, and `is_sealed` is false then. Throws std::runtime_error with the value found
/// and the value expected for another format, a format without a checksum, and a wrong checksum. It
/// also throws unless the line is one flat JSON object of null, bool, number, string or array of
/// numbers, whose keys occur once and whose values have the types of their keys (measures.h).
/// Linear in the length of any line.
Record FromJsonLine(std::string_view line, bool* is_sealed = nullptr);

/// Whether `line` is the beginning of a line that ToJsonLine() wrote of a run's record, and no
/// more: what a crash leaves.
bool IsTornRecord(std::string_view line);

/// 16 hexadecimal digits that name a case: FNV-1a (64 bit) of the canonical JSON of its keys. In
/// the canonical form keys are sorted and there are no spaces, so the order in which keys were set
/// does not matter. A hash, not a signature: it is for finding equal cases, not for security.
std::string CaseId(const Record& canonical_keys);

}  // namespace loopbench::harness
