// Figures and their legends, drawn by gnuplot.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <map>
#include <numeric>
#include <string_view>
#include <utility>

#include "harness/base/text.h"
#include "harness/figures/figures.h"

namespace loopbench::harness {
namespace {

// pdfcairo takes 4/3 points for a point of letters and half a point for a width of 1.
std::string TerminalOf(const GnuplotPage& page, bool pdf) {
  if (!pdf) {
    return fmt::format(
        "svg noenhanced size {:.0f},{:.0f} font 'Helvetica,Arial,sans-serif,{:g}' background "
        "'#ffffff'",
        page.width, page.height, kLetterSize);
  }
  return fmt::format(
      "pdfcairo noenhanced size {:.4f}in,{:.4f}in font 'Helvetica,{:g}' fontscale 0.75 linewidth 2",
      page.width / 72.0, page.height / 72.0, kLetterSize);
}

/// Sets the intended print size of a drawing in points; gnuplot writes pixels.
std::string InMillimetres(std::string svg, const GnuplotPage& page) {
  const std::string pixels =
      fmt::format("width=\"{:.0f}\" height=\"{:.0f}\"", page.width, page.height);
  const std::size_t at = svg.find(pixels);
  if (at == std::string::npos) return svg;
  return svg.replace(at, pixels.size(),
                     fmt::format("width=\"{:.2f}mm\" height=\"{:.2f}mm\"", page.width * 25.4 / 72.0,
                                 page.height * 25.4 / 72.0));
}

}  // namespace

double WidthOf(std::string_view text) {
  // names in capitals, as of ARKODE's tables, are wider
  const auto capitals = std::ranges::count_if(text, [](char c) { return c >= 'A' && c <= 'Z'; });
  const double wider = 1.5 * static_cast<double>(std::max<std::ptrdiff_t>(capitals - 4, 0));
  return kLetterWidth * static_cast<double>(CountCharacters(text)) + wider;
}

std::vector<std::string> Wrapped(const std::string& text, std::size_t most) {
  std::vector<std::string> lines(1);
  for (std::size_t start = 0; start < text.size();) {
    const std::size_t end = std::min(text.find(' ', start), text.size());
    const std::string word = text.substr(start, end - start);
    if (!lines.back().empty() && CountCharacters(lines.back()) + 1 + CountCharacters(word) > most) {
      lines.emplace_back();
    }
    lines.back() += (lines.back().empty() ? "" : " ") + word;
    start = end + 1;
  }
  return lines;
}

std::string TextAt(const GnuplotPage& page, std::string_view text, double x, double y,
                   std::string_view options) {
  return fmt::format("set label {} at screen {:.5f}, screen {:.5f} {}\n", QuoteGnuplot(text),
                     x / page.width, y / page.height, options);
}

std::optional<std::string> DrawWithGnuplot(const std::filesystem::path& path,
                                           const Drawing& drawing, const std::string& gnuplot) {
  if (drawing.is_empty) return fmt::format("{}: no curve has a point to draw", path.string());
  const bool pdf = path.extension() == ".pdf";
  // without the user's ~/.gnuplot, whose settings would change figures
  const ProgramResult run =
      RunProgram({gnuplot, "--default-settings"},
                 fmt::format("set terminal {}\n{}", TerminalOf(drawing.page, pdf), drawing.script));
  if (run.error != 0) {
    return fmt::format("{}: {}{}", path.string(), run.Failure(gnuplot),
                       run.error == ENOENT ? "; install gnuplot-nox" : "");
  }
  if (run.status != 0 || run.output.empty()) {
    return fmt::format("{}: gnuplot failed: {}", path.string(), run.messages);
  }
  WriteFileAtomically(path, pdf ? run.output : InMillimetres(run.output, drawing.page));
  return std::nullopt;
}

double WidthOfPage(FigureSize size) {
  return std::round(PointsOf(size == FigureSize::kOneColumn ? 85.0 : 178.0));
}

std::string LineLook(const CurveStyle& style) {
  // [pt]; gnuplot multiplies them by half the line width
  constexpr std::array<std::array<double, 6>, kDashes> kPatterns = {
      {{}, {6, 2.5}, {1.2, 1.8}, {6, 2, 1.2, 2}, {6, 2, 1.2, 2, 1.2, 2}, {3, 2}}};
  std::string lengths;
  for (const double length : kPatterns[style.dash % kDashes]) {
    if (length == 0.0) continue;
    lengths += fmt::format("{}{:.3g}", lengths.empty() ? "" : ",", 2.0 * length / style.width);
  }
  return fmt::format("lc rgb '{}' dt {} lw {:.4g}", style.color,
                     lengths.empty() ? "solid" : "(" + lengths + ")", style.width);
}

namespace {

constexpr const char* kCrossLook = "pt 2 ps 0.45 lw 1.2";

std::string MarkLook(const CurveStyle& style) {
  constexpr std::array kOpen = {6, 6, 8, 4, 12, 10};  // in the order of Shape; filled is the next
  const int open = kOpen[static_cast<std::size_t>(style.shape)];
  return fmt::format("pt {} ps 0.4 lw 1 lc rgb '{}'", style.flagged ? open : open + 1, style.color);
}

constexpr double kSample = 17.0, kSampleGap = 4.0, kItemGap = 10.0;  // [pt]

double SampleOf(const LegendItem& item) {
  if (item.line) return kSample + kSampleGap;
  return item.style.shape == Shape::kNone ? 0.0 : 6.0 + kSampleGap;
}

double WidthOfItem(const LegendItem& item) {
  return SampleOf(item) + WidthOf(item.text) + kItemGap;
}

LegendItem TextItem(const std::string& text) { return {.text = text, .line = false}; }

LegendRow SignsOf(const std::vector<Curve>& curves, const std::vector<std::string>& failures) {
  const auto any = [&](const auto& is) { return std::ranges::any_of(curves, is); };
  LegendRow row;
  if (any([](const Curve& curve) { return curve.style.flagged || !curve.hollow.empty(); })) {
    row.push_back({"flagged", {.shape = Shape::kCircle, .flagged = true}, false});
  }
  if (any([](const Curve& curve) { return curve.ends_early || !curve.crosses.empty(); })) {
    row.push_back(TextItem(fmt::format("×: failed run{}{}{}", failures.empty() ? "" : " (",
                                       fmt::join(failures, "; "), failures.empty() ? "" : ")")));
  }
  if (any([](const Curve& curve) { return curve.guide.has_value(); })) {
    row.push_back(TextItem("numbers: fitted power of time"));
  }
  if (any([](const Curve& curve) { return curve.remark.ends_with('?'); })) {
    row.push_back(TextItem("?: not resolved"));
  }
  return row;
}

std::vector<LegendRow> Broken(const LegendRow& items, double width) {
  std::vector<LegendRow> rows;
  double used = 0.0;
  for (const LegendItem& item : items) {
    const double own = WidthOfItem(item);
    if (rows.empty() || used + own - kItemGap > width) {
      rows.emplace_back();
      used = 0.0;
    }
    rows.back().push_back(item);
    used += own;
  }
  return rows;
}

void Append(const std::vector<LegendRow>& rows, std::vector<LegendRow>* all) {
  all->insert(all->end(), rows.begin(), rows.end());
}

struct Legend {
  std::vector<LegendRow> rows;
  std::size_t letters = 0;  ///< listed curves that stand for several
};

/// Makes the legend of a figure with the curves `merged`: its own rows, or else the labels of the
/// curves (unless `names` puts them at the ends of the curves); the meaning of signs, with
/// `failures`, remarks on crosses without a curve; the curves that stand for several, by the
/// letters at their ends. In one column this list ends in "…" if the legend would exceed
/// kLegendRows.
Legend LegendOf(const Figure& figure, const std::vector<Curve>& merged, bool names, FigureSize size,
                const std::vector<std::string>& failures) {
  const double width = WidthOfPage(size) - 16.0;
  std::vector<LegendRow> rows;
  if (!figure.legend_title.empty()) rows.push_back({TextItem(figure.legend_title)});
  for (const LegendRow& row : figure.legend) Append(Broken(row, width), &rows);
  if (rows.size() > 3) {  // then without a row of its own for each channel
    LegendRow all;
    for (const LegendRow& row : rows) all.insert(all.end(), row.begin(), row.end());
    rows = Broken(all, width);
  }
  LegendRow named;
  std::vector<std::string> several;
  for (const Curve& curve : merged) {
    if (curve.label.empty()) continue;
    if (!figure.legend.empty()) {
      if (curve.several) several.push_back(LetterOf(several.size()) + ": " + curve.label);
    } else if (!names || !curve.merges) {
      named.push_back({curve.label, curve.style, curve.line || !curve.points});
    }
  }
  Append(Broken(named, width), &rows);
  Append(Broken(SignsOf(merged, failures), width), &rows);
  std::ptrdiff_t letters = std::ssize(several);
  const auto list = [&] {
    std::vector<std::string> shown(several.begin(), several.begin() + letters);
    if (letters < std::ssize(several)) shown.emplace_back("…");
    const std::string words = "coincide: " + Joined(shown, ";  ");
    return Wrapped(words, static_cast<std::size_t>(width / kLetterWidth));
  };
  const auto has_room = [&] { return rows.size() + list().size() <= kLegendRows; };
  while (size == FigureSize::kOneColumn && letters > 0 && !has_room()) --letters;
  if (!several.empty()) {
    for (const std::string& line : list()) rows.push_back({TextItem(line)});
  }
  return {std::move(rows), static_cast<std::size_t>(letters)};
}

/// Draws rows below `top` [pt from the lower edge of the page].
std::string DrawLegend(const std::vector<LegendRow>& rows, const GnuplotPage& page, double top) {
  // gnuplot 5.4 draws all SVG lines of one colour and width with the dashes of the first: widths
  // differ by a thousandth
  std::string commands;
  double width = 0.0;
  double y = top - 0.5 * kLineHeight;
  for (const LegendRow& row : rows) {
    double x = 8.0;
    for (const LegendItem& item : row) {
      if (item.line) {
        CurveStyle style = item.style;
        style.width += width += 0.001;
        commands += fmt::format(
            "set arrow from screen {0:.5f}, screen {1:.5f} to screen {2:.5f}, screen {1:.5f} "
            "nohead {3}\n",
            x / page.width, y / page.height, (x + kSample) / page.width, LineLook(style));
      }
      if (item.style.shape != Shape::kNone) {
        const double middle = x + (item.line ? 0.5 * kSample : 3.0);
        commands += TextAt(page, "", middle, y, "point " + MarkLook(item.style));
      }
      commands += TextAt(page, item.text, x + SampleOf(item), y, "left");
      x += WidthOfItem(item);
    }
    y -= kLineHeight;
  }
  return commands;
}

std::string DataBlock(const std::string& name, const std::vector<Point>& points) {
  std::string block = fmt::format("${} << EOD\n", name);
  for (const auto& [x, y] : points) block += fmt::format("{:.6g} {:.6g}\n", x, y);
  return block + "EOD\n";
}

// Returns the marks of curve `index` of `count`: the points nearest to evenly spaced places on the
// axis. They lie between the marks of other curves, so that marks of close curves stay visible.
std::vector<Point> Marks(const PlotArea& area, const std::vector<Point>& points, std::size_t index,
                         std::size_t count) {
  constexpr int kMarks = 5;
  std::vector<Point> marks;
  const double phase = (static_cast<double>(index) + 0.5) / static_cast<double>(count);
  for (int i = 0; i < kMarks; ++i) {
    const auto at =
        std::ranges::lower_bound(points, (i + phase) / kMarks, {},
                                 [&](const Point& point) { return area.x.Place(point.first); });
    if (at != points.end() && (marks.empty() || marks.back() != *at)) marks.push_back(*at);
  }
  if (marks.empty()) marks.push_back(points.back());
  return marks;
}

std::string GuideElement(const Guide& guide, const std::vector<Point>& points) {
  double sum = 0.0;
  int count = 0;
  for (const auto& [x, y] : points) {
    if (x < guide.from || x > guide.to) continue;
    sum += std::log(y) - guide.exponent * std::log(x);
    ++count;
  }
  if (count < 2) return "";
  return fmt::format(
      "[{0:.6g}:{1:.6g}] {2:.6g}*(x/{0:.6g})**({3:.4g}) with lines lc rgb '#808080' dt solid lw "
      "0.7 notitle",
      guide.from, guide.to, std::exp(sum / count + guide.exponent * std::log(guide.from)),
      guide.exponent);
}

/// Draws failed runs as labels with a point and no text. Unlike plot elements they may lie on the
/// edges: on the lower one without a value, on the left one at a time outside a logarithmic axis.
/// Crosses of several colours at one place on the lower edge are stacked.
class Crosses {
 public:
  explicit Crosses(const PlotArea& area) : area_(area) {}

  std::string Of(const Curve& curve) {
    std::string commands;
    for (const Point& cross : curve.crosses) commands += At(cross, curve.style.color);
    if (curve.ends_early && !curve.x.empty() && curve.x.size() == curve.y.size()) {
      commands += At({curve.x.back(), curve.y.back()}, curve.style.color);
    }
    return commands;
  }

 private:
  std::string At(const Point& cross, const std::string& color) {
    constexpr double kDistance = 0.03;  // fraction of the height
    const auto& [x, y] = cross;
    if (!std::isfinite(x)) return "";
    const std::string at = area_.x.CanShow(x) ? fmt::format("first {:.6g}", x) : "graph 0";
    std::string height = fmt::format("first {:.6g}", y);
    if (!area_.y.CanShow(y)) {
      std::vector<std::string>& colors = on_edge_[at];
      if (Contains(colors, color)) return "";
      colors.push_back(color);
      height = fmt::format("graph {:.4g}", kDistance * static_cast<double>(colors.size()));
    }
    return fmt::format("set label '' at {}, {} point {} lc rgb '{}' front\n", at, height,
                       kCrossLook, color);
  }

  const PlotArea& area_;
  std::map<std::string, std::vector<std::string>> on_edge_;  ///< colours by place
};

std::string TicksCommand(char axis, const std::vector<Tick>& ticks, bool has_labels) {
  const std::string list = Joined(ticks, ", ", [&](const Tick& tick) {
    return fmt::format("{} {:.10g}{}", QuoteGnuplotTick(has_labels ? tick.label : ""), tick.at,
                       tick.label.empty() ? " 1" : "");
  });
  return fmt::format("set {}tics scale 0.5,0.25 ({})\n", axis, list);
}

std::vector<Tick> NamedTicks(const std::vector<std::string>& names) {
  std::vector<Tick> ticks;
  for (const std::string& name : names) {
    ticks.push_back({static_cast<double>(ticks.size() + 1), name});
  }
  return ticks;
}

// Returns heights at least a line apart, each as near as possible to the wanted height.
std::vector<double> Spread(std::vector<double> wanted, double low, double high) {
  std::vector<std::size_t> order(wanted.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return wanted[i]; });
  constexpr double kDistance = 0.9 * kLineHeight;
  constexpr int kSweeps = 200;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    for (std::size_t k = 1; k < order.size(); ++k) {
      double &lower = wanted[order[k - 1]], &upper = wanted[order[k]];
      const double push = 0.5 * std::max(0.0, lower + kDistance - upper);
      lower -= push;
      upper += push;
    }
    for (double& height : wanted) height = std::clamp(height, low, high);
  }
  return wanted;
}

/// Position of a panel on the page [pt from the lower left corner].
struct PanelPlace {
  double left = 0.0, right = 0.0, bottom = 0.0, top = 0.0;
};

struct DrawnCurve {
  Curve curve;
  std::vector<Point> points = {};
  std::string text = "";  ///< at its end
};

struct Panel {
  Figure figure;
  PlotArea area;
  std::vector<DrawnCurve> drawn;
};

std::vector<Panel> PanelsOf(const Figure& figure, FigureSize size) {
  std::vector<Panel> panels;
  AxisRange x(figure.log_x);  // one axis for all panels
  const auto add = [&](Figure own) {
    own.log_x = figure.log_x;
    own.x_ticks = figure.x_ticks;
    panels.push_back({own, AreaOf(own, size),
                      Mapped<DrawnCurve>(MergedCurves(own, size),
                                         [](const Curve& curve) { return DrawnCurve{curve}; })});
    x.Include(panels.back().area.x.low);
    x.Include(panels.back().area.x.high);
  };
  add(figure);
  for (const Figure& below : figure.below) add(below);
  for (Panel& panel : panels) {
    if (figure.x_ticks.empty()) panel.area.x = x.WithMargin(0.0);
    for (DrawnCurve& one : panel.drawn) one.points = DrawnPoints(panel.area, one.curve);
  }
  return panels;
}

/// True if curves are named at their ends instead of in the legend.
bool NamesAtEnds(const Figure& figure, const Panel& panel) {
  const auto is_named = [](const DrawnCurve& one) {
    return !one.curve.label.empty() && one.curve.merges;
  };
  return figure.legend.empty() &&
         (figure.names_at_ends ||
          std::ranges::count_if(panel.drawn, is_named) > static_cast<std::ptrdiff_t>(kLegendRows));
}

// Draws texts right of the panel, each with a thin line to the end of its curve.
std::string EndLabels(const Panel& panel, const GnuplotPage& page, const PanelPlace& place) {
  constexpr double kLeader = 8.0;
  const double height = place.top - place.bottom;
  const std::size_t room = static_cast<std::size_t>(height / (0.9 * kLineHeight));
  std::vector<const DrawnCurve*> shown;
  std::vector<double> wanted;
  std::size_t left_out = 0;
  for (const DrawnCurve& one : panel.drawn) {
    if (one.text.empty()) continue;
    if (shown.size() + 1 >= room) {
      ++left_out;
      continue;
    }
    shown.push_back(&one);
    wanted.push_back(place.bottom + height * panel.area.y.Place(one.points.back().second));
  }
  const std::vector<double> heights =
      Spread(wanted, place.bottom + (left_out > 0 ? kLineHeight : 0.0), place.top);
  std::string commands;
  for (std::size_t k = 0; k < shown.size(); ++k) {
    const Point& end = shown[k]->points.back();
    commands += TextAt(page, shown[k]->text, place.right + kLeader + 2.0, heights[k], "left");
    commands += fmt::format(
        "set arrow from first {:.6g}, first {:.6g} to screen {:.5f}, screen {:.5f} nohead "
        "lc rgb '#808080' dt solid lw 0.4\n",
        end.first, end.second, (place.right + kLeader) / page.width, heights[k] / page.height);
  }
  if (left_out > 0) {
    commands += TextAt(page, fmt::format("and {} more", left_out), place.right + kLeader,
                       place.bottom, "left");
  }
  return commands;
}

/// Returns commands that draw a panel, the last one "plot"; labels set before belong to it. Data
/// names begin with `name`.
std::string PanelScript(const Panel& panel, const GnuplotPage& page, const PanelPlace& place,
                        const std::string& name, bool has_x_labels) {
  const PlotArea& area = panel.area;
  const std::vector<std::string>& names = panel.figure.x_ticks;
  const int most = page.width < 300.0 ? 4 : 7;
  std::string script = fmt::format(
      "set lmargin at screen {:.5f}\nset rmargin at screen {:.5f}\nset bmargin at screen {:.5f}\n"
      "set tmargin at screen {:.5f}\nunset key\nset border lw 0.5\nset grid lc rgb '#d0d0d0' dt "
      "solid lw 0.3\n",
      place.left / page.width, place.right / page.width, place.bottom / page.height,
      place.top / page.height);
  if (area.x.logarithmic) script += "set logscale x\n";
  if (area.y.logarithmic) script += "set logscale y\n";
  script += fmt::format("set xrange [{:.10g}:{:.10g}]\nset yrange [{:.10g}:{:.10g}]\n", area.x.low,
                        area.x.high, area.y.low, area.y.high);
  script +=
      TicksCommand('x', names.empty() ? Ticks(area.x, most) : NamedTicks(names), has_x_labels);
  script += TicksCommand('y', Ticks(area.y, 6), true);
  script += TextAt(page, panel.figure.y_label, 7.0, 0.5 * (place.bottom + place.top),
                   "center rotate by 90");
  std::string plot;
  const auto add = [&plot](const std::string& element) {
    if (!element.empty()) plot += (plot.empty() ? "plot " : ", \\\n  ") + element;
  };
  Crosses crosses(area);
  for (std::size_t i = 0; i < panel.drawn.size(); ++i) {
    const auto& [curve, own, text] = panel.drawn[i];
    script += crosses.Of(curve);
    if (own.empty()) continue;
    const auto add_marks = [&](const char* suffix, const CurveStyle& style) {
      add(fmt::format("${}{}{} with points {} notitle", name, i, suffix, MarkLook(style)));
    };
    script += DataBlock(fmt::format("{}{}", name, i), own);
    if (curve.line) add(fmt::format("${}{} with lines {} notitle", name, i, LineLook(curve.style)));
    const bool marked = curve.style.shape != Shape::kNone || curve.style.flagged || curve.points;
    if (curve.points) {
      add_marks("", curve.style);
    } else if (marked) {
      script += DataBlock(fmt::format("{}{}m", name, i), Marks(area, own, i, panel.drawn.size()));
      add_marks("m", curve.style);
    }
    if (!curve.hollow.empty()) {
      // white marks first, over the curve's own marks
      CurveStyle inner = curve.style, outer = curve.style;
      inner.color = "#ffffff";
      outer.flagged = true;
      script += DataBlock(fmt::format("{}{}h", name, i), curve.hollow);
      add_marks("h", inner);
      add_marks("h", outer);
    }
    if (curve.guide && area.x.logarithmic && area.y.logarithmic) {
      add(GuideElement(*curve.guide, own));
    }
  }
  if (plot.empty()) add("NaN notitle");
  return script + EndLabels(panel, page, place) + plot + '\n';
}

}  // namespace

Drawing GnuplotScript(const Figure& figure, FigureSize size) {
  std::vector<Panel> panels = PanelsOf(figure, size);
  Drawing drawing{.page = {.width = WidthOfPage(size)}, .is_empty = true};
  GnuplotPage& page = drawing.page;
  std::vector<Curve> all;
  std::vector<std::string> failures;  // of runs without a curve
  bool names = false;
  for (const Panel& panel : panels) {
    names = names || NamesAtEnds(figure, panel);
    for (const auto& [curve, points, text] : panel.drawn) {
      all.push_back(curve);
      drawing.is_empty = drawing.is_empty && points.empty() && curve.crosses.empty();
      const bool is_cross = points.empty() && curve.ends_early;
      if (is_cross && !curve.remark.empty()) AddOnce(failures, curve.remark);
    }
  }
  const Legend legend = LegendOf(figure, all, names, size, failures);
  double labels = 0.0, ends = 0.0;
  std::size_t next = 0;
  for (Panel& panel : panels) {
    for (const Tick& tick : Ticks(panel.area.y, 6)) labels = std::max(labels, WidthOf(tick.label));
    for (auto& [curve, points, text] : panel.drawn) {
      // its letter in the legend or its name, and its remark
      const bool has_letter = !figure.legend.empty() && curve.several && next++ < legend.letters;
      if (points.empty()) continue;
      text = has_letter ? LetterOf(next - 1) : names && curve.merges ? curve.label : "";
      if (!curve.remark.empty()) text += (text.empty() ? "" : " ") + curve.remark;
      ends = std::max(ends, WidthOf(text));
    }
  }
  std::vector<std::string> title;
  if (!figure.title.empty()) {
    title = Wrapped(figure.title, static_cast<std::size_t>((page.width - 16.0) / kLetterWidth));
  }

  const double line = kLineHeight, height = HeightOfPanel(size, panels.size());
  constexpr double kEdge = 5.0, kGap = 8.0;
  const double head = kEdge + line * static_cast<double>(title.size());
  const double foot = 3.0 * line + kGap + line * static_cast<double>(legend.rows.size()) + kEdge;
  const double count = static_cast<double>(panels.size());
  page.height = std::round(head + count * (height + kGap) + foot);
  drawing.legend_rows = legend.rows.size();
  std::string& commands = drawing.script;
  commands = "set encoding utf8\n";
  double y = page.height - kEdge - 0.5 * line;
  for (const std::string& words : title) {
    commands += TextAt(page, words, 0.5 * page.width, y, "center");
    y -= line;
  }
  commands += DrawLegend(legend.rows, page, foot - 3.0 * line - kGap);
  commands += TextAt(page, figure.x_label, 0.5 * page.width, foot - 2.5 * line, "center");
  if (panels.size() > 1) commands += "set multiplot\n";
  PanelPlace place{.left = 16.0 + labels + 4.0,
                   .right = page.width - (ends > 0.0 ? ends + 14.0 : 10.0),
                   .top = page.height - head - kGap};
  for (std::size_t i = 0; i < panels.size(); ++i) {
    place.bottom = place.top - height;
    if (i > 0) commands += "unset label\nunset arrow\nunset logscale\n";
    commands += PanelScript(panels[i], page, place, std::string(1, static_cast<char>('c' + i)),
                            i + 1 == panels.size());
    place.top = place.bottom - kGap;
  }
  if (panels.size() > 1) commands += "unset multiplot\n";
  return drawing;
}

std::optional<std::string> WriteFigure(const std::filesystem::path& path, const Figure& figure,
                                       FigureSize size, const std::string& gnuplot) {
  return DrawWithGnuplot(path, GnuplotScript(figure, size), gnuplot);
}

}  // namespace loopbench::harness
