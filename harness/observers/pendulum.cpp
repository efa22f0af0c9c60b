#include <boost/math/special_functions/ellint_1.hpp>
#include <boost/math/special_functions/jacobi_elliptic.hpp>
#include <cmath>
#include <numbers>

#include "harness/observers/observer.h"

namespace loopbench::harness {

// With k^2 = sin^2(theta0/2) + omega0^2 / (4 w^2), w^2 = frequency_squared:
//   swinging (k < 1)   sin(theta/2) = k sn(w t + a, k),     sin(theta0/2) = k sn(a, k)
//   turning  (k > 1)   theta/2 = am(k w t + a, 1/k),        theta0/2 = am(a, 1/k)
// (Whittaker, Analytical Dynamics, section 44), and on the separatrix, where sn is tanh and am its
// arcsine,
//   k = 1              sin(theta/2) = tanh(w t + a),        sin(theta0/2) = tanh(a).
// Motions with omega0 < 0 are mirrored, so that no quarter period enters `a`: near the separatrix
// it grows without bound and is poorly known.
double PendulumAngle(double frequency_squared, double theta0, double omega0, double t) {
  if (omega0 < 0) return -PendulumAngle(frequency_squared, -theta0, -omega0, t);
  const double w = std::sqrt(frequency_squared);
  const double s0 = std::sin(theta0 / 2), v0 = omega0 / (2 * w);
  const double k = std::hypot(s0, v0);
  if (k == 0.0) return 0.0;
  if (k == 1.0) return 2 * std::asin(std::tanh(w * t + std::atanh(s0)));
  if (k < 1.0) {
    // sn(a) = s0 / k, and cn(a) has the sign of the speed
    const double a = boost::math::ellint_1(k, std::atan2(s0 / k, v0 / k));
    return 2 * std::asin(k * boost::math::jacobi_sn(k, w * t + a));
  }
  const double modulus = 1 / k;
  const double a = boost::math::ellint_1(modulus, theta0 / 2);
  const double x = k * w * t + a;
  double cn, dn;
  const double sn = boost::math::jacobi_elliptic(modulus, x, &cn, &dn);
  // am(x) grows by pi with every 2 K; sn and cn give it modulo 2 pi
  const double turns = std::round(x / (4 * boost::math::ellint_1(modulus)));
  return 2 * (std::atan2(sn, cn) + 2 * std::numbers::pi * turns);
}

}  // namespace loopbench::harness
