// Cases of their own kind: runs in several scalars, certified references.
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

// The precision ladders of an experiment (harness/precision/ladder.h): one per scene and column.

/// A ladder and the keys of its records: those of the reference, then of every rung in the order of
/// Ladder::rungs (kind "precision", with case_id and content).
struct LadderGroup {
  LadderTask task;  ///< without the description, which is made in the process that climbs
  std::size_t scene = 0;
  std::vector<Record> keys;
};

/// Groups without a rung that passes the filter are left out.
std::vector<LadderGroup> LadderGroups(const Experiment& experiment, const Selection& filter = {});

/// Number of records of all groups.
std::size_t CountRungs(const Experiment& experiment);

/// Throws ConfigError for a scene that the ladder cannot run: one that is not planar once it is
/// compiled, or with tables of time. Scenes are compiled in a child process, under the experiment's
/// limits; one that they cut off is not refused here.
void CheckLadders(const Experiment& experiment);

/// Throws ConfigError when the experiment has ladders and this program cannot run them: as above,
/// or when it was built without their scalars (LOOPBENCH_PRECISIONS).
void RequireLadders(const Experiment& experiment);

/// One record per key, in order.
std::vector<Record> ClimbTogether(const Experiment& experiment, const LadderGroup& group);

// The references that the accuracy cases of an experiment are held against, one per scene and
// horizon: a record of each, and of certified ones a file beside the store.

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
