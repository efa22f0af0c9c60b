// The failure map as a picture: a grid of coloured cells, each with its class and number in words.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "harness/figures/gnuplot.h"
#include "harness/judge/failure_map.h"

namespace loopbench::harness {

/// A drawing: gnuplot's commands and the page they are for.
struct MapDrawing {
  GnuplotPage page;
  std::string script;
};

/// Rows of groups from top to bottom, methods from left to right, a legend below. Colours are told
/// apart by colour-blind readers and in grey; every cell says in words what its colour says. Cells
/// that must hold and do not have a frame. `point` is the size of a pixel of text in the unit of
/// the terminal's fonts, 1 for SVG.
MapDrawing DrawMap(const FailureMap& map, double point);

/// Draws into `path`, as PDF when its extension is ".pdf", else as SVG; returns what
/// DrawWithGnuplot() does.
[[nodiscard]] std::optional<std::string> WriteMapFigure(const std::filesystem::path& path,
                                                        const FailureMap& map,
                                                        const std::string& gnuplot = "gnuplot");

}  // namespace loopbench::harness
