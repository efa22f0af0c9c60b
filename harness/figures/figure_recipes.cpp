// Figures made of records, and the styles of methods in all of them.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <string_view>
#include <tuple>

#include "harness/base/record.h"
#include "harness/base/text.h"
#include "harness/config/experiment.h"
#include "harness/config/formulations.h"
#include "harness/figures/figures.h"
#include "harness/judge/analysis.h"
#include "harness/judge/tables.h"

namespace loopbench::harness {
namespace {

constexpr const char* kNeutral = "#707070";  // for samples whose meaning is not their hue

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

LegendRow ItemsOf(std::span<const Record> records, const std::string& key) {
  LegendRow row;
  for (const Record& record : records) {
    const std::string text = record.Text(key);
    if (!text.empty() && !Contains(row, text, &LegendItem::text)) {
      row.push_back(ItemOf(record, key));
    }
  }
  return row;
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

CurveStyle StyleOf(const Record& record) {
  const FormulationRow* row = FindFormulation(record.Text("formulation"));
  const auto level = Parse<Enforcement>(record.Text("enforcement"));
  const bool as_published = record.Text("solver") == ToString(SolverKind::kAsPublished);
  const bool absolute = record.Text("coordinates") == "absolute";
  return {.color = row == nullptr ? kNeutral : row->color,  // formulation of another program
          .dash = static_cast<std::size_t>(level.value_or(Enforcement())) % kDashes,
          .width = as_published ? 0.7 : 1.5,
          .shape = absolute ? Shape::kTriangle : Shape::kCircle,
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
    if (!IsAlike(all, key)) label += (label.empty() ? "" : ", ") + record.Text(key);
  }
  return label.empty() ? record.Text("formulation") : label;
}

void AddRunsOverTime(std::span<const Record> records, const std::string& x, const std::string& y,
                     Figure* figure) {
  if (!records.empty()) figure->legend = ChannelLegend(records);
  for (const Record& record : records) {
    figure->curves.push_back(
        CurveOverTime(record, x, y, MethodLabel(record, records), StyleOf(record)));
  }
}

std::vector<LegendRow> ChannelLegend(std::span<const Record> records) {
  std::vector<LegendRow> rows;
  if (LegendRow hues = ItemsOf(records, "formulation"); !hues.empty())
    rows.push_back(std::move(hues));
  if (!IsAlike(records, "enforcement")) rows.push_back(ItemsOf(records, "enforcement"));
  LegendRow others;
  for (const char* key : {"coordinates", "solver"}) {
    if (IsAlike(records, key)) continue;
    for (LegendItem& item : ItemsOf(records, key)) others.push_back(std::move(item));
  }
  if (!others.empty()) rows.push_back(std::move(others));
  return rows;
}

namespace {

// Returns "1.97 ± 0.05", with a "?" if the power is not resolved.
std::string FittedPower(const Record& record) {
  const double exponent = record.Number("growth_exponent");
  if (!std::isfinite(exponent)) return "";
  std::string text = fmt::format("{:.2f}", exponent);
  const double spread = record.Number("growth_spread");
  if (std::isfinite(spread)) text += fmt::format(" ± {:.1g}", spread);
  return record.Text("growth_resolved") == "true" ? text : text + "?";
}

// Returns the step control of a run: "rtol 10⁻⁸", or "step 0.001 s".
std::string StepsOf(const Record& record) {
  if (record.Text("step").empty()) return "rtol " + NumberText(record.Number("rtol"));
  return fmt::format("step {} s", NumberText(record.Number("step")));
}

std::string TitleOf(std::span<const Record> records, std::string_view what) {
  if (records.empty()) return std::string(what);
  std::string title = fmt::format("{}: {}", records[0].Text("mechanism"), what);
  for (const char* key : {"enforcement", "coordinates", "solver"}) {
    if (IsAlike(records, key)) title += ", " + records[0].Text(key);
  }
  if (IsAlike(records, "rtol") && IsAlike(records, "step")) title += ", " + StepsOf(records[0]);
  return title;
}

// Kind of joint coordinates: names and labels of their series. Angles and lengths have no common
// axis.
struct CoordinateKind {
  const char *prefix, *opening_prefix, *axis;
};
constexpr CoordinateKind kCoordinateKinds[] = {
    {"series.angle.", "series.opening.angle.", "angle [rad]"},
    {"series.displacement.", "series.opening.displacement.", "displacement [m]"}};

bool HasSeries(const Record& record, std::string_view prefix) {
  return std::ranges::any_of(record.items(),
                             [&](const auto& item) { return item.first.starts_with(prefix); });
}

// Returns true if the loops came this close to a singular configuration: about the remaining angle
// [rad] (SingularityObserver).
bool PassesSingularPosition(const Record& record) {
  constexpr double kNear = 0.01;
  return record.Number("singularity_distance_min") < kNear;  // false for NaN
}

// Returns a larger number for smaller values, the smallest if there is no value.
double Smallness(const Record& record, const char* key) {
  const double value = record.Number(key);
  return std::isnan(value) ? -std::numeric_limits<double>::infinity() : -value;
}

// Ranks runs for the motion figure, largest first: finished and without warnings; level without
// drift growth; then finest tolerance, smallest energy error, smallest drift.
auto MotionRank(const Record& record) {
  const double energy = record.Number("energy_error_relative");
  constexpr double kTrusted = 1e-2;
  return std::tuple(!HasFailed(record), !HasWarning(record) && !(energy > kTrusted),
                    GrowthAt(record) == DriftGrowth::kNone, Smallness(record, "rtol"),
                    Smallness(record, "energy_error_relative"),
                    Smallness(record, "drift_position_max"));
}

// Returns all identifying values of the run, for a figure that shows one of several.
std::string RunOf(const Record& record) {
  std::string text;
  for (const char* key : {"formulation", "enforcement", "coordinates", "solver"}) {
    if (!record.Text(key).empty()) text += ", " + record.Text(key);
  }
  text += ", " + StepsOf(record);
  for (const std::string& key : ParametersOf({&record, 1})) {
    if (key != "step") text += fmt::format(", {} {}", key, record.Text(key));
  }
  return text;
}

// Groups runs that agree in all keys without a channel: integrator, experiment, parameters, as far
// as these differ among `records`. The first are the values, "mass 5".
std::map<std::vector<std::string>, std::vector<Record>> ByOtherKeys(
    std::span<const Record> records) {
  std::vector<std::string> keys = {"integrator", "experiment"};
  for (const std::string& key : ParametersOf(records)) keys.push_back(key);
  std::erase_if(keys,
                [&](const std::string& key) { return key == "step" || IsAlike(records, key); });
  std::map<std::vector<std::string>, std::vector<Record>> groups;
  for (const Record& record : records) {
    groups[Mapped<std::string>(keys, [&](const std::string& key) {
      return fmt::format("{} {}", key, record.Text(key));
    })].push_back(record);
  }
  return groups;
}

Figure PanelOf(const Record& record, const CoordinateKind& kind, const std::vector<double>& t,
               bool opening) {
  const std::string_view prefix = opening ? kind.opening_prefix : kind.prefix;
  Figure panel{.title = "", .x_label = "time [s]", .y_label = kind.axis};
  for (const auto& [key, value] : record.items()) {
    if (!key.starts_with(prefix)) continue;
    Curve curve{.label = key.substr(prefix.size()),
                .x = t,
                .y = record.Numbers(key),
                .style = DistinctStyle(panel.curves.size())};
    curve.style.shape = Shape::kNone;
    curve.style.flagged = HasWarning(record);
    curve.ends_early = HasFailed(record) && !opening;
    panel.curves.push_back(std::move(curve));
  }
  panel.names_at_ends = true;
  return panel;
}

}  // namespace

Figure MotionFigure(const Record& record) {
  // if the whole run has too few points for its motion, the record has a series of its opening
  const bool opening = record.Find("series.opening_t") != nullptr;
  const std::vector<double> t = record.Numbers(opening ? "series.opening_t" : "series.t");
  Figure figure;
  for (const CoordinateKind& kind : kCoordinateKinds) {
    Figure panel = PanelOf(record, kind, t, opening);
    if (panel.curves.empty()) continue;
    if (figure.curves.empty()) {
      figure = std::move(panel);
    } else {
      figure.below.push_back(std::move(panel));
    }
  }
  figure.title = fmt::format("{}{}", record.Text("mechanism"), RunOf(record));
  if (opening && !t.empty()) {
    figure.title += fmt::format(" (the first {} of {} s)", NumberText(t.back()),
                                NumberText(record.Number("t_reached")));
  }
  return figure;
}

Figure DriftFigure(std::span<const Record> records, bool singular) {
  Figure figure{.title = TitleOf(records, singular ? "drift through singular positions" : "drift"),
                .x_label = "time [s]",
                .y_label = "position drift, running maximum [m]",
                .log_x = !singular,
                .log_y = true};
  AddRunsOverTime(records, "series.drift_t", "series.drift", &figure);
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Record& record = records[i];
    Curve& curve = figure.curves[i];
    if (!singular) curve.remark = FittedPower(record);
    if (curve.ends_early) {
      curve.remark += fmt::format("{}{} at {} s", curve.remark.empty() ? "" : ", ",
                                  record.Text("outcome"), NumberText(record.Number("t_reached")));
    }
    if (!singular && record.Text("growth_resolved") == "true") {
      curve.guide = {record.Number("growth_exponent"), record.Number("growth_from"),
                     record.Number("growth_to")};
    }
  }
  return figure;
}

std::vector<NamedFigure> AllFigures(std::span<const Record> records) {
  std::vector<Record> sorted(records.begin(), records.end());
  SortRows(&sorted);
  // ordered maps: the order of figures is independent of the order of the store
  std::map<std::string, Record> motions;
  std::map<std::string, std::vector<Record>> drift;
  for (const Record& record : sorted) {
    const std::string problem =
        fmt::format("{}-{}s", record.Text("mechanism"), record.Text("horizon"));
    const bool moves = std::ranges::any_of(
        kCoordinateKinds, [&](const auto& kind) { return HasSeries(record, kind.prefix); });
    if (moves) {
      const auto [it, is_new] = motions.try_emplace("motion-" + problem, record);
      if (!is_new && MotionRank(record) > MotionRank(it->second)) it->second = record;
    }
    if (record.Find("series.drift") != nullptr) {
      const std::string step = record.Text("step");
      const std::string steps =
          step.empty() ? "rtol-" + record.Text("rtol") : fmt::format("step-{}s", step);
      drift[fmt::format("{}-{}", problem, steps)].push_back(record);
    }
  }
  std::vector<NamedFigure> figures;
  for (const auto& [name, record] : motions) figures.push_back({name, MotionFigure(record)});
  for (const auto& [name, group] : drift) {
    const bool singular = std::ranges::any_of(group, PassesSingularPosition);
    for (auto& [others, own] : ByOtherKeys(group)) {
      Figure figure = DriftFigure(own, singular);
      for (const std::string& text : others) figure.title += ", " + text;
      figures.push_back({fmt::format("{}-{}{}{}", singular ? "singular" : "drift", name,
                                     others.empty() ? "" : "-", fmt::join(others, "-")),
                         std::move(figure)});
    }
  }
  return figures;
}
namespace {

Curve CurveOf(std::span<const Record> rungs, Scalar scalar, const char* key) {
  Curve curve{.label = std::string(ToString(scalar)),
              .style = DistinctStyle(static_cast<std::size_t>(scalar)),
              .points = true};
  // scalars agree if truncation dominates: each later one stays visible on the earlier ones
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

Figure PanelOf(std::span<const Record> rungs, const char* key, const char* axis) {
  Figure panel{.title = "", .x_label = "tolerance", .y_label = axis, .log_x = true, .log_y = true};
  for (std::size_t i = 0; i < kNames<Scalar>.size(); ++i) {
    Curve curve = CurveOf(rungs, static_cast<Scalar>(i), key);
    if (!curve.x.empty() || !curve.crosses.empty()) panel.curves.push_back(std::move(curve));
  }
  return panel;
}

NamedFigure FigureOf(std::span<const Record> rungs) {
  const Record& first = rungs.front();
  NamedFigure named{"precision", PanelOf(rungs, "error_final", "error at the end [m]")};
  for (const char* key : kLadderKeys) {
    const std::string_view word = key;
    const bool in_name = word != "horizon" && word != "experiment" && word != "config_hash";
    if (in_name) named.name += "-" + first.Text(key);
  }
  Figure& figure = named.figure;
  figure.below = {PanelOf(rungs, "drift_position_max", "largest drift [m]")};
  figure.title =
      fmt::format("{}: {}, {}, {}, {}, after {} s", first.Text("mechanism"),
                  first.Text("formulation"), first.Text("enforcement"), first.Text("coordinates"),
                  first.Text("solver"), first.Text("horizon"));
  for (const std::string& key : ParametersOf({&first, 1})) {
    named.name += fmt::format("-{}-{}", key, first.Text(key));
    figure.title += fmt::format(", {} {}", key, first.Text(key));
  }
  figure.legend.resize(figure.curves.empty() ? 0 : 1);
  for (const Curve& curve : figure.curves) {
    figure.legend.front().push_back({curve.label, curve.style});
  }
  return named;
}

}  // namespace

std::vector<NamedFigure> PrecisionFigures(std::span<const Record> records) {
  std::vector<Record> sorted(records.begin(), records.end());
  SortSweepLevels(&sorted);
  std::vector<NamedFigure> figures;
  std::vector<std::string> others, contents;  // other keys that distinguish ladders
  for (const auto& [ladder, rungs] : GroupBy(sorted, LadderOf)) {
    const Record& first = rungs.front();
    figures.push_back(FigureOf(rungs));
    others.push_back(fmt::format("-{}s-{}", first.Text("horizon"), first.Text("experiment")));
    contents.push_back("-" + first.Text("config_hash"));
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

Figure TrajectoryFigure(const Trajectory& ours, const Trajectory& theirs,
                        std::span<const SharedColumn> columns, const std::string& title) {
  const std::string unit = columns.empty() ? "" : columns.front().unit;
  Figure both{.title = title, .x_label = "time [s]", .y_label = fmt::format("[{}]", unit)};
  Figure apart{
      .title = "", .x_label = "time [s]", .y_label = fmt::format("first - second [{}]", unit)};
  const auto add = [&](const Trajectory& from, std::size_t column, Curve curve) {
    for (std::size_t row = 0; row < from.rows(); ++row) {
      curve.x.push_back(from.Time(row));
      curve.y.push_back(from.At(row, column));
    }
    both.curves.push_back(std::move(curve));
  };
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const SharedColumn& column = columns[i];
    // "joint:A:angle" of "joint:A:angle [rad]"
    const std::string name = column.label.substr(0, column.label.rfind(" ["));
    CurveStyle style = DistinctStyle(i);
    style.shape = Shape::kNone;
    CurveStyle dashed = style;
    dashed.dash = 1;
    add(ours, column.in_ours, {.label = name + ", second", .style = style});
    add(theirs, column.in_theirs, {.label = name + ", first", .style = dashed});
    apart.curves.push_back({.label = name,
                            .x = both.curves.back().x,
                            .y = Differences(ours, theirs, column),
                            .style = style});
  }
  both.names_at_ends = true;
  both.below.push_back(std::move(apart));
  return both;
}

}  // namespace loopbench::harness
