// Figures as SVG or PDF, drawn by gnuplot.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace loopbench::harness {

/// Marks on a curve.
enum class Shape { kNone, kCircle, kTriangle, kSquare, kDiamond, kTriangleDown };

/// How a curve looks, one attribute per property of what it shows. The defaults are a thin black
/// line. Dashes have one meaning in all figures: the run is doubtful.
struct CurveStyle {
  std::string color = "#000000";
  double width = 2.0;          ///< [px]
  Shape shape = Shape::kNone;  ///< at some places of the line, others than those of its neighbours
  bool filled = true;          ///< of the marks
  bool doubtful = false;       ///< dashed, and the legend says so
};

/// The style of the index-th curve of a figure: colours that colour-blind readers tell apart, then
/// the same with marks.
CurveStyle DistinctStyle(std::size_t index);

/// Points joined by a line. `x` and `y` have the same length; points that are not finite, and on a
/// logarithmic axis those that are not positive, are left out. A curve without points keeps its
/// place in the legend.
struct Curve {
  std::string label = "";
  std::vector<double> x = {};
  std::vector<double> y = {};
  CurveStyle style = {};
  /// Draws y ~ x^slope as a grey line above the last decade of the curve. Logarithmic axes only.
  std::optional<double> slope = std::nullopt;
  /// Marks the last point with a cross: the run failed there.
  bool ends_early = false;
  bool points = false;     ///< marks each point, for few of them
  bool own_marks = false;  ///< these are of the style's shape, not of the curve's place
  bool line = true;        ///< joins them
  /// Runs that failed, as crosses in the curve's colour. Without a y that can be drawn (NaN) the
  /// cross lies on the lower edge of the plot.
  std::vector<std::pair<double, double>> crosses = {};
};

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
};

/// The gnuplot commands and data of a figure, without terminal and output, so that any terminal can
/// draw it. Points nearer to their predecessor than the eye can tell are thinned out, which keeps
/// files of long runs small.
std::string GnuplotScript(const Figure& figure);

/// Draws `figure` into `path`, as PDF when its extension is ".pdf", else as SVG. Returns nothing on
/// success, else the reason: gnuplot missing (and the package that has it), gnuplot's own message,
/// or nothing to draw. The file is complete or absent. The same figure gives the same bytes of SVG;
/// a PDF carries its date. `gnuplot` is the program to call.
[[nodiscard]] std::optional<std::string> WriteFigure(const std::filesystem::path& path,
                                                     const Figure& figure,
                                                     const std::string& gnuplot = "gnuplot");

}  // namespace loopbench::harness
