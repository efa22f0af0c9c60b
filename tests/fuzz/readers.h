// One call of a reader on arbitrary bytes, for the fuzzers and for the replay in the test suite.
//
// A reader may accept the bytes or refuse them with its error and a message in which every line is
// valid UTF-8 and not endless. Anything else (another exception, a crash, a sanitizer's finding) is
// a fault.
#pragma once

#include <array>
#include <string_view>

namespace loopbench::fuzz {

/// All files that this program reads: four kinds of configuration, families of benchmarks, Google
/// Benchmark's JSON, a line of a store, and a store (baselines are stores). Files of other programs
/// are XML to import, the loops beside it, published series, and trajectories.
inline constexpr std::array<std::string_view, 12> kKinds = {
    "mechanism", "experiment", "claim",  "map",     "benchmark", "measurement",
    "record",    "store",      "import", "sidecar", "series",    "trajectory"};

/// Returns true if the reader accepts the bytes. Throws std::logic_error for a message that is not
/// fit to be shown, and for an unknown kind.
bool CallReader(std::string_view kind, std::string_view bytes);

}  // namespace loopbench::fuzz
