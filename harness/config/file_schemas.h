// Schemas of whole files, printed by harness/json/schema.h.
#pragma once

#include "harness/json/schema.h"

namespace loopbench::harness {

Json MechanismSchema();
Json ExperimentSchema();
Json BenchmarksSchema();
Json PublishedSeriesSchema();

}  // namespace loopbench::harness
