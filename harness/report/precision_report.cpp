#include "harness/report/precision_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <tuple>

#include "harness/config/experiment.h"
#include "harness/report/columns.h"
#include "harness/report/table.h"

namespace loopbench::harness {
namespace {

constexpr const char* kLadderKeys[] = {"mechanism", "formulation", "enforcement", "coordinates",
                                       "solver",    "horizon",     "experiment",  "content"};

bool IsReference(const Record& record) { return record.Text("integrator") == "gragg"; }

// Width of the scalar; any other word comes last.
std::size_t WidthOf(const Record& record) {
  const auto scalar = Parse<Scalar>(record.Text("scalar"));
  return scalar ? static_cast<std::size_t>(*scalar) : kNames<Scalar>.size();
}

std::string LadderOf(const Record& record) {
  std::string text;
  for (const char* key : kLadderKeys) text += record.Text(key) + '\n';
  for (const TableColumn& parameter : WithParameters({}, {&record, 1})) {
    text += fmt::format("{} {}\n", parameter.key, record.Text(parameter.key));
  }
  return text;
}

Curve CurveOf(std::span<const Record> rungs, Scalar scalar, const char* key, bool drift) {
  constexpr const char* kColors[] = {"#E69F00", "#0072B2", "#009E73", "#CC79A7"};
  Curve curve;
  curve.label = fmt::format("{}, {}", drift ? "drift" : "error", ToString(scalar));
  curve.style = {.color = kColors[static_cast<std::size_t>(scalar)], .width = drift ? 1.0 : 2.5};
  curve.points = !drift;
  for (const Record& rung : rungs) {
    if (rung.Text("scalar") != ToString(scalar) || IsReference(rung)) continue;
    if (HasFailed(rung)) {
      if (!drift) {
        curve.crosses.emplace_back(rung.Number("rtol"), std::numeric_limits<double>::quiet_NaN());
      }
      continue;
    }
    curve.x.push_back(rung.Number("rtol"));
    curve.y.push_back(rung.Number(key));
  }
  return curve;
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
  figure.title =
      fmt::format("{}: {}, {}, {}, {}, after {} s", first.Text("mechanism"),
                  first.Text("formulation"), first.Text("enforcement"), first.Text("coordinates"),
                  first.Text("solver"), first.Text("horizon"));
  for (const TableColumn& parameter : WithParameters({}, {&first, 1})) {
    named.name += fmt::format("-{}-{}", parameter.key, first.Text(parameter.key));
    figure.title += fmt::format(", {} {}", parameter.key, first.Text(parameter.key));
  }
  figure.x_label = "tolerance";
  figure.y_label = "error at the end, largest drift [m]";
  figure.log_x = figure.log_y = true;
  for (std::size_t i = 0; i < kNames<Scalar>.size(); ++i) {
    const auto scalar = static_cast<Scalar>(i);
    for (const bool drift : {false, true}) {
      Curve curve = CurveOf(rungs, scalar, drift ? "drift_position_max" : "error_final", drift);
      if (!curve.x.empty() || !curve.crosses.empty()) figure.curves.push_back(std::move(curve));
    }
  }
  return named;
}

}  // namespace

void SortRungs(std::vector<Record>* records) {
  const auto key = [](const Record& record) {
    return std::tuple(LadderOf(record), IsReference(record), -record.Number("rtol"),
                      WidthOf(record));
  };
  std::ranges::stable_sort(*records, {}, key);
}

std::vector<std::string> PrecisionNotes() {
  return {
      "error: largest distance of a centre of mass from the reference at the end; the reference "
      "(integrator gragg) is the same for all columns: multipliers in joint coordinates without "
      "softening, float128; its own error is the distance from another one at 10^4 times its "
      "tolerance",
      "drift: largest mismatch of the points of a constraint at accepted steps, measured in "
      "float128",
      "ruled by: round-off where the widest scalar at the same tolerance changes the number by "
      "more "
      "than a factor of two, else truncation (of the method, or by softening); of the widest, "
      "truncation where the number is more than ten times the next narrower's scaled by the ratio "
      "of their eps"};
}

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
