#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <span>
#include <string_view>
#include <utility>

#include "harness/base/text.h"
#include "harness/figures/figures.h"
#include "harness/judge/analysis.h"
#include "harness/judge/tables.h"

namespace loopbench::harness {
namespace {

// lengths in points from the lower left corner
constexpr double kMargin = 6.0, kRoom = 4.0;
constexpr double kShareWidth = 26.0;   // width of the numbers at the right
constexpr double kPageHeight = 680.0;  // usable page height, 240 mm

// From all rows hold (first) to no row holds (last). Letters are white on the last two.
constexpr std::array kShades = {"#ffffff", "#dfe5ec", "#b7c4d3", "#8599b0", "#4b6384", "#16294a"};

std::size_t ShadeOf(const FoldedCell& cell) {
  if (cell.judged == 0 || cell.holding == cell.judged) return 0;
  return 1 + static_cast<std::size_t>(std::floor((1.0 - cell.Share()) * 4.0));
}

/// Point type of gnuplot, or a text.
struct Glyph {
  int point = 0;
  double size = 0.0;
  const char* text = "";
  const char* meaning = "";
};

const Glyph& GlyphOf(CellState state) {
  // in the order of CellState
  static constexpr Glyph kGlyphs[] = {{7, 0.25, "", "holds"},
                                      {0, 0.0, "–", "not applicable"},
                                      {0, 0.0, "?", "not measured"},
                                      {8, 0.6, "", "ended with a named outcome"},
                                      {6, 0.55, "", "reached a limit of time or steps"},
                                      {2, 0.55, "", "finished, demand not met"},
                                      {3, 0.6, "", "crashed, or no result"}};
  return kGlyphs[static_cast<std::size_t>(state)];
}

class MapPainter {
 public:
  MapPainter(const RobustnessMap& map, FigureSize size) : map_(map), groups_(Folded(map)) {
    page_.width = WidthOfPage(size);
    const auto columns = static_cast<double>(map.rules.columns.size());
    label_width_ = 0.34 * page_.width;
    const double room = page_.width - 2 * kMargin - label_width_ - kShareWidth;
    cell_width_ = std::min(room / columns, 40.0);
    label_letters_ = static_cast<std::size_t>((label_width_ - kRoom) / kLetterWidth);
    std::size_t head = 1, lines = 1;
    for (const MapMethod& column : map.rules.columns)
      head = std::max(head, CountCharacters(column.label));
    for (const FoldedGroup& group : groups_) {
      lines = std::max(lines, Wrapped(group.label, label_letters_).size());
    }
    head_height_ = kLetterWidth * static_cast<double>(head) + kRoom;
    cell_height_ =
        std::max({kLineHeight * static_cast<double>(lines) + 1.0, 0.8 * cell_width_, 11.0});
    const double foot = kLineHeight * (size == FigureSize::kOneColumn ? 6.0 : 4.0) + kRoom;
    const auto height = [&] {
      return 2 * kMargin + 2 * kLineHeight + head_height_ + foot +
             cell_height_ * static_cast<double>(groups_.size());
    };
    if (height() > kPageHeight && !groups_.empty()) {
      cell_height_ -= (height() - kPageHeight) / static_cast<double>(groups_.size());
      cell_height_ = std::max(cell_height_, kLineHeight);
    }
    page_.height = std::round(height());
  }

  Drawing Draw() {
    double y = page_.height - kMargin - 0.5 * kLineHeight;
    Text(map_.rules.title, kMargin, y, "left");
    y -= 0.5 * kLineHeight + head_height_;
    for (std::size_t c = 0; c < map_.rules.columns.size(); ++c) {
      Text(map_.rules.columns[c].label, Left(c) + 0.5 * cell_width_, y + 0.5 * kRoom,
           "left rotate by 90");
    }
    Text("hold", Left(map_.rules.columns.size()) + kRoom, y + 0.5 * kLineHeight, "left");
    for (const FoldedGroup& group : groups_) {
      y -= cell_height_;
      DrawGroup(group, y);
    }
    DrawLegend(y - kRoom - 0.5 * kLineHeight);
    return {page_, fmt::format("set encoding utf8\nset margins 0,0,0,0\nunset border\nunset tics\n"
                               "unset key\nset xrange [0:1]\nset yrange [0:1]\n{}plot -1 notitle\n",
                               commands_)};
  }

 private:
  double Left(std::size_t column) const {
    return kMargin + label_width_ + cell_width_ * static_cast<double>(column);
  }

  void Text(const std::string& text, double x, double y, std::string_view options) {
    commands_ += TextAt(page_, text, x, y, fmt::format("{} front", options));
  }

  void Box(double x, double y, double width, double height, std::string_view look) {
    commands_ += fmt::format(
        "set object rect from screen {:.5f}, screen {:.5f} to screen {:.5f}, screen {:.5f} {}\n",
        x / page_.width, y / page_.height, (x + width) / page_.width, (y + height) / page_.height,
        look);
  }

  void Shade(double x, double y, double width, double height, std::size_t shade) {
    Box(x, y, width, height,
        fmt::format("fc rgb '{}' fs solid border rgb '#9aa5b1' lw 0.4", kShades[shade]));
  }

  void Draw(const Glyph& glyph, bool hollow, double x, double y, std::string_view color) {
    if (glyph.point == 0) {
      Text(glyph.text, x, y, fmt::format("center tc rgb '{}'", color));
      return;
    }
    // the type of a hollow circle is one below that of the filled one
    commands_ += TextAt(page_, "", x, y,
                        fmt::format("point pt {} ps {:g} lw 1.1 lc rgb '{}' front",
                                    hollow ? glyph.point - 1 : glyph.point, glyph.size, color));
  }

  void DrawGroup(const FoldedGroup& group, double y) {
    const std::vector<std::string> lines = Wrapped(group.label, label_letters_);
    double at = y + 0.5 * cell_height_ + 0.5 * kLineHeight * static_cast<double>(lines.size() - 1);
    for (const std::string& line : lines) {
      Text(line, kMargin, at, "left");
      at -= kLineHeight;
    }
    for (std::size_t c = 0; c < group.cells.size(); ++c) {
      const FoldedCell& cell = group.cells[c];
      const std::size_t shade = ShadeOf(cell);
      Shade(Left(c), y, cell_width_, cell_height_, shade);
      const bool hollow = cell.worst == CellState::kHolds && cell.with_warnings;
      warnings_ = warnings_ || hollow;
      Draw(GlyphOf(cell.worst), hollow, Left(c) + 0.5 * cell_width_, y + 0.5 * cell_height_,
           shade + 2 >= kShades.size() ? "#ffffff" : "#000000");
      if (!cell.fails_demand) continue;
      framed_ = true;
      Box(Left(c) + 1.0, y + 1.0, cell_width_ - 2.0, cell_height_ - 2.0,
          "front fs empty border rgb '#000000' lw 1.6");
    }
    Text(fmt::format("{:.0f} %", 100.0 * group.Share()), Left(group.cells.size()) + kRoom,
         y + 0.5 * cell_height_, "left");
  }

  void DrawLegend(double y) {
    const double left = kMargin;
    double x = left;
    const auto place = [&](const std::string& text, double sample) {
      const double width = sample + WidthOf(text) + 10.0;
      if (x > left && x + width > page_.width) {
        x = left;
        y -= kLineHeight;
      }
      const double at = x;
      x += width;
      return at;
    };
    const auto add = [&](const std::string& text, double sample, const auto& draw) {
      const double at = place(text, sample);
      draw(at);
      Text(text, at + sample, y, "left");
    };
    const auto words = [&](const std::string& text) { add(text, 0.0, [](double) {}); };
    const auto sign = [&](CellState state, bool hollow, const std::string& text) {
      add(text, 12.0, [&](double at) { Draw(GlyphOf(state), hollow, at + 5.0, y, "#000000"); });
    };
    words("rows of the extreme that hold:");
    constexpr const char* kShares[] = {"all", "3/4 and more", "1/2", "1/4", "fewer", "none"};
    for (std::size_t shade = 0; shade < kShades.size(); ++shade) {
      add(kShares[shade], 13.0, [&](double at) { Shade(at, y - 4.0, 10.0, 8.0, shade); });
    }
    x = left;
    y -= kLineHeight;
    words("the worst of them:");
    for (const CellState state : kCellStates) {
      const bool occurs = std::ranges::any_of(groups_, [state](const FoldedGroup& group) {
        return Contains(group.cells, state, &FoldedCell::worst);
      });
      if (occurs) sign(state, false, GlyphOf(state).meaning);
    }
    if (warnings_) sign(CellState::kHolds, true, "holds, with warnings");
    if (framed_) words("frame: must hold and does not");
  }

  const RobustnessMap& map_;
  std::vector<FoldedGroup> groups_;
  GnuplotPage page_;
  double label_width_ = 0.0, cell_width_ = 0.0, cell_height_ = 0.0, head_height_ = 0.0;
  std::size_t label_letters_ = 0;
  bool framed_ = false, warnings_ = false;
  std::string commands_;
};

}  // namespace

double FoldedCell::Share() const {
  return judged == 0 ? 1.0 : static_cast<double>(holding) / static_cast<double>(judged);
}

double FoldedGroup::Share() const {
  FoldedCell all;
  for (const FoldedCell& cell : cells) {
    all.holding += cell.holding;
    all.judged += cell.judged;
  }
  return all.Share();
}

std::vector<FoldedGroup> Folded(const RobustnessMap& map) {
  std::vector<FoldedGroup> groups;
  for (std::size_t g = 0; g < map.cells.size(); ++g) {
    const MapGroup& rules = map.rules.groups[g];
    FoldedGroup& group = groups.emplace_back();
    group.label = rules.short_label.empty() ? rules.label : rules.short_label;
    group.cells.resize(map.rules.columns.size());
    for (const std::vector<MapCell>& row : map.cells[g]) {
      for (std::size_t c = 0; c < row.size(); ++c) {
        FoldedCell& folded = group.cells[c];
        const MapCell& cell = row[c];
        if (cell.state != CellState::kNotApplicable) {
          folded.worst = folded.judged == 0 ? cell.state : std::max(folded.worst, cell.state);
          ++folded.judged;
        }
        folded.holding += cell.state == CellState::kHolds;
        folded.with_warnings = folded.with_warnings || cell.HoldsWithWarnings();
        folded.fails_demand =
            folded.fails_demand || (cell.demanded && cell.state != CellState::kHolds);
      }
    }
  }
  std::ranges::stable_sort(groups, {}, &FoldedGroup::Share);
  return groups;
}

Drawing DrawMap(const RobustnessMap& map, FigureSize size) { return MapPainter(map, size).Draw(); }

namespace {

using Rows = std::vector<const WorkPrecisionRow*>;

/// Groups rows that agree in these keys, in the order of the figure's rows.
std::map<std::string, Rows> RowsBy(std::span<const char* const> keys, const Rows& rows) {
  std::map<std::string, Rows> groups;
  for (const WorkPrecisionRow* row : rows) groups[ValuesOf(row->record, keys)].push_back(row);
  return groups;
}

std::vector<Record> RecordsOf(const Rows& rows) {
  return Mapped<Record>(rows, &WorkPrecisionRow::record);
}

/// Returns the rows with an integrator, or with any ("").
Rows RowsWith(const WorkPrecisionProblem& problem, const std::string& integrator) {
  Rows rows;
  for (const WorkPrecisionRow& row : problem.rows) {
    if (integrator.empty() || row.record.Text("integrator") == integrator) rows.push_back(&row);
  }
  return rows;
}

/// Draws runs as marks of `sound`: error over `x`, hollow with warnings. Failed runs are crosses
/// there, or at the cost reached. A line joins sound runs only if no two of them share an x.
template <class X>
void AddRuns(const Rows& rows, X x, Curve sound, Figure* figure) {
  sound.points = true;
  sound.style.flagged = false;
  Curve flagged = sound;
  flagged.label = "";
  flagged.line = false;
  flagged.style.flagged = true;
  for (const WorkPrecisionRow* row : rows) {
    double at = x(*row);
    if (HasFailed(row->record)) {
      if (!std::isfinite(at))
        at = std::isfinite(row->cost) ? row->cost : row->record.Number("cpu_s");
      sound.crosses.emplace_back(at, kNoNumber);
      continue;
    }
    Curve& curve = HasWarning(row->record) ? flagged : sound;
    curve.x.push_back(at);
    curve.y.push_back(row->error);
  }
  sound.line = sound.line && std::ranges::adjacent_find(sound.x) == sound.x.end();
  if (!flagged.x.empty()) figure->curves.push_back(std::move(flagged));
  figure->curves.push_back(std::move(sound));
}

/// Draws a line through the non-dominated compared runs of a formulation and level.
void AddBest(const Rows& rows, Figure* figure) {
  const Record& first = rows.front()->record;
  Curve best{.label = first.Text("formulation") + ", " + first.Text("enforcement"),
             .style = StyleOf(first)};
  best.style.shape = Shape::kNone;
  best.style.width = 1.2;
  best.style.flagged = false;
  double least = std::numeric_limits<double>::infinity();
  for (const WorkPrecisionRow* row : rows) {
    if (HasFailed(row->record) || !row->reason.empty() || !(row->error < least)) continue;
    least = row->error;
    best.x.push_back(row->cost);
    best.y.push_back(row->error);
  }
  if (best.x.size() > 1) figure->curves.push_back(std::move(best));
}

Figure ErrorFigure(const std::string& title, const std::string& x_label,
                   const WorkPrecision& work_precision) {
  return {.title = title,
          .x_label = x_label,
          .y_label = WithUnit(work_precision.error),
          .log_x = true,
          .log_y = true};
}

LegendRow RowOf(const Curve& line) { return {{line.label, line.style}}; }

/// Draws stairs: between two rows of the front, the cheaper one applies.
Curve Stairs(const WorkPrecisionProblem& problem) {
  Curve stairs{.label = "Pareto front", .style = {.width = 0.6}, .merges = false};
  for (const WorkPrecisionRow& row : problem.rows) {
    if (!row.on_front) continue;
    if (!stairs.y.empty()) {
      stairs.x.push_back(row.cost);
      stairs.y.push_back(stairs.y.back());
    }
    stairs.x.push_back(row.cost);
    stairs.y.push_back(row.error);
  }
  return stairs;
}

std::set<std::string> IntegratorsOf(const WorkPrecisionProblem& problem) {
  std::set<std::string> names;
  for (const WorkPrecisionRow& row : problem.rows) names.insert(row.record.Text("integrator"));
  return names;
}

/// Draws vertical lines at the trust horizon: the smallest and, if runs differ, the largest.
std::vector<Curve> TrustLines(const Rows& rows, const std::vector<Curve>& curves) {
  double low = std::numeric_limits<double>::infinity(), high = 0.0;
  for (const Curve& curve : curves) {
    for (const double value : curve.y) {
      if (value > 0.0) low = std::min(low, value), high = std::max(high, value);
    }
  }
  std::set<double> ends;
  for (const WorkPrecisionRow* row : rows) {
    const double end = row->record.Number("reference_valid_until");
    if (std::isfinite(end)) ends.insert(end);
  }
  std::vector<Curve> lines;
  if (!(high > low)) return lines;
  while (ends.size() > 2) ends.erase(std::next(ends.begin()));
  for (const double end : ends) {
    lines.push_back({.label = lines.empty() ? "validity limit of the reference" : "",
                     .x = {end, end},
                     .y = {low, high},
                     .style = {.color = "#606060", .width = 1.0},
                     .merges = false});
  }
  return lines;
}

/// Returns true if any part can be drawn on logarithmic axes, or over time.
bool HasPoint(const Curve& curve) {
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    if (std::isfinite(curve.x[i]) && std::isfinite(curve.y[i]) && curve.y[i] > 0.0) return true;
  }
  return false;
}

std::string Slug(const std::string& text) {
  std::string slug;
  for (const char c : text) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       c == '.' || c == '_' || c == '+';
    if (plain) slug += c;
    if (!plain && !slug.empty() && slug.back() != '-') slug += '-';
  }
  return slug;
}

}  // namespace

Figure WorkPrecisionFigure(const WorkPrecision& work_precision,
                           const WorkPrecisionProblem& problem) {
  Figure figure = ErrorFigure(problem.name + ": error against cost", WithUnit(work_precision.cost),
                              work_precision);
  const Rows rows = RowsWith(problem, "");
  figure.legend = ChannelLegend(RecordsOf(rows));
  constexpr const char* kHueAndMark[] = {"formulation", "coordinates"};
  constexpr const char* kHueAndDash[] = {"formulation", "enforcement"};
  const auto cost = [](const WorkPrecisionRow& row) { return row.cost; };
  for (const auto& [name, own] : RowsBy(kHueAndMark, rows)) {
    AddRuns(own, cost, {.style = StyleOf(own.front()->record), .line = false}, &figure);
  }
  for (const auto& [name, own] : RowsBy(kHueAndDash, rows)) AddBest(own, &figure);
  figure.curves.push_back(Stairs(problem));
  figure.legend.push_back(RowOf(figure.curves.back()));
  return figure;
}

Figure ToleranceFigure(const WorkPrecision& work_precision, const WorkPrecisionProblem& problem,
                       const std::string& integrator) {
  Figure figure =
      ErrorFigure(fmt::format("{}, {}: is the tolerance honoured?", problem.name, integrator),
                  "tolerance", work_precision);
  Rows rows = RowsWith(problem, integrator);
  const auto rtol = [](const WorkPrecisionRow& row) { return row.record.Number("rtol"); };
  std::erase_if(rows, [&](const auto* row) { return std::isnan(rtol(*row)); });
  if (rows.empty()) return figure;
  std::ranges::stable_sort(rows, std::less(), [&](const auto* row) { return rtol(*row); });
  const std::vector<Record> records = RecordsOf(rows);
  figure.legend = ChannelLegend(records);
  for (const auto& [name, own] : RowsBy(kChannelKeys, rows)) {
    const Record& first = own.front()->record;
    AddRuns(own, rtol, {.label = MethodLabel(first, records), .style = StyleOf(first)}, &figure);
  }
  const bool is_length =
      IsErrorOfPositions(work_precision.error) || UnitOf(ColumnOf(work_precision.error, {})) == "m";
  const double length = rows.front()->record.Number("link_length");
  const double scale = is_length && length > 0.0 ? length : 1.0;
  Curve honoured{.label = is_length ? "error = tolerance x link" : "error = tolerance",
                 .style = {.width = 0.6},
                 .merges = false};
  for (const WorkPrecisionRow* row : {rows.front(), rows.back()}) {
    honoured.x.push_back(rtol(*row));
    honoured.y.push_back(scale * rtol(*row));
  }
  figure.legend.push_back(RowOf(honoured));
  figure.curves.push_back(std::move(honoured));
  return figure;
}

Figure ErrorOverTimeFigure(const WorkPrecisionProblem& problem, const std::string& integrator) {
  double finest = std::numeric_limits<double>::infinity();
  Rows rows;
  for (const WorkPrecisionRow* row : RowsWith(problem, integrator)) {
    const double rtol = row->record.Number("rtol");
    if (row->record.Numbers("series.error").empty() || !(rtol <= finest)) continue;
    if (rtol < finest) rows.clear();
    finest = rtol;
    rows.push_back(row);
  }
  Figure figure{.title = fmt::format("{}, {}, rtol {}: error over time", problem.name, integrator,
                                     NumberText(finest)),
                .x_label = "time [s]",
                .y_label = "error of positions [m]",
                .log_x = false,
                .log_y = true};
  AddRunsOverTime(RecordsOf(rows), "series.error_t", "series.error", &figure);
  for (Curve& line : TrustLines(rows, figure.curves)) {
    if (!line.label.empty()) figure.legend.push_back(RowOf(line));
    figure.curves.push_back(std::move(line));
  }
  return figure;
}

namespace {

/// Returns the exponent of y ~ x^p by least squares; NaN for fewer than two different x.
double Slope(const Curve& curve) {
  double sum_x = 0.0, sum_y = 0.0, sum_xx = 0.0, sum_xy = 0.0;
  const double n = static_cast<double>(curve.x.size());
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    const double x = std::log(curve.x[i]), y = std::log(curve.y[i]);
    sum_x += x, sum_y += y, sum_xx += x * x, sum_xy += x * y;
  }
  const double spread = n * sum_xx - sum_x * sum_x;
  return spread > 1e-12 * n * sum_xx ? (n * sum_xy - sum_x * sum_y) / spread : kNoNumber;
}

/// Draws the error of one method, with a curve for each integrator: over the fixed step with the
/// observed orders, or over the cost.
Figure IntegratorsFigure(const WorkPrecision& work_precision, const std::string& title,
                         const Rows& rows, bool over_step) {
  Figure figure =
      ErrorFigure(title, over_step ? "step [s]" : WithUnit(work_precision.cost), work_precision);
  constexpr const char* kIntegrator[] = {"integrator"};
  for (auto [name, own] : RowsBy(kIntegrator, rows)) {
    const std::string label = own.front()->record.Text("integrator");
    const auto x = [&](const WorkPrecisionRow& row) {
      return over_step ? row.record.Number("step") : row.cost;
    };
    std::ranges::stable_sort(own, std::less(), [&](const auto* row) { return x(*row); });
    AddRuns(own, x, {.label = label, .style = DistinctStyle(figure.curves.size())}, &figure);
    Curve& curve = figure.curves.back();
    const double order = over_step ? Slope(curve) : kNoNumber;
    if (std::isfinite(order)) curve.label += fmt::format(", order {:.2f}", order);
  }
  return figure;
}

}  // namespace

std::vector<NamedFigure> WorkPrecisionFigures(const WorkPrecision& work_precision) {
  std::vector<NamedFigure> figures;
  std::set<std::string> taken;
  const auto add = [&](const std::string& kind, const std::string& what, Figure figure) {
    // a failed run alone has no error for an axis, and stairs or lines alone have no meaning
    const bool anything = std::ranges::any_of(figure.curves, [](const Curve& curve) {
      return (curve.merges || !curve.line) && HasPoint(curve);
    });
    if (!anything) return;
    std::string name = kind + Slug(what);
    if (!taken.insert(name).second) name = kind + what;  // with a hash in its file name
    figures.push_back({name, std::move(figure)});
  };
  for (const WorkPrecisionProblem& problem : work_precision.problems) {
    add("work-precision-", problem.name, WorkPrecisionFigure(work_precision, problem));
    const bool several = IntegratorsOf(problem).size() > 1;
    const std::vector<Record> all = RecordsOf(RowsWith(problem, ""));
    for (const auto& [name, rows] : RowsBy(kChannelKeys, RowsWith(problem, ""))) {
      const std::string what =
          fmt::format("{}, {}", problem.name, MethodLabel(rows.front()->record, all));
      // a curve joins runs of one kind: at tolerances, or else at fixed steps
      Rows fixed, adaptive;
      for (const WorkPrecisionRow* row : rows) {
        (row->record.Number("step") > 0.0 ? fixed : adaptive).push_back(row);
      }
      if (several) {
        add("integrators-", what,
            IntegratorsFigure(work_precision, what, adaptive.empty() ? fixed : adaptive, false));
      }
      if (!IsAlike(RecordsOf(fixed), "step")) {
        add("order-", what, IntegratorsFigure(work_precision, what + ": order", fixed, true));
      }
    }
    for (const std::string& integrator : IntegratorsOf(problem)) {
      const std::string what = problem.name + " " + integrator;
      add("tolerance-", what, ToleranceFigure(work_precision, problem, integrator));
      add("error-", what, ErrorOverTimeFigure(problem, integrator));
    }
  }
  return figures;
}

}  // namespace loopbench::harness
