// Motions of one rigid body in closed form: Jacobi's elliptic functions for the angular velocity or
// the nutation, a quadrature of them (an elliptic integral of the third kind) for the angle that
// goes round. L. Landau, E. Lifshitz: Mechanics, sections 35 and 37; E. Whittaker: Analytical
// Dynamics, sections 69 to 71.
#pragma once

#include <Eigen/Core>

namespace loopbench::harness::reference {

/// R = Rz(phi) Rx(theta) Rz(psi): body axes in fixed axes.
Eigen::Matrix3d EulerRotation(double phi, double theta, double psi);

/// A body without moments, principal moments of inertia I1 < I2 < I3 [kg m^2], that starts with
/// (w1, 0, w3) in its principal axes. L^2 > 2 T I2 is required: the motion that circles axis 3.
class FreeBody {
 public:
  FreeBody(const Eigen::Vector3d& moments, double w1, double w3);

  /// Angular velocity in principal axes at time t [rad/s].
  Eigen::Vector3d Rates(double t) const;
  /// Principal axes at time t in those of the start.
  Eigen::Matrix3d Attitude(double t) const;

 private:
  /// Principal axes in fixed axes whose third is the angular momentum; phi(0) = 0.
  Eigen::Matrix3d FromMomentum(double t) const;
  double PrecessionRate(double t) const;

  Eigen::Vector3d moments_;
  double w1_, w2_, w3_;  ///< amplitudes of cn, sn, dn
  double rate_;          ///< argument per time [1/s]
  double modulus_;       ///< k
};

/// A symmetric body on a fixed point in gravity along -z, started at a turning point of its
/// nutation: theta' = 0, precession `phi_rate`, spin w3 about its own axis. Without spin: the
/// spherical pendulum.
class SymmetricTop {
 public:
  /// Moments about the fixed point, A across the axis and C along it [kg m^2]; weight times
  /// distance of the centre of mass m g l [N m]; theta from +z [rad].
  SymmetricTop(double A, double C, double mgl, double theta, double phi_rate, double w3);

  /// cos(theta) at time t.
  double Height(double t) const;
  /// Body axes, the third along the axis of symmetry, in fixed axes; phi(0) = psi(0) = 0.
  Eigen::Matrix3d Attitude(double t) const;
  /// cos(theta) at the other end of the nutation.
  double other_height() const { return other_; }

 private:
  double PrecessionRate(double t) const;

  double A_, w3_, p_phi_, p_psi_;
  double start_, other_;  ///< cos(theta) at the two turning points
  double rate_, modulus_;
};

}  // namespace loopbench::harness::reference
