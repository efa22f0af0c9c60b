// Growth exponents of synthetic drifts whose exponents are known.
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

// scale t^p (1 + 0.5 sin(w t + phase)) (1 + 0.02 noise), with a period of about 1.4 s like a
// mechanism's swing; period and phase differ between members like perturbed starts.
std::vector<DriftSeries> PowerLaw(double exponent, double scale, int members = kMembers,
                                  double t_end = kEnd, int count = 4000) {
  std::vector<DriftSeries> runs;
  for (int k = 0; k < members; ++k) {
    std::mt19937_64 generator(static_cast<std::uint64_t>(k) + 1);
    std::uniform_real_distribution<double> uniform(0, 1);
    std::normal_distribution<double> noise(0, 0.02);
    const double phase = 2 * std::numbers::pi * uniform(generator);
    const double frequency = 4.4 + 0.2 * uniform(generator);
    runs.push_back(Sample(
        [&](double t) {
          return scale * std::pow(t, exponent) * (1 + 0.5 * std::sin(frequency * t + phase)) *
                 (1 + noise(generator));
        },
        t_end, count));
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

// 0.05 is the bias that the running maximum may have (GrowthOptions::slope_bias): it lags by up to
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
}

// Exponential growth: the local exponent is about t / 20, so that no power law holds on both
// windows.
TEST(Growth, ExponentialGrowthIsNotResolved) {
  std::vector<DriftSeries> runs;
  for (int k = 0; k < kMembers; ++k) {
    runs.push_back(Sample([k](double t) { return (1 + 0.01 * k) * 1e-9 * std::expm1(t / 20); }));
  }
  const Growth growth = AnalyseGrowth(runs, kEnd, 1);
  EXPECT_GT(growth.exponent_late - growth.exponent, 1);
  EXPECT_FALSE(growth.resolved);
}

// A fast start-up (t^4 up to 5 s, then linear from there) lies before both windows.
TEST(Growth, StartUpIsCutOff) {
  std::vector<DriftSeries> runs;
  for (int k = 0; k < kMembers; ++k) {
    runs.push_back(Sample([k](double t) {
      const double start = std::min(t / 5, 1.0);
      return (1 + 0.01 * k) * 1e-9 * std::pow(start, 4) * std::max(t / 5, 1.0);
    }));
  }
  const Growth growth = AnalyseGrowth(runs, kEnd, 1);
  EXPECT_NEAR(growth.exponent, 1, 0.02);  // exact but for reading between samples 0.025 s apart
  EXPECT_TRUE(growth.resolved);
}

// 4e-5 t^2 passes 0.1 at 50 s and is held at 0.3 afterwards: fitted up to 100 s it would look like
// 1.5 or less; cut off, it is 2.
TEST(Growth, SaturationIsCutOffAndNamed) {
  std::vector<DriftSeries> runs = PowerLaw(2, 4e-5);
  for (DriftSeries& run : runs) {
    for (double& value : run.value) {
      value = std::min(value, 0.3);
    }
  }
  const Growth growth = AnalyseGrowth(runs, kEnd, 1);
  EXPECT_EQ(growth.regime, "saturated");
  EXPECT_GT(growth.t_to, 30);  // with the modulation, 6e-5 t^2 (1 + noise) reaches 0.1 before 50 s
  EXPECT_LT(growth.t_to, 50);
  EXPECT_NEAR(growth.exponent, 2, 0.1 + growth.spread);  // three periods at the window's start
}

// Ten round-offs of noise until 1e-15 t passes them: the flat part must not lower the exponent.
TEST(Growth, FloorIsCutOff) {
  std::vector<DriftSeries> runs;
  for (int k = 0; k < kMembers; ++k) {
    runs.push_back(
        Sample([k](double t) { return std::max(5 * kEpsilon, (1 + 0.01 * k) * 1.2e-16 * t); }));
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

// Twenty samples in all leave ten in the late window, fewer than the sixteen required.
TEST(Growth, FewSamplesAreTooShort) {
  const Growth growth = AnalyseGrowth(PowerLaw(2, 1e-9, kMembers, kEnd, 20), kEnd, 1);
  EXPECT_EQ(growth.regime, "too-short");
  EXPECT_TRUE(std::isnan(growth.exponent));
  EXPECT_FALSE(growth.resolved);
}

// Saturation at once leaves windows that end near their start.
TEST(Growth, WindowShorterThanAFactorOfFourIsTooShort) {
  std::vector<DriftSeries> runs;
  for (int k = 0; k < kMembers; ++k) {
    // Above the floor from 30 s on, above a tenth of the length from 60 s on.
    runs.push_back(Sample([](double t) { return t < 30 ? 0 : t < 60 ? 1e-3 * t : 1; }));
  }
  EXPECT_EQ(AnalyseGrowth(runs, kEnd, 1).regime, "too-short");
}

TEST(Growth, OneRunHasNoSpreadAndResolvesNothing) {
  const Growth growth = AnalyseGrowth(PowerLaw(2, 1e-9, 1), kEnd, 1);
  EXPECT_NEAR(growth.exponent, 2, 0.1);
  EXPECT_TRUE(std::isnan(growth.spread));
  EXPECT_TRUE(std::isnan(growth.spread_late));
  EXPECT_FALSE(growth.resolved);
  EXPECT_EQ(growth.members, 1);
}

TEST(Growth, NoRunsAreTooShort) {
  const Growth growth = AnalyseGrowth({}, kEnd, 1);
  EXPECT_EQ(growth.members, 0);
  EXPECT_EQ(growth.regime, "too-short");
  EXPECT_FALSE(growth.resolved);
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

}  // namespace growth_test
}  // namespace loopbench::harness
