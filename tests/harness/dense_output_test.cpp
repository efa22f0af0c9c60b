// The solution between steps: its orders, what it leaves alone, and the times it is asked for.
#include "harness/integrator/arkode.h"
#include "tests/standard.h"

namespace dense_output_test {

using namespace loopbench;
using namespace loopbench::harness;

/// y' = (y_1, -y_0): circles.
bool Circle(double, std::span<const double> y, std::span<double> f) {
  f[0] = y[1], f[1] = -y[0];
  return true;
}

/// Largest errors over a step of length h with exact ends: of the full and of the lower degree.
std::array<double, 2> Errors(double h) {
  const auto at = [](double t) { return std::vector<double>{std::sin(t), std::cos(t)}; };
  DenseOutput output;
  EXPECT_TRUE(output.Prepare(1.0, at(1.0), 1.0 + h, at(1.0 + h), Circle));
  std::array<double, 2> worst = {0.0, 0.0};
  std::vector<double> y(2), lower(2);
  for (int i = 0; i <= 20; ++i) {
    const double t = 1.0 + h * i / 20;
    output.At(t, y, lower);
    worst[0] = std::max(worst[0], std::abs(y[0] - std::sin(t)));
    worst[1] = std::max(worst[1], std::abs(lower[0] - std::sin(t)));
  }
  return worst;
}

TEST(DenseOutput, ErrsWithTheSixthAndTheFifthPowerOfTheStep) {
  const auto coarse = Errors(0.2), fine = Errors(0.05);
  // log2 of the ratio over two halvings; a tenth for higher powers
  EXPECT_NEAR(std::log2(coarse[0] / fine[0]) / 2, 6.0, 0.1);
  EXPECT_NEAR(std::log2(coarse[1] / fine[1]) / 2, 5.0, 0.1);
  EXPECT_LT(fine[0], fine[1]);
}

TEST(DenseOutput, IsExactForAQuintic) {
  const auto y = [](double t) { return std::vector<double>{std::pow(t, 5) - 3 * t * t}; };
  const auto rate = [](double t, std::span<const double>, std::span<double> f) {
    f[0] = 5 * std::pow(t, 4) - 6 * t;
    return true;
  };
  DenseOutput output;
  ASSERT_TRUE(output.Prepare(-1.0, y(-1.0), 2.0, y(2.0), rate));
  std::vector<double> own(1), lower(1);
  for (const double t : {-1.0, -0.3, 0.5, 1.9, 2.0}) {
    output.At(t, own, lower);
    EXPECT_NEAR(own[0], y(t)[0], 32 * 20 * 2.2e-16) << t;  // of numbers up to 20
  }
}

TEST(DenseOutput, SaysWhenADerivativeCannotBeHad) {
  const std::vector<double> y = {1.0};
  DenseOutput output;
  const auto fails = [](double t, std::span<const double>, std::span<double> f) {
    f[0] = 0.0;
    return t < 0.5;
  };
  EXPECT_FALSE(output.Prepare(0.0, y, 1.0, y, fails));
  const auto overflows = [](double, std::span<const double>, std::span<double> f) {
    f[0] = INFINITY;
    return true;
  };
  EXPECT_FALSE(output.Prepare(0.0, y, 1.0, y, overflows));
}

struct Oscillator final : loopbench::Ode<double> {
  int size() const override { return 2; }
  Outcome Derivative(double t, std::span<const double> y, std::span<double> f) override {
    Circle(t, y, f);
    return Outcome::kFinished;
  }
};

TEST(DenseObserver, ShowsEachTimeOnceAndChangesNoBit) {
  for (const std::string& profile : ProfileNames()) {
    IntegratorOptions options;
    options.profile = profile;
    options.rtol = options.atol = 1e-6;
    std::vector<double> alone = {0.0, 1.0}, watched = alone;
    Oscillator ode;
    const IntegratorResult first = Integrate(ode, 0.0, 3.0, alone, options);
    std::vector<std::size_t> shown;
    double worst = 0.0, apart = 0.0;
    DenseObserver dense;
    for (int k = 0; k <= 30; ++k) dense.times.push_back(k == 30 ? 3.0 : 0.1 * k);
    dense.observe = [&](std::size_t k, std::span<const double> y, std::span<const double> lower) {
      shown.push_back(k);
      worst = std::max(worst, std::abs(y[0] - std::sin(dense.times[k])));
      apart = std::max(apart, std::abs(y[0] - lower[0]));
    };
    const IntegratorResult second = Integrate(ode, 0.0, 3.0, watched, options, {}, &dense);
    EXPECT_EQ(alone, watched) << profile;
    EXPECT_EQ(first.rhs_evaluations, second.rhs_evaluations) << profile;
    EXPECT_EQ(first.steps, second.steps) << profile;
    ASSERT_EQ(shown.size(), 31u) << profile;
    for (std::size_t k = 0; k < shown.size(); ++k) EXPECT_EQ(shown[k], k);
    // what interpolation adds is at most what it says, besides the error of the steps
    const double end = std::abs(watched[0] - std::sin(3.0));
    EXPECT_LE(worst, 10 * end + apart + 1e-5) << profile;
  }
}

}  // namespace dense_output_test
