// Families of mechanisms of any size (mechanism/description/library.h), as benchmarks and the
// timings of experiments take them.
#pragma once

#include <string>
#include <vector>

#include "mechanism/description/description.h"

namespace loopbench::harness {

struct SizedFamily {
  std::string name;
  int smallest, largest;
  std::string of_what;  ///< what a size counts: "bars of a closed chain"
  /// With a start that moves, so that no term of the equations vanishes.
  MechanismDescription (*make)(int size);
};

const std::vector<SizedFamily>& SizedFamilies();
std::vector<std::string> NamesOfSizedFamilies();
/// All of them, with what their sizes count, in a sentence.
std::string TextOfSizedFamilies();

/// The family of that name, which must be one.
const SizedFamily& SizedFamilyOf(const std::string& name);

}  // namespace loopbench::harness
