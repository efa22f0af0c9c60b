// Numbers with their first and second derivative along a curve, and the little geometry the oracle
// builds from them. Nothing here knows the project's kinematics.
#pragma once

#include <array>
#include <cmath>

namespace loopbench::testing {

using Real = long double;

/// f, f', f'' at one instant of a curve.
struct Jet {
  Real f = 0, d = 0, dd = 0;
  Jet() = default;
  Jet(Real value, Real first = 0, Real second = 0) : f(value), d(first), dd(second) {}
};

inline Jet operator+(const Jet& a, const Jet& b) { return {a.f + b.f, a.d + b.d, a.dd + b.dd}; }
inline Jet operator-(const Jet& a, const Jet& b) { return {a.f - b.f, a.d - b.d, a.dd - b.dd}; }
inline Jet operator-(const Jet& a) { return {-a.f, -a.d, -a.dd}; }
inline Jet operator*(const Jet& a, const Jet& b) {
  return {a.f * b.f, a.d * b.f + a.f * b.d, a.dd * b.f + 2 * a.d * b.d + a.f * b.dd};
}
inline Jet Reciprocal(const Jet& a) {
  const Real r = 1 / a.f;
  return {r, -a.d * r * r, (2 * a.d * a.d * r - a.dd) * r * r};
}
inline Jet Cos(const Jet& a) {
  const Real c = std::cos(a.f), s = std::sin(a.f);
  return {c, -s * a.d, -c * a.d * a.d - s * a.dd};
}
inline Jet Sin(const Jet& a) {
  const Real c = std::cos(a.f), s = std::sin(a.f);
  return {s, c * a.d, -s * a.d * a.d + c * a.dd};
}

inline Jet Sqrt(const Jet& a) {
  const Real r = std::sqrt(a.f), d = a.d / (2 * r);
  return {r, d, (a.dd / 2 - d * d) / r};
}
/// The angle whose cosine and sine are given.
inline Jet Angle(const Jet& c, const Jet& s) {
  return {std::atan2(s.f, c.f), c.f * s.d - s.f * c.d, c.f * s.dd - s.f * c.dd};
}

using JetVector = std::array<Jet, 3>;

/// Row by row.
struct JetMatrix {
  std::array<Jet, 9> m;
  Jet& operator()(int row, int column) { return m[3 * row + column]; }
  const Jet& operator()(int row, int column) const { return m[3 * row + column]; }
};

inline JetVector operator+(const JetVector& a, const JetVector& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
inline JetVector operator-(const JetVector& a) { return {-a[0], -a[1], -a[2]}; }
inline JetVector operator*(const JetMatrix& A, const JetVector& x) {
  JetVector y;
  for (int i = 0; i < 3; ++i) y[i] = A(i, 0) * x[0] + A(i, 1) * x[1] + A(i, 2) * x[2];
  return y;
}
inline JetMatrix operator*(const JetMatrix& A, const JetMatrix& B) {
  JetMatrix C;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      C(i, j) = A(i, 0) * B(0, j) + A(i, 1) * B(1, j) + A(i, 2) * B(2, j);
    }
  }
  return C;
}
inline JetMatrix Transposed(const JetMatrix& A) {
  JetMatrix B;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) B(i, j) = A(j, i);
  }
  return B;
}
inline JetMatrix JetIdentity() {
  JetMatrix A;
  for (int i = 0; i < 3; ++i) A(i, i) = Jet(1);
  return A;
}

/// Orientation and origin of a frame; plane figures are embedded with z = 0.
struct JetPose {
  JetMatrix R = JetIdentity();
  JetVector p{};
};
inline JetPose operator*(const JetPose& a, const JetPose& b) {
  return {a.R * b.R, a.p + a.R * b.p};
}
inline JetPose Inverted(const JetPose& a) {
  const JetMatrix R = Transposed(a.R);
  return {R, -(R * a.p)};
}

}  // namespace loopbench::testing
