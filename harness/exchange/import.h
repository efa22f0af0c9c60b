// Import of mechanisms from MuJoCo (MJCF), URDF and SDF (docs/exchange.md).
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "harness/config/mechanism_reader.h"
#include "mechanism/description/joint_frames.h"

namespace loopbench::harness {

/// A part of the file that the mechanism does not have, or represents differently.
struct ImportNote {
  std::string file;     ///< the imported file, or a file that it includes
  int line = 0;         ///< in the file
  std::string element;  ///< <joint name="knee">, optionally with an attribute
  std::string reason;   ///< replacement or omission, and the reason
  bool changes_motion = false;
};

struct Imported {
  std::string format;  ///< "mjcf", "urdf" or "sdf"
  MechanismDescription description;
  ObservedQuantities observe;
  std::vector<ImportNote> notes;  ///< of the imported file first, by line
};

struct ImportOptions {
  std::string format = "";             ///< of ImportFormats(); "": from the root element
  std::filesystem::path sidecar = {};  ///< file with loops, forces and a start; "": none
  bool planar = false;                 ///< import as a planar mechanism; rejects others
  bool floats = false;                 ///< URDF: the root link is free, not fixed to the ground
  bool balances_inertia = false;       ///< replace impossible moments by their mean
  bool keeps_digits = false;           ///< keep rounded angles and directions as written
  std::optional<Eigen::Vector3d> gravity = {};  ///< overrides the file's or format's [m/s^2]
};

inline std::vector<std::string> ImportFormats() { return {"mjcf", "urdf", "sdf"}; }

/// Throws ConfigError for invalid or inexpressible content: file, line, element, found, expected.
Imported ImportMechanism(const std::filesystem::path& path, const ImportOptions& options = {});

/// Reads a text; `file` is the name used in messages. Without a `path` it includes no files.
Imported ImportText(std::string_view text, const std::string& file,
                    const ImportOptions& options = {},
                    const std::optional<std::filesystem::path>& path = {});

}  // namespace loopbench::harness
