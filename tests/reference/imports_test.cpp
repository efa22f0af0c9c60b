// Mechanisms of other formats (configs/imports/), written from published parameters: the motion of
// each against numbers that do not come from this library: closed forms, published or derived
// numbers, an integration of published equations, or a shipped mechanism that has such a reference.
#include "harness/exchange/import.h"
#include "harness/observers/observer.h"
#include "tests/reference/cases.h"
#include "tests/reference/published_numbers.h"
#include "tests/reference/simulate.h"

namespace loopbench::harness::reference::imports_test {

constexpr double kTolerance = 1e-11;  // rtol = atol unless a test says otherwise

MechanismDescription Import(const std::string& file, const std::string& sidecar = "",
                            bool planar = false) {
  ImportOptions options;
  options.planar = planar;
  if (!sidecar.empty()) options.sidecar = kConfigs / "imports" / sidecar;
  return ImportMechanism(kConfigs / "imports" / file, options).description;
}

Simulation RunTo(const MechanismDescription& description, const Method& method, double horizon,
                 const Watch& watch = {}) {
  const Simulation run =
      Simulate(description, method, Options("ode45", kTolerance), horizon, watch);
  EXPECT_EQ(run.result.outcome, Outcome::kFinished) << run.result.message;
  EXPECT_EQ(run.result.t_reached, horizon);
  return run;
}

/// As in planar_problems_test.cpp: each accepted step adds an error below the tolerance, and the
/// motions are stable, so that one that is carried along grows at most with time.
double Bound(const Simulation& run) { return static_cast<double>(run.result.steps) * kTolerance; }

Eigen::Vector3d Point(const MechanismDescription& description, const Snapshot& snapshot,
                      const std::string& body, const Eigen::Vector3d& at) {
  return PointOf(description, snapshot, BodyNamed(description, body), at);
}

/// Largest difference of the motions of the bodies with equal names [m, rad/s, m/s].
double Difference(const MechanismDescription& a, const Snapshot& at_a,
                  const MechanismDescription& b, const Snapshot& at_b) {
  double worst = 0.0;
  for (std::size_t i = 1; i < a.bodies.size(); ++i) {
    const BodyState& one = at_a.bodies[i];
    const BodyState& other = at_b.bodies[static_cast<std::size_t>(BodyNamed(b, a.bodies[i].name))];
    worst = std::max(
        {worst, (one.p - other.p).norm(), (one.w - other.w).norm(), (one.v - other.v).norm()});
  }
  return worst;
}

using State = std::array<long double, 4>;  // two coordinates and their rates
using Accelerations = std::function<std::array<long double, 2>(const State&)>;

/// The classical Runge-Kutta method in long double with 2e4 steps: errors below 1e-13 here.
State Integrate(State y, const Accelerations& accelerations, double horizon) {
  constexpr int kSteps = 20000;
  const long double h = static_cast<long double>(horizon) / kSteps;
  const auto rates = [&](const State& s) {
    const auto a = accelerations(s);
    return State{s[2], s[3], a[0], a[1]};
  };
  const auto after = [](const State& s, const State& k, long double step) {
    State moved = s;
    for (std::size_t i = 0; i < 4; ++i) moved[i] += step * k[i];
    return moved;
  };
  for (int n = 0; n < kSteps; ++n) {
    const State k1 = rates(y), k2 = rates(after(y, k1, h / 2)), k3 = rates(after(y, k2, h / 2)),
                k4 = rates(after(y, k3, h));
    for (std::size_t i = 0; i < 4; ++i) y[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
  }
  return y;
}

class Imports : public testing::TestWithParam<Method> {};

TEST_P(Imports, PendulumOfMjcfFollowsItsClosedForm) {
  const MechanismDescription pendulum = Import("pendulum.xml");
  const double l = 0.5, r = 0.05, w2 = 9.81 * l / (l * l + 0.4 * r * r);
  double worst = 0.0;
  const Simulation run = RunTo(pendulum, GetParam(), 5.0, [&](const Snapshot& snapshot) {
    const double up = PendulumAngle(w2, -kPi / 3, 0.0, snapshot.t) + kPi;
    const Eigen::Vector3d exact(l * std::sin(up), 0.0, 0.6 + l * std::cos(up));
    const Eigen::Vector3d tip = Point(pendulum, snapshot, "pole", {0.0, 0.0, l});
    worst = std::max(worst, (tip - exact).norm());
  });
  EXPECT_LE(worst, Bound(run));
  std::cout << "tip " << worst << " m, " << run.result.steps << " steps\n";
}

TEST_P(Imports, AcrobotOfMjcfFollowsSuttonsEquations) {
  const MechanismDescription acrobot = Import("acrobot.xml");
  const Accelerations sutton = [](const State& s) {
    constexpr long double m = 1, l = 1, lc = 0.5L, I = 1, g = 9.8L;
    const auto [q1, q2, u1, u2] = s;
    const long double c2 = std::cos(q2), s2 = std::sin(q2);
    const long double d1 = m * lc * lc + m * (l * l + lc * lc + 2 * l * lc * c2) + I + I;
    const long double d2 = m * (lc * lc + l * lc * c2) + I;
    const long double phi2 = m * lc * g * std::sin(q1 + q2);  // cos(x - pi / 2)
    const long double phi1 = -m * l * lc * u2 * u2 * s2 - 2 * m * l * lc * u2 * u1 * s2 +
                             (m * lc + m * l) * g * std::sin(q1) + phi2;
    const long double a2 =
        (d2 / d1 * phi1 - m * l * lc * u1 * u1 * s2 - phi2) / (m * lc * lc + I - d2 * d2 / d1);
    return std::array{-(d2 * a2 + phi1) / d1, a2};
  };
  const State exact = Integrate({0.8L, -0.4L, 0.5L, 1.0L}, sutton, 3.0);
  const Simulation run = RunTo(acrobot, GetParam(), 3.0);
  const double q1 = static_cast<double>(exact[0]), q2 = static_cast<double>(exact[0] + exact[1]);
  const Eigen::Vector3d tip(std::sin(q1) + std::sin(q2), 0.0, 2.0 - std::cos(q1) - std::cos(q2));
  const double error = (Point(acrobot, run.last, "lower", {0.0, 0.0, -1.0}) - tip).norm();
  EXPECT_LE(error, Bound(run));
  std::cout << "tip " << error << " m, " << run.result.steps << " steps\n";
}

TEST_P(Imports, CartPoleOfMjcfFollowsTheEquationsOf1983) {
  const MechanismDescription cart = Import("cart-pole.xml");
  const Accelerations barto = [](const State& s) {
    constexpr long double m = 0.1L, M = 1.1L, l = 0.5L, g = 9.8L, F = 10;
    const long double sine = std::sin(s[1]), cosine = std::cos(s[1]);
    const long double push = (-F - m * l * s[3] * s[3] * sine) / M;
    const long double turn =
        (g * sine + cosine * push) / (l * (4.0L / 3 - m * cosine * cosine / M));
    return std::array{(F + m * l * (s[3] * s[3] * sine - turn * cosine)) / M, turn};
  };
  const State exact = Integrate({0, 0.2L, 0, 0}, barto, 1.0);
  const Simulation run = RunTo(cart, GetParam(), 1.0);
  const double x = static_cast<double>(exact[0]), q = static_cast<double>(exact[1]);
  const Eigen::Vector3d top(x + std::sin(q), 0.0, std::cos(q));
  const double error = (Point(cart, run.last, "pole", {0.0, 0.0, 1.0}) - top).norm();
  EXPECT_LE(error, Bound(run));
  std::cout << "top " << error << " m, " << run.result.steps << " steps\n";
}

/// The published angles are of the crank; its speed follows, in the plane and in space.
TEST_P(Imports, AndrewsSqueezerOfMjcfIsThatOfA03) {
  const MechanismDescription shipped = Shipped("andrews-squeezer").description;
  const Simulation ours = RunTo(shipped, GetParam(), 0.03);
  for (const bool planar : {false, true}) {
    // nine redundant constraints: dense ones of absolute coordinates take fifteen seconds
    if (!planar && GetParam().coordinates == Coordinates::kAbsolute) continue;
    const MechanismDescription squeezer = Import("andrews-squeezer.xml", "", planar);
    EXPECT_EQ(squeezer.space, planar ? SpaceKind::kPlanar : SpaceKind::kSpatial);
    const Simulation run = RunTo(squeezer, GetParam(), 0.03);
    const BodyState& crank = run.last.bodies[BodyNamed(squeezer, "K1")];
    const double beta = std::atan2(crank.R(1, 0), crank.R(0, 0));
    const double angle = std::abs(std::remainder(beta - kA03Verified.q[0], 2 * kPi));
    const double speed = std::abs(crank.w.z() / kA03Verified.v[0] - 1.0);
    EXPECT_LE(angle, Bound(run));
    EXPECT_LE(speed, Bound(run));
    const double apart = Difference(squeezer, run.last, shipped, ours.last) / kA03Verified.v[0];
    EXPECT_LE(apart, Bound(run));
    std::cout << "crank " << angle << " rad, speed " << speed << ", to the shipped one " << apart
              << ", " << run.result.steps << " steps\n";
  }
}

TEST_P(Imports, FlyballGovernorOfMjcfIsThatOfA05) {
  if (GetParam().coordinates != Coordinates::kJoint) return;  // four times the steps
  const MechanismDescription governor = Import("flyball-governor.xml");
  const A05State& exact = kA05Derived.front();
  const Simulation run = Simulate(governor, GetParam(), Options("ode45", 1e-9), exact.t);
  ASSERT_EQ(run.result.outcome, Outcome::kFinished) << run.result.message;
  const auto at = [&](const char* name) { return run.last.bodies[BodyNamed(governor, name)]; };
  const Eigen::Vector3d rod = at("rod1").R.col(0);
  const double alpha = std::atan2(-rod.z(), rod.head<2>().norm());
  const double error =
      std::max({std::abs(at("slider").p.z() - exact.s), std::abs(alpha - exact.alpha),
                std::abs(at("shaft").w.z() - exact.omega)});
  EXPECT_LE(error, 1e-9 * 10);  // as flyball_test.cpp has it
  std::cout << "height, angle, speed: " << error << ", " << run.result.steps << " steps\n";
}

TEST_P(Imports, OneFourBarOfUrdfIsThatOfA02) {
  const A02Angle& exact = kA02DerivedAtHalfSecond[0];
  for (const bool planar : {false, true}) {
    const MechanismDescription bars = Import("one-four-bar.urdf", "one-four-bar-loop.json", planar);
    const Simulation run = RunTo(bars, GetParam(), 0.5);
    // the plane has axes of its own: up is against gravity. The middle of the coupler is as high as
    // the tips of the cranks, and as fast
    const BodyState& coupler = run.last.bodies[BodyNamed(bars, "coupler")];
    const double up = -coupler.p.dot(bars.gravity.normalized());
    const double error = std::abs(up - std::cos(exact.phi));
    EXPECT_LE(error, Bound(run));
    EXPECT_NEAR(coupler.v.norm(), run.last.bodies[BodyNamed(bars, "left")].w.norm(), Bound(run));
    std::cout << "height " << error << " m, " << run.result.steps << " steps\n";
  }
}

TEST_P(Imports, LoopsWithinUrdfMoveAsInASidecar) {
  const MechanismDescription bars = Import("one-four-bar.urdf", "one-four-bar-loop.json");
  const Simulation expected = RunTo(bars, GetParam(), 0.5);
  for (const std::string loop :
       {R"(<loop_joint name="B" type="continuous"><link1 link="right" xyz="0 0 1"/>
           <link2 link="coupler" xyz="1 0 0"/><axis xyz="0 1 0"/></loop_joint>)",
        R"(<gazebo><joint name="B" type="revolute"><parent>right</parent><child>coupler</child>
           <pose>1 0 0 0 0 0</pose><axis><xyz>0 1 0</xyz></axis></joint></gazebo>)",
        R"(<drake:ball_constraint><drake:ball_constraint_body_A name="right"/>
           <drake:ball_constraint_p_AP value="0 0 1"/><drake:ball_constraint_body_B name="coupler"/>
           <drake:ball_constraint_p_BQ value="1 0 0"/></drake:ball_constraint>)"}) {
    std::string text = ReadFile(kConfigs / "imports/one-four-bar.urdf");
    text.insert(text.rfind("</robot>"), loop);
    MechanismDescription own = ImportText(text, "file.urdf").description;
    own.initial = bars.initial;  // the same joints in the same order
    const Simulation run = RunTo(own, GetParam(), 0.5);
    EXPECT_LE(Difference(own, run.last, bars, expected.last), Bound(run)) << loop;
  }
}

TEST_P(Imports, BennettOfUrdfMovesAsTheShippedOne) {
  const MechanismDescription shipped = Shipped("bennett").description;
  const MechanismDescription linkage = Import("bennett.urdf", "bennett-loop.json", false);
  const Simulation ours = RunTo(shipped, GetParam(), 2.0);
  const Simulation run = RunTo(linkage, GetParam(), 2.0);
  const double apart = Difference(linkage, run.last, shipped, ours.last);
  EXPECT_LE(apart, Bound(run) + Bound(ours));
  std::cout << "apart " << apart << ", " << run.result.steps << " steps\n";
}

TEST_P(Imports, SliderCrankOfUrdfIsThatOfSundials) {
  for (const bool planar : {false, true}) {
    const MechanismDescription crank =
        Import("slider-crank.urdf", "slider-crank-loop.json", planar);
    const SliderCrankState& exact = kSliderCrankVerified.back();
    const Simulation run = RunTo(crank, GetParam(), exact.t);
    const Eigen::Vector3d middle = Point(crank, run.last, "rod", {1.0, 0.0, 0.0});
    const double error = (middle - Eigen::Vector3d(exact.x, 0.0, 0.0)).norm();
    const double speed = run.last.bodies[BodyNamed(crank, "crank")].w.z();
    EXPECT_LE(error, Bound(run));
    EXPECT_NEAR(speed, kSliderCrankSpeedVerified, Bound(run));
    std::cout << "rod " << error << " m, speed " << speed - kSliderCrankSpeedVerified << " rad/s, "
              << run.result.steps << " steps\n";
  }
}

TEST_P(Imports, NFourBarOfSdfIsThatOfA02) {
  const MechanismDescription bars = Import("n-four-bar.sdf", "n-four-bar-start.json");
  const double w2 = 3.5 * 9.81 / 3.0;
  double worst = 0.0;
  RunTo(bars, GetParam(), 0.70, [&](const Snapshot& snapshot) {
    const double theta = PendulumAngle(w2, kPi, -1.0, snapshot.t);
    const Eigen::Vector3d exact(std::cos(theta - kPi / 2), std::sin(theta - kPi / 2), 0.0);
    worst = std::max(worst, (Point(bars, snapshot, "crank0", {0.0, 1.0, 0.0}) - exact).norm());
  });
  EXPECT_LE(worst, 1e-9);  // as planar_problems_test.cpp has it
  std::cout << "tip " << worst << " m\n";
}

TEST_P(Imports, FurutaPendulumOfSdfFollowsItsEquations) {
  const MechanismDescription furuta = Import("furuta.sdf", "furuta-start.json");
  // equations (33) and (34) of the paper with the moments about the arms' own axes kept
  const Accelerations cazzolato = [](const State& s) {
    constexpr long double L1 = 0.278L, l1 = 0.150L, l2 = 0.148L, m1 = 0.3L, m2 = 0.075L,
                          J1 = 2.48e-2L, J2 = 3.86e-3L, own = 1e-7L, b1 = 1e-4L, b2 = 2.8e-4L,
                          g = 9.81L;
    const long double sine = std::sin(s[1]), cosine = std::cos(s[1]);
    const long double J0 = J1 + m1 * l1 * l1 + m2 * L1 * L1 + own;
    const long double across = J2 + m2 * l2 * l2, twist = across - own;
    const long double a = J0 + twist * sine * sine, b = m2 * L1 * l2 * cosine, d = across;
    const long double r1 =
        m2 * L1 * l2 * sine * s[3] * s[3] - s[2] * s[3] * twist * 2 * sine * cosine - b1 * s[2];
    const long double r2 = s[2] * s[2] * twist * sine * cosine - b2 * s[3] - g * m2 * l2 * sine;
    const long double det = a * d - b * b;
    return std::array{(d * r1 - b * r2) / det, (a * r2 - b * r1) / det};
  };
  const State exact = Integrate({0, static_cast<long double>(kPi / 2), 2, 0}, cazzolato, 3.0);
  const Simulation run = RunTo(furuta, GetParam(), 3.0);
  const double q1 = static_cast<double>(exact[0]), q2 = static_cast<double>(exact[1]);
  const Eigen::Vector3d x(std::cos(q1), std::sin(q1), 0.0), y(-std::sin(q1), std::cos(q1), 0.0);
  const Eigen::Vector3d com =
      0.278 * x + 0.148 * (std::sin(q2) * y) - 0.148 * std::cos(q2) * Eigen::Vector3d::UnitZ();
  const double error = (run.last.bodies[BodyNamed(furuta, "pendulum")].p - com).norm();
  EXPECT_LE(error, Bound(run));
  std::cout << "centre of mass " << error << " m, " << run.result.steps << " steps\n";
}

INSTANTIATE_TEST_SUITE_P(Methods, Imports, testing::ValuesIn(RankRevealingMethods()),
                         NameOfParam());

}  // namespace loopbench::harness::reference::imports_test
