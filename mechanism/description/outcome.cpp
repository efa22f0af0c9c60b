#include "mechanism/description/outcome.h"

namespace loopbench {

std::string_view ToString(Outcome outcome) {
  switch (outcome) {
    case Outcome::kFinished:
      return "finished";
    case Outcome::kSingular:
      return "singular";
    case Outcome::kStepTooSmall:
      return "step-too-small";
    case Outcome::kNonFinite:
      return "non-finite";
    case Outcome::kStepLimit:
      return "step-limit";
    case Outcome::kTimeLimit:
      return "time-limit";
    case Outcome::kInconsistentStart:
      return "inconsistent-start";
    case Outcome::kInconsistentMotion:
      return "inconsistent-motion";
    case Outcome::kLocked:
      return "locked";
    case Outcome::kNewtonFailure:
      return "newton-failure";
    case Outcome::kInexpressible:
      return "unsupported";
    case Outcome::kIntegratorError:
      return "integrator-error";
  }
  return "unknown";
}

}  // namespace loopbench
