// Lanes: sines and cosines against long double, moves from lane to lane.
#include "mechanism/algebra/lanes.h"

#include "tests/standard.h"

namespace loopbench::lanes_test {

/// Distance from a long double in units of the last place of the result.
double Ulps(double value, long double exact) {
  int exponent = 0;
  std::frexp(static_cast<double>(exact), &exponent);
  const double ulp = std::ldexp(1.0, std::max(exponent - 53, -1074));
  return static_cast<double>(std::abs(static_cast<long double>(value) - exact)) / ulp;
}

/// Angles of all sizes, those next to multiples of a quarter turn among them, where reduction
/// cancels most.
std::vector<double> Angles() {
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> exponent(-30.0, std::log(kLargestAngle));
  std::vector<double> angles = {0.0, -0.0, 1e-300, -5e-324, kLargestAngle, -kLargestAngle};
  for (int i = 0; i < 200000; ++i) {
    const double x = std::exp(exponent(generator));
    angles.push_back(i % 2 == 0 ? x : -x);
    const double near = std::nearbyint(x) * (kPi / 2);
    if (near > kLargestAngle) continue;
    angles.push_back(near);
    angles.push_back(std::nextafter(near, 0.0));
  }
  while (angles.size() % kLanes != 0) angles.push_back(1.0);
  return angles;
}

TEST(Lanes, SinesAndCosinesAreRightToTheLastPlace) {
  double worst = 0.0;
  for (const double x : Angles()) {
    double s, c;
    SinCos(x, s, c);
    worst = std::max({worst, Ulps(s, std::sin(static_cast<long double>(x))),
                      Ulps(c, std::cos(static_cast<long double>(x)))});
  }
  EXPECT_LT(worst, 1.1) << "as lanes.h says";
}

TEST(Lanes, HaveTheBitsOfOneNumber) {
  const std::vector<double> angles = Angles();
  for (std::size_t i = 0; i < angles.size(); i += kLanes) {
    Lanes s, c;
    SinCos(Load<Lanes>(&angles[i]), s, c);
    for (int lane = 0; lane < kLanes; ++lane) {
      double sine, cosine;
      SinCos(angles[i + static_cast<std::size_t>(lane)], sine, cosine);
      ASSERT_EQ(std::bit_cast<std::int64_t>(s[lane]), std::bit_cast<std::int64_t>(sine));
      ASSERT_EQ(std::bit_cast<std::int64_t>(c[lane]), std::bit_cast<std::int64_t>(cosine));
    }
  }
}

TEST(Lanes, MoveOnAndBack) {
  Lanes numbers;
  for (int lane = 0; lane < kLanes; ++lane) numbers[lane] = 1.0 + lane;
  const Lanes after = LaneAfter(numbers, -7.0), before = LaneBefore(numbers);
  for (int lane = 0; lane < kLanes; ++lane) {
    EXPECT_EQ(after[lane], lane == 0 ? -7.0 : 1.0 * lane);
    EXPECT_EQ(before[lane], lane == kLanes - 1 ? 0.0 : 2.0 + lane);
  }
}

}  // namespace loopbench::lanes_test
