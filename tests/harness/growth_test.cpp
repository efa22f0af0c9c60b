// Growth exponents and laws of synthetic drifts for which they are known, and of the Cartesian
// pendulum.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <utility>
#include <vector>

#include "harness/judge/analysis.h"
#include "tests/harness/integrator_problems.h"

namespace loopbench::harness {
namespace growth_test {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr double kEnd = 100;  // s
constexpr int kMembers = 16;

// Samples at t_end i / count, i = 0..count, as an integrator with a steady step gives them.
DriftSeries Sample(const std::function<double(double)>& drift, double t_end = kEnd,
                   int count = 4000) {
  DriftSeries series;
  for (int i = 0; i <= count; ++i) {
    series.t.push_back(t_end * i / count);
    series.value.push_back(drift(series.t.back()));
  }
  return series;
}

/// Runs of law(t), each times a swing of its own and (1 + 0.02 noise). `swing_of` draws the swing,
/// a function of time, for each member: phases differ like those of perturbed starts.
std::vector<DriftSeries> Swinging(const std::function<double(double)>& law, const auto& swing_of,
                                  int members, double t_end = kEnd, int count = 4000) {
  std::vector<DriftSeries> runs;
  for (int k = 0; k < members; ++k) {
    std::mt19937_64 generator(static_cast<std::uint64_t>(k) + 1);
    std::uniform_real_distribution<double> uniform(0, 1);
    std::normal_distribution<double> noise(0, 0.02);
    const auto swing = swing_of([&] { return uniform(generator); });
    runs.push_back(
        Sample([&](double t) { return law(t) * swing(t) * (1 + noise(generator)); }, t_end, count));
  }
  return runs;
}

/// scale t^p times a swing of a half, whose period of about 1.4 s is like a mechanism's.
std::vector<DriftSeries> PowerLaw(double exponent, double scale, int members = kMembers,
                                  double t_end = kEnd, int count = 4000) {
  return Swinging([=](double t) { return scale * std::pow(t, exponent); },
                  [](const auto& draw) {
                    const double phase = 2 * std::numbers::pi * draw(),
                                 frequency = 4.4 + 0.2 * draw();
                    return [=](double t) { return 1 + 0.5 * std::sin(frequency * t + phase); };
                  },
                  members, t_end, count);
}

/// Runs of law(t) with factors between 1 and 1.15.
std::vector<DriftSeries> Scaled(const std::function<double(double)>& law) {
  std::vector<DriftSeries> runs;
  for (int k = 0; k < kMembers; ++k) {
    runs.push_back(Sample([&](double t) { return (1 + 0.01 * k) * law(t); }));
  }
  return runs;
}

std::vector<DriftSeries> RandomWalks(double step, int members, int count) {
  std::vector<DriftSeries> runs;
  for (int k = 0; k < members; ++k) {
    std::mt19937_64 generator(static_cast<std::uint64_t>(k) + 100);
    std::normal_distribution<double> noise(0, step);
    double position = 0;
    runs.push_back(Sample([&](double) { return position += noise(generator); }, kEnd, count));
  }
  return runs;
}

// 0.05 is the bias that the running maximum may have (kSlopeBias): it lags by up to
// one period P, and t - P / 2 in place of t makes a slope p larger by some p P / (2 t), 0.04 for
// p = 2 over a window that starts at seven periods.
TEST(Growth, KnownExponentsAreFoundAndResolved) {
  for (const double exponent : {0.5, 1.0, 1.5, 2.0}) {
    const Growth growth = AnalyseGrowth(PowerLaw(exponent, 1e-9), kEnd, 1);
    EXPECT_NEAR(growth.exponent, exponent, 0.05);
    EXPECT_NEAR(growth.exponent_late, exponent, 0.05 + growth.spread_late);
    EXPECT_TRUE(growth.resolved) << growth.exponent << " " << growth.exponent_late;
    EXPECT_EQ(growth.regime, "truncation");
    EXPECT_EQ(growth.members, kMembers);
    EXPECT_DOUBLE_EQ(growth.t_from, 0.1 * kEnd);
    EXPECT_DOUBLE_EQ(growth.t_to, kEnd);
  }
}

// Two per cent of noise and a random phase move a single run's exponent by a hundredth, more in the
// shorter window: that is what the spread must show, and no more.
TEST(Growth, SpreadIsTheScatterOfSingleRuns) {
  const std::vector<DriftSeries> runs = PowerLaw(1, 1e-9);
  const Growth growth = AnalyseGrowth(runs, kEnd, 1);
  double squares = 0;
  for (const DriftSeries& run : runs) {
    const double deviation = AnalyseGrowth({&run, 1}, kEnd, 1).exponent - growth.exponent;
    squares += deviation * deviation;
  }
  EXPECT_NEAR(growth.spread, std::sqrt(squares / (kMembers - 1)), 1e-12);
  EXPECT_GT(growth.spread_late, growth.spread);
  EXPECT_LT(growth.spread_late, 0.05);
}

// The scale and the unit of drift do not matter as long as neither cut-off is met.
TEST(Growth, ScaleDoesNotChangeTheExponent) {
  const Growth small = AnalyseGrowth(PowerLaw(1.5, 1e-9), kEnd, 1);
  const Growth large = AnalyseGrowth(PowerLaw(1.5, 1e-6), kEnd, 1000);
  EXPECT_NEAR(small.exponent, large.exponent, 1e-9);
  EXPECT_EQ(small.regime, large.regime);
}

// By Brownian scaling E log max|W| grows exactly like (1/2) log t; the mean over the ensemble lies
// within 3 standard errors of a half. Single walks scatter by more than 0.2, so that one run could
// pass for anything between 0 and 1.
TEST(Growth, RandomWalkGrowsLikeTheSquareRoot) {
  constexpr int kWalks = 64;
  const Growth growth = AnalyseGrowth(RandomWalks(1e-15, kWalks, 10000), kEnd, 1);
  EXPECT_NEAR(growth.exponent, 0.5, 3 * growth.spread / std::sqrt(kWalks));
  EXPECT_GT(growth.spread, 0.2);
  EXPECT_EQ(growth.regime, "round-off");  // 1e-15 sqrt(1e4) = 1e-13, below 1e3 eps
}

// Sixteen walks have standard errors above 0.125 in the late window: no claim.
TEST(Growth, FewRandomWalksDoNotResolveAnExponent) {
  const Growth growth = AnalyseGrowth(RandomWalks(1e-13, 12, 10000), kEnd, 1);
  EXPECT_GT(growth.spread_late / std::sqrt(12), 0.125);
  EXPECT_FALSE(growth.resolved);
  // a walk's maximum is a staircase whose own slope says little; the ensemble's spread must show it
  EXPECT_FALSE(growth.hypothesis_resolved) << growth.hypothesis.name;
}

// Exponential growth: the local exponent is about t / 20, so that no power law holds on both
// windows.
TEST(Growth, ExponentialGrowthIsNotResolved) {
  const Growth growth =
      AnalyseGrowth(Scaled([](double t) { return 1e-9 * std::expm1(t / 20); }), kEnd, 1);
  EXPECT_GT(growth.exponent_late - growth.exponent, 1);
  EXPECT_FALSE(growth.resolved);
}

// A fast start-up (t^4 up to 5 s, then linear from there) lies before both windows.
TEST(Growth, StartUpIsCutOff) {
  const auto law = [](double t) {
    return 1e-9 * std::pow(std::min(t / 5, 1.0), 4) * std::max(t / 5, 1.0);
  };
  const Growth growth = AnalyseGrowth(Scaled(law), kEnd, 1);
  EXPECT_NEAR(growth.exponent, 1, 0.02);  // exact but for reading between samples 0.025 s apart
  EXPECT_TRUE(growth.resolved);
}

// 4e-5 t^2 passes 0.1 at 50 s and is held at 0.3 afterwards: fitted up to 100 s it would look like
// 1.5 or less; cut off, it is 2.
TEST(Growth, SaturationIsCutOffAndNamed) {
  std::vector<DriftSeries> runs = PowerLaw(2, 4e-5);
  for (DriftSeries& run : runs) {
    for (double& value : run.value) value = std::min(value, 0.3);
  }
  const Growth growth = AnalyseGrowth(runs, kEnd, 1);
  EXPECT_EQ(growth.regime, "saturated");
  EXPECT_GT(growth.t_to, 30);  // with the modulation, 6e-5 t^2 (1 + noise) reaches 0.1 before 50 s
  EXPECT_LT(growth.t_to, 50);
  EXPECT_NEAR(growth.exponent, 2, 0.1 + growth.spread);  // three periods at the window's start
}

// Ten round-offs of noise until 1e-15 t passes them: the flat part must not lower the exponent.
TEST(Growth, FloorIsCutOff) {
  std::vector<DriftSeries> runs = Scaled([](double t) { return 1.2e-16 * t; });
  for (DriftSeries& run : runs) {
    for (double& value : run.value) value = std::max(5 * kEpsilon, value);
  }
  const Growth growth = AnalyseGrowth(runs, kEnd, 1);
  EXPECT_GT(growth.t_from, 18);  // 10 eps / 1.2e-16 = 18.5 s
  EXPECT_NEAR(growth.exponent, 1, 0.02);
  EXPECT_EQ(growth.regime, "round-off");
}

TEST(Growth, DriftBelowTheFloorIsRoundOffWithoutExponent) {
  const std::vector<DriftSeries> runs(kMembers, Sample([](double) { return 2 * kEpsilon; }));
  const Growth growth = AnalyseGrowth(runs, kEnd, 1);
  EXPECT_EQ(growth.regime, "round-off");
  EXPECT_TRUE(std::isnan(growth.exponent));
  EXPECT_FALSE(growth.resolved);
}

// Twenty samples in all leave ten in the late window, fewer than the sixteen required. Saturation
// at once (above the floor from 30 s on, above a tenth of the length from 60 s on) leaves windows
// that end near their start, less than a factor of four.
TEST(Growth, FewSamplesShortWindowsAndNoRunsAreTooShort) {
  const std::vector<DriftSeries> saturated(kMembers, Sample([](double t) {
                                             return t < 30 ? 0 : t < 60 ? 1e-3 * t : 1;
                                           }));
  for (const std::vector<DriftSeries>& runs :
       {PowerLaw(2, 1e-9, kMembers, kEnd, 20), saturated, std::vector<DriftSeries>()}) {
    const Growth growth = AnalyseGrowth(runs, kEnd, 1);
    EXPECT_EQ(growth.regime, "too-short");
    EXPECT_EQ(growth.members, static_cast<int>(runs.size()));
    EXPECT_TRUE(std::isnan(growth.exponent));
    EXPECT_FALSE(growth.resolved);
  }
}

TEST(Growth, OneRunHasNoSpreadAndResolvesNothing) {
  const Growth growth = AnalyseGrowth(PowerLaw(2, 1e-9, 1), kEnd, 1);
  EXPECT_NEAR(growth.exponent, 2, 0.1);
  EXPECT_TRUE(std::isnan(growth.spread));
  EXPECT_TRUE(std::isnan(growth.spread_late));
  EXPECT_FALSE(growth.resolved);
  EXPECT_EQ(growth.members, 1);
}

// A run that fails at 40 s shortens the windows of all, so that every fit covers the same times.
TEST(Growth, AllMembersUseTheShortestRun) {
  std::vector<DriftSeries> runs = PowerLaw(1, 1e-9);
  for (size_t i = 0; i < runs[3].t.size(); ++i) {
    if (runs[3].t[i] > 40) runs[3].value[i] = std::numeric_limits<double>::quiet_NaN();
  }
  const Growth growth = AnalyseGrowth(runs, kEnd, 1);
  EXPECT_DOUBLE_EQ(growth.t_to, 40);
  EXPECT_NEAR(growth.exponent, 1, 0.1 + growth.spread);
}

TEST(Growth, MisuseThrows) {
  const std::vector<DriftSeries> uneven{{{1, 2, 3}, {1, 2}}};
  EXPECT_THROW(AnalyseGrowth(uneven, 3, 1), std::invalid_argument);
  EXPECT_THROW(AnalyseGrowth({}, 3, 0), std::invalid_argument);
}

TEST(Envelope, IsTheRunningMaximumOfTheMagnitudeAtEvenLogTimes) {
  const DriftSeries series{{0, 1, 2, 4, 8, 16}, {0, 1, -3, 2, 4, -1}};
  const DriftSeries envelope = Envelope(series, 5);
  EXPECT_EQ(envelope.value, (std::vector<double>{1, 3, 3, 4, 4}));
  ASSERT_EQ(envelope.t.size(), 5);
  for (size_t i = 0; i < 5; ++i) {
    EXPECT_NEAR(envelope.t[i], std::exp2(i), 4 * kEpsilon * std::exp2(i));
  }
  EXPECT_EQ(envelope.t.back(), 16);
}

TEST(Envelope, IsEmptyWithoutAnInterval) {
  EXPECT_TRUE(Envelope({}, 10).t.empty());
  EXPECT_TRUE(Envelope({{0, 1}, {0, 1}}, 10).t.empty());
  EXPECT_TRUE(Envelope({{0, 1, 2}, {0, 1, 2}}, 1).t.empty());
}

/// Runs of law(t) times a swing of a third with a period of about 1.4 s.
std::vector<DriftSeries> Runs(const std::function<double(double)>& law, int members = kMembers) {
  return Swinging(
      law,
      [](const auto& draw) {
        const double phase = 2 * std::numbers::pi * draw();
        return [=](double t) { return 1 + std::sin(4.5 * t + phase) / 3; };
      },
      members);
}

Growth Analyse(const std::function<double(double)>& law, int members = kMembers) {
  return AnalyseGrowth(Runs(law, members), kEnd, 1);
}

TEST(Hypotheses, EachPowerIsToldFromItsNeighbours) {
  for (const auto& [exponent, name] :
       {std::pair(0.5, "t^0.5"), {1.0, "t^1"}, {1.5, "t^1.5"}, {2.0, "t^2"}}) {
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
  return AnalyseGrowth(runs, t_end, 1);
}

// An independent implementation of ode45's logic gives these largest drifts (released horizontally
// at rest, 10 s); the profile follows it within some per cent at tolerances that are not coarse.
TEST(CartesianPendulumDrift, HasTheSizeThatAnIndependentOde45Gives) {
  for (const auto& [tolerance, expected] :
       {std::pair(1e-6, 4.97e-5), {1e-9, 1.188e-8}, {1e-12, 2.286e-12}}) {
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

// f'' = 0: errors of speed stay, so the systematic part of the drift grows like t^2. f' = 0: errors
// of position add up, like t. f'' = k^2 f: whatever the source, e^(k t) takes over.
TEST(CartesianPendulumDrift, GrowsByTheLawOfItsLevel) {
  const double rate = 0.3;
  const Growth acceleration = PendulumGrowth(0, false, 100),
               velocity = PendulumGrowth(0, true, 100),
               fed = PendulumGrowth(rate * rate, false, 50);
  for (const Growth& growth : {acceleration, velocity, fed}) {
    EXPECT_TRUE(growth.hypothesis_resolved);
  }
  EXPECT_EQ(acceleration.hypothesis.name, "t^2");
  EXPECT_NEAR(acceleration.exponent, 2, 0.1);
  EXPECT_EQ(velocity.hypothesis.name, "t^1");
  EXPECT_NEAR(velocity.exponent, 1, 0.1);
  EXPECT_EQ(fed.hypothesis.name, "exponential");
  // at the window's start (k t = 1.5) sinh still bends: the fitted rate is a little off
  EXPECT_NEAR(fed.hypothesis.rate, rate, 0.15 * rate);
}

}  // namespace growth_test
}  // namespace loopbench::harness
