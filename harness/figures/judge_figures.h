// Figures of the robustness map, and of work and precision.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "harness/figures/figure_recipes.h"
#include "harness/figures/figures.h"
#include "harness/figures/panel.h"
#include "harness/judge/failure_map.h"
#include "harness/judge/tradeoff.h"

namespace loopbench::harness {

// The robustness map as a picture: a small heat map that is read at arm's length.

/// What became of a method in all rows of a group.
struct FoldedCell {
  CellState worst = CellState::kNotApplicable;  ///< of the rows that are applicable
  std::size_t holding = 0, judged = 0;          ///< of the rows that are applicable
  bool in_doubt = false;                        ///< a row holds in doubt (HoldsInDoubt)
  bool fails_demand = false;                    ///< a row must hold and does not

  /// 1 where all hold.
  double Share() const;
};

/// A group with a cell for each method.
struct FoldedGroup {
  std::string label;  ///< the short one of the rules where there is one
  std::size_t rows = 0;
  std::vector<FoldedCell> cells;

  double Share() const;  ///< of all its rows and methods
};

/// The groups of a map, those of which the least holds first.
std::vector<FoldedGroup> Folded(const FailureMap& map);

/// A drawing: gnuplot's commands and the page they are for.
struct MapDrawing {
  GnuplotPage page;
  std::string script;
};

/// Groups from top to bottom, methods from left to right, a legend below. The darker a cell, the
/// fewer of its group's rows hold; its glyph says how the worst of them ended. There are no hues.
/// Cells in which a row must hold and does not have a frame. Rows, numbers and reasons stand in
/// robustness-map.md and .csv.
MapDrawing DrawMap(const FailureMap& map, FigureSize size = FigureSize::kTwoColumn);

/// Draws into `path`, as PDF when its extension is ".pdf", else as SVG; returns what
/// DrawWithGnuplot() does.
[[nodiscard]] std::optional<std::string> WriteMapFigure(const std::filesystem::path& path,
                                                        const FailureMap& map,
                                                        FigureSize size = FigureSize::kTwoColumn,
                                                        const std::string& gnuplot = "gnuplot");

// What accuracy costs, as figures.

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
