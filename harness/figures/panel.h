// Panels of figures and their legends, drawn by gnuplot.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "harness/figures/axis.h"
#include "harness/figures/figures.h"

namespace loopbench::harness {

// gnuplot, the program that draws all figures.

/// Letter size of all drawings [pt], distance of their lines and mean width of letters.
inline constexpr double kLetterSize = 8.0, kLineHeight = 10.0, kLetterWidth = 4.2;

/// Size of a drawing [pt].
struct GnuplotPage {
  double width = 504.0, height = 260.0;
};

/// Converts millimetres to points of 1/72 inch.
constexpr double PointsOf(double millimetres) { return millimetres * 72.0 / 25.4; }

/// Returns the approximate width of a text [pt].
double WidthOf(std::string_view text);

/// Breaks a text into lines of at most `most` letters at spaces; a longer word stays whole.
std::vector<std::string> Wrapped(const std::string& text, std::size_t most);

/// Writes a text at a position of the page [pt from its lower left corner]; `options` are gnuplot
/// label options.
std::string TextAt(const GnuplotPage& page, std::string_view text, double x, double y,
                   std::string_view options);

/// Runs `script`, which sets neither terminal nor output and quotes its texts with QuoteGnuplot().
/// Writes `path`, as PDF if its extension is ".pdf", else as SVG. Returns nothing on success, else
/// the reason: gnuplot missing (and its package) or gnuplot's own message. The file is complete or
/// absent. No other files remain, even if this process is killed. No shell is used.
[[nodiscard]] std::optional<std::string> DrawWithGnuplot(const std::filesystem::path& path,
                                                         const GnuplotPage& page,
                                                         const std::string& script,
                                                         const std::string& gnuplot = "gnuplot");

// A panel of a figure and its legend.

// Legend below a figure: samples of colours, dashes and marks with their meaning.

/// Returns gnuplot's "lc ... dt ... lw ..." of a curve's line, and "pt ... ps ... lc ..." of its
/// marks.
std::string LineLook(const CurveStyle& style);
std::string MarkLook(const CurveStyle& style);
inline constexpr const char* kCrossLook = "pt 2 ps 0.45 lw 1.2";

struct Legend {
  std::vector<LegendRow> rows;
  std::size_t letters = 0;  ///< listed curves that stand for several
};

/// Makes the legend of a figure with the curves `merged`. First come its own rows, or else the
/// curves' labels. Then follow the meaning of hollow marks, crosses and question marks, with
/// `failures`, remarks on crosses without a curve. Last is a list of the curves that stand for
/// several, by the letters at their ends. Rows are broken at the page width. In one column the list
/// ends in "…" if the legend would exceed kLegendRows.
Legend LegendOf(const Figure& figure, const std::vector<Curve>& merged, FigureSize size,
                const std::vector<std::string>& failures);

/// Draws rows below `top` [pt from the lower edge of the page].
std::string DrawLegend(const std::vector<LegendRow>& rows, const GnuplotPage& page, double top);

/// True if curves are named at their ends instead of in the legend.
bool NamesAtEnds(const Figure& figure, const std::vector<Curve>& merged);

/// Returns the text at the end of each curve: its name and its remark. The first `letters` curves
/// that stand for several have their letter in the legend as name.
std::vector<std::string> EndTexts(const Figure& figure, const std::vector<Curve>& merged,
                                  bool names, std::size_t letters);

// One panel of a figure: axes, curves, and the texts beside their ends.

double WidthOfPage(FigureSize size);

/// Height of a panel's rectangle [pt] in a figure of `panels` panels.
double HeightOfPanel(FigureSize size, std::size_t panels);

/// Axes of a panel and its approximate size.
PlotArea AreaOf(const Figure& panel, FigureSize size);

/// Returns the points that the axes can show.
std::vector<Point> Drawable(const PlotArea& area, const Curve& curve);

/// Position of a panel on the page [pt from the lower left corner].
struct PanelPlace {
  double left = 0.0, right = 0.0, bottom = 0.0, top = 0.0;
};

/// Returns commands that draw a panel, the last one "plot"; labels set before belong to it. Data
/// names begin with `name`. `texts` are placed at the ends of the curves (panel.h).
std::string PanelScript(const Figure& panel, const std::vector<Curve>& curves,
                        const std::vector<std::string>& texts, const PlotArea& area,
                        const GnuplotPage& page, const PanelPlace& place, const std::string& name,
                        bool has_x_labels);

/// Width [pt] of the labels of the vertical axis.
double WidthOfLabels(const PlotArea& area);

}  // namespace loopbench::harness
