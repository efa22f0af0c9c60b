#include "harness/run/run_keys.h"

#include <cmath>

namespace loopbench::harness {

void WriteCounts(const IntegratorResult& result, std::int64_t projection_steps, bool is_implicit,
                 Record& record) {
  record.Set("outcome", std::string(ToString(result.outcome)));
  record.Set("message", result.message);
  record.Set("t_reached", result.t_reached);
  record.Set("steps", result.steps);
  record.Set("rejected", result.rejected);
  record.Set("rhs_evaluations", result.rhs_evaluations);
  record.Set("rhs_equivalents", result.rhs_evaluations + projection_steps);
  record.Set("restarts", result.restarts);
  if (is_implicit) {
    record.Set("newton_jacobians", result.jacobians);
    record.Set("newton_rhs_evaluations", result.jacobian_rhs_evaluations);
    record.Set("newton_dual_evaluations", result.dual_evaluations);
    record.Set("newton_iterations", result.newton_iterations);
    record.Set("newton_failures", result.newton_failures);
  }
  record.Set("wall_s", result.wall_s);
  record.Set("cpu_s", result.cpu_s);
}

void WriteGrowth(const Growth& growth, int failed, Record& record) {
  record.Set("growth_exponent", growth.exponent);
  record.Set("growth_spread", growth.spread);
  record.Set("growth_exponent_late", growth.exponent_late);
  record.Set("growth_spread_late", growth.spread_late);
  record.Set("growth_regime", growth.regime);
  record.Set("growth_resolved", growth.resolved && failed == 0);
  record.Set("growth_hypothesis", growth.hypothesis.name);
  record.Set("growth_hypothesis_resolved", growth.hypothesis_resolved && failed == 0);
  record.Set("growth_hypothesis_ratio", growth.hypothesis.ratio);
  record.Set("growth_rate", growth.hypothesis.rate);
  record.Set("growth_from", growth.t_from);
  record.Set("growth_to", growth.t_to);
  record.Set("ensemble", std::int64_t{growth.members});
  record.Set("ensemble_failed", std::int64_t{failed});
}

void WriteExponent(const std::string& key, const DriftSeries& series, double horizon, double scale,
                   Record& record) {
  if (series.t.empty() || !(scale > 0.0)) return;
  const Growth growth = AnalyseGrowth({&series, 1}, horizon, scale);
  if (std::isfinite(growth.exponent)) record.Set(key, growth.exponent);
}

}  // namespace loopbench::harness
