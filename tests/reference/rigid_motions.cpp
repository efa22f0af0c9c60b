#include "tests/reference/rigid_motions.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <boost/math/quadrature/gauss.hpp>
#include <boost/math/special_functions/jacobi_elliptic.hpp>
#include <cmath>
#include <stdexcept>

namespace loopbench::harness::reference {
namespace {

struct Jacobi {
  double sn, cn, dn;
};

Jacobi JacobiAt(double modulus, double x) {
  Jacobi value{};
  value.sn = boost::math::jacobi_elliptic(modulus, x, &value.cn, &value.dn);
  return value;
}

/// Integral of a smooth function with period `period` from 0 to t: 15 Gauss points on each eighth
/// of a period leave nothing but round-off.
template <class Function>
double Integral(const Function& f, double period, double t) {
  const int pieces = std::max(1, static_cast<int>(std::ceil(8 * t / period)));
  double sum = 0.0;
  for (int i = 0; i < pieces; ++i) {
    sum += boost::math::quadrature::gauss<double, 15>::integrate(f, t * i / pieces,
                                                                 t * (i + 1) / pieces);
  }
  return sum;
}

}  // namespace

Eigen::Matrix3d EulerRotation(double phi, double theta, double psi) {
  using Eigen::AngleAxisd;
  using Eigen::Vector3d;
  return (AngleAxisd(phi, Vector3d::UnitZ()) * AngleAxisd(theta, Vector3d::UnitX()) *
          AngleAxisd(psi, Vector3d::UnitZ()))
      .toRotationMatrix();
}

// Euler's equations I1 w1' = (I2 - I3) w2 w3 and cyclic are solved by
//   w1 = a cn(p t), w2 = b sn(p t), w3 = c dn(p t),
//   p^2 = c^2 (I3 - I1)(I3 - I2) / (I1 I2),  b^2 = a^2 I1 (I3 - I1) / (I2 (I3 - I2)),
//   k^2 = a^2 I1 (I2 - I1) / (c^2 I3 (I3 - I2)).
FreeBody::FreeBody(const Eigen::Vector3d& moments, double w1, double w3)
    : moments_(moments), w1_(w1), w3_(w3) {
  const double I1 = moments[0], I2 = moments[1], I3 = moments[2];
  rate_ = w3 * std::sqrt((I3 - I1) * (I3 - I2) / (I1 * I2));
  w2_ = w1 * std::sqrt(I1 * (I3 - I1) / (I2 * (I3 - I2)));
  modulus_ = std::abs(w1 / w3) * std::sqrt(I1 * (I2 - I1) / (I3 * (I3 - I2)));
  if (!(modulus_ < 1.0)) throw std::invalid_argument("the body does not circle its axis 3");
}

Eigen::Vector3d FreeBody::Rates(double t) const {
  const Jacobi j = JacobiAt(modulus_, rate_ * t);
  return {w1_ * j.cn, w2_ * j.sn, w3_ * j.dn};
}

double FreeBody::PrecessionRate(double t) const {
  const Eigen::Vector3d w = Rates(t), L = moments_.cwiseProduct(w);
  return L.norm() * (L[0] * w[0] + L[1] * w[1]) / (L[0] * L[0] + L[1] * L[1]);
}

// R^T e_z = L_body / |L| = (sin(theta) sin(psi), sin(theta) cos(psi), cos(theta)).
Eigen::Matrix3d FreeBody::FromMomentum(double t) const {
  const Eigen::Vector3d L = moments_.cwiseProduct(Rates(t));
  const double period = 4.0 / std::abs(rate_);  // at most a quarter off: only sets the pieces
  const double phi = Integral([this](double s) { return PrecessionRate(s); }, period, t);
  return EulerRotation(phi, std::atan2(std::hypot(L[0], L[1]), L[2]), std::atan2(L[0], L[1]));
}

Eigen::Matrix3d FreeBody::Attitude(double t) const {
  return FromMomentum(0.0).transpose() * FromMomentum(t);
}

// u = cos(theta):  u'^2 = (2 / A)(E - mgl u)(1 - u^2) - ((p_phi - p_psi u) / A)^2
//                       = (2 mgl / A)(u - u1)(u - u2)(u - u3),     u1 <= u <= u2 <= 1 <= u3,
// E without the energy of the spin;  u = u1 + (u2 - u1) sn^2(x),  x' = sqrt(mgl (u3 - u1) / (2 A)).
SymmetricTop::SymmetricTop(double A, double C, double mgl, double theta, double phi_rate, double w3)
    : A_(A), w3_(w3) {
  const double u0 = std::cos(theta), sin2 = std::sin(theta) * std::sin(theta);
  p_psi_ = C * w3;
  p_phi_ = A * phi_rate * sin2 + p_psi_ * u0;
  const double E = A * phi_rate * phi_rate * sin2 / 2 + mgl * u0;
  // the cubic without its known root: cubic u^2 + linear u + constant
  const double cubic = 2 * mgl / A;
  const double linear = cubic * u0 - 2 * E / A - p_psi_ * p_psi_ / (A * A);
  const double constant = linear * u0 - cubic + 2 * p_phi_ * p_psi_ / (A * A);
  // the root farther from zero first, the other one by their product: no cancellation
  const double half = -linear / 2;
  const double far = half + std::copysign(std::sqrt(half * half - cubic * constant), half);
  const double u3 = std::max(far / cubic, constant / far);
  start_ = u0;
  other_ = std::min(far / cubic, constant / far);
  const double u1 = std::min(start_, other_), u2 = std::max(start_, other_);
  rate_ = std::sqrt(mgl * (u3 - u1) / (2 * A));
  modulus_ = std::sqrt((u2 - u1) / (u3 - u1));
}

double SymmetricTop::Height(double t) const {
  const Jacobi j = JacobiAt(modulus_, rate_ * t);
  // from the lower end sn^2 rises from 0; from the upper one it falls from sn^2(K) = 1
  const double part = start_ <= other_ ? j.sn * j.sn : (j.sn * j.sn) / (j.dn * j.dn);
  if (start_ <= other_) return start_ + (other_ - start_) * part;
  // 1 - sn^2(x + K) = 1 - cn^2 / dn^2 = (1 - k^2) sn^2 / dn^2
  return start_ + (other_ - start_) * (1 - modulus_ * modulus_) * part;
}

double SymmetricTop::PrecessionRate(double t) const {
  const double u = Height(t);
  return (p_phi_ - p_psi_ * u) / (A_ * (1 - u * u));
}

Eigen::Matrix3d SymmetricTop::Attitude(double t) const {
  const double period = 2.0 / rate_;  // as above
  const double phi = Integral([this](double s) { return PrecessionRate(s); }, period, t);
  const double psi =
      Integral([this](double s) { return w3_ - Height(s) * PrecessionRate(s); }, period, t);
  return EulerRotation(phi, std::acos(Height(t)), psi);
}

}  // namespace loopbench::harness::reference
