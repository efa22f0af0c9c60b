// Schemas of whole files, printed by harness/base/schema.h.
#pragma once

#include "harness/base/schema.h"

namespace loopbench::harness {

Json MechanismSchema();
Json ExperimentSchema();
Json BenchmarksSchema();
Json PublishedSeriesSchema();

}  // namespace loopbench::harness
