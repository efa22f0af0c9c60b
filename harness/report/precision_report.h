// Records of runs in several scalars (kind "precision"): their order, notes and figures.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "harness/record.h"
#include "harness/report/figure_recipes.h"

namespace loopbench::harness {

/// One ladder after another; in each the tolerances from the largest, and for each the scalars from
/// the narrowest. The reference comes last.
void SortRungs(std::vector<Record>* records);

/// What error, drift and "ruled by" mean, one line each.
std::vector<std::string> PrecisionNotes();

/// For each ladder error (lines) and drift (dashes) against tolerance, one colour per scalar. Runs
/// that failed are crosses at the lower edge.
std::vector<NamedFigure> PrecisionFigures(std::span<const Record> records);

}  // namespace loopbench::harness
