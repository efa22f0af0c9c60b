// Given functions of time against an evaluation written anew, and against their own differences.
#include "mechanism/description/time_function.h"

#include "tests/contract/time_oracle.h"
#include "tests/standard.h"

namespace loopbench::time_function_test {

using testing::Jet;
using testing::OracleAt;
using testing::Real;

struct Sample {
  const char* name;
  TimeFunctionDescription function;
  double scale;  ///< of values and, per second, of derivatives
};

/// Steps of unlike length, ratios up to 10, and one table of two points.
const TimeTable kTable{.times = {-1.0, -0.4, 0.1, 0.2, 1.2, 1.9},
                       .values = {2.0, -1.0, 0.5, 0.75, 3.0, -2.0}};

TimeTable Linear(TimeTable table) {
  table.cubic = false;
  return table;
}

std::vector<Sample> Samples() {
  // derivatives of the table: differences of up to 5 over steps down to 0.1
  return {{"constant", Polynomial{{-3.5}}, 4.0},
          {"polynomial", Polynomial{{1.0, -2.0, 0.5, 0.25}}, 40.0},
          {"harmonic", Harmonic{.mean = 1.0, .amplitude = 2.0, .omega = 3.0, .phase = 0.4}, 20.0},
          {"cubic table", kTable, 500.0},
          {"linear table", Linear(kTable), 50.0},
          {"two points", TimeTable{.times = {0.0, 0.5}, .values = {1.0, 2.0}}, 4.0}};
}

/// Inside, at knots, at the ends and beyond them.
std::vector<double> Times() {
  std::vector<double> times = kTable.times;
  for (double t = -2.0; t < 3.0; t += 0.0617) times.push_back(t);
  return times;
}

TEST(TimeFunctionTest, ValuesAndDerivativesAgreeWithTheOracle) {
  for (const Sample& sample : Samples()) {
    const TimeFunction f(sample.function);
    for (const double t : Times()) {
      SCOPED_TRACE(std::string(sample.name) + " at " + std::to_string(t));
      const Jet expected = OracleAt(sample.function, t);
      const TimeValue<double> y = f.At(t);
      // a few operations on numbers of the size of the scale
      const double bound = 16 * kEps * sample.scale;
      EXPECT_NEAR(y.value, static_cast<double>(expected.f), bound);
      EXPECT_NEAR(y.rate, static_cast<double>(expected.d), bound);
      EXPECT_NEAR(y.acceleration, static_cast<double>(expected.dd), bound);
#ifdef LOOPBENCH_PRECISIONS
      // the spline's curvatures are rounded to double once
      const TimeValue<Real> fine = f.At(static_cast<Real>(t));
      EXPECT_NEAR(static_cast<double>(fine.value - expected.f), 0.0, bound);
#endif
    }
  }
}

TEST(TimeFunctionTest, DerivativesAreDifferences) {
  const Real h = 1e-5L;  // truncation h^2 = 1e-10 of the third derivative, round-off 1e-14
  for (const Sample& sample : Samples()) {
    const TimeFunction f(sample.function);
    for (double t = -1.9871; t < 3.0; t += 0.0617) {
      bool kink = false;  // within a step of one the difference is of two pieces
      for (const double knot : f.knots()) kink = kink || std::abs(knot - t) < 2e-5;
      if (kink) continue;
      SCOPED_TRACE(std::string(sample.name) + " at " + std::to_string(t));
      const auto at = [&](Real time) { return OracleAt(sample.function, time).f; };
      const TimeValue<double> y = f.At(t);
      EXPECT_NEAR(y.rate, static_cast<double>((at(t + h) - at(t - h)) / (2 * h)),
                  1e-7 * sample.scale);
      const double h2 = 1e-5;
      EXPECT_NEAR(y.acceleration, (f.At(t + h2).rate - f.At(t - h2).rate) / (2 * h2),
                  1e-7 * sample.scale);
    }
  }
}

TEST(TimeFunctionTest, TablesPassThroughTheirPointsAndSplinesSmoothlySo) {
  for (const bool cubic : {true, false}) {
    TimeTable table = kTable;
    table.cubic = cubic;
    const TimeFunction f(table);
    EXPECT_EQ(f.knots(), table.times);
    for (std::size_t i = 0; i < table.times.size(); ++i) {
      EXPECT_NEAR(f.At(table.times[i]).value, table.values[i], 8 * kEps);
      const TimeValue<double> before = f.At(std::nextafter(table.times[i], -9.0));
      const TimeValue<double> after = f.At(table.times[i]);
      // slopes within 100, curvatures within 500: continuous up to round-off
      EXPECT_NEAR(before.value, after.value, 1e3 * kEps);
      if (!cubic) continue;
      EXPECT_NEAR(before.rate, after.rate, 1e4 * kEps);
      EXPECT_NEAR(before.acceleration, after.acceleration, 1e5 * kEps);
    }
  }
}

TEST(TimeFunctionTest, BeyondTheirEndsSplinesGoOnStraightAndLinesHold) {
  const TimeFunction cubic(kTable), linear(Linear(kTable));
  for (const double end : {kTable.times.front(), kTable.times.back()}) {
    const double outward = end < 0 ? -1.0 : 1.0;
    const TimeValue<double> at = cubic.At(end), far = cubic.At(end + 10 * outward);
    EXPECT_EQ(far.rate, at.rate);
    EXPECT_EQ(far.acceleration, 0.0);
    EXPECT_NEAR(far.value, at.value + 10 * outward * at.rate, 1e3 * kEps);
    EXPECT_NEAR(at.acceleration, 0.0, 1e3 * kEps) << "natural ends";
    EXPECT_EQ(linear.At(end + 10 * outward).value,
              end < 0 ? kTable.values.front() : kTable.values.back());
    EXPECT_EQ(linear.At(end + 10 * outward).rate, 0.0);
  }
}

/// A parabola's third derivative is zero, but natural ends bend no spline: a straight line is met
/// exactly, and of a sine inner points with the fourth power of the step.
TEST(TimeFunctionTest, SplinesConvergeWithTheFourthPowerOfTheStep) {
  const auto error = [](int points) {
    TimeTable table;
    for (int i = 0; i < points; ++i) {
      // from 0 to pi a sine has no curvature at its ends
      table.times.push_back(M_PI * i / (points - 1));
      table.values.push_back(std::sin(table.times.back()));
    }
    const TimeFunction f(table);
    double worst = 0.0;
    for (double t = 0.0; t < 3.14; t += 0.001) {
      worst = std::max(worst, std::abs(f.At(t).value - std::sin(t)));
    }
    return worst;
  };
  EXPECT_NEAR(std::log2(error(9) / error(17)), 4.0, 0.2);
  EXPECT_NEAR(std::log2(error(17) / error(33)), 4.0, 0.2);
}

TEST(TimeFunctionTest, WhatIsWrongWithADescriptionIsNamed) {
  EXPECT_EQ(Validate(kTable), "");
  EXPECT_NE(Validate(Polynomial{}), "");
  EXPECT_NE(Validate(Polynomial{{0.0, NAN}}), "");
  EXPECT_NE(Validate(Harmonic{.omega = INFINITY}), "");
  EXPECT_NE(Validate(TimeTable{.times = {0.0, 1.0}, .values = {1.0}}), "");
  EXPECT_NE(Validate(TimeTable{.times = {0.0}, .values = {1.0}}), "");
  EXPECT_NE(Validate(TimeTable{.times = {0.0, 0.0}, .values = {1.0, 2.0}}), "");
  EXPECT_NE(Validate(TimeTable{.times = {1.0, 0.0}, .values = {1.0, 2.0}}), "");
  EXPECT_NE(Validate(TimeTable{.times = {0.0, NAN}, .values = {1.0, 2.0}}), "");
}

}  // namespace loopbench::time_function_test
