// import: a description of another program as a mechanism file.
#pragma once

#include <filesystem>

#include "harness/cli/commands.h"
#include "harness/exchange/import.h"

namespace loopbench::harness {

struct ImportCommand {
  std::filesystem::path file;
  std::filesystem::path out;  ///< "": the file's name with .json, here
  ImportOptions options;
  bool json = false;
  ProcessLimits limits = kFileLimits;
};

/// Writes the mechanism and prints what of the file it does not have. The work is done in a child
/// process under the limits.
int Import(const ImportCommand& command);

}  // namespace loopbench::harness
