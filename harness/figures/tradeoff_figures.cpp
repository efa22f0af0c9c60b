#include "harness/figures/tradeoff_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "harness/tables/columns.h"
#include "harness/tables/table.h"

namespace loopbench::harness {
namespace {

constexpr double kNowhere = std::numeric_limits<double>::quiet_NaN();

/// Rows of one formulation and level, in order of cost.
struct MethodRows {
  std::string name;
  std::vector<const TradeoffRow*> rows;
  std::size_t formulation = 0;  ///< its place among those of the figure
};

std::vector<MethodRows> RowsByMethod(const std::vector<const TradeoffRow*>& rows) {
  std::map<std::string, std::vector<const TradeoffRow*>> methods;
  for (const TradeoffRow* row : rows) {
    methods[row->record.Text("formulation") + ", " + row->record.Text("enforcement")].push_back(
        row);
  }
  std::vector<MethodRows> result;
  std::set<std::string> formulations;
  for (auto& [name, own] : methods) {
    formulations.insert(own.front()->record.Text("formulation"));
    result.push_back({name, std::move(own), formulations.size() - 1});
  }
  return result;
}

std::vector<const TradeoffRow*> RowsWith(const TradeoffProblem& problem,
                                         const std::string& integrator) {
  std::vector<const TradeoffRow*> rows;
  for (const TradeoffRow& row : problem.rows) {
    const bool is_one = integrator.empty() || row.record.Text("integrator") == integrator;
    if (is_one) rows.push_back(&row);
  }
  return rows;
}

bool IsDoubted(const TradeoffRow& row) {
  return !HasFailed(row.record) && !row.record.Text("doubts").empty();
}

/// The look of a formulation and level, whichever coordinates and solver.
CurveStyle StyleOfMethod(const MethodRows& method) {
  Record record = method.rows.front()->record;
  record.Set("coordinates", std::string("joint"));
  record.Set("solver", std::string("rank-revealing"));
  record.Set("doubts", std::string());
  CurveStyle style = StyleOf(record);
  // formulations differ in the width of lines and the size of marks too, for those who see no hues
  constexpr std::array<double, 5> kWidths = {3.0, 1.8, 1.0, 0.7, 0.5};
  style.width = kWidths[std::min(method.formulation, kWidths.size() - 1)];
  return style;
}

std::string LabelOfAxis(const std::string& key) {
  const std::string unit = UnitOf(ColumnOf(key, {}));
  return unit.empty() ? key : fmt::format("{} [{}]", key, unit);
}

/// What a run that failed had cost by then.
double SpentBy(const TradeoffRow& row) {
  if (std::isfinite(row.cost)) return row.cost;
  return row.record.Number("cpu_s");
}

/// Marks of the sound rows, a line through those that no other of them beats, marks and dashes of
/// the doubtful ones, crosses of those that failed.
template <class X>
void AddMethod(const MethodRows& method, bool only_best, X x, double x_of_crosses, Figure* figure) {
  Curve sound{.label = method.name, .style = StyleOfMethod(method)};
  sound.points = sound.own_marks = true;
  sound.line = !only_best;
  Curve doubted = sound, best;
  doubted.label = "";
  doubted.style.filled = false;
  doubted.style.doubtful = doubted.line = only_best;
  best.style = sound.style;
  best.style.shape = Shape::kNone;
  double least = std::numeric_limits<double>::infinity();
  for (const TradeoffRow* row : method.rows) {
    if (HasFailed(row->record)) {
      sound.crosses.emplace_back(std::isnan(x_of_crosses) ? SpentBy(*row) : x(*row), kNowhere);
      continue;
    }
    Curve& curve = IsDoubted(*row) ? doubted : sound;
    curve.x.push_back(x(*row));
    curve.y.push_back(row->error);
    if (!row->reason.empty() || !(row->error < least)) continue;
    least = row->error;
    best.x.push_back(x(*row));
    best.y.push_back(row->error);
  }
  // several runs at one place are a cloud, through which no line goes
  std::vector<double> places = sound.x;
  std::ranges::sort(places);
  if (std::ranges::adjacent_find(places) != places.end()) sound.line = false;
  if (!doubted.x.empty()) figure->curves.push_back(std::move(doubted));
  if (only_best && best.x.size() > 1) figure->curves.push_back(std::move(best));
  figure->curves.push_back(std::move(sound));
}

/// From one row of the front to the next the cheaper one serves.
Curve Stairs(const TradeoffProblem& problem) {
  Curve stairs{.label = "Pareto front", .style = {.width = 1.0}};
  for (const TradeoffRow& row : problem.rows) {
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

bool HasDoubtedRow(const std::vector<const TradeoffRow*>& rows) {
  return std::ranges::any_of(rows, [](const TradeoffRow* row) { return IsDoubted(*row); });
}

std::vector<std::string> IntegratorsOfRows(const TradeoffProblem& problem) {
  std::set<std::string> names;
  for (const TradeoffRow& row : problem.rows) names.insert(row.record.Text("integrator"));
  return {names.begin(), names.end()};
}

/// Upright, at the end of what can be trusted: the least and, where runs differ, the largest.
std::vector<Curve> TrustLines(const std::vector<const TradeoffRow*>& rows,
                              const std::vector<Curve>& curves) {
  double low = std::numeric_limits<double>::infinity(), high = 0.0;
  for (const Curve& curve : curves) {
    for (const double value : curve.y) {
      if (value > 0.0) low = std::min(low, value), high = std::max(high, value);
    }
  }
  std::set<double> ends;
  for (const TradeoffRow* row : rows) {
    const double end = row->record.Number("trust_horizon");
    if (std::isfinite(end)) ends.insert(end);
  }
  std::vector<Curve> lines;
  if (!(high > low)) return lines;
  while (ends.size() > 2) ends.erase(std::next(ends.begin()));
  for (const double end : ends) {
    lines.push_back({.label = lines.empty() ? "trust horizon" : "",
                     .x = {end, end},
                     .y = {low, high},
                     .style = {.color = "#606060", .width = 1.5}});
  }
  return lines;
}

/// Whether anything of it can be drawn on logarithmic axes, or over time.
bool HasPoint(const Curve& curve) {
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    if (std::isfinite(curve.x[i]) && std::isfinite(curve.y[i]) && curve.y[i] > 0.0) return true;
  }
  return false;
}

/// For a file: letters, digits and '-'.
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

Figure WorkPrecisionFigure(const Tradeoff& tradeoff, const TradeoffProblem& problem) {
  Figure figure{.title = problem.name + ": what accuracy costs",
                .x_label = LabelOfAxis(tradeoff.cost),
                .y_label = LabelOfAxis(tradeoff.error),
                .log_x = true,
                .log_y = true,
                .curves = {}};
  const auto rows = RowsWith(problem, "");
  const auto cost = [](const TradeoffRow& row) { return row.cost; };
  for (const MethodRows& method : RowsByMethod(rows)) {
    AddMethod(method, true, cost, kNowhere, &figure);
  }
  figure.curves.push_back(Stairs(problem));
  if (HasDoubtedRow(rows)) figure.legend_title = "open marks";  // "; dashed: doubtful"
  return figure;
}

Figure ToleranceFigure(const Tradeoff& tradeoff, const TradeoffProblem& problem,
                       const std::string& integrator) {
  Figure figure{
      .title = fmt::format("{}, {}: is the tolerance honoured?", problem.name, integrator),
      .x_label = "tolerance",
      .y_label = LabelOfAxis(tradeoff.error),
      .log_x = true,
      .log_y = true,
      .curves = {}};
  std::vector<const TradeoffRow*> rows = RowsWith(problem, integrator);
  std::erase_if(rows,
                [](const TradeoffRow* row) { return std::isnan(row->record.Number("rtol")); });
  if (rows.empty()) return figure;
  const auto rtol = [](const TradeoffRow& row) { return row.record.Number("rtol"); };
  std::ranges::stable_sort(rows, std::less(), [&](const TradeoffRow* row) { return rtol(*row); });
  for (const MethodRows& method : RowsByMethod(rows)) AddMethod(method, false, rtol, 0.0, &figure);
  const bool is_length =
      IsErrorOfPositions(tradeoff.error) || UnitOf(ColumnOf(tradeoff.error, {})) == "m";
  const double length = rows.front()->record.Number("link_length");
  const double scale = is_length && length > 0.0 ? length : 1.0;
  Curve honoured{.label = is_length ? "error = tolerance x link" : "error = tolerance"};
  honoured.style.width = 1.0;
  for (const TradeoffRow* row : {rows.front(), rows.back()}) {
    honoured.x.push_back(rtol(*row));
    honoured.y.push_back(scale * rtol(*row));
  }
  figure.curves.push_back(std::move(honoured));
  if (HasDoubtedRow(rows)) figure.legend_title = "open marks: doubtful";
  return figure;
}

Figure ErrorOverTimeFigure(const TradeoffProblem& problem, const std::string& integrator) {
  double finest = std::numeric_limits<double>::infinity();
  std::vector<const TradeoffRow*> rows;
  for (const TradeoffRow* row : RowsWith(problem, integrator)) {
    const double rtol = row->record.Number("rtol");
    if (row->record.Numbers("series.error").empty() || !(rtol <= finest)) continue;
    if (rtol < finest) rows.clear();
    finest = rtol;
    rows.push_back(row);
  }
  Figure figure{.title = fmt::format("{}, {}, rtol {}: error over time", problem.name, integrator,
                                     rows.empty() ? "" : rows.front()->record.Text("rtol")),
                .x_label = "time [s]",
                .y_label = "error of positions [m]",
                .log_x = false,
                .log_y = true,
                .curves = {}};
  std::set<std::string> labels;
  for (const TradeoffRow* row : rows) {
    Curve curve;
    curve.label = fmt::format("{}, {}, {}", row->record.Text("formulation"),
                              row->record.Text("enforcement"), row->record.Text("coordinates"));
    // of several solvers the second has the same look but for its marks
    if (!labels.insert(curve.label).second) curve.label += ", " + row->record.Text("solver");
    curve.x = row->record.Numbers("series.error_t");
    curve.y = row->record.Numbers("series.error");
    curve.style = StyleOf(row->record);
    curve.ends_early = HasFailed(row->record);
    figure.curves.push_back(std::move(curve));
  }
  // wide ones first: those that agree with them are seen on them
  std::ranges::stable_sort(figure.curves, std::greater(),
                           [](const Curve& curve) { return curve.style.width; });
  for (Curve& line : TrustLines(rows, figure.curves)) figure.curves.push_back(std::move(line));
  return figure;
}

std::vector<NamedFigure> TradeoffFigures(const Tradeoff& tradeoff) {
  std::vector<NamedFigure> figures;
  std::set<std::string> taken;
  const auto add = [&](const std::string& kind, const std::string& what, Figure figure) {
    // a failed run alone has no error that an axis could show, nor have stairs or lines a meaning
    const bool anything = std::ranges::any_of(figure.curves, [](const Curve& curve) {
      return curve.style.color != "#000000" && HasPoint(curve);
    });
    if (!anything) return;
    std::string name = kind + Slug(what);
    if (!taken.insert(name).second) name = kind + what;  // with a hash in its file's name
    figures.push_back({name, std::move(figure)});
  };
  for (const TradeoffProblem& problem : tradeoff.problems) {
    add("work-precision-", problem.name, WorkPrecisionFigure(tradeoff, problem));
    for (const std::string& integrator : IntegratorsOfRows(problem)) {
      const std::string what = problem.name + " " + integrator;
      add("tolerance-", what, ToleranceFigure(tradeoff, problem, integrator));
      add("error-", what, ErrorOverTimeFigure(problem, integrator));
    }
  }
  return figures;
}

}  // namespace loopbench::harness
