// The references that the accuracy cases of an experiment are held against, one per scene and
// horizon: a record of each, and of certified ones a file beside the store.
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
  std::filesystem::path file;  ///< empty where it is a published series
  Record keys;                 ///< of kind "reference", with case_id and content
};

/// Whether the case is to be held against a certified reference or a published series.
bool HasReference(const Experiment& experiment, const Case& one);

/// The reference of a case that has one.
/// @param store  the file of the store
ReferenceCase ReferenceOf(const Experiment& experiment, const Case& one,
                          const std::filesystem::path& store);

/// Makes the file, unless it is there or none is needed, and says in a record what is certified.
Record MakeOne(const Experiment& experiment, const ReferenceCase& one);

/// The case's certified reference as the file has it; nothing where the experiment asks for none. A
/// reference that could not be made comes without snapshots and with the reason.
std::optional<Reference> FindReference(const Experiment& experiment, const Case& one,
                                       const std::filesystem::path& store);

/// Throws ConfigError when the experiment asks for references and this program was built without
/// the scalars that they take (LOOPBENCH_PRECISIONS).
void RequireReferences(const Experiment& experiment);

}  // namespace loopbench::harness
