// What is the same in all programs for Simbody; internal to export_simbody.cpp.
#pragma once

#include <string>
#include <vector>

#include "harness/exchange/model.h"

namespace loopbench::exchange {

/// From the comment on top to the declaration of `Mechanism`, whose constructor and SetStart()
/// follow.
std::string SimbodyHead(const std::string& name, const std::vector<Note>& notes);

/// What prints, integrates and reads arguments. It stands behind kJoints, kBodies and kPoints.
std::string SimbodyTail();

}  // namespace loopbench::exchange
