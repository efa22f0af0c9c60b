#include "harness/figures/precision_figures.h"

#include <fmt/format.h>

#include <limits>
#include <map>

#include "harness/config/experiment.h"
#include "harness/tables/columns.h"
#include "harness/tables/precision_ladders.h"

namespace loopbench::harness {
namespace {

Curve CurveOf(std::span<const Record> rungs, Scalar scalar, const char* key) {
  Curve curve{.label = std::string(ToString(scalar)),
              .style = DistinctStyle(static_cast<std::size_t>(scalar)),
              .points = true};
  // scalars agree where truncation rules: each is seen on those before it
  curve.style.width = 2.6 - 0.7 * static_cast<double>(scalar);
  for (const Record& rung : rungs) {
    if (rung.Text("scalar") != ToString(scalar) || IsReferenceRung(rung)) continue;
    if (HasFailed(rung)) {
      curve.crosses.emplace_back(rung.Number("rtol"), std::numeric_limits<double>::quiet_NaN());
      continue;
    }
    curve.x.push_back(rung.Number("rtol"));
    curve.y.push_back(rung.Number(key));
  }
  return curve;
}

/// A curve for each scalar that has runs.
Figure PanelOf(std::span<const Record> rungs, const char* key, const char* axis) {
  Figure panel{.title = "",
               .x_label = "tolerance",
               .y_label = axis,
               .log_x = true,
               .log_y = true,
               .curves = {}};
  for (std::size_t i = 0; i < kNames<Scalar>.size(); ++i) {
    Curve curve = CurveOf(rungs, static_cast<Scalar>(i), key);
    if (!curve.x.empty() || !curve.crosses.empty()) panel.curves.push_back(std::move(curve));
  }
  return panel;
}

NamedFigure FigureOf(std::span<const Record> rungs) {
  const Record& first = rungs.front();
  NamedFigure named;
  named.name = "precision";
  for (const char* key : kLadderKeys) {
    const std::string_view word = key;
    const bool in_name = word != "horizon" && word != "experiment" && word != "content";
    if (in_name) named.name += "-" + first.Text(key);
  }
  Figure& figure = named.figure;
  figure = PanelOf(rungs, "error_final", "error at the end [m]");
  figure.below = {PanelOf(rungs, "drift_position_max", "largest drift [m]")};
  figure.title =
      fmt::format("{}: {}, {}, {}, {}, after {} s", first.Text("mechanism"),
                  first.Text("formulation"), first.Text("enforcement"), first.Text("coordinates"),
                  first.Text("solver"), first.Text("horizon"));
  for (const TableColumn& parameter : WithParameters({}, {&first, 1})) {
    named.name += fmt::format("-{}-{}", parameter.key, first.Text(parameter.key));
    figure.title += fmt::format(", {} {}", parameter.key, first.Text(parameter.key));
  }
  for (const Curve& curve : figure.curves) {
    LegendItem item{curve.label, curve.style};
    if (figure.legend.empty()) figure.legend.emplace_back();
    figure.legend.front().push_back(std::move(item));
  }
  return named;
}

}  // namespace

std::vector<NamedFigure> PrecisionFigures(std::span<const Record> records) {
  std::vector<Record> sorted(records.begin(), records.end());
  SortRungs(&sorted);
  std::vector<NamedFigure> figures;
  std::vector<std::string> others, contents;  // what else tells ladders apart
  for (std::size_t begin = 0; begin < sorted.size();) {
    std::size_t end = begin;
    while (end < sorted.size() && LadderOf(sorted[end]) == LadderOf(sorted[begin])) ++end;
    figures.push_back(FigureOf(std::span(sorted).subspan(begin, end - begin)));
    others.push_back(
        fmt::format("-{}s-{}", sorted[begin].Text("horizon"), sorted[begin].Text("experiment")));
    contents.push_back("-" + sorted[begin].Text("content"));
    begin = end;
  }
  for (const std::vector<std::string>& endings : {others, contents}) {
    std::map<std::string, int> uses;
    for (const NamedFigure& figure : figures) ++uses[figure.name];
    for (std::size_t i = 0; i < figures.size(); ++i) {
      if (uses[figures[i].name] > 1) figures[i].name += endings[i];
    }
  }
  return figures;
}

}  // namespace loopbench::harness
