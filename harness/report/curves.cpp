#include "harness/report/curves.h"

#include <algorithm>

#include "harness/report/decimate.h"

namespace loopbench::harness {
namespace {

struct Quantity {
  const char *name, *title, *unit, *time_key, *key;
};
constexpr Quantity kQuantities[] = {
    {"drift", "Drift", "m", "series.drift_t", "series.drift"},
    {"energy", "Error of the energy balance", "J", "series.energy_t", "series.energy_error"},
    {"error", "True error of points", "m", "series.error_t", "series.error"}};

}  // namespace

std::vector<ReportPlot> MakePlots(const std::vector<Record>& rows, std::size_t most) {
  std::vector<ReportPlot> plots;
  std::size_t curves = 0;
  for (const Quantity& quantity : kQuantities) {
    ReportPlot plot{.name = quantity.name, .title = quantity.title, .unit = quantity.unit};
    for (std::size_t row = 0; row < rows.size(); ++row) {
      const std::vector<double>& t = rows[row].Numbers(quantity.time_key);
      const std::vector<double>& y = rows[row].Numbers(quantity.key);
      const std::size_t n = std::min(t.size(), y.size());
      if (n == 0) continue;
      plot.points += n;
      plot.curves.push_back({row,
                             {t.begin(), t.begin() + static_cast<std::ptrdiff_t>(n)},
                             {y.begin(), y.begin() + static_cast<std::ptrdiff_t>(n)}});
    }
    curves += plot.curves.size();
    if (!plot.curves.empty()) plots.push_back(std::move(plot));
  }
  for (ReportPlot& plot : plots) {
    for (ReportCurve& curve : plot.curves) {
      ReportCurve kept{.row = curve.row};
      for (const std::size_t i : KeepExtremes(curve.y, most / curves)) {
        kept.t.push_back(curve.t[i]);
        kept.y.push_back(curve.y[i]);
      }
      plot.shown += kept.t.size();
      curve = std::move(kept);
    }
  }
  return plots;
}

}  // namespace loopbench::harness
