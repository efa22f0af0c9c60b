// Many runs of the same kind: on several threads, and on each of them side by side, as many as
// there are lanes (mechanism/formulation/side_by_side.h).
#pragma once

#include <functional>

#include "mechanism/formulation/side_by_side.h"

namespace loopbench::harness {

/// Calls run(i, beside) for each i < count. Runs on one thread switch where they Meet(); each has
/// its own stack of kStackBytes. If memory is short, fewer runs alternate. Returns when all have
/// ended; rethrows the exception of the first run that threw. Sanitizers follow one stack only:
/// with them runs are sequential.
void RunSideBySide(int count, int threads, const std::function<void(int, SideBySide&)>& run);

inline constexpr std::size_t kStackBytes = std::size_t{8} << 20;

}  // namespace loopbench::harness
