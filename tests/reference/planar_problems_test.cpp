// Published planar problems as shipped, in their plane and turned by any rotation into space, where
// loops of parallel axes carry three redundant constraints each: the same numbers.
#include "harness/observers/observer.h"
#include "mechanism/description/library.h"
#include "mechanism/description/transforms.h"
#include "tests/reference/cases.h"
#include "tests/reference/published_numbers.h"
#include "tests/reference/simulate.h"

namespace loopbench::harness::reference::planar_problems_test {

constexpr double kTolerance = 1e-11;  // rtol = atol unless a test says otherwise

enum class Place { kPlane, kTilted };

/// A problem, and its points seen in the plane it was described in.
class PlacedProblem {
 public:
  PlacedProblem(const MechanismDescription& planar, Place place)
      : description_(place == Place::kPlane ? planar : InSpace(planar, AnyTurn())),
        R_(place == Place::kPlane ? Eigen::Matrix3d::Identity() : AnyRotation()) {}

  Simulation Run(const Method& method, const IntegratorOptions& options, double horizon,
                 const Watch& watch = {}) const {
    const Simulation run = Simulate(description_, method, options, horizon, watch);
    EXPECT_EQ(run.result.outcome, Outcome::kFinished) << run.result.message;
    EXPECT_EQ(run.result.t_reached, horizon);
    return run;
  }

  Eigen::Vector3d Point(const Snapshot& snapshot, const std::string& body,
                        const Eigen::Vector3d& at) const {
    return R_.transpose() * PointOf(description_, snapshot, BodyNamed(description_, body), at);
  }
  Eigen::Vector3d Velocity(const Snapshot& snapshot, const std::string& body,
                           const Eigen::Vector3d& at) const {
    return R_.transpose() * VelocityOf(description_, snapshot, BodyNamed(description_, body), at);
  }
  /// Angle of a body from the plane's x axis [rad], in (-pi, pi], and its rate [rad/s].
  double Angle(const Snapshot& snapshot, const std::string& body) const {
    const Eigen::Vector3d x = R_.transpose() * At(snapshot, body).R.col(0);
    return std::atan2(x.y(), x.x());
  }
  double Rate(const Snapshot& snapshot, const std::string& body) const {
    return (R_.transpose() * At(snapshot, body).w).z();
  }

 private:
  const BodyState& At(const Snapshot& snapshot, const std::string& body) const {
    return snapshot.bodies[BodyNamed(description_, body)];
  }

  MechanismDescription description_;
  Eigen::Matrix3d R_;
};

/// Distance of two angles, whole turns aside.
double Apart(double a, double b) { return std::abs(std::remainder(a - b, 2 * kPi)); }

/// Each accepted step adds an error below the tolerance; all motions below are stable, so that one
/// that is carried along grows at most with time, and what is propagated is of one order more than
/// what the tolerance bounds.
double Bound(const Simulation& run) { return static_cast<double>(run.result.steps) * kTolerance; }

class PlanarProblem : public testing::TestWithParam<std::tuple<Method, Place>> {
 protected:
  const Method& method() const { return std::get<0>(GetParam()); }
  PlacedProblem Placed(const MechanismDescription& planar) const {
    return PlacedProblem(planar, std::get<1>(GetParam()));
  }
  static const IntegratorOptions& Accurate() {
    static const IntegratorOptions kOptions = Options("ode45", kTolerance);
    return kOptions;
  }
};

const Eigen::Vector3d kTip = Eigen::Vector3d::UnitX();

TEST_P(PlanarProblem, SimplePendulumIsThatOfA01) {
  const PlacedProblem problem = Placed(Shipped("simple-pendulum").description);
  for (std::size_t i = 0; i < kA01Published.size(); ++i) {
    const Simulation run = problem.Run(method(), Accurate(), kA01Published[i].t);
    const Eigen::Vector3d tip = problem.Point(run.last, "bob", kTip);
    const double bound = Bound(run);
    EXPECT_NEAR(tip.x(), kA01Derived[i].x, bound);
    EXPECT_NEAR(tip.y(), kA01Derived[i].y, bound);
    EXPECT_NEAR(tip.x(), kA01Published[i].x, 0.5e-6 + bound);  // printed with six digits
    EXPECT_NEAR(tip.y(), kA01Published[i].y, 0.5e-6 + bound);
    EXPECT_NEAR(tip.z(), 0.0, bound);
  }
}

TEST(LongPendulum, IsThatOfA01AfterTwoThousandSeconds) {
  // an error in the energy makes one in the period, which adds up: method and tolerance to match
  const MechanismDescription problem = Shipped("simple-pendulum").description;
  for (const auto& [t, x, y] : kA01PublishedLate) {
    const Simulation run =
        Simulate(problem, RankRevealingMethods()[0], Options("fehlberg-78", 1e-14), t);
    ASSERT_EQ(run.result.outcome, Outcome::kFinished) << run.result.message;
    const Eigen::Vector3d tip = PointOf(problem, run.last, 1, kTip);
    // six digits are printed; the file is within 7.1e-7 of the closed form over its 2000 s
    EXPECT_NEAR(tip.x(), x, 7.1e-7) << t;
    EXPECT_NEAR(tip.y(), y, 7.1e-7) << t;
  }
}

TEST_P(PlanarProblem, PendulumOfTwoSecondsReturns) {
  // fifteen periods; the state returns to within 5e4 rtol at rtol 1e-8
  constexpr double kRtol = 1e-8;
  const PlacedProblem problem = Placed(Shipped("pendulum-two-seconds").description);
  const Simulation run = problem.Run(method(), Options("ode45", kRtol), 30.0);
  const Eigen::Vector3d x = problem.Point(run.last, "bob", kTip);
  const Eigen::Vector3d v = problem.Velocity(run.last, "bob", kTip);
  EXPECT_LE((x - kTip).lpNorm<Eigen::Infinity>(), 5e4 * kRtol);
  EXPECT_LE(v.lpNorm<Eigen::Infinity>(), 5e4 * kRtol);
}

TEST_P(PlanarProblem, NFourBarOfTwoIsThatOfA02) {
  // 0.70 s: 0.014 s before the first position with all bars in line
  const double w2 = 3.5 * 9.81 / 3.0;
  const PlacedProblem problem = Placed(Shipped("n-four-bar").description);
  double worst = 0.0;
  problem.Run(method(), Accurate(), 0.70, [&](const Snapshot& snapshot) {
    const double theta = PendulumAngle(w2, kPi, -1.0, snapshot.t);
    const Eigen::Vector3d exact(std::cos(theta - kPi / 2), std::sin(theta - kPi / 2), 0.0);
    worst = std::max(worst, (problem.Point(snapshot, "crank0", kTip) - exact).norm());
  });
  EXPECT_LE(worst, 1e-9);
}

TEST_P(PlanarProblem, ParallelogramOfThePaperIsAPendulum) {
  // a quarter of the way to the position in line, see closed_forms_test.cpp
  const PlacedProblem problem = Placed(Shipped("parallelogram").description);
  double theta0 = std::nan(""), worst = 0.0;
  const Simulation run = problem.Run(method(), Accurate(), 0.57, [&](const Snapshot& snapshot) {
    const double theta = problem.Angle(snapshot, "bar1") + kPi / 2;
    if (std::isnan(theta0)) theta0 = theta;
    const double exact = PendulumAngle(2 * 9.81 / 3.5, theta0, 0.0, snapshot.t);
    worst = std::max(worst, Apart(theta, exact));
  });
  EXPECT_LE(worst, Bound(run));
}

TEST_P(PlanarProblem, AndrewsSqueezerIsThatOfTheTestSet) {
#ifdef __SANITIZE_ADDRESS__
  if (method().formulation == "lagrange" && method().coordinates == Coordinates::kAbsolute &&
      std::get<1>(GetParam()) == Place::kTilted) {
    GTEST_SKIP() << "dense and in space: a quarter of an hour with sanitizers";
  }
#endif
  const PlacedProblem problem = Placed(Shipped("andrews-squeezer").description);
  // spring and torque by hand: 4530 (d - 0.07785)^2 / 2 and 0.033 N m times the crank's angle
  const Eigen::Vector3d C(0.014, 0.072, 0.0), D(0.02, -0.018, 0.0);
  double first = std::nan(""), worst = 0.0, most = 0.0, turned = -0.06171389001427645;
  const auto balance = [&](const Snapshot& snapshot) {
    turned += std::remainder(problem.Angle(snapshot, "K1") - turned, 2 * kPi);
    const double stretch = (problem.Point(snapshot, "K3", D) - C).norm() - 0.07785;
    const double energy = snapshot.kinetic + 4530.0 * stretch * stretch / 2 - 0.033 * turned;
    if (std::isnan(first)) first = energy;
    worst = std::max(worst, std::abs(energy - first));
    most = std::max(most, snapshot.kinetic);
  };
  // 0.03 s; speeds reach 1e3 rad/s, and the bound for angles is 1e-10
  const Simulation run = problem.Run(method(), Options("fehlberg-78", 1e-14), 0.03, balance);
  const auto angle = [&](const char* body) { return problem.Angle(run.last, body); };
  const auto rate = [&](const char* body) { return problem.Rate(run.last, body); };
  const std::array<double, 7> q = {
      angle("K1"), angle("K2") - angle("K1"), angle("K3"), angle("K4") - angle("K5"),
      angle("K5"), angle("K6") - angle("K7"), angle("K7")};
  const std::array<double, 7> v = {
      rate("K1"), rate("K2") - rate("K1"), rate("K3"), rate("K4") - rate("K5"),
      rate("K5"), rate("K6") - rate("K7"), rate("K7")};
  for (std::size_t i = 0; i < q.size(); ++i) {
    EXPECT_LE(Apart(q[i], kA03Verified.q[i]), 1e-10) << i;
    // the published digits are off by 1.5e-9 rad and 5.1e-8 themselves
    EXPECT_LE(Apart(q[i], kA03Published.q[i]), 5e-9) << i;
    EXPECT_NEAR(v[i] / kA03Published.v[i], 1.0, 2e-7) << i;
  }
  EXPECT_LE(worst, 1e-10 * most);  // the bound of the angles in the energy
}

TEST_P(PlanarProblem, SliderCrankIsThatOfSundials) {
  const PlacedProblem problem = Placed(Shipped("slider-crank").description);
  for (std::size_t i = 0; i < kSliderCrankVerified.size(); ++i) {
    const SliderCrankState& exact = kSliderCrankVerified[i];
    const SliderCrankState& printed = kSliderCrankPublished[i];
    const Simulation run = problem.Run(method(), Accurate(), exact.t);
    const double q = problem.Angle(run.last, "crank"), p = problem.Angle(run.last, "rod");
    const double x = problem.Point(run.last, "rod", Eigen::Vector3d::Zero()).x();
    const double bound = Bound(run);
    EXPECT_LE(Apart(q, exact.q), bound) << exact.t;
    EXPECT_NEAR(x, exact.x, bound) << exact.t;
    EXPECT_LE(Apart(p, exact.p), bound) << exact.t;
    // five digits are printed, of a solution at 1e-6: one unit of the fifth
    EXPECT_NEAR(q, printed.q, FifthDigit(printed.q)) << exact.t;
    EXPECT_NEAR(x, printed.x, FifthDigit(printed.x)) << exact.t;
    EXPECT_NEAR(p, printed.p, FifthDigit(printed.p)) << exact.t;
    if (exact.t == 10.0) {
      EXPECT_NEAR(problem.Rate(run.last, "crank"), kSliderCrankSpeedVerified, bound);
      EXPECT_NEAR(run.kinetic_integral, kSliderCrankIntegralVerified, bound);
      // published at rtol 1e-6, which leaves 9.3e-6
      EXPECT_NEAR(run.kinetic_integral, kSliderCrankIntegralPublished, 1e-5);
      EXPECT_LE(run.energy_error, bound);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, PlanarProblem,
                         testing::Combine(testing::ValuesIn(RankRevealingMethods()),
                                          testing::Values(Place::kPlane, Place::kTilted)),
                         [](const auto& test) {
                           return NameOf(std::get<0>(test.param)) +
                                  (std::get<1>(test.param) == Place::kPlane ? "Plane" : "Tilted");
                         });

}  // namespace loopbench::harness::reference::planar_problems_test
