// A mechanism in the terms that other programs share, and as a file of theirs.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "harness/exchange/model.h"
#include "mechanism/description/description.h"

namespace loopbench::exchange {

// A mechanism as a model in plain numbers.

/// With the tree and the order of Mechanism(description, Coordinates::kJoint), put where all
/// coordinates and speeds are zero. Model::missing then names prescribed motions, forces that
/// depend on time, drag, forces along the coordinate of a joint that closes a loop, joints and
/// forces of other programs.
Model MakeModel(const MechanismDescription& description);

/// The same at the assembled start. Throws std::runtime_error where it cannot be assembled.
Model MakeModelAtStart(const MechanismDescription& description);

// A mechanism as a file for other programs.

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
