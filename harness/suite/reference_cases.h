// Special cases: runs in several scalar types, and certified references.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "harness/config/experiment.h"
#include "harness/precision/ladder.h"
#include "harness/record/record.h"
#include "harness/reference/reference.h"

namespace loopbench::harness {

// Precision ladders of an experiment (harness/precision/ladder.h): one per problem and method.

/// A ladder and the keys of its records: the reference, then every rung in the order of
/// Ladder::rungs (kind "precision", with case_id and content).
struct LadderGroup {
  LadderTask task;  ///< without the description, which the child process makes
  std::size_t problem = 0;
  std::vector<Record> keys;
};

/// Returns the groups that contain a rung passing the filter.
std::vector<LadderGroup> LadderGroups(const Experiment& experiment, const Selection& filter = {});

/// Returns the number of records of all groups.
std::size_t CountRungs(const Experiment& experiment);

/// Throws ConfigError for a problem that a ladder cannot run: not planar after compilation, or with
/// time tables. Compiles problems in a child process under the experiment's limits. A problem that
/// exceeds these limits is not rejected here.
void CheckLadders(const Experiment& experiment);

/// Throws ConfigError if the experiment has ladders that cannot run: as above, or in a program
/// built without their scalars (LOOPBENCH_PRECISIONS).
void RequireLadders(const Experiment& experiment);

/// Runs a ladder; returns one record per key, in order.
std::vector<Record> ClimbTogether(const Experiment& experiment, const LadderGroup& group);

// Reference solutions for the accuracy cases of an experiment, one per problem and horizon: a
// record of each, and a file next to the store for certified ones.

struct ReferenceCase {
  std::size_t problem = 0;
  double horizon = 0.0;  ///< [s]
  std::string id;
  std::filesystem::path file;  ///< empty for a published series
  Record keys;                 ///< of kind "reference", with case_id and content
};

/// Returns true if the case is compared with a certified reference or a published series.
bool HasReference(const Experiment& experiment, const Case& one);

/// Returns the reference of a case that has one.
/// @param store  the file of the store
ReferenceCase ReferenceOf(const Experiment& experiment, const Case& one,
                          const std::filesystem::path& store);

/// Creates the file if needed and absent, and returns a record of the certified accuracy.
Record MakeOne(const Experiment& experiment, const ReferenceCase& one);

/// Reads the certified reference of the case; nothing if the experiment requests none. A failed
/// reference has no snapshots and contains the reason.
std::optional<Reference> FindReference(const Experiment& experiment, const Case& one,
                                       const std::filesystem::path& store);

/// Throws ConfigError if the experiment requests references and this program was built without
/// their scalars (LOOPBENCH_PRECISIONS).
void RequireReferences(const Experiment& experiment);

}  // namespace loopbench::harness
