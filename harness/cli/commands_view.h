// view: a mechanism as a page, as a picture for papers, as tables.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "harness/cli/commands.h"
#include "harness/view/svg.h"

namespace loopbench::harness {

struct ViewCommand {
  std::filesystem::path mechanism;
  std::string format;         ///< html, svg or text; "" for the ending of `out`, else html
  std::filesystem::path out;  ///< "": NAME.html or NAME.svg beside the caller; text: the terminal
  SvgOptions svg;
  bool all = false;  ///< every row of long tables
  ProcessLimits limits = kFileLimits;
};

/// 0, or 2 when the start cannot be assembled: the picture then shows the mechanism as the file
/// says it, with its open loops.
int View(const ViewCommand& command);

}  // namespace loopbench::harness
