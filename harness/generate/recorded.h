// A scalar that records the operations of any template compiled for it.
//
// It carries the number, which decides branches of the code, and its node of a graph (graph.h). A
// number without a node is a constant. Comparisons of numbers with nodes are recorded with their
// outcomes. CastsAs defines the value of a number with a node that is cast to double. If the graph
// depends on this value, control flow uses a cast.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <numbers>
#include <type_traits>

#include "harness/generate/graph.h"

namespace loopbench::generate {

/// Result of a cast of a recorded number to another type.
enum class CastsAs { kNumber, kInfinity, kMinusInfinity };

/// Records numbers of this thread in `graph`. Beyond `most_nodes` an operation throws NotCovered.
class Recording {
 public:
  Recording(Graph& graph, CastsAs casts, std::size_t most_nodes = 100'000);
  ~Recording();
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;
};

struct Recorded {
  double number;
  int node;

  Recorded() = default;  // as indefinite as a double's
  template <class Number>
  requires std::is_arithmetic_v<Number>
  constexpr Recorded(Number value) : number(static_cast<double>(value)), node(-1) {}
  constexpr Recorded(double value, int at) : number(value), node(at) {}
  template <class Number>
  requires std::is_arithmetic_v<Number>
  explicit operator Number() const { return static_cast<Number>(Cast()); }

  /// A new input of the current graph with this number.
  static Recorded Input(double number);

  Recorded& operator+=(const Recorded& b) { return *this = *this + b; }
  Recorded& operator-=(const Recorded& b) { return *this = *this - b; }
  Recorded& operator*=(const Recorded& b) { return *this = *this * b; }
  Recorded& operator/=(const Recorded& b) { return *this = *this / b; }

  friend Recorded operator+(const Recorded& a) { return a; }
  friend Recorded operator-(const Recorded& a) { return Make(Operation::kNegate, a); }
  friend Recorded operator+(const Recorded& a, const Recorded& b) {
    return Make(Operation::kAdd, a, b);
  }
  friend Recorded operator-(const Recorded& a, const Recorded& b) {
    return Make(Operation::kSubtract, a, b);
  }
  friend Recorded operator*(const Recorded& a, const Recorded& b) {
    return Make(Operation::kMultiply, a, b);
  }
  friend Recorded operator/(const Recorded& a, const Recorded& b) {
    return Make(Operation::kDivide, a, b);
  }

  friend bool operator==(const Recorded& a, const Recorded& b) {
    return Compare(Relation::kEqual, a, b);
  }
  friend bool operator<(const Recorded& a, const Recorded& b) {
    return Compare(Relation::kLess, a, b);
  }
  friend bool operator>(const Recorded& a, const Recorded& b) { return b < a; }
  friend bool operator<=(const Recorded& a, const Recorded& b) {
    return Compare(Relation::kLessEqual, a, b);
  }
  friend bool operator>=(const Recorded& a, const Recorded& b) { return b <= a; }

  friend Recorded abs(const Recorded& x) { return Make(Operation::kAbs, x); }
  friend Recorded sqrt(const Recorded& x) { return Make(Operation::kSqrt, x); }
  friend Recorded sin(const Recorded& x) { return Make(Operation::kSin, x); }
  friend Recorded cos(const Recorded& x) { return Make(Operation::kCos, x); }
  friend Recorded asin(const Recorded& x) { return Make(Operation::kAsin, x); }
  friend Recorded acos(const Recorded& x) { return Make(Operation::kAcos, x); }
  friend Recorded atan2(const Recorded& y, const Recorded& x) {
    return Make(Operation::kAtan2, y, x);
  }
  friend Recorded exp(const Recorded& x) { return Make(Operation::kExp, x); }
  friend Recorded expm1(const Recorded& x) { return Make(Operation::kExpm1, x); }
  friend Recorded log(const Recorded& x) { return Make(Operation::kLog, x); }
  friend Recorded pow(const Recorded& x, const Recorded& y) { return Make(Operation::kPow, x, y); }
  friend Recorded round(const Recorded& x) { return Make(Operation::kRound, x); }
  friend Recorded remainder(const Recorded& x, const Recorded& y) {
    return Make(Operation::kRemainder, x, y);
  }
  friend Recorded min(const Recorded& a, const Recorded& b) { return Make(Operation::kMin, a, b); }
  friend Recorded max(const Recorded& a, const Recorded& b) { return Make(Operation::kMax, a, b); }
  friend bool isnan(const Recorded& x) { return !(x == x); }
  friend bool isfinite(const Recorded& x) { return !isnan(x - x); }
  friend bool isinf(const Recorded& x) { return !isfinite(x) && !isnan(x); }
  /// One angle at a time, instead of the vector code of Kinematics.
  friend void SinesOfPose(const Recorded& angle, Recorded& sine, Recorded& cosine) {
    PoseSines(angle, sine, cosine);
  }

 private:
  double Cast() const;
  static Recorded Make(Operation operation, const Recorded& a);
  static Recorded Make(Operation operation, const Recorded& a, const Recorded& b);
  static bool Compare(Relation relation, const Recorded& a, const Recorded& b);
  static void PoseSines(const Recorded& angle, Recorded& sine, Recorded& cosine);
};

}  // namespace loopbench::generate

template <>
class std::numeric_limits<loopbench::generate::Recorded> : public std::numeric_limits<double> {
  using Recorded = loopbench::generate::Recorded;
  using Of = std::numeric_limits<double>;

 public:
  static constexpr Recorded epsilon() { return Of::epsilon(); }
  static constexpr Recorded min() { return Of::min(); }
  static constexpr Recorded max() { return Of::max(); }
  static constexpr Recorded lowest() { return Of::lowest(); }
  static constexpr Recorded infinity() { return Of::infinity(); }
  static constexpr Recorded quiet_NaN() { return Of::quiet_NaN(); }
};

template <>
inline constexpr loopbench::generate::Recorded std::numbers::pi_v<loopbench::generate::Recorded> =
    std::numbers::pi;

namespace Eigen {
template <>
struct NumTraits<loopbench::generate::Recorded> : GenericNumTraits<loopbench::generate::Recorded> {
  using Literal = double;
  enum { RequireInitialization = 0, ReadCost = 1, AddCost = 1, MulCost = 1 };
  static loopbench::generate::Recorded dummy_precision() {
    return NumTraits<double>::dummy_precision();
  }
};
}  // namespace Eigen

// Scalar for which mechanism and formulations are compiled here (mechanism/algebra/instantiate.h).
#define LOOPBENCH_FOR_EACH_SCALAR(MACRO) MACRO(::loopbench::generate::Recorded)
#define LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(MACRO) \
  MACRO(Planar, ::loopbench::generate::Recorded) MACRO(Spatial, ::loopbench::generate::Recorded)
#define LOOPBENCH_FOR_EACH_MODEL_SCALAR(MACRO) LOOPBENCH_FOR_EACH_SCALAR(MACRO)
#define LOOPBENCH_FOR_EACH_SPACE_AND_MODEL_SCALAR(MACRO) LOOPBENCH_FOR_EACH_SPACE_AND_SCALAR(MACRO)
