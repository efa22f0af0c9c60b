// A mechanism as a file for other programs.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "harness/exchange/model.h"
#include "mechanism/description/description.h"

namespace loopbench::exchange {

struct ExportOptions {
  double time_step = 1e-3;  ///< of MuJoCo [s]
};

struct ExportedFile {
  std::string text;
  std::vector<Note> notes;
};

/// A format that Loopbench writes.
struct ExportFormat {
  std::string_view name, ending, sentence;
  ExportedFile (*write)(const MechanismDescription& description, const ExportOptions& options);
};

/// A row each.
const std::vector<ExportFormat>& ExportFormats();

/// The mechanism at its assembled start. The same description gives the same bytes. Throws NotThere
/// with all that the format does not have, and std::runtime_error where there is no start.
ExportedFile Export(const MechanismDescription& description, const ExportFormat& format,
                    const ExportOptions& options = {});

}  // namespace loopbench::exchange
