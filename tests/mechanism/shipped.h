// Mechanisms of configs/mechanisms, by name.
#pragma once

#include <string>

#include "harness/config/mechanism_reader.h"

namespace loopbench::testing {

inline MechanismDescription Shipped(const std::string& name) {
  return harness::ReadMechanism(std::string(LOOPBENCH_SOURCE_DIR) + "/configs/mechanisms/" + name +
                                ".json")
      .description;
}

}  // namespace loopbench::testing
