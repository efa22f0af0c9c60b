// Starts nearest to their guesses.
#include "tests/mechanism/shipped.h"

namespace loopbench::nearest_start_test {

using testing::Assembled;

const Eigen::Vector3d kOrigin = Eigen::Vector3d::Zero(), kX = Eigen::Vector3d::UnitX();

/// Bars of 1 kg with these moments of inertia, "bar1" first.
MechanismDescription Bars(const std::string& name, const std::vector<double>& inertias) {
  MechanismDescription d;
  d.name = name;
  for (const double inertia : inertias) {
    d.bodies.push_back(Bar("bar" + std::to_string(d.bodies.size()), 1.0, 1.0, inertia));
  }
  return d;
}

/// A double rocker, pins 3.5 m apart, bars of 2, 1.5 and 1.5 m; `A` and `C` are guessed.
MechanismDescription Rocker(double crank, double A, double C) {
  MechanismDescription d = Bars("rocker", {2.0, 1.5, 1.5});
  d.gravity = {0.0, -9.81, 0.0};
  d.joints = {Revolute("O", 0, kOrigin, 1, kOrigin), Revolute("A", 1, 2.0 * kX, 2, kOrigin),
              Revolute("C", 0, 3.5 * kX, 3, kOrigin), Revolute("B", 2, 1.5 * kX, 3, 1.5 * kX)};
  d.initial.coordinates = {{0, {crank}}, {1, {A}}, {2, {C}}};
  d.initial.held = {0};
  return d;
}

/// Its two positions at a crank angle, A and C: where circles of 1.5 m about the crank's end and
/// about the pin meet. Empty where they do not.
std::vector<Eigen::Vector2d> RockerPositions(double crank) {
  const Eigen::Vector2d end(2.0 * std::cos(crank), 2.0 * std::sin(crank)), pin(3.5, 0.0),
      between = pin - end, middle = 0.5 * (end + pin);
  const double half = 0.5 * between.norm();
  if (half >= 1.5) return {};
  const Eigen::Vector2d aside =
      std::sqrt(1.5 * 1.5 - half * half) * Eigen::Vector2d(-between[1], between[0]).normalized();
  std::vector<Eigen::Vector2d> positions;
  for (const double side : {1.0, -1.0}) {
    const Eigen::Vector2d tip = middle + side * aside, a = tip - end, c = tip - pin;
    positions.emplace_back(std::atan2(a[1], a[0]) - crank, std::atan2(c[1], c[0]));
  }
  return positions;
}

/// A closed chain of five bars with two free motions. Its start is a stationary point of the
/// squared distance from the guesses along both.
TEST(NearestStart, IsStationaryAlongFreeMotions) {
  const std::vector<double> lengths = {1.0, 1.4, 0.8, 1.2};
  MechanismDescription d = Bars("chain", lengths);
  for (int i = 0; i < 4; ++i) {
    d.joints.push_back(Revolute("J" + std::to_string(i), i,
                                i == 0 ? kOrigin : Eigen::Vector3d(lengths[i - 1] * kX), i + 1,
                                kOrigin));
  }
  d.joints.push_back(Revolute("end", 4, lengths[3] * kX, 0, 1.5 * kX));
  const Eigen::Vector4d guess(1.2, -0.5, -1.3, -0.2);  // missed by 0.1 to 0.3 rad
  for (int i = 0; i < 4; ++i) d.initial.coordinates.push_back({i, {guess[i]}});
  const Assembled<> at(d);
  const Start<double>& start = at.start;
  ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
  // rows of the closure: derivatives of the end's place by each angle
  Eigen::Matrix<double, 2, 4> J = Eigen::Matrix<double, 2, 4>::Zero();
  double angle = 0.0;
  for (int bar = 0; bar < 4; ++bar) {
    angle += start.q[bar];
    for (int i = 0; i <= bar; ++i) {
      J.col(i) += lengths[bar] * Eigen::Vector2d(-std::sin(angle), std::cos(angle));
    }
  }
  const Eigen::Vector4d apart = start.q - guess;
  const Eigen::Vector4d free = apart - J.transpose() * (J * J.transpose()).ldlt().solve(J * apart);
  // The last steps end where they gain less than a share of 1e-6.
  EXPECT_GT(apart.norm(), 0.05);
  EXPECT_LT(free.norm(), 1e-2 * apart.norm());
}

double ModuloTurn(double angle) { return std::remainder(angle, 2 * kPi); }

/// Angles A and C of a start of the rocker.
template <class Space>
Eigen::Vector2d AngleAC(const Assembled<Space>& at) {
  return {at.start.q[at.mechanism.joints()[1].q_offset],
          at.start.q[at.mechanism.joints()[2].q_offset]};
}

/// Of a guess from a position, angles modulo a turn.
double Away(const Eigen::Vector2d& guess, const Eigen::Vector2d& position) {
  return std::hypot(ModuloTurn(guess[0] - position[0]), ModuloTurn(guess[1] - position[1]));
}

/// Guesses anywhere: in the plane and in space, where cut joints measure angles modulo a turn.
template <class Space>
void ExpectNearestPositions(int starts) {
  std::mt19937_64 generator(4);
  const auto random = [&] { return static_cast<double>(generator() >> 11) * 0x1p-52 - 1.0; };
  int farther_exists = 0;
  for (int tried = 0; tried < starts;) {
    const double crank = kPi * random();
    const std::vector<Eigen::Vector2d> positions = RockerPositions(crank);
    if (positions.empty()) continue;
    const double most = tried % 2 == 0 ? 1.0 : kPi;
    const Eigen::Vector2d guess = positions[0] + most * Eigen::Vector2d(random(), random());
    ++tried;
    MechanismDescription d = Rocker(crank, guess[0], guess[1]);
    if (Space::kRot == 3) d.space = SpaceKind::kSpatial;
    const Assembled<Space> at(d);
    const Start<double>& start = at.start;
    ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
    EXPECT_EQ(start.q[0], crank);
    const Eigen::Vector2d found = AngleAC(at);
    EXPECT_LE((found - guess).cwiseAbs().maxCoeff(), kPi * (1 + 4 * kEps))
        << "wound: from " << guess.transpose() << " to " << found.transpose();
    const double nearest = std::min(Away(guess, positions[0]), Away(guess, positions[1]));
    farther_exists += Away(guess, positions[1]) < Away(guess, positions[0]);
    // positions are known to sqrt(eps) next to the stretched one, and distances as well
    EXPECT_NEAR((found - guess).norm(), nearest, 1e-6)
        << "crank " << crank << ", guess " << guess.transpose() << ", found " << found.transpose();
    std::size_t missed = 0;
    for (int i = 0; i < 2; ++i) missed += std::abs(found[i] - guess[i]) > kFarGuess;
    EXPECT_EQ(FindMissedGuesses(d, start.q).size(), missed);
  }
  EXPECT_GT(farther_exists, starts / 10) << "the nearer branch was the other one";
}

TEST(NearestStartTest, PlanarStartsAreTheNearestToTheirGuesses) {
  ExpectNearestPositions<Planar>(400);
}

TEST(NearestStartTest, SpatialStartsAreTheNearestToTheirGuesses) {
  ExpectNearestPositions<Spatial>(100);
}

/// A spring counts turns: its energy is that of the angle next to the guess.
TEST(NearestStartTest, AnglesStayWithinHalfATurnOfTheirGuesses) {
  const MechanismDescription d = Rocker(0.0922819241303573, 0.37415581619492866, 3.019000253116773);
  const Assembled<> at(d);
  const Start<double>& start = at.start;
  ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
  // circles about the crank's end and the pin: 0.825734, 1.980432, or -1.253442, 4.059608, farther
  EXPECT_LE((AngleAC(at) - Eigen::Vector2d(0.825734, 1.980432)).norm(), 1e-6);
  const std::vector<MissedGuess> missed = FindMissedGuesses(d, start.q);
  ASSERT_EQ(missed.size(), 1u);
  EXPECT_EQ(missed[0].joint, 2);
  EXPECT_EQ(missed[0].guess, d.initial.coordinates[2].values[0]);
  EXPECT_NEAR(missed[0].by, 1.980432 - 3.019000, 2e-6);
}

/// All four joints are guessed, and one of them is cut whatever is chosen.
TEST(NearestStartTest, AGuessOnTheJointThatClosesTheLoopIsUsed) {
  MechanismDescription d = Rocker(0.3, -1.6, 3.8);
  d.initial.coordinates.push_back({3, {5.1}});
  const Assembled<> at(d);
  const Start<double>& start = at.start;
  ASSERT_EQ(at.mechanism.constraints(), std::vector<int>{3});
  ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
  EXPECT_LE((AngleAC(at) - Eigen::Vector2d(-1.626127, 3.755653)).norm(), 1e-6);
  EXPECT_TRUE(FindMissedGuesses(d, start.q).empty());
}

/// It decides the branch where nothing else does, also given a turn away.
TEST(NearestStartTest, AGuessOnTheJointThatClosesTheLoopDecides) {
  for (const double crank : {0.3, -0.4, 0.7}) {
    for (const Eigen::Vector2d& right : RockerPositions(crank)) {
      for (const double turns : {-1.0, 0.0, 1.0}) {
        MechanismDescription d = Rocker(crank, 0.0, 0.0);
        d.initial.coordinates.resize(1);
        d.joints[3].cut = true;
        const double angle = right[1] - right[0] - crank + 2 * kPi * turns;
        d.initial.coordinates.push_back({3, {angle + 0.1}});
        const Assembled<> at(d);
        const Start<double>& start = at.start;
        ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
        EXPECT_LE(Away(AngleAC(at), right), 64 * kEps) << crank << ' ' << turns;
        EXPECT_TRUE(FindMissedGuesses(d, start.q).empty());
      }
    }
  }
}

/// A crank of 1 m, a rod of 2 m and a slider along x, which is at cos phi +- sqrt(4 - sin^2 phi).
TEST(NearestStartTest, LengthsCountInLengthsOfTheMechanism) {
  MechanismDescription d;
  d.name = "slider-crank";
  for (const double length : {1.0, 2.0, 0.2}) {
    d.bodies.push_back(Bar("bar" + std::to_string(d.bodies.size()), length, 1.0, 1.0));
  }
  d.joints = {Revolute("O", 0, kOrigin, 1, kOrigin), Revolute("A", 1, kX, 2, kOrigin),
              Revolute("S", 0, kOrigin, 3, kOrigin), Revolute("B", 2, 2.0 * kX, 3, kOrigin)};
  d.joints[2].type = JointType::kPrismatic;
  d.initial.held = {0};
  const double cosine = std::cos(0.5), root = std::sqrt(4.0 - std::pow(std::sin(0.5), 2));
  for (const double guess : {-1.5, 0.5, 2.5}) {
    d.initial.coordinates = {{0, {0.5}}, {2, {guess}}};
    const Assembled<> at(d);
    const Start<double>& start = at.start;
    ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
    const double expected = guess < 2.0 ? cosine - root : cosine + root;
    EXPECT_NEAR(start.q[at.mechanism.joints()[2].q_offset], expected, 64 * kEps) << guess;
    EXPECT_EQ(FindMissedGuesses(d, start.q).size(), guess == 0.5 ? 1u : 0u) << guess;
  }
}

/// A pin in a slot at y = 1.2 sin 0.5 - sin 0.7, held at its angle and shift: they decide both
/// bars.
TEST(NearestStartTest, AHeldCutJointMayHaveSeveralCoordinates) {
  const double height = 1.2 * std::sin(0.5) - std::sin(0.7);
  MechanismDescription d;
  d.name = "slot";
  for (const double length : {1.2, 1.0}) {
    d.bodies.push_back(Bar("bar" + std::to_string(d.bodies.size()), length, 1.0, 1.0));
  }
  d.joints = {Revolute("O", 0, kOrigin, 1, kOrigin), Revolute("A", 1, 1.2 * kX, 2, kOrigin),
              Revolute("S", 0, height * Eigen::Vector3d::UnitY(), 2, kX)};
  d.joints[2].type = JointType::kPinInSlot;
  d.joints[2].cut = true;
  d.initial.coordinates = {{2, {-0.7, 1.2 * std::cos(0.5) + std::cos(0.7)}}};
  d.initial.held = {2};
  const Assembled<> at(d);
  const Start<double>& start = at.start;
  ASSERT_EQ(at.mechanism.constraints(), std::vector<int>{2});
  ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
  EXPECT_NEAR(start.q[at.mechanism.joints()[0].q_offset], 0.5, 64 * kEps);
  EXPECT_NEAR(start.q[at.mechanism.joints()[1].q_offset], -1.2, 64 * kEps);
}

constexpr double kLeft[] = {0.026098795180722844, 0.4001497880670621};

/// A leg of three loops (Jansen's linkage); `guesses` are those of Q1 and Q2.
MechanismDescription Leg(double crank, std::vector<JointValues> guesses) {
  const auto at = [](double x, double y) { return Eigen::Vector3d(x, y, 0.0); };
  const Eigen::Vector3d origin = at(0.0, 0.0), Q = at(-0.38, -0.078);
  MechanismDescription d;
  d.name = "leg";
  d.gravity = {0.0, -9.81, 0.0};
  // crank, j, k, c, f, upper, lower
  for (const double length : {0.15, 0.5, 0.619, 0.393, 0.394, 0.415, 0.367}) {
    d.bodies.push_back(Bar("bar" + std::to_string(d.bodies.size()), 1.0, 0.01, length));
  }
  d.joints = {Revolute("O", 0, origin, 1, origin),
              Revolute("P1", 1, at(0.15, 0.0), 2, origin),
              Revolute("P2", 1, at(0.15, 0.0), 3, origin),
              Revolute("Q1", 0, Q, 6, origin),
              Revolute("Q2", 0, Q, 4, origin),
              Revolute("J", 2, at(0.5, 0.0), 6, at(0.415, 0.0)),
              Revolute("F1", 6, at(kLeft[0], kLeft[1]), 5, origin),
              Revolute("F2", 5, at(0.394, 0.0), 7, at(0.367, 0.0)),
              Revolute("K1", 3, at(0.619, 0.0), 7, origin),
              Revolute("K2", 4, at(0.393, 0.0), 7, origin)};
  d.initial.coordinates = {{0, {crank}}};
  d.initial.held = {0};
  for (const JointValues& guess : guesses) d.initial.coordinates.push_back(guess);
  return d;
}

/// Angles of a bar of r1 about `centre` whose end is r2 from `other`.
std::vector<double> DyadAngles(const Eigen::Vector2d& centre, double r1,
                               const Eigen::Vector2d& other, double r2) {
  const Eigen::Vector2d between = other - centre;
  const double distance = between.norm(), towards = std::atan2(between[1], between[0]);
  const double open = std::acos((r1 * r1 + distance * distance - r2 * r2) / (2.0 * r1 * distance));
  return {towards + open, towards - open};
}

TEST(NearestStartTest, TwoGuessesDecideTheBranchOfALeg) {
  std::mt19937_64 generator(5);
  const auto random = [&] { return static_cast<double>(generator() >> 11) * 0x1p-52 - 1.0; };
  const Eigen::Vector2d Q(-0.38, -0.078);
  int reached = 0;
  for (const double crank : {0.0, 1.3, 2.6, 4.0, 5.2}) {
    const Eigen::Vector2d end(0.15 * std::cos(crank), 0.15 * std::sin(crank));
    for (const double Q1 : DyadAngles(Q, 0.415, end, 0.5)) {
      for (const double Q2 : DyadAngles(Q, 0.393, end, 0.619)) {
        const Eigen::Vector2d knee = Q + 0.393 * Eigen::Vector2d(std::cos(Q2), std::sin(Q2)),
                              hip =
                                  Q + Eigen::Rotation2Dd(Q1) * Eigen::Vector2d(kLeft[0], kLeft[1]);
        if ((knee - hip).norm() > 0.394 + 0.367) continue;  // f does not reach the lower leg
        ++reached;
        const MechanismDescription d =
            Leg(crank, {{3, {Q1 + 0.1 * random()}}, {4, {Q2 + 0.1 * random()}}});
        const Assembled<> at(d);
        const Start<double>& start = at.start;
        ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
        const auto angle = [&](int joint) {
          return ModuloTurn(start.q[at.mechanism.joints()[joint].q_offset]);
        };
        EXPECT_LE(std::abs(ModuloTurn(angle(3) - Q1)), 1e-12) << crank;
        EXPECT_LE(std::abs(ModuloTurn(angle(4) - Q2)), 1e-12) << crank;
        EXPECT_TRUE(FindMissedGuesses(d, start.q).empty());
      }
    }
  }
  EXPECT_GE(reached, 8);
}

/// Steps of dense factors leave round-off in columns that are not there.
TEST(NearestStartTest, HeldValuesAreExact) {
  for (const double crank : {0.0, 1e-9, 0.7}) {
    const MechanismDescription d = Leg(crank, {});
    const Start<double> start = Assembled<>(d).start;
    ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
    EXPECT_EQ(start.q[0], crank);
  }
}

}  // namespace loopbench::nearest_start_test
