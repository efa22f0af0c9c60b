// Joints that close loops, as constraints of Simbody.
#pragma once

#include <Simbody.h>

#include "peers/model.h"

namespace loopbench::peers {

inline SimTK::Vec3 ToVec3(const Vec& v) { return {v[0], v[1], v[2]}; }

/// Exactly orthogonal to round-off already: taken as it is.
inline SimTK::Transform ToTransform(const Frame& frame) {
  const Matrix& R = frame.R;
  const SimTK::Mat33 matrix(R[0], R[1], R[2], R[3], R[4], R[5], R[6], R[7], R[8]);
  return {SimTK::Rotation(matrix, true), ToVec3(frame.p)};
}

/// The directions that the joint imposes; where some are redundant all the same, Simbody finds the
/// rank. In the plane those of the plane alone. Throws NotThere for a helical joint.
void AddConstraint(const Joint& joint, bool planar, SimTK::MobilizedBody& P,
                   SimTK::MobilizedBody& Q);

}  // namespace loopbench::peers
