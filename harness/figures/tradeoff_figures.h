// What accuracy costs, as figures.
#pragma once

#include <vector>

#include "harness/figures/figure_recipes.h"
#include "harness/judge/tradeoff.h"

namespace loopbench::harness {

/// Error over cost on logarithmic axes. Marks are the runs, in the hue of their formulation and the
/// shape of their coordinates, hollow for those with doubts; a line, dashed by level, joins what no
/// other run of the same formulation and level beats, and thin black stairs are the Pareto front of
/// all. Runs that failed are crosses on the lower edge, where their cost is known (for times of
/// simulations, of which a failed run has none, their CPU time).
Figure WorkPrecisionFigure(const Tradeoff& tradeoff, const TradeoffProblem& problem);

/// Error over tolerance of the runs with one integrator, beside the line on which the error is the
/// tolerance (times the length of a link, for lengths): is a tolerance honoured?
Figure ToleranceFigure(const Tradeoff& tradeoff, const TradeoffProblem& problem,
                       const std::string& integrator);

/// Error over time ("series.error" over "series.error_t") of the runs with one integrator at its
/// finest tolerance, with the trust horizon of the reference as an upright line.
Figure ErrorOverTimeFigure(const TradeoffProblem& problem, const std::string& integrator);

/// Of every problem the first, of every integrator the others, as far as there is anything to draw.
std::vector<NamedFigure> TradeoffFigures(const Tradeoff& tradeoff);

}  // namespace loopbench::harness
