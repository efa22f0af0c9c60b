// The text of an experiment of one run, for programs that recommend one.
#pragma once

#include <filesystem>
#include <string>

#include "harness/config/experiment.h"

namespace loopbench::harness {

struct SingleRun {
  std::string name, comment;
  std::filesystem::path mechanism;  ///< as the experiment's folder sees it
  double horizon = 1.0;             ///< [s]
  Column column;
  std::string integrator = "ode45";
  double rtol = 1e-8;
  double step = 0.0;  ///< [s]; fixed where it is positive
  ReferenceOptions reference;
};

/// With a certified reference, and timed as it is.
std::string ExperimentText(const SingleRun& run);

}  // namespace loopbench::harness
