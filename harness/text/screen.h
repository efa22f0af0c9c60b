// What whoever reads standard output or standard error sees: the one place that decides width and
// colour (docs/decisions/024).
#pragma once

#include <cstddef>

namespace loopbench::harness {

bool OutputIsTerminal();

struct Screen {
  std::size_t width = 0;  ///< [cells]; 0: as wide as it takes, for files and pipes
  bool colour = false;
};

/// Of standard output. A terminal that does not know its width has that of the environment's
/// COLUMNS, else 80. There is colour on a terminal that has it, unless https://no-color.org is
/// obeyed.
Screen OutputScreen();

/// Of standard error: where progress is shown, if it is a terminal (width > 0).
Screen ErrorScreen();

/// From now on standard output is as wide as it takes: --wide.
void ShowWide();

}  // namespace loopbench::harness
