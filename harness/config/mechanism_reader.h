// What a mechanism file says, its reader and its writer.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "mechanism/description/description.h"

namespace loopbench::harness {

// What a mechanism file says beyond the mechanism itself: exact facts that observers compare with.

/// A linear combination of absolute body angles, as (body name, coefficient) pairs. On the branch
/// the scene starts on it keeps its initial value; a run that changes it has left the branch.
using AngleCombination = std::vector<std::pair<std::string, double>>;

/// The exact motion of one body is that of a plain pendulum,
///   theta'' = -frequency_squared sin(theta),   theta = absolute angle of the body - down_angle.
struct PendulumForm {
  std::string body;
  double down_angle = 0.0;         ///< absolute angle of the body where theta = 0 [rad]
  double frequency_squared = 0.0;  ///< [1/s^2], > 0
};

/// JSON "observe". Empty where a scene has no such facts.
struct SceneObservation {
  std::vector<AngleCombination> branch_invariants;  ///< JSON "branch"
  std::optional<PendulumForm> closed_form;
  double length = 1.0;  ///< characteristic bar length, the scale of "saturated" drift [m]
};

/// All that one mechanism file says.
struct MechanismFile {
  MechanismDescription description;
  SceneObservation observe;
  std::string canonical;  ///< the document without spaces: equal texts are equal mechanisms
};

// Reads a mechanism from JSON (configs/schema/mechanism.schema.json; SI units, angles in rad).
//
// The reader answers for what the file says: names that exist, numbers in range, as many values as
// a joint has coordinates, inertias that are positive definite. Whether the loops can be closed
// from the initial values is the assembly's business. In a planar file vectors may have a third
// component, which must be zero, and frames turn about z only.

/// Reads a file. Throws ConfigError with all mistakes in it, one per line.
MechanismFile ReadMechanism(const std::filesystem::path& path);

/// The same from text; `file` is the name used in messages.
MechanismFile ParseMechanism(std::string_view text, const std::string& file);

// A mechanism as the JSON file that says it (mechanism_reader.h reads it to the same description).
//
// What is written comes from the lists of fields that the readers use, so that nothing that a file
// can say is lost. Points of bodies that joints and forces refer to keep their names.

/// The whole file. Reading it gives the description bit by bit, but for what no file says: values
/// of joints whose only coordinate follows a given motion, which say nothing, are left out, and the
/// sign of a zero that is a default.
///
/// @throws ConfigError with what the reader has against it, for a description that no file can say:
/// released directions of joints (redundancy.h), names that are empty or used twice, parts out of
/// the plane, inertias that no body has.
std::string MechanismText(const MechanismDescription& description, const SceneObservation& observe,
                          const std::string& comment = "");

}  // namespace loopbench::harness
