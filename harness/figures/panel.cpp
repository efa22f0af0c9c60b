#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <map>
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
                                           const GnuplotPage& page, const std::string& script,
                                           const std::string& gnuplot) {
  const bool pdf = path.extension() == ".pdf";
  // without the user's ~/.gnuplot, whose settings would change figures
  const ProgramResult run =
      RunProgram({gnuplot, "--default-settings"},
                 fmt::format("set terminal {}\n{}", TerminalOf(page, pdf), script));
  if (run.error != 0) {
    return fmt::format("{}: {}{}", path.string(), run.Failure(gnuplot),
                       run.error == ENOENT ? "; install gnuplot-nox" : "");
  }
  if (run.status != 0 || run.output.empty()) {
    return fmt::format("{}: gnuplot failed: {}", path.string(), run.messages);
  }
  WriteFileAtomically(path, pdf ? run.output : InMillimetres(run.output, page));
  return std::nullopt;
}
namespace {

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

// Breaks items into rows no wider than `width`.
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

void Append(std::vector<LegendRow> rows, std::vector<LegendRow>* all) {
  for (LegendRow& row : rows) all->push_back(std::move(row));
}

}  // namespace

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

std::string MarkLook(const CurveStyle& style) {
  constexpr std::array kOpen = {6, 6, 8, 4, 12, 10};  // in the order of Shape; filled is the next
  const int open = kOpen[static_cast<std::size_t>(style.shape)];
  return fmt::format("pt {} ps 0.4 lw 1 lc rgb '{}'", style.flagged ? open : open + 1, style.color);
}

bool NamesAtEnds(const Figure& figure, const std::vector<Curve>& merged) {
  const auto named = std::ranges::count_if(
      merged, [](const Curve& curve) { return !curve.label.empty() && curve.merges; });
  return figure.legend.empty() &&
         (figure.names_at_ends || named > static_cast<std::ptrdiff_t>(kLegendRows));
}

std::vector<std::string> EndTexts(const Figure& figure, const std::vector<Curve>& merged,
                                  bool names, std::size_t letters) {
  std::vector<std::string> texts;
  std::size_t next = 0;
  for (const Curve& curve : merged) {
    std::string text = names && curve.merges ? curve.label : "";
    if (!figure.legend.empty() && curve.several && next++ < letters) text = LetterOf(next - 1);
    if (!curve.remark.empty()) text += (text.empty() ? "" : " ") + curve.remark;
    texts.push_back(text);
  }
  return texts;
}

Legend LegendOf(const Figure& figure, const std::vector<Curve>& merged, FigureSize size,
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
  const bool at_ends = NamesAtEnds(figure, merged);
  for (const Curve& curve : merged) {
    if (curve.label.empty()) continue;
    if (!figure.legend.empty()) {
      if (curve.several) {
        several.push_back(LetterOf(several.size()) + ": " + curve.label);
      }
    } else if (!at_ends || !curve.merges) {
      named.push_back({curve.label, curve.style, curve.line || !curve.points});
    }
  }
  Append(Broken(named, width), &rows);
  Append(Broken(SignsOf(merged, failures), width), &rows);
  std::size_t letters = several.size();
  const auto list = [&] {
    std::string words = "coincide: ";
    for (std::size_t i = 0; i < letters; ++i) words += (i == 0 ? "" : ";  ") + several[i];
    if (letters < several.size()) words += letters == 0 ? "…" : ";  …";
    return Wrapped(words, static_cast<std::size_t>(width / kLetterWidth));
  };
  const auto has_room = [&] { return rows.size() + list().size() <= kLegendRows; };
  while (size == FigureSize::kOneColumn && letters > 0 && !has_room()) --letters;
  if (!several.empty()) {
    for (const std::string& line : list()) rows.push_back({TextItem(line)});
  }
  return {std::move(rows), letters};
}

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
namespace {

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

// Draws y ~ x^exponent at the height of the points between its ends.
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
  for (std::size_t i = 0; i < names.size(); ++i)
    ticks.push_back({static_cast<double>(i + 1), names[i]});
  return ticks;
}

// Returns heights at least a line apart, each as near as possible to the wanted height.
std::vector<double> Spread(std::vector<double> wanted, double low, double high) {
  std::vector<std::size_t> order(wanted.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
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

// Draws texts right of the panel, each with a thin line to the end of its curve.
std::string EndLabels(const PlotArea& area, const std::vector<std::vector<Point>>& points,
                      const std::vector<std::string>& texts, const GnuplotPage& page,
                      const PanelPlace& place) {
  constexpr double kLeader = 8.0;
  const double height = place.top - place.bottom;
  const std::size_t room = static_cast<std::size_t>(height / (0.9 * kLineHeight));
  std::vector<std::size_t> shown;
  std::vector<double> wanted;
  std::size_t left_out = 0;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    if (texts[i].empty() || points[i].empty()) continue;
    if (shown.size() + 1 >= room) {
      ++left_out;
      continue;
    }
    shown.push_back(i);
    wanted.push_back(place.bottom + height * area.y.Place(points[i].back().second));
  }
  const std::vector<double> heights =
      Spread(wanted, place.bottom + (left_out > 0 ? kLineHeight : 0.0), place.top);
  std::string commands;
  for (std::size_t k = 0; k < shown.size(); ++k) {
    const Point& end = points[shown[k]].back();
    commands += TextAt(page, texts[shown[k]], place.right + kLeader + 2.0, heights[k], "left");
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

}  // namespace

double WidthOfPage(FigureSize size) {
  return std::round(PointsOf(size == FigureSize::kOneColumn ? 85.0 : 178.0));
}

double HeightOfPanel(FigureSize size, std::size_t panels) {
  const double alone = size == FigureSize::kOneColumn ? 135.0 : 200.0;
  return panels == 1 ? alone : 0.7 * alone;
}

PlotArea AreaOf(const Figure& panel, FigureSize size) {
  AxisRange x(panel.log_x), y(panel.log_y);
  for (const Curve& curve : panel.curves) {
    for (std::size_t i = 0; i < std::min(curve.x.size(), curve.y.size()); ++i) {
      if (!Axis{.logarithmic = panel.log_x}.CanShow(curve.x[i]) ||
          !Axis{.logarithmic = panel.log_y}.CanShow(curve.y[i])) {
        continue;
      }
      x.Include(curve.x[i]);
      y.Include(curve.y[i]);
    }
    if (curve.ends_early && !curve.x.empty()) x.Include(curve.x.back());
    for (const Point& cross : curve.crosses) {
      x.Include(cross.first);
      y.Include(cross.second);
    }
  }
  const bool has_points = std::ranges::any_of(
      panel.curves, [](const Curve& curve) { return curve.points || !curve.crosses.empty(); });
  PlotArea area{.x = x.WithMargin(has_points ? 0.04 : 0.0),
                .y = y.WithMargin(has_points ? 0.08 : 0.04),
                .width = WidthOfPage(size) - 80.0,
                .height = HeightOfPanel(size, 1)};
  if (!panel.x_ticks.empty()) {
    area.x = {.low = 0.5, .high = static_cast<double>(panel.x_ticks.size()) + 0.5};
  }
  return area;
}

std::vector<Point> Drawable(const PlotArea& area, const Curve& curve) {
  std::vector<Point> points;
  for (std::size_t i = 0; i < std::min(curve.x.size(), curve.y.size()); ++i) {
    const Point point{curve.x[i], curve.y[i]};
    if (area.CanShow(point)) points.push_back(point);
  }
  return points;
}

double WidthOfLabels(const PlotArea& area) {
  double widest = 0.0;
  for (const Tick& tick : Ticks(area.y, 6)) widest = std::max(widest, WidthOf(tick.label));
  return widest;
}

std::string PanelScript(const Figure& panel, const std::vector<Curve>& curves,
                        const std::vector<std::string>& texts, const PlotArea& area,
                        const GnuplotPage& page, const PanelPlace& place, const std::string& name,
                        bool has_x_labels) {
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
  script += TicksCommand(
      'x', panel.x_ticks.empty() ? Ticks(area.x, most) : NamedTicks(panel.x_ticks), has_x_labels);
  script += TicksCommand('y', Ticks(area.y, 6), true);
  script +=
      TextAt(page, panel.y_label, 7.0, 0.5 * (place.bottom + place.top), "center rotate by 90");
  std::string plot;
  const auto add = [&plot](const std::string& element) {
    if (!element.empty()) plot += (plot.empty() ? "plot " : ", \\\n  ") + element;
  };
  std::vector<std::vector<Point>> points;
  Crosses crosses(area);
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const Curve& curve = curves[i];
    const std::vector<Point> all = Drawable(area, curve);
    points.push_back(curve.line ? Decimated(area, all) : all);
    const std::vector<Point>& own = points.back();
    script += crosses.Of(curve);
    if (own.empty()) continue;
    script += DataBlock(fmt::format("{}{}", name, i), own);
    if (curve.line) add(fmt::format("${}{} with lines {} notitle", name, i, LineLook(curve.style)));
    const bool marked = curve.style.shape != Shape::kNone || curve.style.flagged || curve.points;
    if (curve.points) {
      add(fmt::format("${}{} with points {} notitle", name, i, MarkLook(curve.style)));
    } else if (marked) {
      script += DataBlock(fmt::format("{}{}m", name, i), Marks(area, own, i, curves.size()));
      add(fmt::format("${}{}m with points {} notitle", name, i, MarkLook(curve.style)));
    }
    if (!curve.hollow.empty()) {
      // white marks first, over the curve's own marks
      CurveStyle inner = curve.style, outer = curve.style;
      inner.color = "#ffffff";
      outer.flagged = true;
      script += DataBlock(fmt::format("{}{}h", name, i), curve.hollow);
      for (const CurveStyle& style : {inner, outer}) {
        add(fmt::format("${}{}h with points {} notitle", name, i, MarkLook(style)));
      }
    }
    if (curve.guide && area.x.logarithmic && area.y.logarithmic) {
      add(GuideElement(*curve.guide, own));
    }
  }
  if (plot.empty()) add("NaN notitle");
  return script + EndLabels(area, points, texts, page, place) + plot + '\n';
}

}  // namespace loopbench::harness
