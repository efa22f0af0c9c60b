#include "harness/figures/figure_recipes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <string_view>
#include <tuple>

#include "harness/analysis/doubts.h"
#include "harness/config/experiment.h"
#include "harness/config/formulations.h"
#include "harness/record/select.h"
#include "harness/tables/columns.h"

namespace loopbench::harness {
namespace {

// Formulation by hue, coordinates by its strength.
std::string ColorOf(const Record& record) {
  const bool absolute = record.Text("coordinates") == "absolute";
  const FormulationRow* row = FindFormulation(record.Text("formulation"));
  if (row == nullptr) return "#000000";  // of another program
  return absolute ? row->look.absolute : row->look.joint;
}

double CurveWidth(const Record& record) {
  const FormulationRow* row = FindFormulation(record.Text("formulation"));
  return row == nullptr ? 2.0 : row->look.width;
}

Shape ShapeOf(const Record& record) {
  constexpr std::array kShapes = {Shape::kCircle, Shape::kTriangle, Shape::kSquare, Shape::kDiamond,
                                  Shape::kTriangleDown};
  const auto level = Parse<Enforcement>(record.Text("enforcement"));
  return kShapes[static_cast<std::size_t>(level.value_or(Enforcement())) % kShapes.size()];
}

bool Varies(std::span<const Record> records, std::string_view key) {
  return std::ranges::any_of(
      records, [&](const Record& record) { return record.Text(key) != records[0].Text(key); });
}

bool Failed(const Record& record) {
  const std::string outcome = record.Text("outcome");
  return !outcome.empty() && outcome != "finished";
}

// "odca, joint: t^1.97 +- 0.05", with a "?" if that is not resolved; keys that are the same in all
// curves go into the title.
std::string LabelOf(const Record& record, std::span<const Record> all, bool with_fit) {
  std::string label = record.Text("formulation");
  for (const char* key : {"enforcement", "coordinates", "solver", "integrator", "experiment"}) {
    if (Varies(all, key)) label += ", " + record.Text(key);
  }
  for (const TableColumn& parameter : WithParameters({}, all)) {
    if (Varies(all, parameter.key)) {
      label += fmt::format(", {} {}", parameter.key, record.Text(parameter.key));
    }
  }
  const double exponent = record.Number("growth_exponent");
  if (with_fit && std::isfinite(exponent)) {
    label += fmt::format(": t^{:.2f}", exponent);
    const double spread = record.Number("growth_spread");
    if (std::isfinite(spread)) label += fmt::format(" +- {:.1g}", spread);
    if (record.Text("growth_resolved") != "true") label += "?";
  }
  if (Failed(record)) {
    label += fmt::format(" ({} at {:.3g} s)", record.Text("outcome"), record.Number("t_reached"));
  }
  return label;
}

// What decides a run's steps: "rtol 1e-08", or "step 0.001 s".
std::string StepsOf(const Record& record) {
  const std::string step = record.Text("step");
  return step.empty() ? "rtol " + record.Text("rtol") : fmt::format("step {} s", step);
}

std::string TitleOf(std::span<const Record> records, std::string_view what) {
  if (records.empty()) return std::string(what);
  std::string title = fmt::format("{}: {}", records[0].Text("mechanism"), what);
  for (const char* key : {"coordinates", "solver"}) {
    if (!Varies(records, key)) title += ", " + records[0].Text(key);
  }
  if (!Varies(records, "rtol") && !Varies(records, "step")) title += ", " + StepsOf(records[0]);
  return title;
}

std::vector<Curve> DriftCurves(std::span<const Record> records, bool with_fit) {
  std::vector<Record> ordered(records.begin(), records.end());
  std::ranges::stable_sort(ordered, std::greater(), CurveWidth);
  std::vector<Curve> curves;
  for (const Record& record : ordered) {
    Curve curve;
    curve.label = LabelOf(record, records, with_fit);
    curve.x = record.Numbers("series.drift_t");
    curve.y = record.Numbers("series.drift");
    curve.style = StyleOf(record);
    curve.ends_early = Failed(record);
    const double exponent = record.Number("growth_exponent");
    if (with_fit && std::isfinite(exponent)) curve.slope = exponent;
    curves.push_back(std::move(curve));
  }
  return curves;
}

// Joint coordinates of one kind: what their series are called and drawn as.
struct CoordinateKind {
  const char *name, *prefix, *opening_prefix, *axis;
};
constexpr CoordinateKind kCoordinateKinds[] = {
    {"angles", "series.angle.", "series.opening.angle.", "angle [rad]"},
    {"displacements", "series.displacement.", "series.opening.displacement.", "displacement [m]"}};

bool HasSeries(const Record& record, std::string_view prefix) {
  return std::ranges::any_of(record.items(),
                             [&](const auto& item) { return item.first.starts_with(prefix); });
}

// Whether the loops came within this of a singular position, where it is known: about the angle
// [rad] that was still to go (SingularityObserver).
bool PassesSingularPosition(const Record& record) {
  constexpr double kNear = 0.01;
  return record.Number("singularity_distance_min") < kNear;  // not when it is NaN
}

// Larger is the better choice of the run whose motion is shown: one that ended well and is not in
// doubt; whose loops are closed to the last; then the finest tolerance.
auto MotionRank(const Record& record) {
  const double energy = record.Number("energy_error_relative");
  constexpr double kTrusted = 1e-2;
  return std::tuple(!Failed(record), !HasDoubt(record) && !(energy > kTrusted),
                    GrowthAt(record) == DriftGrowth::kNone, -record.Number("rtol"),
                    record.Text("formulation") == "odca", record.Text("coordinates") == "joint",
                    record.Text("solver") == "rank-revealing");
}

// All that names the run, for a figure that shows one of several.
std::string RunOf(const Record& record) {
  std::string text;
  for (const char* key : {"formulation", "enforcement", "coordinates", "solver"}) {
    if (!record.Text(key).empty()) text += ", " + record.Text(key);
  }
  text += ", " + StepsOf(record);
  for (const TableColumn& parameter : WithParameters({}, {&record, 1})) {
    if (parameter.key == "step") continue;
    text += fmt::format(", {} {}", parameter.key, record.Text(parameter.key));
  }
  return text;
}

Figure CoordinateFigure(const Record& record, const CoordinateKind& kind) {
  // where the points of the whole run are too few for its motion, the record has those of its start
  const bool opening = record.Find("series.opening_t") != nullptr;
  const std::string_view prefix = opening ? kind.opening_prefix : kind.prefix;
  const std::vector<double> t = record.Numbers(opening ? "series.opening_t" : "series.t");
  Figure figure;
  figure.title = fmt::format("{}: {}{}", record.Text("mechanism"), kind.name, RunOf(record));
  if (opening && !t.empty()) {
    figure.title +=
        fmt::format(" (the first {:.3g} of {:.4g} s)", t.back(), record.Number("t_reached"));
  }
  figure.x_label = "time [s]";
  figure.y_label = kind.axis;
  for (const auto& [key, value] : record.items()) {
    if (!key.starts_with(prefix)) continue;
    const std::size_t index = figure.curves.size();
    Curve curve;
    curve.label = key.substr(prefix.size());
    curve.x = t;
    curve.y = record.Numbers(key);
    curve.style = DistinctStyle(index);
    curve.style.doubtful = HasDoubt(record);
    curve.ends_early = Failed(record) && !opening;
    figure.curves.push_back(std::move(curve));
  }
  // later ones lie on top and are thinner: those that coincide are all seen
  const double count = static_cast<double>(figure.curves.size());
  for (std::size_t i = 0; i < figure.curves.size(); ++i) {
    figure.curves[i].style.width = 4.0 - 2.5 * static_cast<double>(i) / count;
  }
  return figure;
}

}  // namespace

CurveStyle StyleOf(const Record& record) {
  return {.color = ColorOf(record),
          .width = CurveWidth(record),
          .shape = ShapeOf(record),
          .filled = record.Text("solver") != "as-published",
          .doubtful = HasDoubt(record)};
}

Figure AnglesFigure(const Record& record) { return CoordinateFigure(record, kCoordinateKinds[0]); }

Figure DisplacementsFigure(const Record& record) {
  return CoordinateFigure(record, kCoordinateKinds[1]);
}

Figure DriftFigure(std::span<const Record> records) {
  const bool has_unresolved = std::ranges::any_of(records, [](const Record& record) {
    return std::isfinite(record.Number("growth_exponent")) &&
           record.Text("growth_resolved") != "true";
  });
  return {.title = TitleOf(records, "drift"),
          .x_label = "time [s]",
          .y_label = "position drift, running maximum [m]",
          .log_x = true,
          .log_y = true,
          .curves = DriftCurves(records, true),
          .legend_title = has_unresolved ? "?: exponent not resolved" : ""};
}

Figure SingularFigure(std::span<const Record> records) {
  return {.title = TitleOf(records, "drift through singular positions"),
          .x_label = "time [s]",
          .y_label = "position drift, running maximum [m]",
          .log_x = false,
          .log_y = true,
          .curves = DriftCurves(records, false)};
}

std::vector<NamedFigure> AllFigures(std::span<const Record> records) {
  std::vector<Record> sorted(records.begin(), records.end());
  SortRows(&sorted);
  // Ordered maps, so that the figures come in the same order whatever the order of the store.
  std::map<std::string, Record> motions;
  std::map<std::string, std::vector<Record>> drift;
  for (const Record& record : sorted) {
    const std::string scene =
        fmt::format("{}-{}s", record.Text("mechanism"), record.Text("horizon"));
    for (const CoordinateKind& kind : kCoordinateKinds) {
      if (!HasSeries(record, kind.prefix)) continue;
      const auto [it, is_new] = motions.try_emplace(fmt::format("{}-{}", kind.name, scene), record);
      if (!is_new && MotionRank(record) > MotionRank(it->second)) it->second = record;
    }
    if (record.Find("series.drift") != nullptr) {
      const std::string step = record.Text("step");
      const std::string steps =
          step.empty() ? "rtol-" + record.Text("rtol") : fmt::format("step-{}s", step);
      drift[fmt::format("{}-{}", scene, steps)].push_back(record);
    }
  }
  std::vector<NamedFigure> figures;
  for (const auto& [name, record] : motions) {
    const bool angles = name.starts_with(kCoordinateKinds[0].name);
    figures.push_back({name, angles ? AnglesFigure(record) : DisplacementsFigure(record)});
  }
  for (const auto& [name, group] : drift) {
    const bool singular = std::ranges::any_of(group, PassesSingularPosition);
    figures.push_back({(singular ? "singular-" : "drift-") + name,
                       singular ? SingularFigure(group) : DriftFigure(group)});
  }
  return figures;
}

}  // namespace loopbench::harness
