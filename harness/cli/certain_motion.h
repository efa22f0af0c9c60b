// The motion of a mechanism as far as it is certified: what advice and models are judged by.
#pragma once

#include "harness/reference/reference.h"

namespace loopbench::harness {

struct CertainMotion {
  ReferenceOptions options = {};  ///< an experiment with them makes the same reference
  Reference reference = {};
  double horizon = 0.0;  ///< [s], its trust horizon, which errors are taken up to; 0: there is none
};

/// Each of the witnesses may take `cpu_s`. Where certification ends before `horizon` the reference
/// is made again up to there, until it is certified to its end. Throws ConfigError in a program
/// without wide scalars, which `what` needs.
CertainMotion MakeCertainMotion(const MechanismDescription& user, double horizon, double cpu_s,
                                const std::string& what);

}  // namespace loopbench::harness
