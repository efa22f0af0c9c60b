// Whether rows that are compared differ in more than what the comparison is about: what was equal
// in all of them and what was not, read from the records.
#pragma once

#include <string>
#include <vector>

#include "harness/judge/tradeoff.h"

namespace loopbench::harness {

/// One line each: what was equal among the compared rows of every problem, with its value where all
/// problems share it; what was not, with its values and how many rows had them; what no record
/// says; the error and the cost, and what they can be trusted to; how many rows were not compared,
/// and why; warnings ("warning: ...") where costs are times that do not compare.
std::vector<std::string> FairnessStatement(const Tradeoff& tradeoff);

}  // namespace loopbench::harness
