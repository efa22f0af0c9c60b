// Runs the cases of an experiment and keeps their records.
#pragma once

#include <vector>

#include "harness/config/experiment.h"
#include "harness/report/select.h"
#include "harness/store/result_store.h"

namespace loopbench::harness {

struct SuiteOptions {
  int jobs = 1;  ///< accuracy cases at once; timing always runs alone
  bool accuracy = true;
  bool timing = true;
  Selection filter;  ///< accuracy cases whose keys do not match are left out
};

/// The accuracy cases that pass the filter. Throws ConfigError when none does, or when it names a
/// key that cases do not have.
std::vector<Case> SelectCases(const Experiment& experiment, const Selection& filter);

/// Runs accuracy cases, costliest first, then timings, appending each record to the store as it is
/// complete. Shows progress.
void RunSuite(const Experiment& experiment, const SuiteOptions& options, ResultStore& store);

}  // namespace loopbench::harness
