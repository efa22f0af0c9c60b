// Records to plant in robustness maps.
#pragma once

#include <fmt/format.h>

#include <string>

#include "harness/base/record.h"

namespace loopbench::harness {

/// A run of the parallelogram, to 20 s if it finished.
inline Record RunOf(const std::string& formulation, double rtol, double branch, double energy,
                    const std::string& outcome = "finished") {
  Record record;
  record.Set("kind", std::string("accuracy"));
  record.Set("mechanism", std::string("parallelogram"));
  record.Set("formulation", formulation);
  record.Set("rtol", rtol);
  record.Set("case_id", fmt::format("{}-{}", formulation, rtol));
  record.Set("outcome", outcome);
  record.Set("t_reached", outcome == "finished" ? 20.0 : 0.3125);
  record.Set("branch_error_max", branch);
  record.Set("energy_error_max", energy);
  return record;
}

}  // namespace loopbench::harness
