// Many runs of the same kind: on several threads, and on each of them side by side, as many as
// there are lanes (mechanism/formulation/side_by_side.h).
#pragma once

#include <functional>

#include "mechanism/formulation/side_by_side.h"

namespace loopbench::harness {

/// Calls run(i, beside) for each i < count. Runs on one thread take turns where they Meet(): each
/// has a stack of its own, of kStackBytes; where memory is short, fewer take turns. Returns when
/// all have ended; an exception is that of the first run that threw one. Sanitizers follow one
/// stack: under them runs go one after another.
void RunSideBySide(int count, int threads, const std::function<void(int, SideBySide&)>& run);

inline constexpr std::size_t kStackBytes = std::size_t{8} << 20;

}  // namespace loopbench::harness
