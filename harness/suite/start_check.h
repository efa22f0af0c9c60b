// Whether starts can be assembled, asked before anything is run.
#pragma once

#include <string>
#include <vector>

#include "harness/config/experiment.h"
#include "harness/isolation/processes.h"

namespace loopbench::harness {

/// Sentences about starts: faults of starts that cannot be assembled, values found and expected,
/// and guesses that are missed.
struct StartReport {
  std::vector<std::string> faults, warnings;
};

/// Assembles the mechanism in a child process; limits that cut it off are a fault.
StartReport CheckStart(const MechanismDescription& description, const ProcessLimits& limits);

/// The same for the scenes of an experiment's combinations as they are run, under the limits of
/// their cases, up to the first combination that has any fault. Scenes that combinations share are
/// assembled once; members of ensembles are not looked at.
StartReport CheckStarts(const std::vector<Experiment>& experiments);

}  // namespace loopbench::harness
