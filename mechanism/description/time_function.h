// A prescribed function of time with two derivatives: motions s(t) and torques tau(t).
//
//   polynomial   c_0 + c_1 t + c_2 t^2 + ..          a constant, a constant speed, ..
//   harmonic     mean + amplitude sin(omega t + phase)
//   table        points (t_i, y_i) and between them a natural cubic spline, which goes on straight
//                beyond both ends (so it has two continuous derivatives everywhere), or straight
//                lines, whose end values hold beyond them
//
// At the knots of a table a derivative jumps, which reduces an integrator's order: steps end there.
#pragma once

#include <string>
#include <variant>
#include <vector>

namespace loopbench {

struct Polynomial {
  std::vector<double> coefficients;  ///< [unit / s^i]
};

struct Harmonic {
  double mean = 0.0, amplitude = 0.0;
  double omega = 0.0;  ///< [rad/s]
  double phase = 0.0;  ///< [rad]
};

struct TimeTable {
  std::vector<double> times;   ///< [s], ascending
  std::vector<double> values;  ///< as many
  bool cubic = true;           ///< else straight lines
};

using TimeFunctionDescription = std::variant<Polynomial, Harmonic, TimeTable>;

/// Returns "" or the error: lists that are empty, of unequal length or not ascending, or non-finite
/// numbers.
std::string Validate(const TimeFunctionDescription& description);

/// Value and derivatives by time.
template <class S>
struct TimeValue {
  S value = S(0), rate = S(0), acceleration = S(0);
};

class TimeFunction {
 public:
  /// `description` must be valid. Computes a spline once.
  explicit TimeFunction(TimeFunctionDescription description);

  /// O(log of the table's length), no allocation. At a knot, the piece that begins there.
  template <class S>
  TimeValue<S> At(S t) const;

  /// Sum of the jumps of the rate at knots after `from` up to `to`; zero except for straight lines.
  double RateJump(double from, double to) const;

  /// Returns the times at which some derivative jumps; empty except for tables.
  const std::vector<double>& knots() const;
  const TimeFunctionDescription& description() const { return description_; }

 private:
  TimeFunctionDescription description_;
  std::vector<double> curvatures_;  ///< y'' at each point of a cubic table
};

}  // namespace loopbench
