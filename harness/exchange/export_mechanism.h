// A mechanism as plain numbers, and as a file of another program.
#pragma once

#include <string_view>

#include "harness/exchange/model.h"
#include "mechanism/description/description.h"

namespace loopbench::exchange {

// A mechanism as a model in plain numbers.

/// Makes a model with the tree and order of Mechanism(description, Coordinates::kJoint), at zero
/// coordinates and speeds. Model::missing then lists prescribed motions, time-dependent forces,
/// drag, forces along coordinates of cut joints, and joints and forces of other programs.
Model MakeModel(const MechanismDescription& description);

/// Makes the model at the assembled start. Throws std::runtime_error if assembly fails.
Model MakeModelAtStart(const MechanismDescription& description);

// A mechanism as a file for other programs.

struct ExportOptions {
  double time_step = 1e-3;  ///< of MuJoCo [s]
};

struct ExportedFile {
  std::string text;
  std::vector<Note> notes;
};

/// An export format.
struct ExportFormat {
  std::string_view name, ending;
  ExportedFile (*write)(const MechanismDescription& description, const ExportOptions& options);
};

const std::vector<ExportFormat>& ExportFormats();

/// Exports the mechanism at its assembled start, byte-reproducibly. Throws Unsupported with all
/// unsupported parts, and std::runtime_error if assembly fails.
inline ExportedFile Export(const MechanismDescription& description, const ExportFormat& format,
                           const ExportOptions& options = {}) {
  return format.write(description, options);
}

}  // namespace loopbench::exchange
