#include "harness/figures/figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>

#include "harness/config/experiment.h"
#include "harness/config/formulations.h"
#include "harness/judge/analysis.h"
#include "harness/judge/tables.h"

namespace loopbench::harness {
namespace {

/// Panel with the properties taken from its figure.
struct Panel {
  Figure figure;
  std::vector<Curve> curves;
  std::vector<std::string> texts;
  PlotArea area;
};

std::vector<Panel> PanelsOf(const Figure& figure, FigureSize size) {
  std::vector<Panel> panels;
  const auto add = [&](Figure own) {
    own.log_x = figure.log_x;
    own.x_ticks = figure.x_ticks;
    own.below.clear();
    panels.push_back({own, MergedCurves(own, size), {}, AreaOf(own, size)});
  };
  add(figure);
  for (const Figure& below : figure.below) add(below);
  // one axis for all panels
  AxisRange x(figure.log_x);
  for (const Panel& panel : panels) {
    x.Include(panel.area.x.low);
    x.Include(panel.area.x.high);
  }
  for (Panel& panel : panels) {
    if (figure.x_ticks.empty()) panel.area.x = x.WithMargin(0.0);
  }
  return panels;
}

bool HasAnything(const Figure& panel) {
  const PlotArea area = AreaOf(panel, FigureSize::kTwoColumn);
  return std::ranges::any_of(panel.curves, [&](const Curve& curve) {
    return !Drawable(area, curve).empty() || !curve.crosses.empty();
  });
}

}  // namespace

CurveStyle DistinctStyle(std::size_t index) {
  // Okabe and Ito's palette, dark and light colours alternating, and an olive
  constexpr std::array<const char*, 8> kPalette = {"#000000", "#E69F00", "#0072B2", "#CC79A7",
                                                   "#009E73", "#D55E00", "#56B4E9", "#999933"};
  constexpr std::array<Shape, 5> kShapes = {Shape::kCircle, Shape::kTriangle, Shape::kSquare,
                                            Shape::kDiamond, Shape::kTriangleDown};
  return {.color = kPalette[index % kPalette.size()], .shape = kShapes[index % kShapes.size()]};
}

FigureScript GnuplotScript(const Figure& figure, FigureSize size) {
  std::vector<Panel> panels = PanelsOf(figure, size);
  GnuplotPage page{.width = WidthOfPage(size)};
  std::vector<Curve> all;
  for (const Panel& panel : panels) all.insert(all.end(), panel.curves.begin(), panel.curves.end());
  const bool names = std::ranges::any_of(
      panels, [&](const Panel& panel) { return NamesAtEnds(figure, panel.curves); });
  Figure named = figure;
  named.names_at_ends = names;
  std::vector<bool> is_drawn;
  std::vector<std::string> failures;  // failures of runs without a curve
  for (const Panel& panel : panels) {
    for (const Curve& curve : panel.curves) {
      is_drawn.push_back(!Drawable(panel.area, curve).empty());
      if (is_drawn.back() || curve.remark.empty()) continue;
      const bool is_new = std::ranges::find(failures, curve.remark) == failures.end();
      if (is_new && curve.ends_early) failures.push_back(curve.remark);
    }
  }
  const Legend legend = LegendOf(named, all, size, failures);
  const std::vector<std::string> texts = EndTexts(figure, all, names, legend.letters);
  double labels = 0.0, ends = 0.0;
  std::size_t next = 0;
  for (Panel& panel : panels) {
    labels = std::max(labels, WidthOfLabels(panel.area));
    for (std::size_t i = 0; i < panel.curves.size(); ++i, ++next) {
      panel.texts.push_back(is_drawn[next] ? texts[next] : "");
      ends = std::max(ends, WidthOf(panel.texts.back()));
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
  std::string commands = "set encoding utf8\n";
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
    const Panel& panel = panels[i];
    if (i > 0) commands += "unset label\nunset arrow\nunset logscale\n";
    commands += PanelScript(panel.figure, panel.curves, panel.texts, panel.area, page, place,
                            std::string(1, static_cast<char>('c' + i)), i + 1 == panels.size());
    place.top = place.bottom - kGap;
  }
  if (panels.size() > 1) commands += "unset multiplot\n";
  return {commands, page.height, legend.rows.size()};
}

std::optional<std::string> WriteFigure(const std::filesystem::path& path, const Figure& figure,
                                       FigureSize size, const std::string& gnuplot) {
  if (!HasAnything(figure) && std::ranges::none_of(figure.below, HasAnything)) {
    return fmt::format("{}: no curve has a point to draw", path.string());
  }
  const FigureScript script = GnuplotScript(figure, size);
  return DrawWithGnuplot(path, {WidthOfPage(size), script.height}, script.commands, gnuplot);
}
namespace {

constexpr const char* kNeutral = "#707070";  // for samples whose meaning is not their hue

std::string ColorOf(const Record& record) {
  const FormulationRow* row = FindFormulation(record.Text("formulation"));
  return row == nullptr ? kNeutral : row->color;  // formulation of another program
}

std::size_t DashOf(const Record& record) {
  const auto level = Parse<Enforcement>(record.Text("enforcement"));
  return static_cast<std::size_t>(level.value_or(Enforcement())) % kDashes;
}

Shape ShapeOf(const Record& record) {
  return record.Text("coordinates") == "absolute" ? Shape::kTriangle : Shape::kCircle;
}

double WidthOfSolver(const Record& record) {
  return record.Text("solver") == ToString(SolverKind::kAsPublished) ? 0.7 : 1.5;
}

/// Returns the legend item of a channel for a run.
LegendItem ItemOf(const Record& record, std::string_view key) {
  const CurveStyle style = StyleOf(record);
  LegendItem item{.text = record.Text(key), .style = {.color = kNeutral}};
  if (key == "formulation") item.style = {.color = style.color, .width = 2.5};
  if (key == "enforcement") item.style.dash = style.dash;
  if (key == "solver") item.style.width = style.width;
  if (key == "coordinates") {
    item.style.shape = style.shape;
    item.line = false;
  }
  return item;
}

/// Returns one item per value, in the order of the records.
LegendRow ItemsOf(std::span<const Record> records, const std::string& key) {
  LegendRow row;
  for (const Record& record : records) {
    LegendItem item = ItemOf(record, key);
    const bool is_new =
        std::ranges::none_of(row, [&](const LegendItem& other) { return other.text == item.text; });
    if (is_new && !record.Text(key).empty()) row.push_back(std::move(item));
  }
  return row;
}

}  // namespace

bool Varies(std::span<const Record> records, const std::string& key) {
  return std::ranges::any_of(
      records, [&](const Record& record) { return record.Text(key) != records[0].Text(key); });
}

CurveStyle StyleOf(const Record& record) {
  return {.color = ColorOf(record),
          .dash = DashOf(record),
          .width = WidthOfSolver(record),
          .shape = ShapeOf(record),
          .flagged = HasWarning(record)};
}

Curve CurveOverTime(const Record& record, const std::string& x, const std::string& y,
                    const std::string& label, const CurveStyle& style) {
  Curve curve{.label = label, .x = record.Numbers(x), .y = record.Numbers(y), .style = style};
  curve.ends_early = HasFailed(record);
  if (curve.ends_early && curve.x.empty() && x.ends_with('t')) {
    curve.x = {record.Number("t_reached")};
    curve.y = {std::numeric_limits<double>::quiet_NaN()};
  }
  return curve;
}

std::string MethodLabel(const Record& record, std::span<const Record> all) {
  std::string label;
  for (const char* key : kChannelKeys) {
    if (Varies(all, key)) label += (label.empty() ? "" : ", ") + record.Text(key);
  }
  return label.empty() ? record.Text("formulation") : label;
}

std::vector<LegendRow> ChannelLegend(std::span<const Record> records) {
  std::vector<LegendRow> rows;
  if (LegendRow hues = ItemsOf(records, "formulation"); !hues.empty())
    rows.push_back(std::move(hues));
  if (Varies(records, "enforcement")) rows.push_back(ItemsOf(records, "enforcement"));
  LegendRow others;
  for (const char* key : {"coordinates", "solver"}) {
    if (!Varies(records, key)) continue;
    for (LegendItem& item : ItemsOf(records, key)) others.push_back(std::move(item));
  }
  if (!others.empty()) rows.push_back(std::move(others));
  return rows;
}

}  // namespace loopbench::harness
