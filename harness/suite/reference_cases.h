// The certified references that the accuracy cases of an experiment are held against, one per scene
// and horizon: files beside the store, and a record of each.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "harness/config/experiment.h"
#include "harness/record/record.h"
#include "harness/reference/reference.h"

namespace loopbench::harness {

struct ReferenceCase {
  std::size_t scene = 0;
  double horizon = 0.0;  ///< [s]
  std::string id;
  std::filesystem::path file;
  Record keys;  ///< of kind "reference", with case_id and content
};

/// The reference of a case of an experiment that asks for them.
/// @param store  the file of the store
ReferenceCase ReferenceOf(const Experiment& experiment, const Case& one,
                          const std::filesystem::path& store);

/// Makes the file, unless it is there, and says in a record what is certified.
Record MakeOne(const Experiment& experiment, const ReferenceCase& one);

/// The case's reference as the file has it; nothing where the experiment asks for none. A reference
/// that could not be made comes without snapshots and with the reason.
std::optional<Reference> FindReference(const Experiment& experiment, const Case& one,
                                       const std::filesystem::path& store);

/// Throws ConfigError when the experiment asks for references and this program was built without
/// the scalars that they take (LOOPBENCH_PRECISIONS).
void RequireReferences(const Experiment& experiment);

}  // namespace loopbench::harness
