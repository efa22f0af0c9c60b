// Vectors out of jets and what is known of each kind of joint, for the oracle's own files.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "tests/contract/oracle.h"

namespace loopbench::testing {

inline Real33 ValueOf(const JetMatrix& R, Real Jet::*part) {
  Real33 A;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) A(i, j) = R(i, j).*part;
  }
  return A;
}
inline Real3 ValueOf(const JetVector& p, Real Jet::*part) {
  return {p[0].*part, p[1].*part, p[2].*part};
}

/// [w; v] from first derivatives, [alpha; a] from second ones: R' R^T = [w]x, R'' R^T = [alpha]x +
/// a symmetric matrix.
inline Real6 MotionOf(const JetPose& pose, Real Jet::*part) {
  const Real33 A = ValueOf(pose.R, part) * ValueOf(pose.R, &Jet::f).transpose();
  Real6 V;
  V << A(2, 1) - A(1, 2), A(0, 2) - A(2, 0), A(1, 0) - A(0, 1), ValueOf(pose.p, part);
  V.head<3>() /= 2;
  return V;
}

/// The wrench at c of one that acts at c + r.
inline Real6 AtCom(const Real6& wrench, const Real3& r) {
  Real6 shifted = wrench;
  shifted.head<3>() += r.cross(wrench.tail<3>());
  return shifted;
}

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

/// Returns the mismatch of a prescribed coordinate with the value s, where M is at X in F.
Mismatch DriveMismatch(const JointDescription& joint, int coordinate, const JetPose& X,
                       const Jet& s);

/// Returns the mismatches of all constrained directions.
std::vector<Mismatch> Mismatches(const JointDescription& joint, bool spatial, const JetPose& X);

}  // namespace loopbench::testing
