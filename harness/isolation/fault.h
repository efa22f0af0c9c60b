// Planted faults, so that the tests can see what a misbehaving case does to a run.
//
// The environment variable LOOPBENCH_FAULT = "<fault>:<key>=<value>[,<value>]" makes every accuracy
// case that meets the condition crash, hang, exhaust memory, throw, or answer garbage. It is read
// in the child process of the case, and has no other effect.
#pragma once

#include <optional>
#include <string>

#include "harness/record/record.h"

namespace loopbench::harness {

/// Does what LOOPBENCH_FAULT says about the case with these keys: may not return. The answer to
/// send in place of the record's when the fault is garbage, else nothing.
std::optional<std::string> PlantedFault(const Record& keys);

}  // namespace loopbench::harness
