// Outcome of an evaluation or a run. A numerical failure is a named result, not an exception.
#pragma once

#include <string_view>

namespace loopbench {

/// Ending of one evaluation or of one run. `kFinished` is the only success.
enum class Outcome {
  kFinished,            ///< reached its end
  kSingular,            ///< a matrix that must be regular was not (plain solvers)
  kStepTooSmall,        ///< the error test failed too often or the step fell below round-off
  kNonFinite,           ///< a derivative was NaN or infinite
  kStepLimit,           ///< more steps than allowed
  kTimeLimit,           ///< more CPU time than allowed
  kInconsistentStart,   ///< positions or speeds that satisfy the loops were not found
  kInconsistentMotion,  ///< prescribed motions contradict the loop constraints
  kLocked,              ///< no speed is free and none is prescribed: nothing can move
  kNewtonFailure,       ///< an implicit step's equations were not solved, however short the step
  kInexpressible,       ///< a peer does not have one of its joints or forces
  kIntegratorError,     ///< any other error return of the integrator
};

/// The name used in tables and files, e.g. "step-too-small".
std::string_view ToString(Outcome outcome);

}  // namespace loopbench
