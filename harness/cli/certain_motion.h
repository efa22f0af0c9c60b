// The motion of a mechanism as far as it is certified: what advice and models are judged by.
#pragma once

#include "harness/reference/reference.h"

namespace loopbench::harness {

struct CertainMotion {
  Reference reference;
  double horizon = 0.0;  ///< [s], not beyond the one asked for; 0: there is none
};

/// At some forty times up to `horizon`; each of the witnesses may take `cpu_s`. Where certification
/// ends earlier the times are spread up to there. Throws ConfigError in a program that was built
/// without wide scalars; `what` needs them.
CertainMotion MakeCertainMotion(const MechanismDescription& user, double horizon, double cpu_s,
                                const std::string& what);

}  // namespace loopbench::harness
