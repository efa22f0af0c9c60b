// Limits as keys and values: what the content of a case says of them.
#pragma once

#include "harness/config/experiment.h"

namespace loopbench::harness {

/// Each limit under its key in files.
Record RecordOf(const Limits& limits);

}  // namespace loopbench::harness
