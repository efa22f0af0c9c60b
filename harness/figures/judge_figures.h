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
#include "harness/judge/robustness_map.h"
#include "harness/judge/work_precision.h"

namespace loopbench::harness {

// The robustness map as a small heat map that is readable from a distance.

/// Result of a method in all rows of a group.
struct FoldedCell {
  CellState worst = CellState::kNotApplicable;  ///< worst of the applicable rows
  std::size_t holding = 0, judged = 0;          ///< numbers of applicable rows
  bool with_warnings = false;                   ///< a row holds with warnings (HoldsWithWarnings)
  bool fails_demand = false;                    ///< a row must hold and does not

  /// Fraction of the applicable rows that hold; 1 if all do.
  double Share() const;
};

/// A group with a cell for each method.
struct FoldedGroup {
  std::string label;  ///< short label of the rules if there is one
  std::size_t rows = 0;
  std::vector<FoldedCell> cells;

  double Share() const;  ///< over all its rows and methods
};

/// Returns the groups of a map, in ascending order of the fraction that holds.
std::vector<FoldedGroup> Folded(const RobustnessMap& map);

/// A drawing: gnuplot's commands and the page they are for.
struct MapDrawing {
  GnuplotPage page;
  std::string script;
};

/// Draws groups from top to bottom, methods from left to right, a legend below. Darker cells have
/// fewer rows that hold; the glyph shows how the worst row ended. There are no hues. Cells with a
/// required row that does not hold have a frame. Rows, numbers and reasons are in robustness-map.md
/// and .csv.
MapDrawing DrawMap(const RobustnessMap& map, FigureSize size = FigureSize::kTwoColumn);

/// Draws into `path`, as PDF if its extension is ".pdf", else as SVG; returns the result of
/// DrawWithGnuplot().
[[nodiscard]] std::optional<std::string> WriteMapFigure(const std::filesystem::path& path,
                                                        const RobustnessMap& map,
                                                        FigureSize size = FigureSize::kTwoColumn,
                                                        const std::string& gnuplot = "gnuplot");

// Work-precision figures: cost of accuracy.

/// Error over cost on logarithmic axes. Marks are the runs: hue for the formulation, shape for the
/// coordinates, hollow with warnings. A line, dashed by level, joins the runs that no other run of
/// the same formulation and level dominates. Thin black stairs are the overall Pareto front. Failed
/// runs are crosses on the lower edge if their cost is known (their CPU time in place of the
/// missing simulation time).
Figure WorkPrecisionFigure(const WorkPrecision& work_precision,
                           const WorkPrecisionProblem& problem);

/// Error over tolerance of the runs with one integrator, to check whether tolerances are met. A
/// line shows error = tolerance (times a link length, for lengths).
Figure ToleranceFigure(const WorkPrecision& work_precision, const WorkPrecisionProblem& problem,
                       const std::string& integrator);

/// Error over time ("series.error" over "series.error_t") of the runs with one integrator at its
/// finest tolerance. A vertical line marks the trust horizon of the reference solution.
Figure ErrorOverTimeFigure(const WorkPrecisionProblem& problem, const std::string& integrator);

/// Returns the first figure per problem and the others per integrator, if they have data.
std::vector<NamedFigure> WorkPrecisionFigures(const WorkPrecision& work_precision);

}  // namespace loopbench::harness
