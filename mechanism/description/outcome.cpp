#include "mechanism/description/outcome.h"

#include <array>

namespace loopbench {

std::string_view ToString(Outcome outcome) {
  static constexpr auto kNames = std::to_array<std::string_view>(
      {"finished", "singular", "step-too-small", "non-finite", "step-limit", "time-limit",
       "inconsistent-start", "inconsistent-motion", "locked", "newton-failure", "unsupported",
       "integrator-error"});  // in the order of Outcome
  static_assert(kNames.size() == static_cast<std::size_t>(Outcome::kIntegratorError) + 1);
  return kNames[static_cast<std::size_t>(outcome)];
}

}  // namespace loopbench
