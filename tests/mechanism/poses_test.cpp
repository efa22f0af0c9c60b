// Starts from poses of bodies and positions of points.
#include "mechanism/start/poses.h"

#include "tests/mechanism/shipped.h"

namespace loopbench::poses_test {

using Eigen::Vector3d;

/// Two bars of 2 m and 1.5 m in series on a pin of Ground.
MechanismDescription Arm() {
  MechanismDescription d;
  d.name = "arm";
  d.bodies.push_back(Bar("upper", 1.0, 1.0, 2.0));
  d.bodies.push_back(Bar("lower", 1.0, 1.0, 1.5));
  d.joints = {Revolute("O", 0, Vector3d::Zero(), 1, Vector3d::Zero()),
              Revolute("A", 1, 2.0 * Vector3d::UnitX(), 2, Vector3d::Zero())};
  return d;
}

PoseTarget TipAt(double x, double y, bool fixed) {
  return {.body = 2, .point = 1.5 * Vector3d::UnitX(), .at = Vector3d(x, y, 0.0), .fixed = fixed};
}

/// Start after the targets are resolved; null if they cannot be met.
template <class Space>
Start<double> StartOf(MechanismDescription* d) {
  EXPECT_EQ(ResolvePoses(d), "");
  return testing::Assembled<Space>(*d).start;
}

TEST(Poses, AFixedPointIsMetWithTheElbowNearestToTheGuess) {
  // law of cosines: cos A = (r^2 - 2^2 - 1.5^2) / (2 2 1.5)
  const double x = 1.2, y = 2.1, cosine = (x * x + y * y - 4.0 - 2.25) / 6.0;
  for (const double sign : {1.0, -1.0}) {
    MechanismDescription d = Arm();
    d.initial.coordinates = {{1, {sign * 0.6}}};
    d.initial.poses = {TipAt(x, y, true)};
    const Start<double> start = StartOf<Planar>(&d);
    const double elbow = sign * std::acos(cosine);
    const double shoulder =
        std::atan2(y, x) - std::atan2(1.5 * std::sin(elbow), 2.0 + 1.5 * std::cos(elbow));
    // closed to 16 eps of an extent of 5 lengths; the elbow turns 0.7 rad per length
    EXPECT_NEAR(start.q[0], shoulder, 256 * kEps);
    EXPECT_NEAR(start.q[1], elbow, 256 * kEps);
    EXPECT_EQ(d.initial.GuessOf(0, 0), start.q[0]);
    EXPECT_TRUE(FindMissedPoses(d, start.q).empty());
  }
}

TEST(Poses, PointAndDirectionTogether) {
  MechanismDescription d = Arm();
  d.initial.poses = {{.body = 1, .rotation = Vector3d(0.0, 0.0, 0.8), .fixed = true},
                     {.body = 2, .rotation = Vector3d(0.0, 0.0, -2.0 + 2 * kPi), .fixed = true}};
  const Start<double> start = StartOf<Planar>(&d);
  EXPECT_NEAR(start.q[0], 0.8, 256 * kEps);
  EXPECT_NEAR(start.q[1], -2.8, 256 * kEps);  // not wound by the turn in the target
}

TEST(Poses, TargetsOutOfReachAreMissedByTheLeast) {
  MechanismDescription d = Arm();
  d.initial.poses = {TipAt(3.0, 4.0, false)};
  const Start<double> start = StartOf<Planar>(&d);
  // the stretched arm points at the target, 1.5 m beyond its tip. The minimum is flat along the
  // folding elbow, which the search's last steps of 1 % leave
  EXPECT_NEAR(start.q[0] + 1.5 / 3.5 * start.q[1], std::atan2(4.0, 3.0), 1e-2);
  EXPECT_NEAR(start.q[1], 0.0, 0.1);
  const auto missed = FindMissedPoses(d, start.q);
  ASSERT_EQ(missed.size(), 1u);
  EXPECT_NEAR(missed[0].shift, 1.5, 1e-2);
  EXPECT_EQ(missed[0].turn, 0.0);
  // fixed, it cannot be met
  d = Arm();
  d.initial.poses = {TipAt(3.0, 4.0, true)};
  EXPECT_NE(ResolvePoses(&d).find("target of lower"), std::string::npos) << ResolvePoses(&d);
}

TEST(Poses, WeightsDecideBetweenContradictoryTargets) {
  MechanismDescription d;
  d.name = "slide";
  d.bodies.push_back(Bar("block", 1.0, 1.0, 1.0));
  JointDescription slide;
  slide.name = "slide";
  slide.type = JointType::kPrismatic;
  slide.to.body = 1;
  d.joints = {slide};
  d.initial.poses = {{.body = 1, .at = Vector3d::Zero()},
                     {.body = 1, .at = Vector3d::UnitX(), .weight = 2.0}};
  // min x^2 + 4 (x - 1)^2
  EXPECT_NEAR(StartOf<Planar>(&d).q[0], 0.8, 1e-6);
  d.initial.coordinates = {{0, {2.0}, 3.0}};
  // with a guess: + 9 (x - 2)^2
  EXPECT_NEAR(StartOf<Planar>(&d).q[0], 22.0 / 14.0, 1e-6);
}

/// Angles and lengths of links count alike, whatever the unit of length is.
TEST(Poses, TheNearestStartDoesNotDependOnTheSize) {
  const auto angles = [](double size) {
    MechanismDescription d = Arm();
    for (BodyDescription& body : d.bodies) body.com *= size;
    for (JointDescription& joint : d.joints) joint.from.position *= size;
    d.initial.coordinates = {{0, {0.2}}, {1, {0.1}}};
    d.initial.poses = {TipAt(2.4 * size, 1.1 * size, false)};
    d.initial.poses[0].point *= size;
    return StartOf<Planar>(&d).q;
  };
  const VectorX<double> expected = angles(1.0);
  EXPECT_GT((expected - Eigen::Vector2d(0.2, 0.1)).norm(), 0.05);
  // The minimum of a sum of squares is known to the root of round-off.
  for (const double size : {1.5, 0.3, 1e-3}) {
    EXPECT_LT((angles(size) - expected).norm(), 8 * std::sqrt(kEps)) << size;
  }
}

/// A double rocker whose coupler point decides the branch and the one freedom.
TEST(Poses, OfALoopAreClosedPositions) {
  MechanismDescription d = Arm();
  d.bodies.push_back(Bar("rocker", 1.0, 1.0, 1.5));
  d.joints.push_back(Revolute("C", 0, {3.5, 0.0, 0.0}, 3, Vector3d::Zero()));
  d.joints.push_back(Revolute("B", 2, 1.5 * Vector3d::UnitX(), 3, 1.5 * Vector3d::UnitX()));
  for (const double angle : {2.2, -2.2, 2.0}) {
    MechanismDescription one = d;
    const Vector3d tip(3.5 + 1.5 * std::cos(angle), 1.5 * std::sin(angle), 0.0);
    one.initial.poses = {{.body = 3, .point = 1.5 * Vector3d::UnitX(), .at = tip}};
    EXPECT_EQ(ResolvePoses(&one), "");
    const testing::Assembled<> at(one);
    ASSERT_EQ(at.start.outcome, Outcome::kFinished) << at.start.message;
    // met: the last of some quadratic steps
    EXPECT_NEAR(std::remainder(at.kinematics.poses()[3].angle - angle, 2 * kPi), 0.0, 1e-8);
    EXPECT_LE(at.start.position_residual, 64 * kEps);
  }
}

TEST(Poses, OfFreeBodiesInSpace) {
  MechanismDescription d;
  d.name = "brick";
  d.space = SpaceKind::kSpatial;
  d.bodies.push_back(Bar("brick", 1.0, 1.0, 1.0));
  d.initial.poses = {{.body = 1,
                      .point = {0.3, 0.2, 0.1},
                      .at = Vector3d(1.0, -2.0, 0.5),
                      .rotation = Vector3d(0.4, -1.1, 2.0),
                      .fixed = true}};
  EXPECT_EQ(ResolvePoses(&d), "no joint connects body \"brick\" to ground, not even a free one");
  JointDescription free;
  free.name = "free";
  free.type = JointType::kFree;
  free.to.body = 1;
  d.joints = {free};
  const Start<double> start = StartOf<Spatial>(&d);
  const Eigen::AngleAxisd turn(d.initial.poses[0].rotation->norm(),
                               d.initial.poses[0].rotation->normalized());
  const Eigen::Quaterniond q(start.q[0], start.q[1], start.q[2], start.q[3]);
  EXPECT_LE(q.normalized().angularDistance(Eigen::Quaterniond(turn)), 256 * kEps);
  const Vector3d p = start.q.tail<3>() + turn * d.initial.poses[0].point;
  EXPECT_LE((p - *d.initial.poses[0].at).norm(), 256 * kEps);
}

}  // namespace loopbench::poses_test
