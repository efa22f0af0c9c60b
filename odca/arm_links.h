// Arms of a spatial mechanism (arm_sweep.cpp), and their bodies as the links of revolutes.h.
#pragma once

#include <vector>

#include "mechanism/model/mechanism.h"
#include "odca/revolutes.h"

namespace loopbench::odca::arms {

/// A body of an arm. The angle of its joint outwards from Ground is `sign` times its coordinate.
struct ArmBody {
  int u = 0;  ///< index in q and u of its inward joint
  double sign = 1.0;
  Link<double> link;
};

/// The last body of an arm that a cut joint holds: all of the motion of handle 2.
struct ArmTip {
  Response<double, kRows, kAll> response;
  double about12[kAll];  ///< as of Link, for all forces on handle 2
};

/// A joint's side on Ground, and its acceleration relative to gravity, in its axes.
struct GroundSide {
  Pose<Spatial, double> pose;
  Linear<Spatial, double> rise;
};

struct Arm {
  std::vector<ArmBody> bodies;  ///< from Ground outwards
  GroundSide ground;            ///< of the first joint
  int last = 0;                 ///< the mechanism's body at its end
  int closing = -1;             ///< the cut joint there, -1 for an open arm
  ArmTip tip;                   ///< of that
};

/// A cut joint between two arms, or one and Ground.
struct ArmClosing {
  int arm_P = -1, arm_Q = -1;  ///< -1: Ground
  GroundSide ground;           ///< there
  JointKind<Spatial, double> kind;

  int rows() const { return kind.num_constraints(); }
  /// Constrained direction i, in axes of P.
  Direction<Spatial, double> D(int i) const {
    return Direction<Spatial, double>::Unit(kind.axes[kind.num_u + i]);
  }
};

struct Arms {
  std::vector<Arm> arms;
  std::vector<ArmClosing> closings;
};

/// Returns no arms if the mechanism is more than arms of revolute joints under gravity: with a tree
/// joint of another kind, bodies that carry two others or hang freely, other forces, prescribed or
/// released coordinates, a cut joint anywhere except at ends of arms, or directions that are no
/// constant axes.
Arms FindArms(const Mechanism<Spatial, double>& mechanism);

/// Computes SinesAndCosines() without fused products.
bool SinesOfJoints(const double* angles, int count, double* sines, double* cosines);

}  // namespace loopbench::odca::arms
