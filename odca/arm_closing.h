// A cut joint between the ends of two arms, or of one and Ground. It is imposed at one point, the
// origin Mo of the frame on its body Q, along axes of the frame on its body P (joint.h). Its sides
// may have drifted apart, so both ends have all six components. Quantities equal those of
// mechanism/model/kinematics.cpp and joins.cpp, in axes of P.
#pragma once

#include "mechanism/formulation/constraint_solver.h"
#include "odca/arm_links.h"

namespace loopbench::odca::arms {

/// The end of an arm at its handle 2, in axes there. Ground has no response.
struct ClosingSide {
  Pose<Spatial, double> pose;  ///< of its axes in Ground
  Velocity<Spatial, double> V = Velocity<Spatial, double>::Zero();
  OneHandle<double, kAll> assembly = {};
  const Symmetric<double, kAll>* alone = nullptr;  ///< zeta22 of the last body; null for Ground
  double F2[kAll] = {};                            ///< is set: the force on it
};

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
