// What stands below a figure: samples of colours, dashes and marks with their meaning.
#pragma once

#include <string>
#include <vector>

#include "harness/figures/figures.h"
#include "harness/figures/gnuplot.h"

namespace loopbench::harness {

/// gnuplot's "lc ... dt ... lw ..." of a curve's line, and "pt ... ps ... lc ..." of its marks.
std::string LineLook(const CurveStyle& style);
std::string MarkLook(const CurveStyle& style);
inline constexpr const char* kCrossLook = "pt 2 ps 0.45 lw 1.2";

/// The legend of a figure whose curves are drawn as in `merged`: its own rows, or else the curves'
/// labels; then what hollow marks, crosses and question marks mean, as far as there are any; then
/// which curves are several, by the letters at their ends. Rows are broken at `width` [pt], and
/// none stands beyond kLegendRows: the last then ends in "…".
std::vector<LegendRow> LegendOf(const Figure& figure, const std::vector<Curve>& merged,
                                double width);

/// Draws rows below `top` [pt from the lower edge of the page].
std::string DrawLegend(const std::vector<LegendRow>& rows, const GnuplotPage& page, double top);

/// Whether curves are named at their ends, and not in the legend.
bool NamesAtEnds(const Figure& figure, const std::vector<Curve>& merged);

/// What stands beside the end of each curve: its name or the letter by which the legend lists what
/// it is, and its remark.
std::vector<std::string> EndTexts(const Figure& figure, const std::vector<Curve>& merged,
                                  bool names);

}  // namespace loopbench::harness
