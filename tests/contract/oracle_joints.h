// What the oracle knows of each kind of joint, for its own files.
#pragma once

#include <vector>

#include "tests/contract/oracle.h"

namespace loopbench::testing {

/// Numbers of coordinates and speeds.
struct Sizes {
  int q, u;
};
Sizes SizesOf(JointType type, bool spatial);

/// A number that is zero while the joint holds, and the direction [w; v] in F in which it grows.
struct Mismatch {
  Real6 along;
  Jet value;
};

/// Of a prescribed coordinate with the value s, M being at X in F.
Mismatch DriveMismatch(const JointDescription& joint, int coordinate, const JetPose& X,
                       const Jet& s);

/// Of all constrained directions.
std::vector<Mismatch> Mismatches(const JointDescription& joint, bool spatial, const JetPose& X);

}  // namespace loopbench::testing
