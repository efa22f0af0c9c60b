#include "harness/report/figure_recipes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string_view>
#include <tuple>

#include "harness/report/columns.h"
#include "harness/report/select.h"

namespace loopbench::harness {
namespace {

constexpr std::string_view kAnglePrefix = "series.angle.";

// Formulation and level share a colour family: the level of the paper in the strong colour.
std::string ColorOf(const Record& record) {
  const bool velocity = record.Text("enforcement") == "velocity";
  const std::string formulation = record.Text("formulation");
  if (formulation == "odca") return velocity ? "#56B4E9" : "#0072B2";
  if (formulation == "lagrange") return velocity ? "#E69F00" : "#D55E00";
  if (formulation == "reduction") return velocity ? "#009E73" : "#999933";
  return "#000000";
}

CurveStyle StyleOf(const Record& record) {
  const int absolute = record.Text("coordinates") == "absolute" ? 1 : 0;
  const int rank_revealing = record.Text("solver") == "rank-revealing" ? 2 : 0;
  const bool wide = record.Text("formulation") == "lagrange";
  return {ColorOf(record), 1 + absolute + rank_revealing, wide ? 5.0 : 2.0};
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
  for (const char* key : {"enforcement", "coordinates", "solver"}) {
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

std::string TitleOf(std::span<const Record> records, std::string_view what) {
  if (records.empty()) return std::string(what);
  std::string title = fmt::format("{}: {}", records[0].Text("mechanism"), what);
  for (const char* key : {"coordinates", "solver"}) {
    if (!Varies(records, key)) title += ", " + records[0].Text(key);
  }
  if (!Varies(records, "rtol")) title += ", rtol " + records[0].Text("rtol");
  return title;
}

std::vector<Curve> DriftCurves(std::span<const Record> records, bool with_fit) {
  std::vector<Record> ordered(records.begin(), records.end());
  std::ranges::stable_partition(
      ordered, [](const Record& record) { return record.Text("formulation") == "lagrange"; });
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

bool HasAngles(const Record& record) {
  return std::ranges::any_of(record.items(),
                             [](const auto& item) { return item.first.starts_with(kAnglePrefix); });
}

bool PassesSingularPositions(const std::string& mechanism) {
  return mechanism.starts_with("parallelogram") || mechanism.starts_with("toggle") ||
         mechanism.starts_with("dead-centre");
}

// Larger is the better choice for the figure of angles.
auto AnglesRank(const Record& record) {
  return std::tuple(!Failed(record), record.Text("formulation") == "odca",
                    record.Text("coordinates") == "joint", -record.Number("rtol"));
}

}  // namespace

Figure AnglesFigure(const Record& record) {
  Figure figure;
  figure.title =
      fmt::format("{}: angles, {}, {}, rtol {}", record.Text("mechanism"),
                  record.Text("formulation"), record.Text("coordinates"), record.Text("rtol"));
  figure.x_label = "time [s]";
  figure.y_label = "angle [rad]";
  for (const auto& [key, value] : record.items()) {
    if (!key.starts_with(kAnglePrefix)) continue;
    const std::size_t index = figure.curves.size();
    Curve curve;
    curve.label = key.substr(kAnglePrefix.size());
    curve.x = record.Numbers("series.t");
    curve.y = record.Numbers(key);
    curve.style = DistinctStyle(index);
    curve.ends_early = Failed(record);
    figure.curves.push_back(std::move(curve));
  }
  return figure;
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
  std::map<std::string, Record> angles;
  std::map<std::string, std::vector<Record>> drift;
  for (const Record& record : sorted) {
    const std::string scene =
        fmt::format("{}-{}s", record.Text("mechanism"), record.Text("horizon"));
    if (HasAngles(record)) {
      const auto [it, is_new] = angles.try_emplace("angles-" + scene, record);
      if (!is_new && AnglesRank(record) > AnglesRank(it->second)) it->second = record;
    }
    if (record.Find("series.drift") != nullptr) {
      const bool singular = PassesSingularPositions(record.Text("mechanism"));
      drift[fmt::format("{}-{}-rtol-{}", singular ? "singular" : "drift", scene,
                        record.Text("rtol"))]
          .push_back(record);
    }
  }
  std::vector<NamedFigure> figures;
  for (const auto& [name, record] : angles) figures.push_back({name, AnglesFigure(record)});
  for (const auto& [name, group] : drift) {
    const bool singular = name.starts_with("singular");
    figures.push_back({name, singular ? SingularFigure(group) : DriftFigure(group)});
  }
  return figures;
}

}  // namespace loopbench::harness
