// An oracle for accelerations, independent of the project's kinematics.
//
// Body poses as functions of q come from composing joint transforms, written anew (and compared
// with JointKind::transform in tests/mechanism/joint_test.cpp). Jacobians and velocity terms follow
// by differentiating those functions along curves q(t) (jet.h), all in long double:
//
//   G_i   = d/dt of all poses along q' = N e_i             column i of the bodies' Jacobian
//   A_0   = d2/dt2 of all poses along q' = N u, udot = 0   what the speeds alone do
//   c(q)  = joint mismatches, J and gamma likewise; prescribed coordinates are jets of time in A_0
//           and constants in G_i,
//   M = sum G^T I G,   h = sum G^T (I A_0 + [w x I w; 0] - applied),
//   [ M J^T; J 0 ] [ udot; -lambda ] = [ -h; gamma ]       dense, scaled to unit diagonal of M.
//
// Redundant constraints are solved in the least squares sense: udot is unique, lambda is not.
// The plane is treated as part of space: one code for both.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "mechanism/model/mechanism.h"
#include "tests/contract/dense.h"
#include "tests/contract/jet.h"

namespace loopbench::testing {

using Real3 = Eigen::Matrix<Real, 3, 1>;
using Real33 = Eigen::Matrix<Real, 3, 3>;
/// [angular; linear] or [moment; force].
using Real6 = Eigen::Matrix<Real, 6, 1>;

/// Which joints are coordinates and where: all that the oracle takes from a Mechanism.
struct Layout {
  struct Step {
    int joint = -1;  ///< index of the description's joint, -1: free from Ground at the com
    int parent = 0, child = 0;
    int q = 0, u = 0;  ///< offsets
  };
  bool spatial = false;
  int num_q = 0, num_u = 0;
  std::vector<Step> steps;
  std::vector<int> constraints;  ///< indices of the description's joints
};

template <class Space, class S>
Layout LayoutOf(const Mechanism<Space, S>& mechanism) {
  Layout layout;
  layout.spatial = Space::kRot == 3;
  layout.num_q = mechanism.num_q();
  layout.num_u = mechanism.num_u();
  for (const TreeStep& step : mechanism.tree()) {
    const Joint<Space, S>& joint = mechanism.joints()[step.joint];
    layout.steps.push_back(
        {joint.description, step.parent, step.child, joint.q_offset, joint.u_offset});
  }
  for (int index : mechanism.constraints()) {
    layout.constraints.push_back(mechanism.joints()[index].description);
  }
  return layout;
}

/// The oracle's values at one (q, u).
struct Answer {
  RealVector udot;
  std::vector<Real6> accelerations;  ///< of the centres of mass, ground axes; by body
  std::vector<Real6> forces;         ///< constraint force on Q at Mo, ground axes; by user joint
  int rows = 0;                      ///< of J
  int rank = 0;                      ///< of J
  /// Extreme eigenvalues (the zero ones left out) of K^-1 J M^-1 J^T K^-T, where K K^T is the
  /// response across each constraint of its two bodies alone. 1 without constraints.
  double rcond = 1.0;
  bool full_rank() const { return rank == rows; }
};

/// The equations at one (q, u).
struct Equations {
  RealMatrix M, J;
  RealVector h, gamma;
};

class Oracle {
 public:
  Oracle(const MechanismDescription& description, Layout layout);

  /// The time [s] at which given functions of time are taken from now on; 0 at first.
  void SetTime(Real t) { time_ = t; }

  /// X_WB of every body at its centre of mass.
  std::vector<JetPose> Poses(const RealVector& q) const;
  /// Pose of M in F of a user joint.
  JetPose JointPose(int joint, const std::vector<JetPose>& poses) const;
  Equations Form(const RealVector& q, const RealVector& u);
  Answer Solve(const RealVector& q, const RealVector& u);
  /// K^-1 J L^-T with K as in Answer::rcond and M = L L^T: rows of constraints, columns of speeds.
  /// Its singular values squared are the spectrum that rcond is taken of; no product is formed.
  RealMatrix ScaledConstraints(const RealVector& q);
  /// c(q): zero where every constraint holds.
  RealVector ClosureMismatches(const RealVector& q) const;
  /// d/dt of all closures: J u and what prescribed motions add.
  RealVector ClosureRates(const RealVector& q, const RealVector& u) const;
  /// The speeds nearest to u that keep the closures.
  RealVector Consistent(const RealVector& q, const RealVector& u) const;
  /// Kinetic energy, gravity, springs, constant torques and forces in ground axes [J].
  Real TotalEnergy(const RealVector& q, const RealVector& u) const;
  /// Applied wrenches at the centres of mass, by body.
  std::vector<Real6> Applied(const RealVector& q, const RealVector& u) const;
  /// Power [W] of all applied wrenches, those with a potential included.
  Real TotalPower(const RealVector& q, const RealVector& u) const;

 private:
  struct Frames {
    JetPose X_PF, X_QM;
  };
  struct Row {  ///< a scalar constraint: unit wrench [moment; force] on Q at Mo, ground axes
    int joint = 0;
    Real6 wrench;
  };

  /// Coordinates of all steps, prescribed ones among them; those stand still unless `driven`.
  std::vector<Jet> Curve(const RealVector& q, const RealVector& u, bool driven) const;
  Jet Prescribed(const PrescribedMotion& motion) const;
  std::vector<JetPose> PosesAlong(const std::vector<Jet>& q) const;
  /// c(q) of all constraints along a curve.
  std::vector<Jet> Closures(const std::vector<JetPose>& poses, bool driven) const;
  RealMatrix Jacobian(const RealVector& q) const;
  std::vector<Row> Rows(const std::vector<JetPose>& poses) const;
  /// Measured coordinate of a revolute or prismatic joint, with its speed.
  Jet Coordinate(int joint, const std::vector<JetPose>& poses) const;
  /// Applied wrenches at the centres of mass.
  std::vector<Real6> Applied(const std::vector<JetPose>& poses) const;
  RealMatrix JointScales() const;
  /// Rank and condition of the scaled rows J.
  void Rank(const RealMatrix& M, const RealMatrix& J, Answer& answer) const;
  void JointForces(const RealVector& lambda, Answer& answer) const;
  Real33 InertiaInGround(int body, const JetPose& pose) const;

  const MechanismDescription description_;
  const Layout layout_;
  Real time_ = 0;
  std::vector<Frames> frames_;
  std::vector<int> first_;  ///< of each step in a curve
  // of the last Form()
  std::vector<JetPose> poses_;
  RealMatrix G_;                      ///< six rows per body
  std::vector<Real6> bias_, needed_;  ///< A_0; wrench of inertia and gyroscopic terms less applied
};

/// X_FM of a joint kind, written anew. `q` holds its coordinates along a curve.
/// A rod has its shift instead.
JetPose Transform(JointType type, bool spatial, const Jet* q, Real pitch = 0);

template <class Derived>
Eigen::Matrix<Real, Eigen::Dynamic, Derived::ColsAtCompileTime> ToReal(
    const Eigen::MatrixBase<Derived>& v) {
  return v.template cast<Real>();
}

}  // namespace loopbench::testing
