// The failure map as a picture: a small heat map that is read at arm's length.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "harness/figures/figures.h"
#include "harness/figures/gnuplot.h"
#include "harness/judge/failure_map.h"

namespace loopbench::harness {

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
/// failure-map.md and .csv.
MapDrawing DrawMap(const FailureMap& map, FigureSize size = FigureSize::kTwoColumn);

/// Draws into `path`, as PDF when its extension is ".pdf", else as SVG; returns what
/// DrawWithGnuplot() does.
[[nodiscard]] std::optional<std::string> WriteMapFigure(const std::filesystem::path& path,
                                                        const FailureMap& map,
                                                        FigureSize size = FigureSize::kTwoColumn,
                                                        const std::string& gnuplot = "gnuplot");

}  // namespace loopbench::harness
