#include "harness/figures/figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string_view>
#include <utility>

#include "harness/figures/gnuplot.h"
#include "harness/text/escape.h"

namespace loopbench::harness {
namespace {

using Point = std::pair<double, double>;

bool CanBeDrawn(double value, bool logarithmic) {
  return std::isfinite(value) && (!logarithmic || value > 0.0);
}

double OnAxis(double value, bool logarithmic) { return logarithmic ? std::log(value) : value; }

// Extent of all that is drawn, on the axes.
struct Extent {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  void Include(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  double Size() const { return high > low ? high - low : 1.0; }
};

std::vector<Point> Drawable(const Figure& figure, const Curve& curve) {
  std::vector<Point> points;
  for (std::size_t i = 0; i < std::min(curve.x.size(), curve.y.size()); ++i) {
    if (CanBeDrawn(curve.x[i], figure.log_x) && CanBeDrawn(curve.y[i], figure.log_y)) {
      points.emplace_back(curve.x[i], curve.y[i]);
    }
  }
  return points;
}

// Leaves out points nearer than a pixel to the last one kept. The last point always stays.
std::vector<Point> Thin(const Figure& figure, const std::vector<Point>& points, const Extent& x,
                        const Extent& y) {
  constexpr double kPixelsX = 860.0;
  constexpr double kPixelsY = 400.0;
  std::vector<Point> kept;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!kept.empty() && i + 1 < points.size()) {
      const double dx =
          OnAxis(points[i].first, figure.log_x) - OnAxis(kept.back().first, figure.log_x);
      const double dy =
          OnAxis(points[i].second, figure.log_y) - OnAxis(kept.back().second, figure.log_y);
      if (std::hypot(dx / x.Size() * kPixelsX, dy / y.Size() * kPixelsY) < 1.0) continue;
    }
    kept.push_back(points[i]);
  }
  return kept;
}

std::string DataBlock(std::string_view name, const std::vector<Point>& points) {
  std::string block = fmt::format("${} << EOD\n", name);
  for (const auto& [x, y] : points) block += fmt::format("{:.6g} {:.6g}\n", x, y);
  return block + "EOD\n";
}

// Solid, or dashes of 9 pixels and gaps of 6. gnuplot's SVG terminal multiplies them by half the
// line's width, so they are divided by it: curves of any width have the same dashes.
std::string DashType(const CurveStyle& style) {
  if (!style.doubtful) return "solid";
  return fmt::format("({:.3g},{:.3g})", 2.0 * 9.0 / style.width, 2.0 * 6.0 / style.width);
}

int PointType(const CurveStyle& style) {
  constexpr std::array kOpen = {0, 6, 8, 4, 12, 10};  // in the order of Shape; filled is the next
  const int open = kOpen.at(static_cast<std::size_t>(style.shape));
  return style.filled && style.shape != Shape::kNone ? open + 1 : open;
}

// Where the marks of curve `index` of `count` lie: the points next to some places evenly spaced
// over the axis, between those of the other curves, so that marks of equal curves are all seen.
std::vector<Point> Marks(const Figure& figure, const std::vector<Point>& points, const Extent& x,
                         std::size_t index, std::size_t count) {
  constexpr int kMarks = 6;
  std::vector<Point> marks;
  const double phase = (static_cast<double>(index) + 0.5) / static_cast<double>(count);
  for (int i = 0; i < kMarks; ++i) {
    const double place = x.low + (i + phase) / kMarks * (x.high - x.low);
    const auto at = std::ranges::lower_bound(
        points, place, {}, [&](const Point& point) { return OnAxis(point.first, figure.log_x); });
    if (at != points.end()) marks.push_back(*at);
  }
  if (marks.empty()) marks.push_back(points.back());
  return marks;
}

// The plot elements of curve `index`; its data blocks are named c<index> and, of marks, m<index>.
std::vector<std::string> Elements(const Figure& figure, const Curve& curve, std::size_t index,
                                  const std::vector<Point>& points) {
  const std::string line = fmt::format("lc rgb '{}' dt {} lw {:.3g}", curve.style.color,
                                       DashType(curve.style), curve.style.width);
  const bool marked = curve.style.shape != Shape::kNone;
  std::string look = "lines", marks;
  if (curve.points) {
    // shape and size tell curves apart that lie on each other
    constexpr std::array<int, 8> kShapes = {7, 5, 9, 13, 6, 4, 8, 12};
    const int shape = curve.own_marks ? PointType(curve.style) : kShapes[index % kShapes.size()];
    look = fmt::format("{} pt {} ps {:.3g}", curve.line ? "linespoints" : "points", shape,
                       curve.own_marks ? 0.4 + 0.3 * curve.style.width : 0.3 * curve.style.width);
  } else if (marked) {
    marks = fmt::format("pt {} ps 0.8", PointType(curve.style));
  }
  const std::string title = curve.label.empty() ? "notitle" : "title " + QuoteGnuplot(curve.label);
  // the legend shows a line with its mark
  const std::string legend = marks.empty()
                                 ? fmt::format("NaN with {} {} {}", look, line, title)
                                 : fmt::format("NaN with linespoints {} {} {}", line, marks, title);
  if (points.empty()) return {legend};
  std::vector<std::string> elements;
  if (marks.empty()) {
    elements = {fmt::format("$c{} with {} {} {}", index, look, line, title)};
  } else {
    elements = {fmt::format("$c{} with lines {} notitle", index, line),
                fmt::format("$m{} with points lc rgb '{}' lw 1.5 {} notitle", index,
                            curve.style.color, marks),
                legend};
  }
  const auto [x_last, y_last] = points.back();
  if (curve.slope && figure.log_x && figure.log_y) {
    // Lifted a little, so that it does not hide what it describes.
    constexpr double kLift = 1.8;
    elements.push_back(fmt::format(
        "[{:.6g}:{:.6g}] {:.6g}*(x/{:.6g})**({:.4g}) with lines lc rgb '#606060' lw 1 notitle",
        x_last / 10.0, x_last, kLift * y_last, x_last, *curve.slope));
  }
  if (curve.ends_early) {
    elements.push_back(
        fmt::format("'+' every ::::0 using ({:.6g}):({:.6g}) with points pt 2 ps 1.2 lw 2 "
                    "lc rgb '{}' notitle",
                    x_last, y_last, curve.style.color));
  }
  return elements;
}

// Failed runs as labels with a point and no text: unlike plot elements these may lie on the edge.
std::string Crosses(const Figure& figure, const Curve& curve) {
  std::string commands;
  for (const auto& [x, y] : curve.crosses) {
    if (!CanBeDrawn(x, figure.log_x)) continue;
    const std::string place =
        CanBeDrawn(y, figure.log_y) ? fmt::format("first {:.6g}", y) : "graph 0.02";
    commands +=
        fmt::format("set label '' at first {:.6g}, {} point pt 2 ps 1.2 lw 2 lc rgb '{}' front\n",
                    x, place, curve.style.color);
  }
  return commands;
}

bool HasCrosses(const Figure& figure) {
  return std::ranges::any_of(figure.curves,
                             [](const Curve& curve) { return !curve.crosses.empty(); });
}

// Room around points and crosses (which do not widen the axes by themselves), and named ticks.
std::string Ranges(const Figure& figure, const Extent& x, const Extent& y) {
  const bool has_points = std::ranges::any_of(
      figure.curves, [](const Curve& curve) { return curve.points || !curve.crosses.empty(); });
  const auto range = [&](char axis, const Extent& extent, bool logarithmic, double margin) {
    if (!has_points || extent.high < extent.low) return std::string();
    const auto value = [&](double at) { return logarithmic ? std::exp(at) : at; };
    // values that agree in their first digits still get a range that these digits can express
    const double magnitude = std::max(std::abs(extent.low), std::abs(extent.high));
    const double least = logarithmic ? 0.2 : magnitude > 0 ? 1e-3 * magnitude : 1.0;
    margin *= std::max(extent.high - extent.low, least);
    return fmt::format("set {}range [{:.6g}:{:.6g}]\n", axis, value(extent.low - margin),
                       value(extent.high + margin));
  };
  // lines, too, keep off the frame; logarithmic axes end at powers of ten anyway
  std::string commands =
      has_points || figure.log_y ? "" : "set offsets 0, 0, graph 0.04, graph 0.04\n";
  commands += range('y', y, figure.log_y, 0.08);
  if (!figure.x_ticks.empty()) {
    commands += fmt::format("set xrange [0.5:{}]\nset xtics (",
                            static_cast<double>(figure.x_ticks.size()) + 0.5);
    for (std::size_t i = 0; i < figure.x_ticks.size(); ++i) {
      commands +=
          fmt::format("{}{} {}", i == 0 ? "" : ", ", QuoteGnuplotTick(figure.x_ticks[i]), i + 1);
    }
    commands += ")\n";
  } else {
    commands += range('x', x, figure.log_x, 0.05);
  }
  return commands;
}

// Rows of the legend, whose blank title keeps it clear of the axis label. It lies below the plot in
// as many columns as its longest label permits.
std::size_t LegendRows(const Figure& figure) {
  constexpr std::size_t kCharacters = 110;
  constexpr std::size_t kSample = 8;
  std::size_t longest = 1;
  std::size_t entries = HasCrosses(figure) ? 1 : 0;
  for (const Curve& curve : figure.curves) {
    longest = std::max(longest, curve.label.size());
    entries += curve.label.empty() ? 0 : 1;
  }
  const std::size_t columns = std::max<std::size_t>(1, kCharacters / (longest + kSample));
  return std::max<std::size_t>(1, (entries + columns - 1) / columns);
}

std::string LegendTitle(const Figure& figure) {
  const bool has_doubts =
      std::ranges::any_of(figure.curves, [](const Curve& curve) { return curve.style.doubtful; });
  if (!has_doubts) return figure.legend_title;
  return figure.legend_title + (figure.legend_title.empty() ? "" : "; ") + "dashed: doubtful";
}

}  // namespace

CurveStyle DistinctStyle(std::size_t index) {
  // Okabe and Ito's palette, and a green
  constexpr std::array<const char*, 8> kPalette = {"#0072B2", "#D55E00", "#009E73", "#CC79A7",
                                                   "#E69F00", "#56B4E9", "#000000", "#999933"};
  constexpr std::array<Shape, 5> kShapes = {Shape::kNone, Shape::kCircle, Shape::kTriangle,
                                            Shape::kSquare, Shape::kDiamond};
  return {.color = kPalette[index % kPalette.size()],
          .shape = kShapes[index / kPalette.size() % kShapes.size()]};
}

std::string GnuplotScript(const Figure& figure) {
  std::vector<std::vector<Point>> points;
  Extent x;
  Extent y;
  for (const Curve& curve : figure.curves) {
    points.push_back(Drawable(figure, curve));
    for (const Point& point : points.back()) {
      x.Include(OnAxis(point.first, figure.log_x));
      y.Include(OnAxis(point.second, figure.log_y));
    }
    for (const Point& cross : curve.crosses) {
      if (CanBeDrawn(cross.first, figure.log_x)) x.Include(OnAxis(cross.first, figure.log_x));
      if (CanBeDrawn(cross.second, figure.log_y)) y.Include(OnAxis(cross.second, figure.log_y));
    }
  }
  const std::string legend_title = LegendTitle(figure);
  std::string script = fmt::format(
      "set encoding utf8\nset title {}\nset xlabel {} offset 0,0.5\nset ylabel {}\n"
      "set grid lc rgb '#cccccc' lw 0.5\n"
      "set key bmargin center vertical maxrows {} Left reverse samplen 4 title {}\n",
      QuoteGnuplot(figure.title), QuoteGnuplot(figure.x_label), QuoteGnuplot(figure.y_label),
      LegendRows(figure),
      legend_title.empty() ? QuoteGnuplot(" ") : "\"\\n\"." + QuoteGnuplot(legend_title));
  if (figure.log_x) script += "set logscale x\nset format x '%g'\n";
  if (figure.log_y) {
    // powers of ten are read most easily as such, unless all are near one
    const bool near_one = y.low > std::log(1e-4) && y.high < std::log(1e6);
    script += fmt::format("set logscale y\nset format y '{}'\n", near_one ? "%g" : "%.0e");
  }
  script += Ranges(figure, x, y);
  std::string plot;
  for (std::size_t i = 0; i < figure.curves.size(); ++i) {
    points[i] = Thin(figure, points[i], x, y);
    const Curve& curve = figure.curves[i];
    if (!points[i].empty()) script += DataBlock(fmt::format("c{}", i), points[i]);
    if (!points[i].empty() && !curve.points && curve.style.shape != Shape::kNone) {
      script +=
          DataBlock(fmt::format("m{}", i), Marks(figure, points[i], x, i, figure.curves.size()));
    }
    script += Crosses(figure, curve);
    for (const std::string& element : Elements(figure, curve, i, points[i])) {
      plot += fmt::format("{}{}", plot.empty() ? "plot " : ", \\\n  ", element);
    }
  }
  if (HasCrosses(figure)) {
    plot += ", \\\n  NaN with points pt 2 ps 1.2 lw 2 lc rgb '#000000' title 'failed run'";
  }
  return script + plot + '\n';
}

namespace {

// 960 wide, 500 high without the legend.
GnuplotPage PageOf(const Figure& figure, bool pdf) {
  const std::size_t height =
      500 + 20 * (LegendRows(figure) + (LegendTitle(figure).empty() ? 0 : 1));
  return {960, static_cast<int>(height), pdf ? 11 : 13};
}

}  // namespace

std::optional<std::string> WriteFigure(const std::filesystem::path& path, const Figure& figure,
                                       const std::string& gnuplot) {
  const bool anything = std::ranges::any_of(figure.curves, [&](const Curve& curve) {
    return !Drawable(figure, curve).empty() || !curve.crosses.empty();
  });
  if (!anything) return fmt::format("{}: no curve has a point to draw", path.string());
  return DrawWithGnuplot(path, PageOf(figure, path.extension() == ".pdf"), GnuplotScript(figure),
                         gnuplot);
}

}  // namespace loopbench::harness
