// Figures as data, and the styles of methods in all of them.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "harness/record/record.h"

namespace loopbench::harness {

// Figures as SVG or PDF, drawn by gnuplot in the size in which they are printed.

/// Marks on a curve.
enum class Shape { kNone, kCircle, kTriangle, kSquare, kDiamond, kTriangleDown };

/// Number of line patterns: solid, long dashes, dots, dash-dot, dash-dot-dot, short dashes.
inline constexpr std::size_t kDashes = 6;

/// Style of a curve, one attribute per property of its run (figures.h). Default: a black line.
struct CurveStyle {
  std::string color = "#000000";
  std::size_t dash = 0;  ///< below kDashes
  double width = 1.2;    ///< [pt]
  Shape shape = Shape::kNone;
  bool flagged = false;  ///< marks are hollow, and a curve without marks gets hollow circles
};

/// Returns the style of the index-th curve of a figure in which colours carry no other meaning:
/// neighbours differ in hue, lightness and mark.
CurveStyle DistinctStyle(std::size_t index);

/// y ~ x^exponent, as a thin grey line through the data from one x to another.
struct Guide {
  double exponent = 0.0, from = 0.0, to = 0.0;
};

/// Points joined by a line. `x` and `y` have the same length. Points that are not finite, or not
/// positive on a logarithmic axis, are left out.
struct Curve {
  std::string label = "";  ///< properties in the order of the other labels, "odca, joint"
  std::vector<double> x = {};
  std::vector<double> y = {};
  CurveStyle style = {};
  std::optional<Guide> guide = std::nullopt;  ///< logarithmic axes only
  std::string remark = "";                    ///< text at the end of the curve: "2.01 ± 0.05"
  bool ends_early = false;                    ///< the last point is a cross: the run failed there
  bool points = false;   ///< marks every point, if there are few; else some positions on the line
  bool line = true;      ///< joins the points
  bool merges = true;    ///< is drawn as one curve with others that coincide
  bool several = false;  ///< is drawn for several that coincide; `label` lists them
  /// Points of `x` and `y` that belong to runs with warnings: only their marks are hollow.
  std::vector<std::pair<double, double>> hollow = {};
  /// Failed runs, as crosses in the curve's colour. If y cannot be drawn (NaN), the cross lies on
  /// the lower edge of the plot.
  std::vector<std::pair<double, double>> crosses = {};
};

/// Meaning of a style. An item without text is left out.
struct LegendItem {
  std::string text;
  CurveStyle style = {};
  bool line = true;  ///< line with the style's mark; else the mark alone
};
using LegendRow = std::vector<LegendItem>;

/// Contents of a figure. Labels are plain text (no markup) and carry their units: "time [s]".
struct Figure {
  std::string title;
  std::string x_label;
  std::string y_label;
  bool log_x = false;
  bool log_y = false;
  std::vector<Curve> curves = {};  ///< later ones lie on top
  std::string legend_title = "";
  std::vector<std::string> x_ticks = {};  ///< names of x = 1, 2, ...; empty for a numeric scale
  /// Meaning of colours, dashes and marks, one entry per row. Without them curves are named: up to
  /// kLegendRows of them in the legend, else at their ends.
  std::vector<LegendRow> legend = {};
  bool names_at_ends = false;      ///< also with a legend
  std::vector<Figure> below = {};  ///< further panels with the same x axis; only `curves`,
                                   ///< `y_label` and `log_y` of them count
};

/// Largest number of curves in a legend, and of its rows in one column.
inline constexpr std::size_t kLegendRows = 6;

/// Width of a drawing: one or two columns of a journal, 85 mm or 178 mm. Letters have 8 pt.
enum class FigureSize { kOneColumn, kTwoColumn };

/// Returns the curves of a panel as drawn. Curves that coincide (axis.h) become one curve: black,
/// and solid and unmarked if they differ in colour, dash or mark. Its label is "odca = lagrange,
/// joint", with "all" for all values of the panel. Curves with warnings are not merged with others,
/// curves that end early never. Points keep hollow marks, crosses their colours.
std::vector<Curve> MergedCurves(const Figure& panel, FigureSize size);

/// The gnuplot commands and data of a figure, for any terminal (neither terminal nor output are
/// set), and its height [pt].
struct FigureScript {
  std::string commands;
  double height = 0.0;
  std::size_t legend_rows = 0;
};
FigureScript GnuplotScript(const Figure& figure, FigureSize size = FigureSize::kTwoColumn);

/// Draws `figure` into `path`, as PDF if its extension is ".pdf", else as SVG. Returns nothing on
/// success, else the reason: gnuplot missing (and its package), gnuplot's own message, or nothing
/// to draw. The file is complete or absent. Equal figures give equal bytes of SVG; a PDF contains
/// its date. `gnuplot` is the program to call.
[[nodiscard]] std::optional<std::string> WriteFigure(const std::filesystem::path& path,
                                                     const Figure& figure,
                                                     FigureSize size = FigureSize::kTwoColumn,
                                                     const std::string& gnuplot = "gnuplot");

// Styles of runs in all figures: one channel of a curve for each property of a method.
//
// | channel | property |
// |---|---|
// | colour | formulation (FormulationRow::color) |
// | dashes | level of enforcement: solid acceleration, long dashes velocity, dots position, ... |
// | marks | coordinates: circles joint, triangles absolute |
// | width | solver: thin as published, else thick |
// | hollow marks | warnings |

/// Keys of records that have a channel, in the order of labels.
inline constexpr const char* kChannelKeys[] = {"formulation", "enforcement", "coordinates",
                                               "solver"};

CurveStyle StyleOf(const Record& record);

/// Returns the curve of two series of a run. A failed run ends early; without series it has only
/// the time of its failure, if `x` are times.
Curve CurveOverTime(const Record& record, const std::string& x, const std::string& y,
                    const std::string& label, const CurveStyle& style);

/// Returns the values of the channel keys that vary among `all`: "odca, joint". Returns the
/// formulation if none does.
std::string MethodLabel(const Record& record, std::span<const Record> all);

/// Returns the meaning of colours, dashes, marks and widths for the values in `records`. One row is
/// for formulations, one for levels, one for coordinates and solvers. Levels, coordinates and
/// solvers appear only if they vary.
std::vector<LegendRow> ChannelLegend(std::span<const Record> records);

/// True if the values of a key differ.
bool Varies(std::span<const Record> records, const std::string& key);

}  // namespace loopbench::harness
