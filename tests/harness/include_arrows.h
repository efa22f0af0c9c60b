// Who may include whom (docs/architecture.md), as a function of a file's path and text.
//
//   mechanism <- {odca, lagrange, reduction} <- harness <- tests
#pragma once

#include "tests/standard.h"

namespace loopbench::architecture {

/// The headers that `text` includes, brackets and quotes kept: "<vector>", "\"odca/plan.h\"".
/// Comments are passed over. What follows an #include that is neither (a macro) is given as it is.
std::vector<std::string> Includes(std::string_view text);

/// One line per #include of `text` that the file at `path` (relative to the repository's root, "/"
/// between folders) must not have; empty when all arrows are right.
std::vector<std::string> Violations(std::string_view path, std::string_view text);

}  // namespace loopbench::architecture
