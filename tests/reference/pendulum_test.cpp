// PendulumAngle (elliptic functions) against an integration of theta'' = -w^2 sin(theta) that
// shares nothing with it.
#include "harness/observers/observer.h"
#include "tests/standard.h"

namespace loopbench::harness::reference::pendulum_test {

struct Start {
  double frequency_squared, theta, omega;
};

/// The pendulum with its derivatives by the starting angle and the starting speed.
struct Swing {
  long double theta, omega;
  long double by_angle, by_angle_rate, by_speed, by_speed_rate;
};

Swing Rate(const Swing& s, long double w2) {
  const long double c = -w2 * std::cos(s.theta);
  return {s.omega,        -w2 * std::sin(s.theta), s.by_angle_rate,
          c * s.by_angle, s.by_speed_rate,         c * s.by_speed};
}

Swing Plus(const Swing& a, long double h, const Swing& b) {
  return {a.theta + h * b.theta,       a.omega + h * b.omega,
          a.by_angle + h * b.by_angle, a.by_angle_rate + h * b.by_angle_rate,
          a.by_speed + h * b.by_speed, a.by_speed_rate + h * b.by_speed_rate};
}

/// One step of the classical Runge-Kutta method.
Swing Step(const Swing& s, long double h, long double w2) {
  const Swing k1 = Rate(s, w2);
  const Swing k2 = Rate(Plus(s, h / 2, k1), w2);
  const Swing k3 = Rate(Plus(s, h / 2, k2), w2);
  const Swing k4 = Rate(Plus(s, h, k3), w2);
  Swing next = Plus(s, h / 6, k1);
  next = Plus(next, h / 3, k2);
  next = Plus(next, h / 3, k3);
  return Plus(next, h / 6, k4);
}

/// How many round-offs of the data, of the modulus and of the result an error of one unit in the
/// last place means in the angle at time t.
double Condition(const Start& start, const Swing& s, double t) {
  const double w2 = start.frequency_squared, w = std::sqrt(w2);
  const double by_angle = std::abs(static_cast<double>(s.by_angle));
  const double by_speed = std::abs(static_cast<double>(s.by_speed));
  const double omega = std::abs(static_cast<double>(s.omega));
  const double theta = std::abs(static_cast<double>(s.theta));
  const double data =
      by_angle * std::abs(start.theta) + by_speed * std::abs(start.omega) + omega * t + theta;
  // k^2 = s0^2 + v0^2: a round-off of k is one of the start, seen as angle or as speed
  const double s0 = std::abs(std::sin(start.theta / 2)), v0 = std::abs(start.omega) / (2 * w);
  const double k2 = s0 * s0 + v0 * v0;
  const double as_angle = by_angle * 2 * k2 / (s0 * std::abs(std::cos(start.theta / 2)));
  const double as_speed = by_speed * 2 * w * k2 / v0;
  const double modulus = std::fmin(as_angle, as_speed);
  // a swinging pendulum's angle is an arcsine, which is steep near its upper turning point
  const double arcsine = k2 < 1 ? 2 * std::abs(std::tan(theta / 2)) : 0.0;
  return data + modulus + arcsine;
}

/// Largest error in units of eps times the condition, over 6 s.
double WorstRatio(const Start& start) {
  // h^4 of the Runge-Kutta method: 1e-3^4 w^5 t / 120 is below 1e-14 of the condition
  constexpr int kSteps = 6000;
  constexpr long double kStep = 1e-3L;
  Swing s{start.theta, start.omega, 1, 0, 0, 1};
  double worst = 0.0;
  for (int i = 1; i <= kSteps; ++i) {
    for (int part = 0; part < 4; ++part) s = Step(s, kStep / 4, start.frequency_squared);
    const double t = static_cast<double>(i * kStep);
    const double angle = PendulumAngle(start.frequency_squared, start.theta, start.omega, t);
    const double error = std::abs(angle - static_cast<double>(s.theta));
    worst = std::max(worst, error / (kEps * Condition(start, s, t)));
  }
  return worst;
}

/// Elliptic functions and their inverse cost some ten roundings each, in worst case all in one
/// direction.
constexpr double kRoundOffs = 64;

void ExpectAgreement(const std::vector<Start>& starts) {
  for (const Start& start : starts) {
    for (const double sign : {1.0, -1.0}) {
      const Start signed_start{start.frequency_squared, sign * start.theta, sign * start.omega};
      EXPECT_LE(WorstRatio(signed_start), kRoundOffs)
          << "start " << signed_start.theta << ", " << signed_start.omega;
    }
  }
}

TEST(PendulumAngle, SwingingPendulumFollowsTheEquationOfMotion) {
  ExpectAgreement({{5.6, 0.5, 0.0},
                   {9.81, kPi / 2, 0.0},
                   {9.81, 1.0, 2.0},
                   {9.81, 1.0, -2.0},
                   {3.924, 0.0, 2.0},
                   {14.715, 2.5, -1.0},
                   {1.0, 1e-3, 0.0}});
}

TEST(PendulumAngle, TurningPendulumFollowsTheEquationOfMotion) {
  ExpectAgreement({{9.81, 0.3, 8.0},
                   {9.81, 2.0, -9.0},
                   {9.81, kPi, 1.0},
                   {9.81, kPi, -1.0},
                   {11.772, -kPi, 1.0},
                   {1.0, 0.0, 20.0}});
}

TEST(PendulumAngle, NearTheSeparatrixFollowsTheEquationOfMotion) {
  const double w = std::sqrt(9.81);
  ExpectAgreement({{9.81, 0.0, 2 * w * (1 - 1e-6)},
                   {9.81, 0.0, 2 * w * (1 + 1e-6)},
                   {9.81, 0.0, 2 * w * (1 - 1e-10)},
                   {9.81, 0.0, 2 * w * (1 + 1e-10)},
                   {9.81, kPi - 1e-3, 0.0},
                   {9.81, 1.0, 2 * w * std::cos(0.5) * (1 + 1e-8)}});
}

TEST(PendulumAngle, OnTheSeparatrixTheAngleApproachesTheTop) {
  // k = 1: theta = 2 asin(tanh(w t)); within the growth e^(w t) of a round-off
  for (const double t : {0.1, 0.5, 1.0, 2.0}) {
    const double exact = 2 * std::asin(std::tanh(3.0 * t));
    double angle = std::numeric_limits<double>::quiet_NaN();
    EXPECT_NO_THROW(angle = PendulumAngle(9.0, 0.0, 6.0, t));
    EXPECT_NEAR(angle, exact, kRoundOffs * kEps * std::exp(3.0 * t)) << t;
  }
}

TEST(PendulumAngle, RestStaysRest) {
  EXPECT_EQ(PendulumAngle(9.81, 0.0, 0.0, 5.0), 0.0);
  // exactly upright sin(theta/2) = 1 and the pendulum stays there
  double upright = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NO_THROW(upright = PendulumAngle(9.81, kPi, 0.0, 0.1));
  EXPECT_NEAR(upright, kPi, kRoundOffs * kEps);
}

TEST(PendulumAngle, TurnsAreCountedWithoutJumps) {
  // around the times of half turns sine and quotient of the amplitude change at different bits
  const double w2 = 9.81, omega = 8.0;
  double low = 0.0, high = 1.0;
  while (high - low > kEps) {
    const double middle = (low + high) / 2;
    (PendulumAngle(w2, 0.0, omega, middle) < kPi ? low : high) = middle;
  }
  for (int turn = 0; turn < 8; ++turn) {
    // theta = pi + 2 pi turn: from the bottom to the top takes `low`, symmetric after that
    double t = low * (1 + 2 * turn);
    for (int i = 0; i < 100; ++i) t = std::nextafter(t, 0.0);
    for (int i = 0; i < 200; ++i, t = std::nextafter(t, 100.0)) {
      EXPECT_NEAR(PendulumAngle(w2, 0.0, omega, t), kPi * (1 + 2 * turn), 1e-9) << "turn " << turn;
    }
  }
}

TEST(PendulumAngle, HalvesOfATurnedMotionMirrorEachOther) {
  // theta -> -theta maps motions to motions
  for (const double t : {0.3, 1.7, 9.9}) {
    EXPECT_EQ(PendulumAngle(9.81, 0.4, 9.0, t), -PendulumAngle(9.81, -0.4, -9.0, t));
    EXPECT_EQ(PendulumAngle(9.81, 0.4, 1.0, t), -PendulumAngle(9.81, -0.4, -1.0, t));
  }
}

}  // namespace loopbench::harness::reference::pendulum_test
