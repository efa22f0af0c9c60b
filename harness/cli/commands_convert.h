// convert: a mechanism as a file for other programs.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "harness/cli/commands.h"
#include "harness/exchange/export_mechanism.h"

namespace loopbench::harness {

struct ConvertCommand {
  std::filesystem::path mechanism;
  std::string to;             ///< a name of ExportFormats()
  std::filesystem::path out;  ///< "": the mechanism file's name with the format's ending, here
  exchange::ExportOptions options;
  bool json = false;
  ProcessLimits limits = kFileLimits;
};

/// 0, or 2 where the format does not have all that the mechanism has, which is then said, and
/// nothing is written.
int Convert(const ConvertCommand& command);

std::vector<std::string> ExportFormatNames();

}  // namespace loopbench::harness
