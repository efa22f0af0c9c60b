// The one exception for input that a person can correct.
#pragma once

#include <stdexcept>

namespace loopbench::harness {

/// Bad input. what() is the whole message, ready to print: for each mistake the file, the JSON
/// Pointer, the value found and what was expected instead. The command line turns it into exit
/// code 2. Numerical failures are not errors of this kind; they are outcomes of a run.
class ConfigError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace loopbench::harness
