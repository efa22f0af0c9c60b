// One rigid body in space against elliptic functions: free, on a spherical joint, and on one that
// closes a loop with a free joint, so that every formulation has constraints in both coordinate
// sets.
#include "tests/reference/cases.h"
#include "tests/reference/rigid_motions.h"
#include "tests/reference/simulate.h"

namespace loopbench::harness::reference::spatial_closed_forms_test {

constexpr double kTolerance = 1e-11;  // rtol = atol of every run here
constexpr double kHorizon = 4.0;      // several turns of every motion [s]

/// How the body hangs on the ground.
enum class Hold { kSpherical, kFreeAndSpherical };

JointDescription JointTo(const std::string& name, JointType type, int body) {
  JointDescription joint;
  joint.name = name;
  joint.type = type;
  joint.from.body = kGround;
  joint.to.body = body;
  return joint;
}

/// A body whose origin is held in the ground's, with attitude R and angular velocity w in ground
/// axes at the start.
MechanismDescription BodyOnPoint(const BodyDescription& body, Hold hold, const Eigen::Vector3d& g,
                                 const Eigen::Matrix3d& R, const Eigen::Vector3d& w) {
  MechanismDescription problem;
  problem.name = "body";
  problem.space = SpaceKind::kSpatial;
  problem.gravity = g;
  problem.bodies[kGround].name = "ground";
  problem.bodies.push_back(body);
  const Eigen::Quaterniond e(R);
  std::vector<double> coordinates = {e.w(), e.x(), e.y(), e.z()};
  std::vector<double> speeds = {w[0], w[1], w[2]};
  if (hold == Hold::kFreeAndSpherical) {
    problem.joints.push_back(JointTo("free", JointType::kFree, 1));
    problem.joints.push_back(JointTo("ball", JointType::kSpherical, 1));
    problem.joints.back().cut = true;
    coordinates.insert(coordinates.end(), 3, 0.0);
    speeds.insert(speeds.end(), 3, 0.0);
  } else {
    problem.joints.push_back(JointTo("ball", JointType::kSpherical, 1));
  }
  problem.initial.coordinates.push_back({0, coordinates});
  problem.initial.speeds.push_back({0, speeds});
  return problem;
}

const Eigen::Vector3d kMoments(0.4, 0.8, 1.1), kRates(3.0, 0.0, 2.5);  // in principal axes

/// Without forces.
MechanismDescription AsymmetricBody(Hold hold, const Eigen::Matrix3d& R) {
  BodyDescription body;
  body.name = "body";
  body.mass = 1.3;
  body.inertia = kMoments.asDiagonal();
  return BodyOnPoint(body, hold, Eigen::Vector3d::Zero(), R, R * kRates);
}

/// For elements of a rotation matrix, energies of some joules and lengths below a metre: each step
/// adds an error below the tolerance, and one that is carried along grows at most with time.
double Bound(const Simulation& simulation) {
  return static_cast<double>(simulation.result.steps) * kTolerance;
}

void ExpectAttitude(const MechanismDescription& problem, const Method& method,
                    const std::function<Eigen::Matrix3d(double)>& exact) {
  double worst = 0.0;
  int step = 0;
  const Simulation run = Simulate(
      problem, method, Options("ode45", kTolerance), kHorizon, [&](const Snapshot& snapshot) {
        // the closed form costs a quadrature
        if (step++ % 50 != 0 && snapshot.t < kHorizon) return;
        const Eigen::Matrix3d error = snapshot.bodies[1].R - exact(snapshot.t);
        worst = std::max(worst, error.lpNorm<Eigen::Infinity>());
      });
  ASSERT_EQ(run.result.outcome, Outcome::kFinished) << run.result.message;
  ASSERT_EQ(run.result.t_reached, kHorizon);
  EXPECT_LE(worst, Bound(run));
  EXPECT_LE(run.energy_error, Bound(run));
  const Eigen::Vector3d held = PointOf(problem, run.last, 1, Eigen::Vector3d::Zero());
  EXPECT_LE(held.norm(), Bound(run));
}

class OneBody : public testing::TestWithParam<std::tuple<Method, Hold>> {
 protected:
  const Method& method() const { return std::get<0>(GetParam()); }
  Hold hold() const { return std::get<1>(GetParam()); }
};

TEST_P(OneBody, AsymmetricWithoutMomentsTurnsAsJacobiSays) {
  const FreeBody exact(kMoments, kRates[0], kRates[2]);
  const Eigen::Matrix3d R0 = AnyRotation();
  const MechanismDescription problem = AsymmetricBody(hold(), R0);
  ExpectAttitude(problem, method(),
                 [&](double t) -> Eigen::Matrix3d { return R0 * exact.Attitude(t); });
}

/// Quaternions are normalised where they are used and nowhere else: every method keeps its order,
/// which a normalisation of the state after each step need not.
TEST_P(OneBody, QuaternionsKeepTheOrderOfTheIntegrator) {
  const FreeBody exact(kMoments, kRates[0], kRates[2]);
  const MechanismDescription problem = AsymmetricBody(hold(), Eigen::Matrix3d::Identity());
  for (const auto& [profile, order] : {std::pair{"bogacki-shampine", 3}, {"dormand-prince", 5}}) {
    const auto error = [&](double step) {
      IntegratorOptions options = Options(profile, 1e-3);
      options.fixed_step = step;
      const Simulation run = Simulate(problem, method(), options, 1.6, {});
      EXPECT_EQ(run.result.outcome, Outcome::kFinished);
      return (run.last.bodies[1].R - exact.Attitude(1.6)).norm();
    };
    const double coarse = error(0.02), fine = error(0.01);
    // errors of 1e-4 to 1e-9: terms of the next order are some per cent at these steps
    EXPECT_NEAR(std::log2(coarse / fine), order, 0.3) << profile << " " << coarse << " " << fine;
  }
}

/// A symmetric body with its centre of mass 0.5 m from the fixed point, along its third axis.
BodyDescription Top(double A, double C) {
  BodyDescription top;
  top.name = "top";
  top.mass = 1.0;
  top.com = {0.0, 0.0, 0.5};
  const double across = A - top.mass * 0.25;
  top.inertia = Eigen::Vector3d(across, across, C).asDiagonal();
  return top;
}

/// Started at a turning point of the nutation.
void ExpectTop(const Method& method, Hold hold, double A, double C, double theta, double phi_rate,
               double w3) {
  constexpr double kGravity = 9.81;
  const SymmetricTop exact(A, C, kGravity * 0.5, theta, phi_rate, w3);
  const Eigen::Matrix3d R0 = EulerRotation(0.0, theta, 0.0);
  const double own_spin = w3 - phi_rate * std::cos(theta);
  const Eigen::Vector3d w = phi_rate * Eigen::Vector3d::UnitZ() + own_spin * R0.col(2);
  ExpectAttitude(BodyOnPoint(Top(A, C), hold, {0.0, 0.0, -kGravity}, R0, w), method,
                 [&](double t) { return exact.Attitude(t); });
}

TEST_P(OneBody, SphericalPendulumNutatesAndPrecesses) {
  // from its upper turning point, without spin
  ExpectTop(method(), hold(), 0.35, 0.1, kPi - 1.2, 1.5, 0.0);
}

TEST_P(OneBody, HeavyTopNutatesAndPrecesses) {
  // dropped without precession: it falls to the lower turning point in cusps
  ExpectTop(method(), hold(), 0.35, 0.2, 0.5, 0.0, 25.0);
}

TEST_P(OneBody, HeavyTopLoopsWhenPushedBackwards) {
  ExpectTop(method(), hold(), 0.35, 0.2, 0.9, -1.5, 20.0);
}

INSTANTIATE_TEST_SUITE_P(Methods, OneBody,
                         testing::Combine(testing::ValuesIn(RankRevealingMethods()),
                                          testing::Values(Hold::kSpherical,
                                                          Hold::kFreeAndSpherical)),
                         [](const auto& test) {
                           return NameOf(std::get<0>(test.param)) +
                                  (std::get<1>(test.param) == Hold::kSpherical ? "Ball"
                                                                               : "FreeAndBall");
                         });

class Bennett : public testing::TestWithParam<Method> {};

TEST_P(Bennett, LinkageKeepsTheRelationOfItsAngles) {
  // tan(theta1 / 2) tan(theta2 / 2) = sin((beta + alpha) / 2) / sin((beta - alpha) / 2)
  const MechanismDescription problem =
      ReadMechanism(kConfigs / "mechanisms/bennett.json").description;
  const double alpha = 1.1, beta = std::asin(0.6 * std::sin(alpha));
  const double plus = std::sin((beta + alpha) / 2), minus = std::sin((beta - alpha) / 2);
  const Eigen::Matrix3d twist = Eigen::AngleAxisd(alpha, Eigen::Vector3d::UnitX()).matrix();
  constexpr double kRtol = 1e-9;
  double worst = 0.0;
  const Simulation run =
      Simulate(problem, GetParam(), Options("ode45", kRtol), 5.0, [&](const Snapshot& snapshot) {
        const Eigen::Matrix3d& R1 = snapshot.bodies[1].R;
        const Eigen::Matrix3d R12 = (R1 * twist).transpose() * snapshot.bodies[2].R;
        const double half1 = std::atan2(R1(1, 0), R1(0, 0)) / 2;
        const double half2 = std::atan2(R12(1, 0), R12(0, 0)) / 2;
        worst = std::max(worst, std::abs(minus * std::sin(half1) * std::sin(half2) -
                                         plus * std::cos(half1) * std::cos(half2)));
      });
  ASSERT_EQ(run.result.outcome, Outcome::kFinished) << run.result.message;
  const double bound = static_cast<double>(run.result.steps) * kRtol;
  EXPECT_LE(worst, bound);
  EXPECT_LE(run.energy_error, 10.0 * bound);  // energies of some 10 J
}

INSTANTIATE_TEST_SUITE_P(Methods, Bennett, testing::ValuesIn(RankRevealingMethods()),
                         NameOfParam());

// The closed forms themselves against facts that need no elliptic function.

TEST(SymmetricTop, PrecessesSteadilyWhereTheMomentsBalance) {
  // A cos(theta) p^2 - C w3 p + m g l = 0
  const double A = 0.35, C = 0.2, mgl = 4.905, theta = 0.7, w3 = 40.0;
  const double a = A * std::cos(theta), b = C * w3;
  for (const double sign : {-1.0, 1.0}) {
    const double rate = (b + sign * std::sqrt(b * b - 4 * a * mgl)) / (2 * a);
    const SymmetricTop top(A, C, mgl, theta, rate, w3);
    EXPECT_NEAR(top.other_height(), std::cos(theta), 1e-13);
    for (const double t : {0.3, 2.0}) {
      const double spin = w3 - rate * std::cos(theta);
      const Eigen::Matrix3d expected = EulerRotation(rate * t, theta, spin * t);
      // angles of some 100 rad, known to as many round-offs
      EXPECT_LE((top.Attitude(t) - expected).lpNorm<Eigen::Infinity>(), 1e-12);
    }
  }
}

TEST(SymmetricTop, TurnsBetweenTheHeightsThatEnergyAllows) {
  const double A = 0.35, C = 0.2, mgl = 4.905, theta = 0.5, w3 = 25.0;
  const SymmetricTop top(A, C, mgl, theta, 0.0, w3);
  // dropped at rest: 2 A mgl (u0 - u)(1 - u^2) = (C w3)^2 (u0 - u)^2 at the turning points
  const double u0 = std::cos(theta), u = top.other_height();
  EXPECT_LT(u, u0);
  EXPECT_NEAR(2 * A * mgl * (1 - u * u), C * C * w3 * w3 * (u0 - u), 1e-12);
  double least = 1.0;
  for (int i = 0; i <= 1000; ++i) least = std::min(least, top.Height(1e-3 * i));
  EXPECT_NEAR(least, u, 1e-4);  // sampled: 1e-3 s beside a minimum
  EXPECT_GE(least, u - 1e-15);
}

TEST(FreeBody, KeepsItsMomentumAndEnergy) {
  const FreeBody body(kMoments, kRates[0], kRates[2]);
  const Eigen::Vector3d L0 = kMoments.cwiseProduct(body.Rates(0.0));
  const double T0 = L0.dot(body.Rates(0.0));
  for (const double t : {0.2, 1.0, 3.7}) {
    const Eigen::Vector3d L = kMoments.cwiseProduct(body.Rates(t));
    EXPECT_LE((body.Attitude(t) * L - L0).norm(), 1e-13) << t;
    EXPECT_NEAR(L.dot(body.Rates(t)), T0, 1e-13) << t;
    // attitude and rates belong together: R' = R [w]x
    const double h = 1e-4;
    const Eigen::Matrix3d Rdot = (body.Attitude(t + h) - body.Attitude(t - h)) / (2 * h);
    const Eigen::Matrix3d W = body.Attitude(t).transpose() * Rdot;
    // central differences: h^2 w^3 / 6 = 1e-7
    EXPECT_LE((Eigen::Vector3d(W(2, 1), W(0, 2), W(1, 0)) - body.Rates(t)).norm(), 1e-6) << t;
  }
}

}  // namespace loopbench::harness::reference::spatial_closed_forms_test
