// Arms of a spatial mechanism (arm_sweep.h), and their bodies as the links of revolute_handles.h.
#pragma once

#include <vector>

#include "mechanism/formulation/constraint_solver.h"
#include "mechanism/model/mechanism.h"
#include "odca/revolute_handles.h"

namespace loopbench::odca::arms {

/// A body of an arm. The angle of its joint outwards from Ground is `sign` times its coordinate.
struct ArmBody {
  int u = 0;  ///< index in q and u of its inward joint
  double sign = 1.0;
  Link<double> link;
};

/// The last body of an arm that a cut joint holds: all of the motion of handle 2.
struct ArmTip {
  Response<double, kAll> response;
  double about12[kAll];  ///< as of Link, for all forces on handle 2
};

struct Arm {
  std::vector<ArmBody> bodies;   ///< from Ground outwards
  Pose<Spatial, double> ground;  ///< of the first joint's side on Ground
  int last = 0;                  ///< the mechanism's body at its end
  int closing = -1;              ///< the cut joint there, -1 for an open arm
  ArmTip tip;                    ///< of that
};

/// A cut joint between two arms, or one and Ground.
struct ArmClosing {
  int arm_P = -1, arm_Q = -1;    ///< -1: Ground
  Pose<Spatial, double> ground;  ///< of its side there
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
  Linear<Spatial, double> gravity;
};

/// Returns no arms if the mechanism is more than arms of revolute joints under gravity: with a tree
/// joint of another kind, bodies that carry two others or hang freely, other forces, prescribed or
/// released coordinates, a cut joint anywhere except at ends of arms, or directions that are no
/// constant axes.
Arms FindArms(const Mechanism<Spatial, double>& mechanism);

/// The end of an arm at its handle 2, in axes there. Ground has no response.
struct ClosingSide {
  Pose<Spatial, double> pose;  ///< of its axes in Ground
  Velocity<Spatial, double> V = Velocity<Spatial, double>::Zero();
  OneHandle<double, kAll> assembly = {};
  const Symmetric<double, kAll>* alone = nullptr;  ///< zeta22 of the last body; null for Ground
  double F2[kAll] = {};                            ///< is set: the force on it
};

/// A cut joint between the ends of two arms, or of one and Ground. It is imposed at one point, the
/// origin Mo of the frame on its body Q, along axes of the frame on its body P (joint.h). Its sides
/// may have drifted apart, so both ends have all six components. Quantities equal those of
/// mechanism/model/kinematics.cpp and joins.cpp, in axes of P.
class Closing {
 public:
  /// Rejects a response across the joint with an eigenvalue below `limit` relative to the response
  /// of its two bodies alone.
  Closing(const ArmClosing& joint, double limit) : joint_(joint), limit_(limit) {}

  /// Sets the poses of the sides; `largest` becomes this joint's violation if that is larger.
  void Place(const ClosingSide& P, const ClosingSide& Q, Correction<double>* largest);
  /// Computes forces on both sides. Negative if the joint may be degenerate.
  template <Sought kSought>
  double Close(ClosingSide& P, ClosingSide& Q) const;

 private:
  /// Transform from axes and origin of a side to axes of P and Mo.
  struct Way {
    Rotation<Spatial, double> R;
    Linear<Spatial, double> e;  ///< Mo from the side's origin, in axes of P

    template <class Kind>
    SpatialVector<Spatial, double, Kind> Of(const double* rows) const;
    /// A force at Mo as one on the side, in its rows.
    void Back(const Wrench<Spatial, double>& F, double* rows) const;
  };
  template <Sought kSought, int n>
  double CloseRows(ClosingSide& P, ClosingSide& Q) const;
  template <Sought kSought>
  Acceleration<Spatial, double> Missing(const ClosingSide& P, const ClosingSide& Q) const;

  ArmClosing joint_;
  double limit_;
  Way from_P_, from_Q_;
  Velocity<Spatial, double> V_P_, V_rel_, mismatch_;  ///< at Mo
};

}  // namespace loopbench::odca::arms
