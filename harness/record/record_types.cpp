#include "harness/record/record_types.h"

#include <algorithm>
#include <array>

namespace loopbench::harness {
namespace {

using std::string_view;

constexpr std::array kTexts = {string_view("kind"),
                               string_view("experiment"),
                               string_view("benchmark"),
                               string_view("mechanism"),
                               string_view("formulation"),
                               string_view("enforcement"),
                               string_view("coordinates"),
                               string_view("solver"),
                               string_view("integrator"),
                               string_view("jacobian"),
                               string_view("scalar"),
                               string_view("case_id"),
                               string_view("content"),
                               string_view("set"),
                               string_view("id"),
                               string_view("version"),
                               string_view("outcome"),
                               string_view("message"),
                               string_view("worst_loop"),
                               string_view("scene_id"),
                               string_view("doubts"),
                               string_view("growth_regime"),
                               string_view("state_hash"),
                               string_view("growth_hypothesis"),
                               string_view("start_hash"),
                               string_view("derivative_hash"),
                               string_view("compiled"),
                               string_view("machine"),
                               string_view("compiler"),
                               string_view("flags"),
                               string_view("libm"),
                               string_view("commit"),
                               string_view("governor"),
                               string_view("noise"),
                               string_view("checksum"),
                               string_view("error_ruled_by"),
                               string_view("drift_ruled_by"),
                               string_view("ensemble_first_failed"),
                               string_view("ensemble_first_left")};

constexpr std::array kFlags = {string_view("growth_resolved"),
                               string_view("growth_hypothesis_resolved")};

constexpr std::array kNumbers = {string_view("rtol"),
                                 string_view("atol"),
                                 string_view("horizon"),
                                 string_view("alpha"),
                                 string_view("beta"),
                                 string_view("t_reached"),
                                 string_view("steps"),
                                 string_view("rejected"),
                                 string_view("restarts"),
                                 string_view("ensemble"),
                                 string_view("mode_changes"),
                                 string_view("projection_iterations"),
                                 string_view("bodies"),
                                 string_view("joints"),
                                 string_view("loops"),
                                 string_view("dof"),
                                 string_view("rank"),
                                 string_view("repeats"),
                                 string_view("ns_per_body"),
                                 string_view("realtime_factor"),
                                 string_view("load1"),
                                 string_view("load_average"),
                                 string_view("processors"),
                                 string_view("evaluations"),
                                 string_view("allocations"),
                                 string_view("bytes"),
                                 string_view("instructions"),
                                 string_view("error_final"),
                                 string_view("experiment_index"),
                                 string_view("softened_steps"),
                                 string_view("agreement"),
                                 string_view("link_length"),
                                 string_view("position_goal"),
                                 string_view("singularity_passages"),
                                 string_view("softened_evaluations"),
                                 string_view("singularity_distance_min"),
                                 string_view("singularity_distance_min_t")};

/// Measured values come in groups (drift_position_max, drift.loop.OC, ...).
constexpr std::array kNumberGroups = {
    string_view("drift_"),        string_view("drift.loop."),
    string_view("loop_closure_"), string_view("energy_"),
    string_view("growth_"),       string_view("rank_"),
    string_view("rcond_"),        string_view("rhs_"),
    string_view("step_us_"),      string_view("wall_s"),
    string_view("plan_"),         string_view("branch_error_"),
    string_view("aa_spread"),     string_view("closed_form_error_"),
    string_view("correction_"),   string_view("newton_"),
    string_view("cpu_"),          string_view("ensemble_")};

}  // namespace

ValueType TypeOf(std::string_view key) {
  const auto starts = [key](string_view group) { return key.starts_with(group); };
  if (starts("series.")) return ValueType::kNumbers;
  if (std::ranges::find(kTexts, key) != kTexts.end()) return ValueType::kText;
  if (std::ranges::find(kFlags, key) != kFlags.end()) return ValueType::kFlag;
  const bool is_number = std::ranges::find(kNumbers, key) != kNumbers.end() ||
                         std::ranges::any_of(kNumberGroups, starts);
  return is_number ? ValueType::kNumber : ValueType::kAny;
}

std::string_view Describe(ValueType type) {
  switch (type) {
    case ValueType::kAny:
      break;
    case ValueType::kNumber:
      return "a number or null";
    case ValueType::kText:
      return "a string or null";
    case ValueType::kFlag:
      return "true, false or null";
    case ValueType::kNumbers:
      return "an array of numbers";
  }
  return "null, a bool, a number, a string or an array of numbers";
}

}  // namespace loopbench::harness
