// Whether starts can be assembled, asked before anything is run.
#pragma once

#include <string>
#include <vector>

#include "harness/config/experiment.h"
#include "harness/isolation/processes.h"

namespace loopbench::harness {

/// "" if the loops of the mechanism can be closed from its initial data, else what was found and
/// expected. Assembled in a child process; one that the limits cut off says so.
std::string StartFault(const MechanismDescription& description, const ProcessLimits& limits);

/// The same for the scenes of an experiment's combinations as they are run, under the limits of
/// their cases: a sentence for each scene, of the first combination that has any fault. Scenes that
/// combinations share are assembled once; members of ensembles are not looked at.
std::vector<std::string> StartFaults(const std::vector<Experiment>& experiments);

}  // namespace loopbench::harness
