// The schemas of whole files, as harness/json/schema.h prints them.
#pragma once

#include "harness/json/schema.h"

namespace loopbench::harness {

Json MechanismSchema();
Json ExperimentSchema();
Json BenchmarksSchema();
Json PublishedSeriesSchema();

}  // namespace loopbench::harness
