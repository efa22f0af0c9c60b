// A scene as it is simulated, and the keys that name its cases.
#pragma once

#include <string>
#include <vector>

#include "harness/config/experiment.h"
#include "harness/config/mechanism_reader.h"
#include "harness/record/record.h"
#include "mechanism/simplify/compile.h"

namespace loopbench::harness {

// A scene as it is run: simplified descriptions, with what is observed of them
// (docs/decisions/009).

struct CompiledScene {
  Compiled compiled;
  /// Names and angles are those of the compiled bodies. Scenes that observe angles are never split,
  /// so this belongs to the only part.
  SceneObservation observe;
};

/// Angles that "observe" names are measured about the user's z: such a scene stays in one piece,
/// and in space as it is.
CompiledScene CompileScene(const MechanismDescription& description, const SceneObservation& observe,
                           CompileOptions options);

/// "planar, welds": the savings that are on; "none" when none is.
std::string ToString(const CompileOptions& options);

// What makes two runs the same run.
//
// One identity serves everywhere. A case is its keys and its content: all that decides the run
// besides them (mechanism, limits, ensemble, simplification, ...). "case_id" stands for both, "id"
// for both and the program that ran them, "content" for the content alone. Cases of equal keys and
// different content are different cases. Limits are content, for they decide how a run ends.

/// Sets "case_id" and "content" (eight digits, for people to choose by) behind the keys.
/// @param content  from one of the functions below
void SetCaseId(Record* keys, const std::string& content);

/// The accuracy case with its id.
Case Identified(const Experiment& experiment, Case one);

/// Of an accuracy case.
std::string AccuracyContent(const Experiment& experiment, const Case& one);

/// Of the timings of a scene, or of a member of a family, which its keys describe whole.
std::string SceneTimingContent(const Experiment& experiment, const Case& one);
std::string FamilyTimingContent(const Experiment& experiment);

/// Of all rungs of a precision ladder. `rungs` names them all: the verdict on one depends on the
/// others.
std::string LadderContent(const Experiment& experiment, const Case& one, const std::string& rungs);

/// "id" of a record: its case and this very program.
std::string RunId(const Record& record);

}  // namespace loopbench::harness
