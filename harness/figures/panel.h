// Panels of figures and their legends as gnuplot draws them.
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

/// Letters of all drawings [pt], the distance of their lines and their mean width.
inline constexpr double kLetterSize = 8.0, kLineHeight = 10.0, kLetterWidth = 4.2;

/// The size of a drawing [pt].
struct GnuplotPage {
  double width = 504.0, height = 260.0;
};

/// Points of 1/72 inch.
constexpr double PointsOf(double millimetres) { return millimetres * 72.0 / 25.4; }

/// About how wide it is [pt].
double WidthOf(std::string_view text);

/// Lines of at most `most` letters, broken at spaces; a longer word stays whole.
std::vector<std::string> Wrapped(const std::string& text, std::size_t most);

/// A text at a place of the page [pt] from its lower left corner; `options` are gnuplot's of
/// labels.
std::string TextAt(const GnuplotPage& page, std::string_view text, double x, double y,
                   std::string_view options);

/// Runs `script`, which sets neither terminal nor output and whose texts are QuoteGnuplot()'s, and
/// writes `path`, as PDF when its
/// extension is ".pdf", else as SVG. Returns nothing on success, else the reason: gnuplot missing
/// (and the package that has it) or gnuplot's own message. The file is complete or absent, and
/// there are no others, even if this process is killed meanwhile. No shell takes part.
[[nodiscard]] std::optional<std::string> DrawWithGnuplot(const std::filesystem::path& path,
                                                         const GnuplotPage& page,
                                                         const std::string& script,
                                                         const std::string& gnuplot = "gnuplot");

// A panel of a figure and its legend.

// What stands below a figure: samples of colours, dashes and marks with their meaning.

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

// One panel of a figure: axes, curves, and the texts beside their ends.

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
/// with `name`. `texts` stand beside the ends of the curves (panel.h).
std::string PanelScript(const Figure& panel, const std::vector<Curve>& curves,
                        const std::vector<std::string>& texts, const PlotArea& area,
                        const GnuplotPage& page, const PanelPlace& place, const std::string& name,
                        bool has_x_labels);

/// Width [pt] of the labels of the vertical axis.
double WidthOfLabels(const PlotArea& area);

}  // namespace loopbench::harness
