// Figures as data, and how methods look in all of them.
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

/// How many patterns of lines there are: solid, long dashes, dots, dash-dot, dash-dot-dot, short
/// dashes.
inline constexpr std::size_t kDashes = 6;

/// How a curve looks, one attribute per property of what it shows (figures.h). The defaults are a
/// black line.
struct CurveStyle {
  std::string color = "#000000";
  std::size_t dash = 0;  ///< below kDashes
  double width = 1.2;    ///< [pt]
  Shape shape = Shape::kNone;
  bool doubtful = false;  ///< marks are hollow, and a curve without marks gets hollow circles
};

/// The style of the index-th curve of a figure whose colours tell nothing else: neighbours differ
/// in hue, lightness and mark.
CurveStyle DistinctStyle(std::size_t index);

/// y ~ x^exponent, as a thin grey line through the data from one x to another.
struct Guide {
  double exponent = 0.0, from = 0.0, to = 0.0;
};

/// Points joined by a line. `x` and `y` have the same length; points that are not finite, and on a
/// logarithmic axis those that are not positive, are left out.
struct Curve {
  std::string label = "";  ///< properties in the order of the figure's others, "odca, joint"
  std::vector<double> x = {};
  std::vector<double> y = {};
  CurveStyle style = {};
  std::optional<Guide> guide = std::nullopt;  ///< logarithmic axes only
  std::string remark = "";                    ///< beside the end of the curve: "2.01 ± 0.05"
  bool ends_early = false;                    ///< the last point is a cross: the run failed there
  bool points = false;   ///< marks every point, for few of them; else some places of the line
  bool line = true;      ///< joins them
  bool merges = true;    ///< is drawn as one with others that coincide with it
  bool several = false;  ///< is drawn for several that coincide; `label` lists them
  /// Of `x` and `y` the points of doubtful runs, whose marks alone are hollow.
  std::vector<std::pair<double, double>> hollow = {};
  /// Runs that failed, as crosses in the curve's colour. Without a y that can be drawn (NaN) the
  /// cross lies on the lower edge of the plot.
  std::vector<std::pair<double, double>> crosses = {};
};

/// What a style means. Without a text it is left out.
struct LegendItem {
  std::string text;
  CurveStyle style = {};
  bool line = true;  ///< shown beside the text, with the style's mark; or the mark alone
};
using LegendRow = std::vector<LegendItem>;

/// What is drawn. Labels are plain text (no markup) and carry their units: "time [s]".
struct Figure {
  std::string title;
  std::string x_label;
  std::string y_label;
  bool log_x = false;
  bool log_y = false;
  std::vector<Curve> curves;  ///< later ones lie on top
  std::string legend_title = "";
  std::vector<std::string> x_ticks = {};  ///< names of x = 1, 2, ...; empty for a scale of numbers
  /// What colours, dashes and marks mean, a row for each. Without them curves are named: in the
  /// legend up to kLegendRows of them, else at their ends.
  std::vector<LegendRow> legend = {};
  bool names_at_ends = false;      ///< in any case
  std::vector<Figure> below = {};  ///< further panels with the same x axis; only `curves`,
                                   ///< `y_label` and `log_y` of them count
};

/// Curves that a legend names at most, and rows of a legend in one column at most.
inline constexpr std::size_t kLegendRows = 6;

/// The width of a drawing: one or two columns of a journal, 85 mm or 178 mm. Letters have 8 pt.
enum class FigureSize { kOneColumn, kTwoColumn };

/// Curves of a panel as they are drawn. Curves that coincide (axis.h) are one curve, black,
/// and solid and unmarked where they differ in colour, dash or mark. Its label is "odca = lagrange,
/// joint", with "all" for all values of the panel. Doubtful curves are not drawn as one with
/// others, and curves that end early with none. Points keep hollow marks, and crosses their
/// colours.
std::vector<Curve> MergedCurves(const Figure& panel, FigureSize size);

/// The gnuplot commands and data of a figure, without terminal and output, so that any terminal can
/// draw it, and its height [pt].
struct FigureScript {
  std::string commands;
  double height = 0.0;
  std::size_t legend_rows = 0;
};
FigureScript GnuplotScript(const Figure& figure, FigureSize size = FigureSize::kTwoColumn);

/// Draws `figure` into `path`, as PDF when its extension is ".pdf", else as SVG. Returns nothing on
/// success, else the reason: gnuplot missing (and the package that has it), gnuplot's own message,
/// or nothing to draw. The file is complete or absent. The same figure gives the same bytes of SVG;
/// a PDF carries its date. `gnuplot` is the program to call.
[[nodiscard]] std::optional<std::string> WriteFigure(const std::filesystem::path& path,
                                                     const Figure& figure,
                                                     FigureSize size = FigureSize::kTwoColumn,
                                                     const std::string& gnuplot = "gnuplot");

// How runs look in all figures: one channel of a curve for each property of a method.
//
// | channel | property |
// |---|---|
// | colour | formulation (FormulationRow::color) |
// | dashes | level of enforcement: solid acceleration, long dashes velocity, dots position, ... |
// | marks | coordinates: circles joint, triangles absolute |
// | width | solver: thin as published, else thick |
// | hollow marks | in doubt |

/// The keys of records that have a channel, in the order of labels.
inline constexpr const char* kChannelKeys[] = {"formulation", "enforcement", "coordinates",
                                               "solver"};

CurveStyle StyleOf(const Record& record);

/// The values of those channel keys that vary among `all`: "odca, joint". The formulation if none
/// does.
std::string MethodLabel(const Record& record, std::span<const Record> all);

/// What colours, dashes, marks and widths mean, of the values that `records` have: a row for
/// formulations, one for levels, one for coordinates and solvers; of levels, coordinates and
/// solvers only where they vary.
std::vector<LegendRow> ChannelLegend(std::span<const Record> records);

/// Whether the values of a key differ.
bool Varies(std::span<const Record> records, const std::string& key);

}  // namespace loopbench::harness
