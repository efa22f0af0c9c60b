// One panel of a figure: axes, curves, and the texts beside their ends.
#pragma once

#include <string>
#include <vector>

#include "harness/figures/drawn_points.h"
#include "harness/figures/figures.h"
#include "harness/figures/gnuplot.h"

namespace loopbench::harness {

double WidthOfPage(FigureSize size);

/// Height of a panel's rectangle [pt], where there are `panels` of them.
double HeightOfPanel(FigureSize size, std::size_t panels);

/// Its axes, and about how large it is.
PlotArea AreaOf(const Figure& panel, FigureSize size);

/// The points that the axes can show.
std::vector<Point> Drawable(const PlotArea& area, const Curve& curve);

/// A panel's place on the page [pt] from the lower left corner.
struct PanelPlace {
  double left = 0.0, right = 0.0, bottom = 0.0, top = 0.0;
};

/// Commands that draw it, its last one "plot"; labels set before belong to it. Names of data begin
/// with `name`. `texts` stand beside the ends of the curves (legend.h).
std::string PanelScript(const Figure& panel, const std::vector<Curve>& curves,
                        const std::vector<std::string>& texts, const PlotArea& area,
                        const GnuplotPage& page, const PanelPlace& place, const std::string& name,
                        bool has_x_labels);

/// Width [pt] of the labels of the vertical axis.
double WidthOfLabels(const PlotArea& area);

}  // namespace loopbench::harness
