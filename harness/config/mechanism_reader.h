// Reads a mechanism from JSON (configs/schema/mechanism.schema.json; SI units, angles in rad).
//
// The reader answers for what the file says: names that exist, numbers in range, as many values as
// a joint has coordinates, inertias that are positive definite. Whether the loops can be closed
// from the initial values is the assembly's business. In a planar file vectors may have a third
// component, which must be zero, and frames turn about z only.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "harness/config/scene.h"

namespace loopbench::harness {

/// Reads a file. Throws ConfigError with all mistakes in it, one per line.
MechanismFile ReadMechanism(const std::filesystem::path& path);

/// The same from text; `file` is the name used in messages.
MechanismFile ParseMechanism(std::string_view text, const std::string& file);

}  // namespace loopbench::harness
