#include "mechanism/formulation/options.h"

namespace loopbench {

std::string_view ToString(Enforcement level) { return TraitsOf(level).name; }

std::string_view ToString(SolverKind solver) {
  return solver == SolverKind::kAsPublished ? "as-published" : "rank-revealing";
}

}  // namespace loopbench
