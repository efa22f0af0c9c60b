// Compiled descriptions, without welds, immovable bodies and islands or in a plane, have the
// accelerations of the user's, which the long double oracle knows.
#include "mechanism/simplify/compile.h"

#include "mechanism/description/transforms.h"
#include "mechanism/formulation/system.h"
#include "mechanism/loops/tree_dynamics.h"
#include "mechanism/simplify/attach.h"
#include "odca/odca.h"
#include "tests/contract/generators.h"
#include "tests/mechanism/shipped.h"

namespace loopbench::testing::compile_test {

/// What the savings may change, relative to the largest acceleration, where loops are conditioned
/// better than 1e-2: rounding of frames and masses (16 eps) over that, with a factor for sums.
constexpr double kSame = 1e-11;

struct Truth {
  MechanismDescription description;  ///< with its whole state as initial values
  std::vector<Real6> A;              ///< of the centres of mass, ground axes
  double rcond = 1.0;
};

template <class Space>
Truth MakeTruth(const MechanismDescription& description, std::uint64_t seed) {
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  const State state = ConsistentState(description, mechanism, seed);
  Truth truth{description, {}, 1.0};
  InitialDescription& initial = truth.description.initial;
  initial = {};
  for (const TreeStep& step : mechanism.tree()) {
    const Joint<Space, double>& joint = mechanism.joints()[step.joint];
    const double *q = state.q.data() + joint.q_offset, *u = state.u.data() + joint.u_offset;
    if (joint.description < 0 || joint.kind->num_u == 0) continue;
    initial.coordinates.push_back({joint.description, {q, q + joint.kind->num_q}});
    initial.speeds.push_back({joint.description, {u, u + joint.kind->num_u}});
    initial.held.push_back(joint.description);
  }
  // floating parts start at rest: their virtual joints take no initial values
  const Mechanism<Space, double> with_state(truth.description, Coordinates::kJoint);
  const Start<double> start = Assemble<Space>(truth.description, with_state);
  EXPECT_EQ(start.outcome, Outcome::kFinished) << start.message;
  Answer answer =
      Oracle(truth.description, LayoutOf(with_state)).Solve(ToReal(start.q), ToReal(start.u));
  truth.A = std::move(answer.accelerations);
  truth.rcond = answer.rcond;
  return truth;
}

/// Poses and accelerations of the user's bodies that one part carries.
template <class Space>
void AddPart(const Truth& truth, const Compiled& compiled, int part, double* error, double* size) {
  const MechanismDescription& description = compiled.parts[part].description;
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  const Start<double> start = Assemble<Space>(description, mechanism);
  ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
  const auto odca = MakeSystem<odca::Odca>(mechanism);
  VectorX<double> udot(mechanism.num_u());
  ASSERT_EQ(odca->Start(0.0, start.q, start.u), Outcome::kFinished);
  ASSERT_EQ(odca->Evaluate(0.0, start.q, start.u, udot), Outcome::kFinished);
  TreeDynamics<Space, double> dynamics(mechanism);
  std::vector<Acceleration<Space, double>> A(mechanism.num_bodies());
  dynamics.BodyAccelerations(odca->kinematics(), udot, A);
  const Eigen::Matrix3d& R_WC = compiled.parts[part].R_WC;
  for (std::size_t b = 1; b < compiled.bodies.size(); ++b) {
    const BodyImage& image = compiled.bodies[b];
    if (image.part != part) continue;
    const auto X = UserPose<Space>(compiled, static_cast<int>(b), &odca->kinematics());
    const Eigen::Vector3d com = X.R * truth.description.bodies[b].com + X.p;
    Eigen::Vector3d w = Eigen::Vector3d::Zero(), alpha = w, a = w, from = w;
    w.tail<Space::kRot>() = odca->kinematics().motions()[image.body].angular.eigen();
    alpha.tail<Space::kRot>() = A[image.body].angular.eigen();
    a.head<Space::kLin>() = A[image.body].linear.eigen();
    from.head<Space::kLin>() = odca->kinematics().poses()[image.body].p.eigen();
    w = (R_WC * w).eval();
    alpha = (R_WC * alpha).eval();
    const Eigen::Vector3d r = com - R_WC * from;
    Eigen::Matrix<double, 6, 1> here;
    here << alpha, R_WC * a + alpha.cross(r) + w.cross(w.cross(r));
    // across the plane the way from the compiled centre of mass has a part along the normal, about
    // which the body turns: it adds nothing
    *error = std::max(*error, (here - truth.A[b].cast<double>()).norm());
    *size = std::max(*size, truth.A[b].cast<double>().norm());
  }
}

void ExpectSameMotion(const Truth& truth, const CompileOptions& options, Compiled* compiled) {
  *compiled = Compile(truth.description, options);
  double error = 0.0, size = 0.0;
  for (std::size_t b = 1; b < compiled->bodies.size(); ++b) {
    if (compiled->bodies[b].part >= 0) continue;
    error = std::max(error, truth.A[b].cast<double>().norm());  // fixed: it must not accelerate
  }
  for (int part = 0; part < static_cast<int>(compiled->parts.size()); ++part) {
    ForSpace(compiled->parts[part].description.space,
             [&]<class Space>(Space) { AddPart<Space>(truth, *compiled, part, &error, &size); });
  }
  EXPECT_GT(size, 0.0);
  EXPECT_LE(error, kSame * std::max(1.0, 1e-2 / truth.rcond) * size)
      << truth.description.name << ", rcond " << truth.rcond;
}

constexpr CompileOptions kOnlyPlanar{.planar = true, .welds = false, .immovable = false};
constexpr CompileOptions kOnlyWelds{.planar = false, .welds = true, .immovable = false};

TEST(CompileTest, WeldedBodiesMoveAsOne) {
  int merged = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const int n = 6 + static_cast<int>(seed);
    const int loops = 1 + static_cast<int>(seed % 3);
    for (const SpaceKind space : {SpaceKind::kPlanar, SpaceKind::kSpatial}) {
      for (const MechanismDescription& d :
           {RandomTree(n, space, seed), RandomGraph(loops, space, 300 + seed),
            MixedGraph(loops, space, 400 + seed)}) {
        const Truth truth =
            space == SpaceKind::kPlanar ? MakeTruth<Planar>(d, seed) : MakeTruth<Spatial>(d, seed);
        Compiled compiled;
        ExpectSameMotion(truth, kOnlyWelds, &compiled);
        merged += compiled.done.welds;
        const MechanismDescription& left = compiled.parts[0].description;
        for (const TreeEdge& edge : BuildTopology(left, Coordinates::kJoint).edges) {
          if (edge.joint < 0) continue;
          EXPECT_NE(left.joints[edge.joint].type, JointType::kWeld) << d.name;
        }
      }
    }
  }
  EXPECT_GT(merged, 30) << "of 72 samples: otherwise nothing was tested";
}

/// Two bars that stand on the ground as an arch of height `h`, a pendulum on top.
MechanismDescription Arch(double h) {
  const Eigen::Vector3d O = Eigen::Vector3d::Zero(),
                        tip = std::hypot(0.5, h) * Eigen::Vector3d::UnitX();
  MechanismDescription d;
  d.name = "arch";
  d.gravity = {0.0, -9.81, 0.0};
  for (const char* name : {"left", "right"}) d.bodies.push_back(Bar(name, tip.x(), 1.0, 1.0));
  d.bodies.push_back(Bar("pendulum", 1.0, 1.0, 1.0));
  d.bodies.push_back(Bar("second", 1.0, 1.0, 1.0));
  d.joints = {Revolute("A", 0, O, 1, O), Revolute("B", 0, Eigen::Vector3d::UnitX(), 2, O),
              Revolute("C", 1, tip, 2, tip), Revolute("D", 2, 0.5 * tip, 3, O),
              Revolute("E", 3, Eigen::Vector3d::UnitX(), 4, O)};
  const double angle = std::atan2(h, 0.5);
  d.initial.coordinates = {{0, {angle}}, {1, {std::acos(-1.0) - angle}}, {3, {2.0}}, {4, {1.0}}};
  d.initial.speeds = {{3, {0.7}}};
  return d;
}

TEST(CompileTest, RigidArchBecomesGround) {
  const MechanismDescription arch = Arch(0.7);
  const Truth truth = MakeTruth<Planar>(arch, 3);
  Compiled compiled;
  ExpectSameMotion(truth, {.planar = false, .welds = false, .immovable = true}, &compiled);
  EXPECT_TRUE(compiled.done.immovable);
  ASSERT_EQ(compiled.parts[0].description.bodies.size(), 3u);
  EXPECT_EQ(compiled.parts[0].description.joints.size(), 2u);
  EXPECT_EQ(compiled.bodies[1].part, -1);
  EXPECT_EQ(compiled.bodies[2].part, -1);
  EXPECT_EQ(compiled.bodies[3].body, 1);
  EXPECT_EQ(compiled.joints[3].joint, 0);
}

TEST(CompileTest, FlatArchIsNotCertain) {
  // in line: the middle joint can move to first order
  EXPECT_FALSE(Compile(Arch(0.0)).done.immovable);
  EXPECT_FALSE(Compile(Arch(1e-5)).done.immovable);
}

TEST(CompileTest, SliderAtDeadCentreIsNotFixed) {
  // it stands still to first order, but only until the crank has turned
  const Eigen::Vector3d O = Eigen::Vector3d::Zero(), X = Eigen::Vector3d::UnitX();
  MechanismDescription d;
  d.name = "slider-crank";
  for (const char* name : {"crank", "rod", "slider"}) d.bodies.push_back(Bar(name, 1.0, 1.0, 1.0));
  d.bodies[2].com = 1.5 * X;
  JointDescription slide;
  slide.name = "S";
  slide.type = JointType::kPrismatic;
  slide.to.body = 3;
  d.joints = {Revolute("O", 0, O, 1, O), Revolute("P", 1, X, 2, O), Revolute("Q", 2, 2.0 * X, 3, O),
              slide};
  d.joints[3].cut = true;
  d.initial.coordinates = {{0, {0.0}}, {1, {0.0}}, {2, {0.0}}};
  ASSERT_EQ(Assembled<>(d).start.outcome, Outcome::kFinished);
  const Compiled compiled = Compile(d, CompileOptions::All());
  EXPECT_FALSE(compiled.done.immovable);
  EXPECT_EQ(compiled.parts[0].description.bodies.size(), 4u);
}

TEST(CompileTest, RigidBodiesStayWhereALoopWouldHaveToBeCutAnew) {
  // the way to the second bar of the arch leads over the pendulum, by joints with initial values
  MechanismDescription d = Arch(0.7);
  d.bodies.push_back(Bar("third", 1.0, 1.0, 1.0));
  d.joints.push_back(Revolute("G", 4, Eigen::Vector3d::UnitX(), 5, Eigen::Vector3d::Zero()));
  d.initial.coordinates.push_back({5, {0.5}});
  JointDescription back = Revolute("F", 5, Eigen::Vector3d::UnitX(), 1, Eigen::Vector3d::Zero());
  const Assembled<> at(d);
  ASSERT_EQ(at.start.outcome, Outcome::kFinished);
  const Pose<Planar, double>&left = at.kinematics.poses()[1], &last = at.kinematics.poses()[5];
  const Linear<Planar, double> tip = last.p + last.R * Linear<Planar, double>(0.5, 0.0);
  back.to.position.head<2>() = (left.R.transpose() * (tip - left.p)).eigen();
  back.to.position += d.bodies[1].com;
  d.joints.push_back(back);
  d.initial.coordinates = {
      {0, {at.start.q[0]}}, {3, {2.0}}, {4, {1.0}}, {5, {0.5}}, {6, {last.angle}}};
  d.initial.coordinates.back().values[0] = left.angle - last.angle;
  d.initial.speeds.clear();
  d.joints[1].cut = d.joints[2].cut = true;
  const Start<double> looped = Assembled<>(d).start;
  ASSERT_EQ(looped.outcome, Outcome::kFinished) << looped.message;
  const Start<double> again = Assembled<>(Compile(d).parts[0].description).start;
  EXPECT_EQ(again.outcome, Outcome::kFinished) << again.message;
}

TEST(CompileTest, LockedMechanismsStayAsTheyAre) {
  MechanismDescription locked = Arch(0.7);
  locked.bodies.resize(3);
  locked.joints.resize(3);
  locked.initial.coordinates.resize(2);
  locked.initial.speeds.clear();
  const Compiled compiled = Compile(locked, CompileOptions::All());
  EXPECT_FALSE(compiled.done.immovable);
  EXPECT_EQ(compiled.parts[0].description.bodies.size(), 3u);
}

TEST(CompileTest, IslandsMoveAloneAsTheyMoveTogether) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const MechanismDescription ladder = RandomLadder(2, SpaceKind::kPlanar, seed);
    MechanismDescription both = Beside(RandomGraph(2, SpaceKind::kPlanar, seed), ladder);
    both.gravity = ladder.gravity;
    const Truth truth = MakeTruth<Planar>(both, seed);
    Compiled compiled;
    ExpectSameMotion(truth, {.planar = false, .welds = false, .immovable = false, .islands = true},
                     &compiled);
    EXPECT_TRUE(compiled.done.islands);
    EXPECT_GE(compiled.parts.size(), 2u);  // branches of a graph from ground are parts, too
    std::size_t bodies = 0, joints = 0, forces = 0;
    for (const CompiledPart& part : compiled.parts) {
      bodies += part.description.bodies.size() - 1;
      joints += part.description.joints.size();
      forces += part.description.forces.size();
    }
    EXPECT_EQ(bodies, both.bodies.size() - 1);
    EXPECT_EQ(joints, both.joints.size());
    EXPECT_EQ(forces, both.forces.size());
  }
}

TEST(CompileTest, PartsInDifferentPlanesAreEachPlanar) {
  const MechanismDescription a = InSpace(Chain(3), {0.3, -0.4, 0.5});
  const MechanismDescription b = InSpace(Chain(4), {-1.0, 0.2, 0.1});
  MechanismDescription both = Beside(a, b);
  both.gravity = b.gravity;
  EXPECT_FALSE(Compile(both, kOnlyPlanar).done.planar);
  const Truth truth = MakeTruth<Spatial>(both, 5);
  Compiled compiled;
  ExpectSameMotion(truth, CompileOptions::All(), &compiled);
  ASSERT_EQ(compiled.parts.size(), 2u);
  for (const CompiledPart& part : compiled.parts) {
    EXPECT_EQ(part.description.space, SpaceKind::kPlanar);
  }
}

TEST(CompileTest, NothingIsDoneWhenAllIsOffOrNothingIsToSave) {
  const MechanismDescription tilted = InSpace(Chain(3), {0.3, -0.4, 0.5});
  EXPECT_EQ(Compile(tilted, CompileOptions::None()).done, CompileOptions::None());
  const Compiled same = Compile(Chain(5), CompileOptions::All());
  EXPECT_EQ(same.done, CompileOptions::None());
  EXPECT_TRUE(same.report.empty());
  EXPECT_EQ(same.parts[0].description.joints.size(), 6u);
}

// Spatial descriptions that are planar, in any orientation, and those that are not quite.

Eigen::Vector3d TurnVector(const Eigen::Matrix3d& R) {
  const Eigen::AngleAxisd turn(R);
  return turn.angle() * turn.axis();
}

/// The same mechanism in a tilted plane: each body with its own axes and origin, each joint at a
/// height of its own, its frames upside down at times. Coordinates keep their values but for the
/// angle of a slot whose frames were turned over. Every part must reach ground.
MechanismDescription Scramble(const MechanismDescription& planar, std::uint64_t seed) {
  Random random(seed);
  MechanismDescription d = InSpace(planar, random.Vector(1.5, true));
  const Eigen::Matrix3d over = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
  for (std::size_t j = 0; j < d.joints.size(); ++j) {
    JointDescription& joint = d.joints[j];
    // ground has no height to give: there the joint stays level with the ground's origin
    const bool grounded = joint.from.body == kGround || joint.to.body == kGround;
    const double height = grounded ? 0.0 : random.Uniform(-1.0, 1.0);
    joint.from.position.z() += height;
    joint.to.position.z() += height;
    const bool turns = joint.type == JointType::kRevolute || joint.type == JointType::kPinInSlot;
    if (!turns || !joint.axis.isZero() || !random.Chance(0.5)) continue;
    for (JointSide* side : {&joint.from, &joint.to}) {
      side->rotation = TurnVector(PoseOf(*side).R * over);
    }
    if (joint.type == JointType::kRevolute) std::swap(joint.from, joint.to);
    if (joint.type != JointType::kPinInSlot) continue;
    for (JointValues& values : d.initial.coordinates) {
      if (values.joint == static_cast<int>(j)) values.values[0] = -values.values[0];
    }
  }
  // bodies in axes of their own
  for (int b = 1; b < static_cast<int>(d.bodies.size()); ++b) {
    const Eigen::Vector3d turn = random.Vector(2.0, true), origin = random.Vector(1.0, true);
    const Eigen::Matrix3d R =
        Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();  // old from new
    BodyDescription& body = d.bodies[b];
    body.com = R.transpose() * (body.com - origin);
    body.inertia = R.transpose() * body.inertia * R;
    body.inertia = (0.5 * (body.inertia + body.inertia.transpose())).eval();
    for (JointDescription& joint : d.joints) {
      for (JointSide* side : {&joint.from, &joint.to}) {
        if (side->body != b) continue;
        const Eigen::Matrix3d frame = R.transpose() * PoseOf(*side).R;
        side->rotation = TurnVector(frame);
        side->position = R.transpose() * (side->position - origin);
      }
    }
    for (ForceDescription& force : d.forces) {
      const ForceParts parts = PartsOf(force);
      for (BodyPoint* point : parts.points) {
        if (point->body != b) continue;
        point->at = R.transpose() * (point->at - origin);
        if (parts.force != nullptr && *parts.in_body_axes)
          *parts.force = R.transpose() * *parts.force;
      }
    }
  }
  return d;
}

TEST(CompilePlanarTest, TiltedPlanarMechanismsBecomePlanar) {
  std::vector<MechanismDescription> mechanisms;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const int n = static_cast<int>(seed);
    mechanisms.push_back(RandomChain(3 + n, SpaceKind::kPlanar, seed));
    mechanisms.push_back(RandomLadder(1 + n % 4, SpaceKind::kPlanar, 50 + seed));
    mechanisms.push_back(RandomGraph(1 + n % 3, SpaceKind::kPlanar, 100 + seed));
    mechanisms.push_back(MixedGraph(1 + n % 2, SpaceKind::kPlanar, 200 + seed));
  }
  // the ends of a rod may leave a plane, so it does not qualify
  std::erase_if(mechanisms, [](const MechanismDescription& mechanism) {
    return std::ranges::find(mechanism.joints, JointType::kRod, &JointDescription::type) !=
           mechanism.joints.end();
  });
  ASSERT_GE(mechanisms.size(), 24u);
  for (std::size_t i = 0; i < mechanisms.size(); ++i) {
    const MechanismDescription tilted = Scramble(mechanisms[i], 1000 + i);
    ASSERT_EQ(tilted.space, SpaceKind::kSpatial);
    const Truth truth = MakeTruth<Spatial>(tilted, i);
    Compiled compiled;
    ExpectSameMotion(truth, kOnlyPlanar, &compiled);
    ASSERT_TRUE(compiled.done.planar) << mechanisms[i].name << ": " << compiled.report.back();
    EXPECT_EQ(compiled.parts[0].description.space, SpaceKind::kPlanar);
    EXPECT_EQ(compiled.parts[0].description.joints.size(), tilted.joints.size());
  }
}

TEST(CompilePlanarTest, PlanarJointsBecomeFreeInThePlane) {
  MechanismDescription d = InSpace(Chain(3), {0.3, -0.4, 0.5});
  JointDescription sheet;  // a body that slides on the ground's plane, pinned to the second bar
  sheet.name = "sheet";
  sheet.type = JointType::kPlanar;
  d.bodies.push_back(Bar("plate", 1.0, 2.0, 0.5));
  sheet.from = d.joints[0].from;
  sheet.to.body = 4;
  d.joints.push_back(sheet);
  d.joints.push_back(Revolute("pin", 2, {0.5, 0.0, 0.0}, 4, {0.2, 0.1, 0.0}));
  ASSERT_EQ(Assembled<Spatial>(d).start.outcome, Outcome::kFinished);
  const Compiled compiled = Compile(d);
  ASSERT_TRUE(compiled.done.planar) << compiled.report.back();
  EXPECT_EQ(compiled.parts[0].description.joints[4].type, JointType::kFree);
  EXPECT_EQ(Assembled<>(compiled.parts[0].description).start.outcome, Outcome::kFinished);
}

TEST(CompilePlanarTest, WhatTipsOutOfThePlaneStaysSpatial) {
  const MechanismDescription level = InSpace(Chain(4), {0.3, -0.4, 0.5});
  ASSERT_TRUE(Compile(level).done.planar);
  const std::vector<void (*)(MechanismDescription&)> changes = {
      [](MechanismDescription& d) { d.joints[1].to.rotation.x() = 1e-6; },
      [](MechanismDescription& d) { d.joints[4].from.position.z() += 1e-6; },
      [](MechanismDescription& d) {
        d.joints[1].type = JointType::kCylindrical;
        d.initial.coordinates[1].values.push_back(0.0);
      },
      [](MechanismDescription& d) { d.bodies.push_back(Bar("loose", 1.0, 1.0, 1.0)); }};
  for (std::size_t i = 0; i < changes.size(); ++i) {
    MechanismDescription changed = level;
    changes[i](changed);
    EXPECT_FALSE(Compile(changed).done.planar) << i;
  }
}

TEST(CompilePlanarTest, ForcesAndGravityAlongTheNormalAreDroppedAndReported) {
  MechanismDescription d = InSpace(Chain(3), Eigen::Vector3d::Zero());
  d.gravity.z() = 3.0;
  d.forces.push_back(PointForce{1, {0.5, 0.0, 0.0}, {1.0, 2.0, 5.0}, false});
  const Truth truth = MakeTruth<Spatial>(d, 1);
  Compiled compiled;
  ExpectSameMotion(truth, kOnlyPlanar, &compiled);
  ASSERT_TRUE(compiled.done.planar);
  EXPECT_EQ(compiled.report.size(), 3u);
  EXPECT_EQ(compiled.parts[0].description.gravity.z(), 0.0);
}

}  // namespace loopbench::testing::compile_test
