// Mechanisms of MuJoCo (MJCF), URDF and SDF as files of this program.
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

// What reading a description of another program gives.

/// Something of the file that the mechanism does not have, or has in another way.
struct ImportNote {
  int line = 0;         ///< in the file
  std::string element;  ///< <joint name="knee">, perhaps with an attribute behind it
  std::string reason;   ///< what became of it, and why
  bool changes_motion = false;
};

struct Imported {
  std::string format;  ///< "mjcf", "urdf" or "sdf"
  MechanismDescription description;
  SceneObservation observe;
  std::vector<ImportNote> notes;  ///< by line
};

// Mechanisms described for other programs: MuJoCo's MJCF, URDF and SDF (docs/exchange.md).

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

// What a description of another program cannot say, beside it: loops, forces and a start, with the
// keys of mechanism files (docs/exchange.md).

struct SidecarFacts {
  SceneObservation observe;
  bool has_gravity = false;
};

/// Adds to `description` what the file says; its start takes the place of the description's.
/// `at_rest` has the bodies in ground axes where all coordinates are 0: loops that are given on one
/// side close there. Throws ConfigError with all mistakes, one per line.
SidecarFacts ReadSidecar(const std::filesystem::path& path, const std::vector<Frame>& at_rest,
                         MechanismDescription* description);

}  // namespace loopbench::harness
