// Figures: data, axes, panels drawn by gnuplot, and recipes from records.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_set>
#include <utility>
#include <vector>

#include "harness/base/record.h"
#include "harness/judge/judge.h"
#include "harness/observers/trajectory.h"

namespace loopbench::harness {

/// Formats a number for figures: plain from 0.01 to 99999, else with powers of ten, "2.5·10⁻⁶".
std::string NumberText(double value);

/// Axis from `low` to `high`; both are positive on a logarithmic axis.
struct Axis {
  double low = 0.0, high = 1.0;
  bool logarithmic = false;

  bool CanShow(double value) const { return std::isfinite(value) && (!logarithmic || value > 0.0); }
  /// Returns the position of a value: 0 at `low` and 1 at `high`.
  double Place(double value) const { return (On(value) - On(low)) / (On(high) - On(low)); }

 private:
  double On(double value) const { return logarithmic ? std::log(value) : value; }
};

/// Range that grows to contain values, and gives an axis with a margin.
class AxisRange {
 public:
  explicit AxisRange(bool logarithmic) : logarithmic_(logarithmic) {}

  void Include(double value) {
    if (!Axis{.logarithmic = logarithmic_}.CanShow(value)) return;
    low_ = std::min(low_, value);
    high_ = std::max(high_, value);
  }
  /// Returns the axis from the least to the largest value.
  Axis Exact() const { return {low_, high_, logarithmic_}; }
  /// Returns the axis. `margin` is a fraction of the extent. Values that agree in their first
  /// digits still get a range that three digits can express.
  Axis WithMargin(double margin) const;

 private:
  bool logarithmic_;
  double low_ = std::numeric_limits<double>::infinity();
  double high_ = -std::numeric_limits<double>::infinity();
};

struct Tick {
  double at = 0.0;
  std::string label;  ///< "" for a small tick
};

/// Returns about `most` labelled ticks and the small ones between them: multiples of 1, 2 or 5 of a
/// power of ten; on a logarithmic axis powers of ten, or digits of each decade if it has fewer than
/// three.
std::vector<Tick> Ticks(const Axis& axis, int most);

/// A place in a drawing [pt], or a pair of values.
using Point = std::pair<double, double>;

/// Two axes and the size of the rectangle that they span [pt].
struct PlotArea {
  Axis x, y;
  double width = 0.0, height = 0.0;

  Point Place(const Point& point) const {
    return {width * x.Place(point.first), height * y.Place(point.second)};
  }
};

/// Returns the first, last, lowest and highest point of each column that is a third of a curve
/// wide. Points need not be in order of x.
std::vector<Point> Decimated(const PlotArea& area, std::span<const Point> points);

/// True if every point of each curve lies within a drawn width of the other's line, or of its
/// points if no line joins them. Points are in the order of x.
bool Coincide(const PlotArea& area, std::span<const Point> one, std::span<const Point> other,
              bool joined = true);

/// Returns the label of coinciding curves, "odca = lagrange, joint"; `all` are the labels of the
/// panel.
std::string LabelOfSeveral(const std::vector<std::string>& labels,
                           const std::vector<std::string>& all);

/// Marks on a curve.
enum class Shape { kNone, kCircle, kTriangle, kSquare, kDiamond, kTriangleDown };

/// Number of line patterns: solid, long dashes, dots, dash-dot, dash-dot-dot, short dashes.
inline constexpr std::size_t kDashes = 6;

/// Style of a curve, one attribute per property of its run. Default: a black line.
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
  std::vector<double> x = {}, y = {};
  CurveStyle style = {};
  std::optional<Guide> guide = std::nullopt;  ///< logarithmic axes only
  std::string remark = "";                    ///< text at the end of the curve: "2.01 ± 0.05"
  bool ends_early = false;                    ///< the last point is a cross: the run failed there
  bool points = false;   ///< marks every point, if there are few; else some positions on the line
  bool line = true;      ///< joins the points
  bool merges = true;    ///< is drawn as one curve with others that coincide
  bool several = false;  ///< is drawn for several that coincide; `label` lists them
  /// Points of `x` and `y` that belong to runs with warnings: only their marks are hollow.
  std::vector<Point> hollow = {};
  /// Failed runs, as crosses in the curve's colour. If y cannot be drawn (NaN), the cross lies on
  /// the lower edge of the plot.
  std::vector<Point> crosses = {};
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
  std::string x_label, y_label;
  bool log_x = false, log_y = false;
  std::vector<Curve> curves = {};  ///< later ones lie on top
  std::string legend_title = "";
  std::vector<std::string> x_ticks = {};  ///< names of x = 1, 2, ...; empty for a numeric scale
  /// Meaning of colours, dashes and marks. Without them curves are named: up to kLegendRows of them
  /// in the legend, else at their ends.
  std::vector<LegendRow> legend = {};
  bool names_at_ends = false;      ///< also with a legend
  std::vector<Figure> below = {};  ///< further panels with the same x axis; only `curves`,
                                   ///< `y_label` and `log_y` of them count
};

/// Largest number of curves in a legend, and of its rows in one column.
inline constexpr std::size_t kLegendRows = 6;

/// Width of a drawing: one or two columns of a journal, 85 mm or 178 mm. Letters have 8 pt.
enum class FigureSize { kOneColumn, kTwoColumn };

/// Returns the curves of a panel as drawn. Curves that coincide (Coincide()) become one curve:
/// black, and solid and unmarked if they differ in colour, dash or mark. Its label is "odca =
/// lagrange, joint", with "all" for all values of the panel. Curves with warnings are not merged
/// with others, curves that end early never. Points keep hollow marks, crosses their colours.
std::vector<Curve> MergedCurves(const Figure& panel, FigureSize size);

/// Size of a drawing [pt].
struct GnuplotPage {
  double width = 504.0, height = 260.0;
};

/// A drawing by gnuplot: its page, and commands and data for any terminal.
struct Drawing {
  GnuplotPage page;
  std::string script = {};
  bool is_empty = false;  ///< no curve has a point to draw
  std::size_t legend_rows = 0;
};

/// Returns the drawing of a figure.
Drawing GnuplotScript(const Figure& figure, FigureSize size = FigureSize::kTwoColumn);

/// Draws `figure` into `path` as DrawWithGnuplot() does. Equal figures give equal bytes of SVG; a
/// PDF contains its date.
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

/// Adds a curve of two series for each run in the style of its method, and the legend.
void AddRunsOverTime(std::span<const Record> records, const std::string& x, const std::string& y,
                     Figure* figure);

/// A figure and the name of its file without extension.
struct NamedFigure {
  std::string name;
  Figure figure;
};

/// Joint coordinates of one run against time. Angles [rad] are "series.angle.JOINT" against
/// "series.t"; displacements [m] have their own panel, "series.displacement.JOINT". If the run has
/// series of its opening, they are used (harness/observers/observer.h). The title names this and
/// the run.
Figure MotionFigure(const Record& record);

/// Drift [m] of several runs of one mechanism against time on logarithmic axes: the running maximum
/// "series.drift" against "series.drift_t". At the end of a curve is the fitted power with its
/// spread, and '?' if it is not resolved; a thin line shows a resolved power over its fit window. A
/// failed run ends in a cross with its outcome. `singular`: on a linear time axis, without fits,
/// for the effect of passing a singular configuration.
Figure DriftFigure(std::span<const Record> records, bool singular = false);

/// All figures of the records with series. Each mechanism and horizon has the motion of one run,
/// the most reliable. Each mechanism, horizon and tolerance has a drift figure, or one of singular
/// configurations if a run came near one. Runs that differ in integrator, experiment or a parameter
/// have separate figures, named with its value.
std::vector<NamedFigure> AllFigures(std::span<const Record> records);

/// Draws error (lines) and drift (dashes) of each ladder against tolerance, one colour per scalar.
/// Failed runs are crosses at the lower edge.
std::vector<NamedFigure> PrecisionFigures(std::span<const Record> records);

/// Draws two trajectories in the upper panel, their difference in the lower one; columns that
/// coincide are one curve. `columns` have one unit.
Figure TrajectoryFigure(const Trajectory& ours, const Trajectory& theirs,
                        std::span<const SharedColumn> columns, const std::string& title);

/// Request for a figure. Keys are keys of records; `x` may hold texts, which become equally spaced
/// ticks. Two series ("series.drift_t" and "series.drift") give one curve per record.
struct FreeFigure {
  std::string x, y;
  std::string group;  ///< keys "a,b": one curve per combination of values; "" for a single curve
  std::string log;    ///< "x", "y", "xy" or "none"; "" for axes that span at least two decades
  /// Title; by default the keys and the values that all records share.
  std::optional<std::string> title = std::nullopt;
  /// "NAME=TEXT": text of an axis (NAME is its key) or of a curve (NAME is its label).
  std::vector<std::string> labels = {};
};

/// Keys that identify a case, in the order of titles.
inline constexpr std::array<const char*, 7> kCaseKeys = {
    "mechanism", "formulation", "enforcement", "coordinates", "solver", "rtol", "horizon"};

struct FreeFigureResult {
  Figure figure;
  /// Remarks for the reader: keys that differ within a curve, failed runs without a value.
  std::vector<std::string> remarks;
};

/// Throws ConfigError if no record has one of the keys.
void RequireKeys(const FreeFigure& wanted, std::span<const Record> records);

/// Draws the records that have both values. Points of a curve are joined in the order of x unless
/// two of them share one. A failed run is a cross at its value, or at the lower edge if it has
/// none; it is never left out. Only records of the kinds with a y value take part.
///
/// @throws ConfigError if a key is in no record, y is not numeric, no record has both values, or no
/// value of a logarithmic axis is positive. Labels without an axis or curve are errors, too.
FreeFigureResult MakeFreeFigure(std::span<const Record> records, const FreeFigure& wanted);

/// Takes records one by one and keeps at most `most` of them, reduced to the keys of a free figure:
/// one per cell of the picture, curve, failure and warning state. Cells are as fine as `most`
/// allows, on linear and on logarithmic axes.
class DistinctPoints {
 public:
  DistinctPoints(const FreeFigure& wanted, std::size_t most);

  /// Adds a record. Throws ConfigError if x or y is a series.
  void Add(const Record& record);

  const std::vector<Record>& records() const { return kept_; }
  std::size_t seen() const { return seen_; }
  /// Side of a cell as a fraction of an axis; 0 if every record was kept.
  double cell() const { return parts_ == 0 ? 0.0 : 1.0 / parts_; }

 private:
  std::string KeyOf(const Record& record) const;
  std::string CellOf(const Record& record, std::size_t axis) const;
  void Coarsen();

  std::array<std::string, 2> axes_;
  std::vector<std::string> group_, keys_;  ///< keys_: all keys that the figure uses
  std::size_t most_, seen_ = 0;
  int parts_ = 0;                              ///< cells per axis; 0: all points are kept
  std::array<std::array<Axis, 2>, 2> scales_;  ///< of x and y: linear and logarithmic
  std::vector<Record> kept_;
  std::unordered_set<std::string> cells_;
};

/// Letter size of all drawings [pt], distance of their lines and mean width of letters.
inline constexpr double kLetterSize = 8.0, kLineHeight = 10.0, kLetterWidth = 4.2;

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

/// Runs the script of a drawing, which sets neither terminal nor output and quotes its texts with
/// QuoteGnuplot(), by the program `gnuplot` without a shell. Writes `path`, as PDF if its extension
/// is ".pdf", else as SVG. Returns nothing on success, else the reason: nothing to draw, gnuplot
/// missing (and its package), or its own message. The file is complete or absent. No other files
/// remain, even if this process is killed.
[[nodiscard]] std::optional<std::string> DrawWithGnuplot(const std::filesystem::path& path,
                                                         const Drawing& drawing,
                                                         const std::string& gnuplot = "gnuplot");

double WidthOfPage(FigureSize size);

/// Returns gnuplot's "lc ... dt ... lw ..." of a curve's line.
std::string LineLook(const CurveStyle& style);

/// Returns the axes of a panel and its approximate size.
PlotArea AreaOf(const Figure& panel, FigureSize size);

/// Returns the points of a curve that are drawn.
std::vector<Point> DrawnPoints(const PlotArea& area, const Curve& curve);

/// Returns the height of each of so many panels [pt].
double HeightOfPanel(FigureSize size, std::size_t panels);

/// Result of a method in all rows of a group.
struct FoldedCell {
  CellState worst = CellState::kNotApplicable;  ///< worst of the applicable rows
  std::size_t holding = 0, judged = 0;          ///< numbers of applicable rows
  bool with_warnings = false;                   ///< a row holds with warnings
  bool fails_demand = false;                    ///< a row must hold and does not

  /// Fraction of the applicable rows that hold; 1 if all do.
  double Share() const;
};

/// A group with a cell for each method.
struct FoldedGroup {
  std::string label;  ///< short label of the rules if there is one
  std::vector<FoldedCell> cells;

  double Share() const;  ///< over all its rows and methods
};

/// Returns the groups of a map, in ascending order of the fraction that holds.
std::vector<FoldedGroup> Folded(const RobustnessMap& map);

/// Draws groups from top to bottom, methods from left to right, a legend below. Darker cells have
/// fewer rows that hold; the glyph shows how the worst row ended. Cells with a required row that
/// does not hold have a frame.
Drawing DrawMap(const RobustnessMap& map, FigureSize size = FigureSize::kTwoColumn);

/// Error over cost on logarithmic axes. Marks are the runs: hue for the formulation, shape for the
/// coordinates, hollow with warnings. A line, dashed by level, joins the runs that no other run of
/// the same formulation and level dominates. Thin black stairs are the overall Pareto front. Failed
/// runs are crosses on the lower edge if their cost is known (their CPU time in place of the
/// missing simulation time).
Figure WorkPrecisionFigure(const WorkPrecision& work_precision,
                           const WorkPrecisionProblem& problem);

/// Error over tolerance of the runs with one integrator, to check whether tolerances are met. A
/// line shows error = tolerance (times a link length, for lengths).
Figure ToleranceFigure(const WorkPrecision& work_precision, const WorkPrecisionProblem& problem,
                       const std::string& integrator);

/// Error over time ("series.error" over "series.error_t") of the runs with one integrator at its
/// finest tolerance. A vertical line marks the trust horizon of the reference solution.
Figure ErrorOverTimeFigure(const WorkPrecisionProblem& problem, const std::string& integrator);

/// Returns the first figure per problem and the others per integrator, if they have data.
std::vector<NamedFigure> WorkPrecisionFigures(const WorkPrecision& work_precision);

}  // namespace loopbench::harness
