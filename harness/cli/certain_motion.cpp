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
  CertainMotion certain{.options = {.scalar = "long-double", .cpu_s = cpu_s}, .horizon = horizon};
  const int all = certain.options.points;
  const auto make = [&] {
    certain.reference = MakeReference(user, certain.horizon, LinkLength(user), certain.options);
    return certain.reference.trust_horizon;
  };
  // a reference is certified up to one of its output times, so the run needs the same times
  constexpr int kFewest = 41, kMostEnds = 8;
  double end = make();
  for (int i = 0; i < kMostEnds && end > 0.0 && end < certain.horizon; ++i) {
    const int trusted = static_cast<int>(certain.reference.NumTrusted());
    certain.options.points = trusted < kFewest ? all : trusted;
    certain.horizon = end;
    end = make();
  }
  certain.horizon = end;
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
