// Documents as people read them: schemas, and mechanisms and experiments that a command writes.
#pragma once

#include <string>

#include "harness/json/json_document.h"

namespace loopbench::harness {

/// On one line, with a space behind each comma and colon.
std::string FlatText(const Json& value);

/// A whole file: what fits stands on one line, else one element per line, indented by two. Lines of
/// at most 100 characters where that is possible. Numbers are read back to the same bits.
std::string JsonText(const Json& document);

}  // namespace loopbench::harness
