// Instruction counts from the files of Callgrind (valgrind --tool=callgrind).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace loopbench::harness {

/// Executed instructions in one file of Callgrind: the first number of its "totals:" line, counted
/// as event "Ir". Throws std::runtime_error that names `file` when there is no such line.
std::int64_t CallgrindInstructions(std::string_view text, const std::string& file);

}  // namespace loopbench::harness
