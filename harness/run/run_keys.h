// What a record says of a run besides what its observers have measured.
#pragma once

#include <string>

#include "harness/analysis/growth.h"
#include "harness/integrator/arkode.h"
#include "harness/record/record.h"

namespace loopbench::harness {

/// How the run ended and what the integrator counted; a projection's Newton steps are evaluations,
/// too.
void WriteCounts(const IntegratorResult& result, std::int64_t projection_steps, bool is_implicit,
                 Record& record);

/// Growth of drift over an ensemble, of which `failed` did not finish.
void WriteGrowth(const Growth& growth, int failed, Record& record);

/// Growth of what is no drift, in the one run that it is known of: its exponent, without a verdict.
void WriteExponent(const std::string& key, const DriftSeries& series, double horizon, double scale,
                   Record& record);

}  // namespace loopbench::harness
