// A mechanism as the JSON file that says it (mechanism_reader.h reads it to the same description).
//
// What is written comes from the lists of fields that the readers use, so that nothing that a file
// can say is lost. Points of bodies that joints and forces refer to keep their names.
#pragma once

#include <string>

#include "harness/config/scene.h"

namespace loopbench::harness {

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
