// The version of all that Loopbench reads back: configuration files, lines of stores, histories.
#pragma once

namespace loopbench::harness {

/// It is raised when a file of today could be misread by yesterday's program or the other way
/// round. What says none is of the time before 1.0 and read as 1: nothing changed its meaning.
/// docs/release.md has the promise.
inline constexpr int kFileFormat = 1;

/// What is expected where another stands; {}: kFileFormat.
inline constexpr const char* kExpectedFormat = "{}, the format that this version reads";

}  // namespace loopbench::harness
