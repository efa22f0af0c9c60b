#include "harness/cli/certain_motion.h"

#include <fmt/format.h>

#include "harness/analysis/link_length.h"
#include "harness/text/config_error.h"
#ifdef LOOPBENCH_PRECISIONS
#include "harness/precision/make_reference.h"
#endif

namespace loopbench::harness {

#ifdef LOOPBENCH_PRECISIONS

CertainMotion MakeCertainMotion(const MechanismDescription& user, double horizon, double cpu_s,
                                const std::string&) {
  // enough to see the largest error, few against a run's steps
  constexpr int kTimes = 41;
  const auto until = [&](double end) {
    return MakeReference(user, end, LinkLength(user),
                         {.scalar = "long-double", .points = kTimes, .cpu_s = cpu_s});
  };
  CertainMotion certain{until(horizon), horizon};
  if (certain.reference.trust_horizon == horizon) return certain;
  certain.horizon = certain.reference.trust_horizon;
  if (certain.horizon > 0.0) certain.reference = until(certain.horizon);
  return certain;
}

#else

CertainMotion MakeCertainMotion(const MechanismDescription&, double, double,
                                const std::string& what) {
  throw ConfigError(
      fmt::format("{} needs certified references: this program was built without wide scalars "
                  "(cmake -DLOOPBENCH_PRECISIONS=ON)",
                  what));
}

#endif

}  // namespace loopbench::harness
