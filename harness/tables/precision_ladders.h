// Records of runs in several scalars (kind "precision"): which form a ladder, their order, notes.
#pragma once

#include <string>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

/// The keys, besides parameters, whose values rungs of one ladder share.
inline constexpr const char* kLadderKeys[] = {"mechanism",   "formulation", "enforcement",
                                              "coordinates", "solver",      "horizon",
                                              "experiment",  "content"};

/// One text per ladder.
std::string LadderOf(const Record& record);

/// Whether a rung is the one that the others are compared with.
bool IsReferenceRung(const Record& record);

/// One ladder after another; in each the tolerances from the largest, and for each the scalars from
/// the narrowest. The reference comes last.
void SortRungs(std::vector<Record>* records);

/// What error, drift and "ruled by" mean, one line each.
std::vector<std::string> PrecisionNotes();

}  // namespace loopbench::harness
