#include "harness/report/columns.h"

namespace loopbench::harness {
namespace {

using enum Format;

TableColumn Make(const char* key, const char* header, Format format = kText) {
  return {.key = key, .header = header, .format = format, .abbreviations = {}};
}

// What was run and how it ended: the keys that drift.csv and timing.csv share.
std::vector<TableColumn> CaseColumns() {
  return {
      Make("experiment", "experiment"),   Make("mechanism", "mechanism"),
      Make("formulation", "formulation"), Make("enforcement", "enforcement"),
      Make("coordinates", "coordinates"), Make("solver", "solver"),
      Make("integrator", "integrator"),   Make("rtol", "rtol", kShortest),
      Make("atol", "atol", kShortest),    Make("horizon", "horizon [s]", kShortest),
      Make("outcome", "outcome"),         Make("t_reached", "t reached [s]", kSeconds),
  };
}

// The same for a terminal: words that differ in their first letters can be short.
std::vector<TableColumn> CompactCaseColumns() {
  return {
      Make("mechanism", "mechanism"),
      Make("formulation", "formul."),
      {"enforcement", "level", kText, {{"acceleration", "accel"}, {"velocity", "veloc"}}},
      {"coordinates", "coord", kText, {{"absolute", "abs"}}},
      {"solver", "solv", kText, {{"as-published", "publ"}, {"rank-revealing", "rank"}}},
      Make("rtol", "rtol", kShortest),
      Make("horizon", "T/s", kShortest),
      {"outcome",
       "outcome",
       kText,
       {{"finished", "ok"},
        {"step-too-small", "small step"},
        {"inconsistent-start", "bad start"},
        {"integrator-error", "integrator"}}},
  };
}

std::vector<TableColumn> Join(std::vector<TableColumn> head, const std::vector<TableColumn>& tail) {
  head.insert(head.end(), tail.begin(), tail.end());
  return head;
}

}  // namespace

const std::vector<TableColumn>& DriftColumns() {
  static const std::vector<TableColumn> kColumns =
      Join(CaseColumns(), {
                              Make("drift_position_max", "drift, position [m]", kScientific),
                              Make("drift_rotation_max", "drift, rotation [rad]", kScientific),
                              Make("drift_velocity_max", "drift, velocity [m/s]", kScientific),
                              Make("drift_acceleration_max", "drift, accel. [m/s2]", kScientific),
                              Make("loop_closure_max", "loop closure [m]", kScientific),
                              Make("correction_max", "correction [m]", kScientific),
                              Make("worst_loop", "worst loop"),
                              Make("energy_error_max", "energy error [J]", kScientific),
                              Make("growth_exponent", "growth exponent", kExponent),
                              Make("growth_spread", "growth spread", kExponent),
                              Make("growth_regime", "growth regime"),
                              Make("growth_resolved", "growth resolved"),
                              Make("growth_hypothesis", "growth hypothesis"),
                              Make("growth_hypothesis_resolved", "hypothesis resolved"),
                              Make("ensemble", "ensemble", kInteger),
                              Make("steps", "steps", kInteger),
                              Make("rejected", "rejected", kInteger),
                              Make("rhs_evaluations", "rhs evaluations", kInteger),
                              Make("rank_min", "rank min", kInteger),
                              Make("rcond_min", "rcond min", kScientific),
                              Make("state_hash", "state hash"),
                              Make("restarts", "restarts", kInteger),
                              Make("branch_error_max", "branch error [rad]", kScientific),
                              Make("closed_form_error_max", "closed-form error", kScientific),
                              Make("message", "message"),
                          });
  return kColumns;
}

const std::vector<TableColumn>& TimingColumns() {
  static const std::vector<TableColumn> kColumns =
      Join(CaseColumns(), {
                              Make("bodies", "bodies", kInteger),
                              Make("joints", "joints", kInteger),
                              Make("loops", "loops", kInteger),
                              Make("dof", "dof", kInteger),
                              Make("rhs_ns_median", "rhs median [ns]", kFixed),
                              Make("rhs_ns_p10", "rhs p10 [ns]", kFixed),
                              Make("rhs_ns_p90", "rhs p90 [ns]", kFixed),
                              Make("ns_per_body", "per body [ns]", kFixed),
                              Make("step_us_median", "step median [us]", kSeconds),
                              Make("wall_s_median", "wall median [s]", kSeconds),
                              Make("realtime_factor", "real-time factor", kSeconds),
                              Make("repeats", "repeats", kInteger),
                          });
  return kColumns;
}

const std::vector<TableColumn>& CompactDriftColumns() {
  static const std::vector<TableColumn> kColumns =
      Join(CompactCaseColumns(), {
                                     Make("drift_position_max", "drift [m]", kScientific),
                                     Make("energy_error_max", "dE [J]", kScientific),
                                     Make("growth_exponent", "slope", kExponent),
                                 });
  return kColumns;
}

const std::vector<TableColumn>& CompactTimingColumns() {
  static const std::vector<TableColumn> kColumns =
      Join(CompactCaseColumns(), {
                                     Make("bodies", "bodies", kInteger),
                                     Make("rhs_ns_median", "rhs [ns]", kFixed),
                                     Make("wall_s_median", "wall [s]", kSeconds),
                                 });
  return kColumns;
}

}  // namespace loopbench::harness
