// simplify: models of one scene, from the whole one down to the simplest.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "harness/cli/commands_explain.h"
#include "harness/isolation/processes.h"
#include "mechanism/simplify/model.h"

namespace loopbench::harness {

struct SimplifyCommand {
  std::filesystem::path mechanism;
  std::vector<std::string> only;        ///< names of ideas; empty: all
  std::vector<std::string> thresholds;  ///< NAME=VALUE, as typed
  Lumping lumping = Lumping::kCentreOfMass;
  double short_run = 1.0;       ///< length of the short run [s]; 0: none
  double horizon = 10.0;        ///< of the experiment [s]
  double errors = 0.0;          ///< length of runs that show how far models are off [s]; 0: none
  std::filesystem::path store;  ///< that gets a record of each model; none when empty
  double accept = 0.0;          ///< error that a model may cause, for its verdict there [m]
  std::filesystem::path out;    ///< folder; nothing is written when empty
  bool assembled = false;       ///< the whole model says all of its start
  bool force = false;           ///< into a folder that is there
  ProcessLimits limits;
};

/// Names of ideas, and of those with a limit.
std::vector<std::string> IdeaNames();
/// "light-links 0.01, ...": the limits as they are unless said.
std::string LimitsText();
/// Names of ways to lump masses, in the order of Lumping.
const std::vector<std::string>& LumpingNames();

/// Lists what each idea could take away, and with a folder writes a mechanism file for each idea
/// that applies, for all of them together and for the whole model, an experiment that runs them and
/// a page that says what was done. The work is done in a child process under the limits. 2 when the
/// start cannot be assembled, or there is nothing to write.
int Simplify(const SimplifyCommand& command, bool all, const std::string& typed);

}  // namespace loopbench::harness
