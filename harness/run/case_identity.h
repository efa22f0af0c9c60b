// What makes two runs the same run.
//
// One identity serves everywhere. A case is its keys and its content: all that decides the run
// besides them (mechanism, limits, ensemble, simplification, ...). "case_id" stands for both, "id"
// for both and the program that ran them, "content" for the content alone. Cases of equal keys and
// different content are different cases. Limits are content, for they decide how a run ends.
#pragma once

#include <string>

#include "harness/config/experiment.h"
#include "harness/record/record.h"

namespace loopbench::harness {

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
