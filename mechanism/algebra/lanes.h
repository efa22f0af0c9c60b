// SIMD lanes, as many as one instruction takes: 8 with AVX-512, 4 with AVX, else 2. The compilers'
// own vectors (GCC, clang): + - * / work lane by lane, and a scalar operand applies to all lanes. A
// template over T = double or Lanes is one kernel for both.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <utility>

#include "mechanism/algebra/small_matrix.h"

namespace loopbench {

#if defined(__AVX512F__)
inline constexpr int kLanes = 8;
#elif defined(__AVX__)
inline constexpr int kLanes = 4;
#else
inline constexpr int kLanes = 2;
#endif

using Lanes [[gnu::vector_size(kLanes * sizeof(double))]] = double;
/// Bit patterns of such numbers and comparison results: all ones for true.
using LaneBits [[gnu::vector_size(kLanes * sizeof(double))]] = std::int64_t;

template <class T>
using BitsOf = std::conditional_t<std::is_same_v<T, double>, std::int64_t, LaneBits>;

/// Comparison result: bool, or for each lane all ones or zeros.
template <class T>
using TruthOf = std::conditional_t<std::is_same_v<T, double>, bool, LaneBits>;
inline bool Any(bool truth) { return truth; }
inline bool Any(const LaneBits& truth) {
  std::int64_t any = 0;
  for (int lane = 0; lane < kLanes; ++lane) any |= truth[lane];
  return any != 0;
}

/// Loads and stores as many numbers as T has; memory need not be aligned.
template <class T>
inline T Load(const double* from) {
  T value;
  std::memcpy(&value, from, sizeof(T));
  return value;
}
template <class T>
inline void Store(const T& value, double* to) {
  std::memcpy(to, &value, sizeof(T));
}

/// Extracts one lane of a struct of Lanes as a struct of numbers.
template <template <class> class Struct>
inline void SetLane(Struct<Lanes>& pack, int lane, const Struct<double>& one) {
  static_assert(sizeof(pack) == kLanes * sizeof(one));
  for (std::size_t i = 0; i < sizeof(one) / sizeof(double); ++i) {
    std::memcpy(reinterpret_cast<char*>(&pack) + i * sizeof(Lanes) +
                    static_cast<std::size_t>(lane) * sizeof(double),
                reinterpret_cast<const char*>(&one) + i * sizeof(double), sizeof(double));
  }
}
inline void SetLane(Lanes& pack, int lane, double one) { pack[lane] = one; }
inline void SetLane(double& pack, int /*lane*/, double one) { pack = one; }
template <template <class> class Struct>
inline Struct<double> LaneOf(const Struct<Lanes>& pack, int lane) {
  Struct<double> one;
  for (std::size_t i = 0; i < sizeof(one) / sizeof(double); ++i) {
    std::memcpy(reinterpret_cast<char*>(&one) + i * sizeof(double),
                reinterpret_cast<const char*>(&pack) + i * sizeof(Lanes) +
                    static_cast<std::size_t>(lane) * sizeof(double),
                sizeof(double));
  }
  return one;
}

/// kLanes of the numbers of `a` and then `b`, from one of them on.
template <int from, int... lane>
inline Lanes From(const Lanes& a, const Lanes& b, std::integer_sequence<int, lane...>) {
  return __builtin_shufflevector(a, b, (from + lane)...);
}
/// Each number a lane further on, the last one left out, behind `first`.
inline Lanes LaneAfter(const Lanes& numbers, double first) {
  return From<kLanes - 1>(Lanes{} + first, numbers, std::make_integer_sequence<int, kLanes>());
}
/// Each number a lane before, the first one left out, 0 in the last one.
inline Lanes LaneBefore(const Lanes& numbers) {
  return From<1>(numbers, Lanes{}, std::make_integer_sequence<int, kLanes>());
}

/// The smaller one, lane by lane.
template <class T>
inline T Min(const T& a, const T& b) {
  return a < b ? a : b;
}

/// The larger one, lane by lane.
template <class T>
inline T Max(const T& a, const T& b) {
  return a < b ? b : a;
}

template <class T>
inline T Magnitude(const T& a) {
  return a < -a ? -a : a;
}

/// The smallest of all lanes.
inline double Smallest(double a) { return a; }
inline double Smallest(const Lanes& a) {
  double smallest = a[0];
  for (int lane = 1; lane < kLanes; ++lane) smallest = Min(smallest, a[lane]);
  return smallest;
}

/// Angles [rad] beyond which SinCos() must not be asked.
inline constexpr double kLargestAngle = 1e6;

/// Returns sine and cosine of |x| <= kLargestAngle with an error of at most 1.1 units in the last
/// place (1.02 in some millions of trials); the same bits in every lane and for a single number.
/// Quarter turns are subtracted in three parts, whose multiples up to 2^20 are exact (W. J. Cody,
/// W. Waite, Software Manual for the Elementary Functions, 1980). Coefficients for the rest, at
/// most pi/4, are from fdlibm (Sun Microsystems, 1993, k_sin.c and k_cos.c).
template <class T>
LOOPBENCH_INLINE void SinCos(const T& x, T& sine, T& cosine) {
  using Bits = BitsOf<T>;
  constexpr double kRound = 6755399441055744.0;  // 1.5 * 2^52: the sum ends at the integers
  const T rounded = x * 0.63661977236758134308 + kRound;
  const Bits quarter = std::bit_cast<Bits>(rounded);
  const T k = rounded - kRound;
  const T r = x - k * 1.57079632673412561417e+00;
  const T half = k * 6.07710050630396597660e-11;
  const T most = r - half;
  const T less = ((r - most) - half) - k * 2.02226624879595063154e-21;
  const T y = most + less, rest = (most - y) + less;
  const T z = y * y;
  const T s =
      y +
      (y * z *
           (-1.66666666666666324348e-01 +
            z * (8.33333333332248946124e-03 +
                 z * (-1.98412698298579493134e-04 +
                      z * (2.75573137070700676789e-06 +
                           z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10))))) +
       rest);
  const T c =
      1.0 -
      (0.5 * z -
       (z * z *
            (4.16666666666666019037e-02 +
             z * (-1.38888888888741095749e-03 +
                  z * (2.48015872894767294178e-05 +
                       z * (-2.75573143513906633035e-07 +
                            z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11))))) -
        y * rest));
  const Bits swap = -(quarter & 1), s_bits = std::bit_cast<Bits>(s),
             c_bits = std::bit_cast<Bits>(c);
  sine = std::bit_cast<T>(((swap & c_bits) | (~swap & s_bits)) ^ ((quarter & 2) << 62));
  cosine = std::bit_cast<T>(((swap & s_bits) | (~swap & c_bits)) ^ (((quarter + 1) & 2) << 62));
}

}  // namespace loopbench
