// Where series change their level: the segmentation against a search of all of them, false alarms
// and power on series whose answer is known.
#include "harness/history/history.h"
#include "tests/standard.h"

namespace loopbench::harness::change_points_test {

/// The least sum of min((x - mu)^2, K^2) over all mu: at the optimum mu is the mean of the values
/// closer than K, and these are neighbours in order.
double CostOfSegment(std::vector<double> x, double bound) {
  std::ranges::sort(x);
  double least = static_cast<double>(x.size()) * bound * bound;
  for (std::size_t i = 0; i < x.size(); ++i) {
    double sum = 0.0;
    for (std::size_t j = i; j < x.size(); ++j) {
      sum += x[j];
      const double mu = sum / static_cast<double>(j - i + 1);
      double cost = 0.0;
      for (const double value : x) {
        cost += std::min((value - mu) * (value - mu), bound * bound);
      }
      least = std::min(least, cost);
    }
  }
  return least;
}

double CostOfSegments(const std::vector<double>& x, std::vector<std::size_t> begins, double bound,
                      double penalty) {
  double cost = penalty * static_cast<double>(begins.size());
  begins.insert(begins.begin(), 0);
  begins.push_back(x.size());
  for (std::size_t i = 0; i + 1 < begins.size(); ++i) {
    const auto at = [&x](std::size_t k) { return x.begin() + static_cast<std::ptrdiff_t>(k); };
    cost += CostOfSegment({at(begins[i]), at(begins[i + 1])}, bound);
  }
  return cost;
}

/// Returns the best of all segmentations, by recursion over the last segment, without pruning.
double LeastCost(const std::vector<double>& x, double bound, double penalty) {
  std::vector<double> best(x.size() + 1, std::numeric_limits<double>::infinity());
  best[0] = -penalty;
  for (std::size_t end = 1; end <= x.size(); ++end) {
    for (std::size_t begin = 0; begin < end; ++begin) {
      const std::vector<double> segment(x.begin() + static_cast<std::ptrdiff_t>(begin),
                                        x.begin() + static_cast<std::ptrdiff_t>(end));
      best[end] = std::min(best[end], best[begin] + penalty + CostOfSegment(segment, bound));
    }
  }
  return best.back();
}

TEST(ChangePoints, HaveTheLeastCostOfAllSegmentations) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 200; ++trial) {
    const std::size_t n = 1 + random() % 22;
    const double far = trial % 4 == 0 ? 1e4 : 0.0;  // levels far from 0 as logarithms of counts are
    std::vector<double> x(n);
    double level = far;
    for (double& value : x) {
      if (random() % 6 == 0) level = far + 4.0 * normal(random);
      value = level + normal(random) + (random() % 9 == 0 ? 30.0 * normal(random) : 0.0);
      if (trial % 5 == 0) value = std::round(value);  // equal values
    }
    const double bound = 0.5 + static_cast<double>(trial % 4), penalty = 0.3 * (1 + trial % 30);
    const std::vector<std::size_t> found = RobustSegments(x, bound, penalty);
    // sums of n squares of numbers up to `most`, once from the values and once from polynomials
    double most = 1.0;
    for (const double value : x) most = std::max(most, std::abs(value - far));
    EXPECT_NEAR(CostOfSegments(x, found, bound, penalty), LeastCost(x, bound, penalty),
                100 * 2.2e-16 * static_cast<double>(n) * (most * most + 1e4))
        << "trial " << trial;
  }
}

TEST(ChangePoints, ShortAndConstantSeriesHaveNone) {
  EXPECT_TRUE(RobustSegments({}, 1.0, 1.0).empty());
  const Resolution resolution{.noise = 1e-3, .least = 1e-2, .places = 200};
  for (const std::size_t n : {1, 2, 3, 4, 5, 200}) {
    EXPECT_TRUE(FindChanges(std::vector<double>(n, 1e9), resolution).empty()) << n;
    EXPECT_TRUE(FindChanges(std::vector<double>(n, 0.0), resolution).empty()) << n;
  }
}

constexpr Resolution kTimes{.noise = 0.002, .least = 0.01, .places = 1.0};

Resolution At(double places) {
  Resolution resolution = kTimes;
  resolution.places = places;
  return resolution;
}

/// Normal noise of 1 % whose neighbours have this correlation; every `outlier`-th value or so is
/// 10 % larger.
std::vector<double> NoisySeries(std::size_t n, double correlation, unsigned outlier,
                                std::mt19937_64& random) {
  std::normal_distribution<double> normal(0.0, 0.01);
  std::vector<double> x(n);
  double state = normal(random);
  for (double& value : x) {
    state = correlation * state + std::sqrt(1.0 - correlation * correlation) * normal(random);
    value = state + (outlier > 0 && random() % outlier == 0 ? 0.1 : 0.0);
  }
  return x;
}

TEST(ChangePoints, NoiseIsThatBetweenSteps) {
  std::mt19937_64 random(11);
  for (const double correlation : {0.0, 0.5, 0.8}) {
    std::vector<double> x = NoisySeries(2000, correlation, 40, random);
    for (std::size_t i = 0; i < x.size(); ++i) x[i] += static_cast<double>(i / 500);
    const Noise noise = NoiseOf(x);
    // medians of 2000 differences have standard errors of 1.65 / sqrt(2000) = 4 %, variances twice
    // that; one difference in twenty meets an outlier and shifts the medians by some 5 %
    EXPECT_NEAR(noise.sigma, 0.01, 0.002) << correlation;
    EXPECT_NEAR(noise.correlation, correlation, 0.15);
  }
  EXPECT_EQ(NoiseOf(std::vector<double>{1.0, 2.0, 3.0}).sigma, 0.0);
  EXPECT_EQ(NoiseOf(std::vector<double>{1.0, 1.0, 1.0, 2.0, 2.0, 2.0}).sigma, 0.0);
  EXPECT_DOUBLE_EQ((Noise{2.0, 0.6}).LongRun(), 4.0);  // 2 sqrt(1.6 / 0.4)
}

TEST(ChangePoints, StepsAreFoundWhereTheyAre) {
  std::vector<double> x(60, 2.0);
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (i >= 20) x[i] = 2.5;
    if (i >= 40) x[i] = 1.0;
  }
  x[10] = 50.0;  // a value off by itself
  const std::vector<LevelChange> found = FindChanges(x, kTimes);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].at, 20u);
  EXPECT_EQ(found[0].before, 2.0);
  EXPECT_EQ(found[0].after, 2.5);
  EXPECT_EQ(found[1].at, 40u);
  EXPECT_EQ(found[1].after, 1.0);
  EXPECT_EQ(found[1].Confidence(), 1.0);  // no noise
}

TEST(ChangePoints, StepsBelowTheLeastAreNone) {
  std::vector<double> x(60, 0.0);
  for (std::size_t i = 30; i < x.size(); ++i) x[i] = 0.009;
  EXPECT_TRUE(FindChanges(x, {.noise = 1e-4, .least = 0.01, .places = 60}).empty());
  EXPECT_EQ(FindChanges(x, {.noise = 1e-4, .least = 0.008, .places = 60}).size(), 1u);
}

/// Changes that are found in series of nothing but noise.
std::size_t FalseAlarms(int series, std::size_t n, double correlation, double places) {
  std::mt19937_64 random(42);
  std::size_t alarms = 0;
  for (int i = 0; i < series; ++i) {
    alarms += FindChanges(NoisySeries(n, correlation, 20, random), At(places)).size();
  }
  return alarms;
}

TEST(ChangePoints, NoiseAloneRaisesNoAlarms) {
  // kFalseAlarms: 0.01 expected at all places together, here of 200 series of 100 values
  EXPECT_EQ(FalseAlarms(200, 100, 0.0, 200 * 100), 0u);
  // the correlation of 100 values is known to 0.13: where it is 0.5, one in fifty is taken for 0.25
  // and less, and its means for too sure
  EXPECT_LE(FalseAlarms(200, 100, 0.5, 200 * 100), 2u);
  // series that are looked at one by one: 0.01 in each, 4 in 400, with three standard deviations
  EXPECT_LE(FalseAlarms(400, 50, 0.0, 50), 10u);
  EXPECT_LE(FalseAlarms(400, 12, 0.0, 12), 10u);
  EXPECT_LE(FalseAlarms(400, 6, 0.0, 6), 10u);
}

TEST(ChangePoints, StepsAreFoundInNoise) {
  // 3 % in noise of 1 %, 40 values on each side: three times its own standard deviation, 13 times
  // the standard error of the difference of the means
  std::mt19937_64 random(3);
  int found = 0;
  for (int trial = 0; trial < 100; ++trial) {
    std::vector<double> x = NoisySeries(80, 0.0, 20, random);
    for (std::size_t i = 40; i < x.size(); ++i) x[i] += 0.03;
    const std::vector<LevelChange> changes = FindChanges(x, At(100 * 80));
    found += changes.size() == 1 && changes[0].at >= 38 && changes[0].at <= 42;
  }
  // in one of fifty the noise seems to last, so that there is not enough of it
  EXPECT_GE(found, 95);
}

}  // namespace loopbench::harness::change_points_test
