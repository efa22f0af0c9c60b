#include "harness/config/options.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace loopbench::harness {
namespace {

// ode45's values; the repeated-failure factor is MATLAB's halving.
constexpr Controller kMatlab{.proportional = false,
                             .uses_method_order = true,
                             .safety = 0.8,
                             .bias = 1,
                             .growth = 5,
                             .first_growth = 5,
                             .reduction = 0.1,
                             .repeated_failure = 0.5,
                             .keep_below = 1};
// The defaults of ERKStep 6.4.1.
constexpr Controller kArkode{.proportional = true,
                             .uses_method_order = false,
                             .safety = 0.99,
                             .bias = 1.2,
                             .growth = 25,
                             .first_growth = 1e4,
                             .reduction = 0.1,
                             .repeated_failure = 0.3,
                             .keep_below = 1.5};

constexpr std::array<Profile, 12> kProfiles{{
    {"ode45", "ARKODE_DORMAND_PRINCE_7_4_5", kMatlab, true, false},
    {"dormand-prince", "ARKODE_DORMAND_PRINCE_7_4_5", kArkode, false, false},
    {"bogacki-shampine", "ARKODE_BOGACKI_SHAMPINE_4_2_3", kArkode, false, false},
    {"cash-karp", "ARKODE_CASH_KARP_6_4_5", kArkode, false, false},
    {"fehlberg", "ARKODE_FEHLBERG_6_4_5", kArkode, false, false},
    {"verner", "ARKODE_VERNER_8_5_6", kArkode, false, true},
    {"fehlberg-78", "ARKODE_FEHLBERG_13_7_8", kArkode, false, true},
    {"trbdf2", "ARKODE_TRBDF2_3_3_2", kArkode, false, false, true},
    {"kennedy-carpenter-32", "ARKODE_ESDIRK324L2SA_4_2_3", kArkode, false, false, true},
    {"kennedy-carpenter-43", "ARKODE_ESDIRK436L2SA_6_3_4", kArkode, false, false, true},
    {"kvaerno-54", "ARKODE_KVAERNO_7_4_5", kArkode, false, false, true},
    {"kennedy-carpenter-54", "ARKODE_ESDIRK547L2SA_7_4_5", kArkode, false, false, true},
}};

}  // namespace

const Profile* FindProfile(std::string_view name) {
  const auto found = std::find_if(kProfiles.begin(), kProfiles.end(),
                                  [&](const Profile& profile) { return name == profile.name; });
  return found == kProfiles.end() ? nullptr : &*found;
}

std::vector<std::string> ProfileNames() {
  std::vector<std::string> names;
  for (const Profile& profile : kProfiles) {
    names.emplace_back(profile.name);
  }
  return names;
}

std::string Validate(const IntegratorOptions& options) {
  // Negated comparisons, so that NaN is rejected too.
  if (FindProfile(options.profile) == nullptr) {
    return fmt::format("profile is \"{}\"; accepted: {}", options.profile,
                       fmt::join(ProfileNames(), ", "));
  }
  if (!(options.rtol > kMinTolerance && options.rtol < 1)) {
    return fmt::format("rtol is {}; it must lie between {:.2g} and 1", options.rtol, kMinTolerance);
  }
  if (!(options.atol > 0 && options.atol <= std::numeric_limits<double>::max())) {
    return fmt::format("atol is {}; it must be positive and finite", options.atol);
  }
  if (options.step_limit < 1) {
    return "step_limit is " + std::to_string(options.step_limit) + "; it must be at least 1";
  }
  if (!(options.time_limit_s > 0)) {
    return "time_limit_s is " + std::to_string(options.time_limit_s) + "; it must be positive";
  }
  if (!(options.max_step >= 0)) {
    return "max_step is " + std::to_string(options.max_step) + "; it must not be negative";
  }
  if (!(options.fixed_step >= 0)) {
    return "fixed_step is " + std::to_string(options.fixed_step) + "; it must not be negative";
  }
  for (size_t i = 0; i < options.stop_times.size(); ++i) {
    const double t = options.stop_times[i];
    if (!std::isfinite(t) || (i > 0 && t < options.stop_times[i - 1])) {
      return "stop_times[" + std::to_string(i) + "] is " + std::to_string(t) +
             "; stop times must be finite and in order";
    }
  }
  return "";
}

}  // namespace loopbench::harness
