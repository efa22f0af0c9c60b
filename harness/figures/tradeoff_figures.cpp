#include "harness/figures/tradeoff_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <span>
#include <utility>

#include "harness/figures/axis.h"
#include "harness/figures/channels.h"
#include "harness/tables/columns.h"
#include "harness/tables/table.h"

namespace loopbench::harness {
namespace {

constexpr double kNowhere = std::numeric_limits<double>::quiet_NaN();

using Rows = std::vector<const TradeoffRow*>;

/// Rows that agree in these keys, in the order of the figure's.
std::map<std::string, Rows> RowsBy(std::span<const char* const> keys, const Rows& rows) {
  std::map<std::string, Rows> groups;
  for (const TradeoffRow* row : rows) {
    std::string name;
    for (const char* key : keys) name += row->record.Text(key) + '\n';
    groups[name].push_back(row);
  }
  return groups;
}

std::vector<Record> RecordsOf(const Rows& rows) {
  std::vector<Record> records;
  for (const TradeoffRow* row : rows) records.push_back(row->record);
  return records;
}

Rows RowsWith(const TradeoffProblem& problem, const std::string& integrator) {
  Rows rows;
  for (const TradeoffRow& row : problem.rows) {
    const bool is_one = integrator.empty() || row.record.Text("integrator") == integrator;
    if (is_one) rows.push_back(&row);
  }
  return rows;
}

bool IsDoubted(const TradeoffRow& row) {
  return !HasFailed(row.record) && !row.record.Text("doubts").empty();
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

/// A run's error over `x`; failed runs are crosses there, or where they had come to.
template <class X>
void AddPoint(const TradeoffRow& row, X x, Curve* sound, Curve* doubted) {
  if (HasFailed(row.record)) {
    const double at = x(row);
    sound->crosses.emplace_back(std::isfinite(at) ? at : SpentBy(row), kNowhere);
    return;
  }
  Curve& curve = IsDoubted(row) ? *doubted : *sound;
  curve.x.push_back(x(row));
  curve.y.push_back(row.error);
}

/// All runs of a formulation in one coordinate set as marks, the doubtful ones hollow.
void AddCloud(const Rows& rows, Figure* figure) {
  Curve sound{.style = StyleOf(rows.front()->record), .points = true, .line = false};
  sound.style.doubtful = false;
  Curve doubted = sound;
  doubted.style.doubtful = true;
  for (const TradeoffRow* row : rows) {
    AddPoint(
        *row, [](const TradeoffRow& one) { return one.cost; }, &sound, &doubted);
  }
  if (!doubted.x.empty()) figure->curves.push_back(std::move(doubted));
  figure->curves.push_back(std::move(sound));
}

/// A line through the compared runs of a formulation and level that no other of them beats.
void AddBest(const Rows& rows, Figure* figure) {
  const Record& first = rows.front()->record;
  Curve best{.label = first.Text("formulation") + ", " + first.Text("enforcement"),
             .style = StyleOf(first)};
  best.style.shape = Shape::kNone;
  best.style.width = 1.2;
  best.style.doubtful = false;
  double least = std::numeric_limits<double>::infinity();
  for (const TradeoffRow* row : rows) {
    if (HasFailed(row->record) || !row->reason.empty() || !(row->error < least)) continue;
    least = row->error;
    best.x.push_back(row->cost);
    best.y.push_back(row->error);
  }
  if (best.x.size() > 1) figure->curves.push_back(std::move(best));
}

/// A row for what a line of its own means.
LegendRow RowOf(const Curve& line) { return {{line.label, line.style}}; }

/// From one row of the front to the next the cheaper one serves.
Curve Stairs(const TradeoffProblem& problem) {
  Curve stairs{.label = "Pareto front", .style = {.width = 0.6}, .merges = false};
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

std::vector<std::string> IntegratorsOfRows(const TradeoffProblem& problem) {
  std::set<std::string> names;
  for (const TradeoffRow& row : problem.rows) names.insert(row.record.Text("integrator"));
  return {names.begin(), names.end()};
}

/// Upright, at the end of what can be trusted: the least and, where runs differ, the largest.
std::vector<Curve> TrustLines(const Rows& rows, const std::vector<Curve>& curves) {
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
                     .style = {.color = "#606060", .width = 1.0},
                     .merges = false});
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
  const Rows rows = RowsWith(problem, "");
  const std::vector<Record> records = RecordsOf(rows);
  figure.legend = ChannelLegend(records);
  constexpr const char* kHueAndMark[] = {"formulation", "coordinates"};
  constexpr const char* kHueAndDash[] = {"formulation", "enforcement"};
  for (const auto& [name, own] : RowsBy(kHueAndMark, rows)) AddCloud(own, &figure);
  for (const auto& [name, own] : RowsBy(kHueAndDash, rows)) AddBest(own, &figure);
  figure.curves.push_back(Stairs(problem));
  figure.legend.push_back(RowOf(figure.curves.back()));
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
  Rows rows = RowsWith(problem, integrator);
  std::erase_if(rows,
                [](const TradeoffRow* row) { return std::isnan(row->record.Number("rtol")); });
  if (rows.empty()) return figure;
  const auto rtol = [](const TradeoffRow& row) { return row.record.Number("rtol"); };
  std::ranges::stable_sort(rows, std::less(), [&](const TradeoffRow* row) { return rtol(*row); });
  const std::vector<Record> records = RecordsOf(rows);
  figure.legend = ChannelLegend(records);
  for (const auto& [name, own] : RowsBy(kChannelKeys, rows)) {
    Curve sound{.label = MethodLabel(own.front()->record, records),
                .style = StyleOf(own.front()->record),
                .points = true};
    sound.style.doubtful = false;
    Curve doubted = sound;
    doubted.label = "";
    doubted.line = false;
    doubted.style.doubtful = true;
    for (const TradeoffRow* row : own) AddPoint(*row, rtol, &sound, &doubted);
    // several runs at one tolerance are a cloud, through which no line goes
    std::vector<double> places = sound.x;
    sound.line = std::ranges::adjacent_find(places) == places.end();
    if (!doubted.x.empty()) figure.curves.push_back(std::move(doubted));
    figure.curves.push_back(std::move(sound));
  }
  const bool is_length =
      IsErrorOfPositions(tradeoff.error) || UnitOf(ColumnOf(tradeoff.error, {})) == "m";
  const double length = rows.front()->record.Number("link_length");
  const double scale = is_length && length > 0.0 ? length : 1.0;
  Curve honoured{.label = is_length ? "error = tolerance x link" : "error = tolerance"};
  honoured.style.width = 0.6;
  honoured.merges = false;
  for (const TradeoffRow* row : {rows.front(), rows.back()}) {
    honoured.x.push_back(rtol(*row));
    honoured.y.push_back(scale * rtol(*row));
  }
  figure.legend.push_back(RowOf(honoured));
  figure.curves.push_back(std::move(honoured));
  return figure;
}

Figure ErrorOverTimeFigure(const TradeoffProblem& problem, const std::string& integrator) {
  double finest = std::numeric_limits<double>::infinity();
  Rows rows;
  for (const TradeoffRow* row : RowsWith(problem, integrator)) {
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
                .log_y = true,
                .curves = {}};
  const std::vector<Record> records = RecordsOf(rows);
  if (!records.empty()) figure.legend = ChannelLegend(records);
  for (const Record& record : records) {
    Curve curve{.label = MethodLabel(record, records),
                .x = record.Numbers("series.error_t"),
                .y = record.Numbers("series.error"),
                .style = StyleOf(record)};
    curve.ends_early = HasFailed(record);
    figure.curves.push_back(std::move(curve));
  }
  for (Curve& line : TrustLines(rows, figure.curves)) {
    if (!line.label.empty()) figure.legend.push_back(RowOf(line));
    figure.curves.push_back(std::move(line));
  }
  return figure;
}

std::vector<NamedFigure> TradeoffFigures(const Tradeoff& tradeoff) {
  std::vector<NamedFigure> figures;
  std::set<std::string> taken;
  const auto add = [&](const std::string& kind, const std::string& what, Figure figure) {
    // a failed run alone has no error that an axis could show, nor have stairs or lines a meaning
    const bool anything = std::ranges::any_of(figure.curves, [](const Curve& curve) {
      return (curve.merges || !curve.line) && HasPoint(curve);
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
