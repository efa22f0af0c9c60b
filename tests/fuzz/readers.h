// One call of a reader on arbitrary bytes, for the fuzzers and for the replay in the test suite.
//
// A reader may accept the bytes or refuse them with ConfigError (lines of stores:
// std::runtime_error) and a message in which every line is valid UTF-8 and not endless. Anything
// else (another exception, a crash, a sanitizer's finding) is a fault.
#pragma once

#include <string_view>

namespace loopbench::fuzz {

/// Throw std::logic_error when a message is not fit to be shown.
void CallMechanismReader(std::string_view bytes);
void CallExperimentReader(std::string_view bytes);
void CallClaimsReader(std::string_view bytes);
void CallMapReader(std::string_view bytes);
void CallRecordReader(std::string_view bytes);  ///< a line of a store

}  // namespace loopbench::fuzz
