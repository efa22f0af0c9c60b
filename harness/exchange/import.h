// Mechanisms described for other programs: MuJoCo's MJCF, URDF and SDF (docs/exchange.md).
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "harness/exchange/imported.h"

namespace loopbench::harness {

struct ImportOptions {
  std::string format;                      ///< of ImportFormats(); "": what the root element says
  std::filesystem::path sidecar;           ///< loops, forces and a start beside the file; "": none
  bool planar = false;                     ///< as a planar mechanism, which it must be
  bool floats = false;                     ///< URDF: the root link is free, not fixed to the ground
  bool keeps_digits = false;               ///< rounded angles and directions stay as written
  std::optional<Eigen::Vector3d> gravity;  ///< in place of the file's or the format's [m/s^2]
};

/// mjcf, urdf, sdf.
const std::vector<std::string>& ImportFormats();

/// Reads a file. Throws ConfigError for what cannot be read or cannot be said as a mechanism: file,
/// line, element, value found, what was expected.
Imported ImportMechanism(const std::filesystem::path& path, const ImportOptions& options = {});

/// The same from text; `file` is the name used in messages.
Imported ImportText(std::string_view text, const std::string& file,
                    const ImportOptions& options = {});

}  // namespace loopbench::harness
