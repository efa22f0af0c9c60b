// A problem as it is simulated, and the keys that name its cases.
#pragma once

#include <string>
#include <vector>

#include "harness/config/experiment.h"
#include "harness/config/mechanism_reader.h"
#include "harness/record/record.h"
#include "mechanism/simplify/compile.h"

namespace loopbench::harness {

// A problem as it is run: simplified descriptions with their known solutions (docs/decisions/009).

struct SimplifiedProblem {
  Compiled compiled;
  /// Names and angles refer to the simplified bodies. Problems with known angles are never split,
  /// so this belongs to the only part.
  ObservedQuantities observe;
};

/// Angles of the known solution are measured about the user's z: such a problem is not split, and a
/// spatial one stays spatial.
SimplifiedProblem SimplifyProblem(const MechanismDescription& description,
                                  const ObservedQuantities& observe, CompileOptions options);

/// Returns the active simplifications, such as "planar, welds", or "none".
std::string ToString(const CompileOptions& options);

// Identity of runs.
//
// A case consists of its keys and its content: all other data that determine the run (mechanism,
// limits, ensemble, simplification, ...). "case_id" identifies both, "id" both and the program that
// ran them, "config_hash" the content alone. Cases of equal keys and different content are
// different cases. Limits belong to the content because they affect the outcome.

/// Sets "case_id" and "content" (eight digits, for people to choose by) behind the keys.
/// @param content  from one of the functions below
void SetCaseId(Record* keys, const std::string& content);

/// The accuracy case with its id.
Case Identified(const Experiment& experiment, Case entry);

/// Returns the content of an accuracy case.
std::string AccuracyContent(const Experiment& experiment, const Case& entry);

/// Returns the content of timings of a problem, or of a family member, which its keys fully define.
std::string ProblemTimingContent(const Experiment& experiment, const Case& entry);
std::string FamilyTimingContent(const Experiment& experiment);

/// Returns the content of all levels of a precision study. `rungs` names them all: the verdict on
/// one depends on the others.
std::string LadderContent(const Experiment& experiment, const Case& entry,
                          const std::string& rungs);

/// "id" of a record: its case and this very program.
std::string RunId(const Record& record);

}  // namespace loopbench::harness
