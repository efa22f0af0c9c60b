// Error and drift of runs in several scalars, against tolerance.
#pragma once

#include <span>
#include <vector>

#include "harness/figures/figure_recipes.h"

namespace loopbench::harness {

/// For each ladder error (lines) and drift (dashes) against tolerance, one colour per scalar. Runs
/// that failed are crosses at the lower edge.
std::vector<NamedFigure> PrecisionFigures(std::span<const Record> records);

}  // namespace loopbench::harness
