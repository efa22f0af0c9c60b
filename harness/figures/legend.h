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

struct Legend {
  std::vector<LegendRow> rows;
  std::size_t letters = 0;  ///< curves that stand for several and are listed
};

/// The legend of a figure whose curves are drawn as in `merged`. First come its own rows, or else
/// the curves' labels. Then follow the meaning of hollow marks, crosses and question marks, with
/// `failures`, remarks on crosses that have no curve. Last is a list of the curves that stand for
/// several, by the letters at their ends. Rows are broken at the width of the page; in one column
/// the list ends in "…" if it would take the legend beyond kLegendRows.
Legend LegendOf(const Figure& figure, const std::vector<Curve>& merged, FigureSize size,
                const std::vector<std::string>& failures);

/// Draws rows below `top` [pt from the lower edge of the page].
std::string DrawLegend(const std::vector<LegendRow>& rows, const GnuplotPage& page, double top);

/// Whether curves are named at their ends, and not in the legend.
bool NamesAtEnds(const Figure& figure, const std::vector<Curve>& merged);

/// The text beside the end of each curve: its name or, for the first `letters` that stand for
/// several, its letter in the legend; and its remark.
std::vector<std::string> EndTexts(const Figure& figure, const std::vector<Curve>& merged,
                                  bool names, std::size_t letters);

}  // namespace loopbench::harness
