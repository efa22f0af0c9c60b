#include "harness/config/options.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "mechanism/description/registration.h"

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

struct NamedProfile {
  const char *name, *table;  ///< ARKODE's name of the Runge-Kutta pair
};
constexpr std::array<NamedProfile, 12> kNamed{{
    {"ode45", "ARKODE_DORMAND_PRINCE_7_4_5"},
    {"dormand-prince", "ARKODE_DORMAND_PRINCE_7_4_5"},
    {"bogacki-shampine", "ARKODE_BOGACKI_SHAMPINE_4_2_3"},
    {"cash-karp", "ARKODE_CASH_KARP_6_4_5"},
    {"fehlberg", "ARKODE_FEHLBERG_6_4_5"},
    {"verner", "ARKODE_VERNER_8_5_6"},
    {"fehlberg-78", "ARKODE_FEHLBERG_13_7_8"},
    {"trbdf2", "ARKODE_TRBDF2_3_3_2"},
    {"kennedy-carpenter-32", "ARKODE_ESDIRK324L2SA_4_2_3"},
    {"kennedy-carpenter-43", "ARKODE_ESDIRK436L2SA_6_3_4"},
    {"kvaerno-54", "ARKODE_KVAERNO_7_4_5"},
    {"kennedy-carpenter-54", "ARKODE_ESDIRK547L2SA_7_4_5"},
}};

Profile MakeProfile(std::string name, ButcherTable table, bool is_own = false) {
  const bool is_ode45 = name == kNamed.front().name;
  const bool ends_at_one =
      std::abs(table.c.back() - 1) <= kOrderTolerance && table.A.back() != table.b;
  const bool is_implicit = table.is_implicit();
  return {std::move(name), std::move(table), is_ode45 ? kMatlab : kArkode, is_ode45, is_own,
          is_implicit,     ends_at_one};
}

std::deque<Profile> BuiltIn() {
  const std::vector<ButcherTable> tables = ArkodeTables();
  std::deque<Profile> profiles;
  for (const auto& [name, table] : kNamed) {
    profiles.push_back(MakeProfile(name, *std::ranges::find(tables, table, &ButcherTable::name)));
  }
  for (const ButcherTable& table : tables) profiles.push_back(MakeProfile(table.name, table));
  return profiles;
}

std::deque<Profile>& Rows() {
  static std::deque<Profile> rows = BuiltIn();
  return rows;
}

}  // namespace

const std::deque<Profile>& Profiles() { return Rows(); }

const Profile* FindProfile(std::string_view name) {
  const auto found = std::ranges::find(Rows(), name, &Profile::name);
  return found == Rows().end() ? nullptr : &*found;
}

std::vector<std::string> ProfileNames() {
  std::vector<std::string> names;
  for (const NamedProfile& profile : kNamed) names.emplace_back(profile.name);
  return names;
}

std::vector<std::string> IntegratorNames() {
  std::vector<std::string> names;
  for (const Profile& profile : Rows()) names.push_back(profile.name);
  return names;
}

std::optional<TableFault> FaultOfIntegrator(const ButcherTable& table) {
  constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyz0123456789_-";
  if (table.name.empty() || table.name.front() == '-' ||
      table.name.find_first_not_of(kLetters) != std::string::npos) {
    return TableFault{"name", fmt::format("\"{}\"", table.name), "a word of a-z, 0-9, '-' and '_'"};
  }
  const Profile* taken = FindProfile(table.name);
  if (taken != nullptr && !(taken->is_own && taken->table == table)) {
    return TableFault{"name", fmt::format("\"{}\", the name of another integrator", table.name),
                      "a name of its own"};
  }
  return FaultOf(table);
}

void RegisterIntegrator(const ButcherTable& table) {
  if (const auto fault = FaultOfIntegrator(table)) {
    RefuseRow("integrator", table.name, fmt::format("in {} {}", fault->key, fault->found),
              fault->expected);
  }
  if (FindProfile(table.name) == nullptr) Rows().push_back(MakeProfile(table.name, table, true));
}

std::string Validate(const IntegratorOptions& options) {
  // Negated comparisons, so that NaN is rejected too.
  const Profile* profile = FindProfile(options.profile);
  if (profile == nullptr) {
    return fmt::format("profile is \"{}\"; accepted: {}, and tables of ARKODE by their names",
                       options.profile, fmt::join(ProfileNames(), ", "));
  }
  if (!profile->has_embedding() && !(options.fixed_step > 0)) {
    return fmt::format("profile is \"{}\", which has no embedding; it needs a fixed_step",
                       options.profile);
  }
  if (!(options.rtol > kMinTolerance && options.rtol < 1)) {
    return fmt::format("rtol is {}; it must lie between {:.2g} and 1", options.rtol, kMinTolerance);
  }
  if (!(options.atol > 0 && options.atol <= std::numeric_limits<double>::max())) {
    return fmt::format("atol is {}; it must be positive and finite", options.atol);
  }
  for (const double atol : options.atols) {
    if (!(atol > 0 && atol <= std::numeric_limits<double>::max())) {
      return fmt::format("atols contain {}; they must be positive and finite", atol);
    }
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
  if (!(options.initial_step >= 0)) {
    return fmt::format("initial_step is {}; it must not be negative", options.initial_step);
  }
  if (options.max_newton_iterations < 0) {
    return fmt::format("max_newton_iterations is {}; it must not be negative",
                       options.max_newton_iterations);
  }
  if (!(options.newton_coefficient > 0 && options.newton_coefficient <= 1)) {
    return fmt::format("newton_coefficient is {}; it must lie between 0 and 1",
                       options.newton_coefficient);
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
