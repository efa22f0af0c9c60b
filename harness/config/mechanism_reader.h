// Content of a mechanism file, its reader and its writer.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "mechanism/description/description.h"

namespace loopbench::harness {

/// Linear combination of absolute body angles, as (body name, coefficient) pairs. It is constant on
/// the initial branch; a run that changes it has left the branch.
using AngleCombination = std::vector<std::pair<std::string, double>>;

/// Closed-form motion of one body, a simple pendulum,
///   theta'' = -frequency_squared sin(theta),   theta = absolute angle of the body - down_angle.
struct PendulumForm {
  std::string body;
  double down_angle = 0.0;         ///< absolute angle of the body where theta = 0 [rad]
  double frequency_squared = 0.0;  ///< [1/s^2], > 0
};

/// JSON "expect": what the structure must have, or else the file is wrong.
struct Expectation {
  int degrees_of_freedom = 0;  ///< finite motions (Structure::freedom())
  std::string place;           ///< file, line and pointer, for messages

  friend bool operator==(const Expectation&, const Expectation&) = default;
};

/// JSON "known_solution" and "expect". Empty if a problem has no such properties.
struct ObservedQuantities {
  std::vector<AngleCombination> branch_invariants;  ///< JSON "branch"
  std::optional<PendulumForm> closed_form;
  double length = 1.0;  ///< characteristic bar length, the scale of "saturated" drift [m]
  std::optional<Expectation> expected;
};

/// Content of one mechanism file.
struct MechanismFile {
  MechanismDescription description;
  ObservedQuantities observe;
  std::string canonical;  ///< document without spaces; equal for equal mechanisms
};

/// Reads a file (configs/schema/mechanism.schema.json; SI units, angles in rad). Checks names,
/// ranges of numbers, one value per coordinate of a joint and inertias; the assembly checks if the
/// loops can be closed. Throws ConfigError with all errors, one per line.
MechanismFile ReadMechanism(const std::filesystem::path& path);

/// Reads a mechanism from text; `file` is the name used in messages.
MechanismFile ParseMechanism(std::string_view text, const std::string& file);

/// Returns the file, written by the readers' lists of fields. Points of bodies that joints and
/// forces refer to keep their names. Reading the file gives a bitwise equal description, with two
/// exceptions. Values of joints whose only coordinate is prescribed are left out. Default zeros
/// lose their sign.
///
/// @throws ConfigError with the reader's messages, for a description that no file can represent:
/// released directions of joints (redundancy.h), empty or repeated names, non-planar parts,
/// impossible inertias.
std::string MechanismText(const MechanismDescription& description,
                          const ObservedQuantities& observe, const std::string& comment = "");

}  // namespace loopbench::harness
