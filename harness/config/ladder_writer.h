// An experiment that runs all models of a ladder alike (mechanism/simplify/model.h).
#pragma once

#include <string>
#include <vector>

namespace loopbench::harness {

struct LadderFile {
  std::string name, comment;
  std::vector<std::string> mechanisms;  ///< paths as the experiment says them
  double horizon = 10.0;                ///< [s]
};

/// The whole file: every model in the same columns, at the same tolerances, for the same horizon,
/// with timings, and without the savings that models of the ladder have made themselves.
std::string LadderText(const LadderFile& ladder);

}  // namespace loopbench::harness
