// What a store keeps beside its lines so that motions can be looked at later: the mechanisms of its
// scenes, as files that every command reads, and their references.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "harness/config/experiment.h"
#include "harness/record/record.h"

namespace loopbench::harness {

/// mechanisms/ID.json beside a store's `file`, ID being the record's "scene_id"; empty where it has
/// none, or one that no run has written.
std::filesystem::path MechanismOf(const Record& record, const std::filesystem::path& store_file);

/// Reads such a file. Throws ChangedFile (trajectory/store_files.h) if its checksum is wrong, and
/// as ReadMechanism() does.
MechanismDescription ReadKeptMechanism(const std::filesystem::path& file);

/// Writes those of all scenes whose motion is kept, in a reference or in trajectories, and that are
/// not there yet. A mechanism that no file can say (parts of other programs) is left out.
void KeepMechanisms(const std::vector<Experiment>& experiments,
                    const std::filesystem::path& store_file);

/// The reference of a record, beside the store's `file`; empty where the record has none.
std::filesystem::path ReferenceOf(const Record& record, const std::filesystem::path& store_file);

/// Copies the mechanisms of `records` from the first of the `stores` that has them to beside
/// `target`, each whole or not at all.
void CopyMechanisms(const std::vector<Record>& records,
                    const std::vector<std::filesystem::path>& stores,
                    const std::filesystem::path& target);

}  // namespace loopbench::harness
