// Forces at rest: efforts of drives that hold a mechanism at its start, and joint reactions.
//
// All speeds and accelerations are zero, at t = 0: gravity, springs and constant forces act,
// dampers and drag do not. Prescribed coordinates are held at their values. As many other
// coordinates are held as degrees of freedom remain: of "fixed" joints first, then in the order of
// the file, without those that held ones determine. Efforts and reactions follow from the
// equilibrium of each body (Reactions, user_mechanism.h).
#pragma once

#include <string>
#include <vector>

#include "harness/trajectory/trajectory.h"
#include "mechanism/start/assembly.h"

namespace loopbench::harness {

struct Statics {
  std::string why;  ///< why there are no forces: something moves that nothing can hold; else empty
  /// Drives (columns "drive"), reactions ("reaction") and efforts of couplings ("coupling"), in
  /// ground axes; NaN if redundant constraints share the load in no one way.
  std::vector<TrajectoryColumn> columns;
  std::vector<double> values;
  std::vector<std::string> held;  ///< names of columns of drives that the file does not prescribe
  int free = 0;                   ///< motions that nothing holds and no force drives: idle freedoms
};

/// `start` is a start of the description in joint coordinates that is assembled.
Statics FindStatics(const MechanismDescription& description, const Start<double>& start);

}  // namespace loopbench::harness
