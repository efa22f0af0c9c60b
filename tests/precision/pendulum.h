// The closed form of a pendulum in all digits of float128.
#pragma once

#include "harness/precision/float128.h"
#include "tests/standard.h"

namespace loopbench::harness {

/// sn(x + K(k), k) by arithmetic-geometric means (Abramowitz and Stegun, 16.4 and 17.6): a_N and
/// with it the amplitude phi_N = 2^N a_N x of the last mean, K = pi / (2 a_N), and
///   sin(2 phi_n-1 - phi_n) = c_n / a_n sin(phi_n)
/// down to phi_0. Every mean doubles the digits: eight are plenty for k below 1 - 1e-3.
inline Float128 ShiftedSn(const Float128& x, const Float128& k) {
  constexpr int kMeans = 8;
  Float128 a = 1, b = sqrt(1 - k * k), power = 1;
  Float128 ratios[kMeans];  // c_n / a_n
  for (Float128& ratio : ratios) {
    const Float128 c = (a - b) / 2, mean = (a + b) / 2;
    b = sqrt(a * b);
    a = mean;
    ratio = c / a;
    power *= 2;
  }
  Float128 phi = power * (a * x + std::numbers::pi_v<Float128> / 2);
  for (int n = kMeans - 1; n >= 0; --n) phi = (phi + asin(ratios[n] * sin(phi))) / 2;
  return sin(phi);
}

/// The angle at t of a pendulum theta'' = -w^2 sin(theta) that starts at rest at theta0
/// (harness/observers/built_in.cpp): sin(theta / 2) = k sn(w t + K(k), k), k = sin(theta0 / 2).
inline Float128 PendulumAngle(const Float128& w, const Float128& theta0, const Float128& t) {
  const Float128 k = sin(theta0 / 2);
  return 2 * asin(k * ShiftedSn(w * t, k));
}

}  // namespace loopbench::harness
