// Which law fits best, on synthetic drifts whose law is known and on the Cartesian pendulum.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <iostream>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "harness/judge/analysis.h"
#include "tests/harness/integrator_problems.h"

namespace loopbench::harness {
namespace hypotheses_test {

constexpr double kEnd = 100;  // s
constexpr int kMembers = 16;

/// Sixteen runs of law(t) times a swing of a third with a period of about 1.4 s, whose phase
/// differs between members, and two per cent of noise.
std::vector<DriftSeries> Runs(const std::function<double(double)>& law, int members = kMembers) {
  std::vector<DriftSeries> runs;
  for (int k = 0; k < members; ++k) {
    std::mt19937_64 generator(static_cast<std::uint64_t>(k) + 1);
    std::uniform_real_distribution<double> uniform(0, 1);
    std::normal_distribution<double> noise(0, 0.02);
    const double phase = 2 * std::numbers::pi * uniform(generator);
    DriftSeries run;
    for (int i = 0; i <= 4000; ++i) {
      const double t = kEnd * i / 4000;
      run.t.push_back(t);
      run.value.push_back(law(t) * (1 + std::sin(4.5 * t + phase) / 3) * (1 + noise(generator)));
    }
    runs.push_back(run);
  }
  return runs;
}

Growth Analyse(const std::function<double(double)>& law, int members = kMembers) {
  return AnalyseGrowth(Runs(law, members), kEnd, 1);
}

TEST(Hypotheses, EachPowerIsToldFromItsNeighbours) {
  const std::vector<std::pair<double, std::string>> laws = {
      {0.5, "t^0.5"}, {1.0, "t^1"}, {1.5, "t^1.5"}, {2.0, "t^2"}};
  for (const auto& [exponent, name] : laws) {
    const Growth growth = Analyse([&](double t) { return 1e-9 * std::pow(t, exponent); });
    EXPECT_EQ(growth.hypothesis.name, name);
    EXPECT_TRUE(growth.hypothesis_resolved) << name << " ratio " << growth.hypothesis.ratio;
    // the nearest rival is off by half a unit of slope, over a window of ln 10 = 2.3
    EXPECT_GT(growth.hypothesis.ratio, 3.0) << name;
  }
}

TEST(Hypotheses, AnExponentialIsFoundWithItsRate) {
  for (const double rate : {0.03, 0.05, 0.15}) {
    const Growth growth = Analyse([&](double t) { return 1e-9 * std::exp(rate * t); });
    EXPECT_EQ(growth.hypothesis.name, "exponential");
    EXPECT_TRUE(growth.hypothesis_resolved) << rate;
    // running maxima lag by at most a swing, which changes little where the law is steep
    EXPECT_NEAR(growth.hypothesis.rate, rate, 0.02 * rate);
    EXPECT_FALSE(growth.resolved);  // no power law
  }
}

TEST(Hypotheses, WhatIsNoneOfThemIsNone) {
  EXPECT_EQ(Analyse([](double t) { return 1e-9 * std::pow(t, 3.0); }).hypothesis.name, "none");
  EXPECT_EQ(Analyse([](double t) { return 1e-9 * std::pow(t, 1.25); }).hypothesis.name, "none");
  // bounded, as with projection: neither a power of time nor an exponential
  const Growth bounded = Analyse([](double) { return 1e-9; });
  EXPECT_EQ(bounded.hypothesis.name, "none");
  EXPECT_FALSE(bounded.hypothesis_resolved);
}

TEST(Hypotheses, SaturationAndFloorAreCutOffFirst) {
  // 3e-9 e^(t/4) passes 0.1 at 69 s; the flat end that follows must not bend the law
  const Growth saturated = Analyse([](double t) { return std::min(0.5, 3e-9 * std::exp(t / 4)); });
  EXPECT_EQ(saturated.regime, "saturated");
  EXPECT_EQ(saturated.hypothesis.name, "exponential");
  EXPECT_NEAR(saturated.hypothesis.rate, 0.25, 0.01);
  // t^2 below ten round-offs until 20 s
  const Growth floored = Analyse([](double t) { return std::max(1e-15, 5e-18 * t * t); });
  EXPECT_GT(floored.t_from, 15);
  EXPECT_EQ(floored.hypothesis.name, "t^2");
}

TEST(Hypotheses, OneRunAndFewRunsNameALawButResolveNone) {
  for (const int members : {1, 4}) {
    const Growth growth = Analyse([](double t) { return 1e-9 * t * t; }, members);
    EXPECT_EQ(growth.hypothesis.name, "t^2") << members;
    EXPECT_FALSE(growth.hypothesis_resolved) << members;
  }
}

TEST(Hypotheses, RandomWalksOfOneRunEachDisagree) {
  // a walk's maximum is a staircase whose own slope says little; the ensemble's spread must show it
  std::vector<DriftSeries> runs;
  for (int k = 0; k < 12; ++k) {
    std::mt19937_64 generator(static_cast<std::uint64_t>(k) + 100);
    std::normal_distribution<double> noise(0, 1e-13);
    DriftSeries run;
    double position = 0;
    for (int i = 0; i <= 10000; ++i) {
      run.t.push_back(kEnd * i / 10000);
      run.value.push_back(position += noise(generator));
    }
    runs.push_back(run);
  }
  const Growth growth = AnalyseGrowth(runs, kEnd, 1);
  EXPECT_FALSE(growth.hypothesis_resolved) << growth.hypothesis.name;
}

TEST(Hypotheses, WithoutReadingsThereIsNone) {
  EXPECT_EQ(CompareHypotheses({}, 1.0).name, "none");
  const std::vector<DriftSeries> two{{{1, 2}, {1, 2}}};
  EXPECT_EQ(CompareHypotheses(two, 1.0).name, "none");
}

// --- A mechanism: the Cartesian pendulum, whose constraint f = (x^2 + z^2 - 1) / 2 obeys an
// equation that we choose. Local errors of the integrator are the source of all drift.

using integrator_test::kGravity;
using integrator_test::State;
using integrator_test::TestOde;

/// f'' = gain_position f instead of zero, by choice of the rod's force; with
/// `tangent` the speeds in the right-hand side are first projected on f' = 0.
TestOde CartesianPendulum(double gain_position, bool tangent) {
  return TestOde(4, [=](double, auto y, auto ydot) {
    const double square = y[0] * y[0] + y[1] * y[1];
    const double slip = tangent ? (y[0] * y[2] + y[1] * y[3]) / square : 0.0;
    const double vx = y[2] - slip * y[0], vz = y[3] - slip * y[1];
    const double f = (square - 1) / 2;
    const double tension = (vx * vx + vz * vz - kGravity * y[1] - gain_position * f) / square;
    ydot[0] = vx;
    ydot[1] = vz;
    ydot[2] = -tension * y[0];
    ydot[3] = -tension * y[1] - kGravity;
    return Outcome::kFinished;
  });
}

Growth PendulumGrowth(double gain_position, bool tangent, double t_end) {
  std::vector<DriftSeries> runs;
  for (int k = 0; k < 12; ++k) {
    const double angle = 0.8 + 0.03 * k;  // from the horizontal
    State y = {std::cos(angle), -std::sin(angle), 0, 0};
    TestOde ode = CartesianPendulum(gain_position, tangent);
    DriftSeries run;
    const IntegratorResult result =
        Integrate(ode, 0.0, t_end, y, integrator_test::WithTolerance("ode45", 1e-9),
                  [&](double t, std::span<double> now) {
                    run.t.push_back(t);
                    run.value.push_back(std::hypot(now[0], now[1]) - 1);
                    return StepAction::kContinue;
                  });
    EXPECT_EQ(result.outcome, Outcome::kFinished);
    runs.push_back(run);
  }
  const Growth growth = AnalyseGrowth(runs, t_end, 1);
  std::cout << growth.hypothesis.name << " ratio " << growth.hypothesis.ratio << ", t^"
            << growth.exponent << " +- " << growth.spread << ", rate " << growth.hypothesis.rate
            << ", " << growth.regime << "\n";
  return growth;
}

// An independent implementation of ode45's logic gives these largest drifts (released horizontally
// at rest, 10 s); the profile follows it within some per cent at tolerances that are not coarse.
TEST(CartesianPendulumDrift, HasTheSizeThatAnIndependentOde45Gives) {
  const std::vector<std::pair<double, double>> known = {
      {1e-6, 4.97e-5}, {1e-9, 1.188e-8}, {1e-12, 2.286e-12}};
  for (const auto& [tolerance, expected] : known) {
    State y = {1, 0, 0, 0};
    TestOde ode = CartesianPendulum(0, false);
    double drift = 0;
    Integrate(ode, 0.0, 10.0, y, integrator_test::WithTolerance("ode45", tolerance),
              [&](double, std::span<double> now) {
                drift = std::max(drift, std::abs(std::hypot(now[0], now[1]) - 1));
                return StepAction::kContinue;
              });
    EXPECT_NEAR(drift / expected, 1, 0.05) << tolerance << ": " << drift;
  }
}

// f'' = 0: errors of speed stay, so the systematic part of the drift grows like t^2.
TEST(CartesianPendulumDrift, GrowsQuadraticallyAtAccelerationLevel) {
  const Growth growth = PendulumGrowth(0, false, 100);
  EXPECT_EQ(growth.hypothesis.name, "t^2");
  EXPECT_TRUE(growth.hypothesis_resolved);
  EXPECT_NEAR(growth.exponent, 2, 0.1);
}

// f' = 0: errors of position add up, like t.
TEST(CartesianPendulumDrift, GrowsLinearlyAtVelocityLevel) {
  const Growth growth = PendulumGrowth(0, true, 100);
  EXPECT_EQ(growth.hypothesis.name, "t^1");
  EXPECT_TRUE(growth.hypothesis_resolved);
  EXPECT_NEAR(growth.exponent, 1, 0.1);
}

// f'' = k^2 f: whatever the source, e^(k t) takes over.
TEST(CartesianPendulumDrift, GrowsExponentiallyWhenItFeedsItself) {
  const double rate = 0.3;
  const Growth growth = PendulumGrowth(rate * rate, false, 50);
  EXPECT_EQ(growth.hypothesis.name, "exponential");
  EXPECT_TRUE(growth.hypothesis_resolved);
  // at the window's start (k t = 1.5) sinh still bends: the fitted rate is a little off
  EXPECT_NEAR(growth.hypothesis.rate, rate, 0.15 * rate);
}

}  // namespace hypotheses_test
}  // namespace loopbench::harness
