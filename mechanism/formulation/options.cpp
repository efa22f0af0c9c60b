#include "mechanism/formulation/options.h"

namespace loopbench {

std::string_view ToString(Enforcement enforcement) {
  switch (enforcement) {
    case Enforcement::kAcceleration:
      return "acceleration";
    case Enforcement::kVelocity:
      return "velocity";
    case Enforcement::kPosition:
      return "position";
    case Enforcement::kBaumgarte:
      return "baumgarte";
  }
  return "unknown";
}
std::string_view ToString(SolverKind solver) {
  return solver == SolverKind::kAsPublished ? "as-published" : "rank-revealing";
}

}  // namespace loopbench
