#include "tests/contract/time_oracle.h"

#include "tests/contract/dense.h"

namespace loopbench::testing {

namespace {

/// x^power with its derivatives by x.
Jet Power(Real x, int power) {
  Jet result(1);
  for (int i = 0; i < power; ++i) result = result * Jet(x, 1);
  return result;
}

/// Coefficients of the cubics of a natural spline, four per piece in powers of (t - t_i): both ends
/// of each piece, both derivatives across inner points, no curvature at the outer ones.
RealVector SplineCoefficients(const TimeTable& table) {
  const int pieces = static_cast<int>(table.times.size()) - 1;
  RealMatrix A = RealMatrix::Zero(4 * pieces, 4 * pieces);
  RealVector b = RealVector::Zero(4 * pieces);
  int row = 0;
  for (int i = 0; i < pieces; ++i) {
    const Real h = Real(table.times[i + 1]) - Real(table.times[i]);
    for (int k = 0; k < 4; ++k) {
      const Jet here = Power(0, k), there = Power(h, k);
      A(row, 4 * i + k) = here.f;
      A(row + 1, 4 * i + k) = there.f;
      if (i == 0) A(4 * pieces - 2, k) = here.dd;
      if (i == pieces - 1) A(4 * pieces - 1, 4 * i + k) = there.dd;
      if (i + 1 == pieces) continue;
      A(row + 2, 4 * i + k) = there.d;
      A(row + 3, 4 * i + k) = there.dd;
      A(row + 2, 4 * (i + 1) + k) = -here.d;
      A(row + 3, 4 * (i + 1) + k) = -here.dd;
    }
    b[row] = table.values[i];
    b[row + 1] = table.values[i + 1];
    row += i + 1 == pieces ? 2 : 4;
  }
  return SolveFullPivot(A, b, 0);
}

Jet At(const Polynomial& f, Real t) {
  Jet y;
  for (std::size_t k = 0; k < f.coefficients.size(); ++k) {
    y = y + Jet(f.coefficients[k]) * Power(t, static_cast<int>(k));
  }
  return y;
}

Jet At(const Harmonic& f, Real t) {
  return Jet(f.mean) + Jet(f.amplitude) * Sin(Jet(f.omega) * Jet(t, 1) + Jet(f.phase));
}

Jet At(const TimeTable& f, Real t) {
  const std::size_t last = f.times.size() - 1;
  const Real first_time = f.times[0], last_time = f.times[last];
  if (!f.cubic && t < first_time) return Jet(f.values[0]);
  if (!f.cubic && t >= last_time) return Jet(f.values[last]);
  std::size_t i = 0;
  while (i + 1 < last && t >= f.times[i + 1]) ++i;
  const Real h = Real(f.times[i + 1]) - Real(f.times[i]);
  if (!f.cubic) {
    const Real slope = (Real(f.values[i + 1]) - Real(f.values[i])) / h;
    return {f.values[i] + slope * (t - f.times[i]), slope};
  }
  const RealVector c = SplineCoefficients(f);
  const Real within = t < first_time ? 0 : t > last_time ? h : t - f.times[i];
  Jet y;
  for (int k = 0; k < 4; ++k) y = y + Jet(c[4 * i + k]) * Power(within, k);
  // straight on beyond the ends
  if (t < first_time) return {y.f + y.d * (t - first_time), y.d};
  if (t >= last_time) return {y.f + y.d * (t - last_time), y.d};
  return y;
}

}  // namespace

Jet OracleAt(const TimeFunctionDescription& function, Real t) {
  return std::visit([t](const auto& f) { return At(f, t); }, function);
}

}  // namespace loopbench::testing
