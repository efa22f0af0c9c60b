// Poses, motions and velocity terms against the oracle's differentiated poses.
#include "mechanism/loops/tree_dynamics.h"
#include "mechanism/simplify/compile.h"
#include "tests/mechanism/samples.h"
#include "tests/mechanism/shipped.h"

namespace loopbench::kinematics_test {

using testing::kKind;
using testing::Oracle;
using testing::Real;
using testing::State;
using testing::ToReal;

/// Trees with every joint kind, reversed joints, a floating body; graphs with closing joints.
template <class Space>
std::vector<MechanismDescription> Samples() {
  std::vector<MechanismDescription> samples;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    samples.push_back(testing::RandomTree(15, kKind<Space>, seed));
    samples.push_back(testing::TightGraph(24, 2, kKind<Space>, seed));
  }
  return samples;
}

template <class Space>
class KinematicsTest : public ::testing::Test {};
using Spaces = ::testing::Types<Planar, Spatial>;
TYPED_TEST_SUITE(KinematicsTest, Spaces);

/// Calls check(description, mechanism, state, kinematics at the state) for all samples and sets.
template <class Space, class Check>
void ForAll(Check check) {
  testing::ForBothSets<Space>(Samples<Space>(),
                              [&](const auto& d, const auto& mechanism, const State& at) {
                                Kinematics<Space, double> kinematics(mechanism);
                                kinematics.UpdatePosition(at.q);
                                kinematics.UpdateVelocity(at.u);
                                check(d, mechanism, at, kinematics);
                              });
}

TYPED_TEST(KinematicsTest, PosesAgreeWithTheOracle) {
  ForAll<TypeParam>(
      [](const auto& d, const auto& mechanism, const State& at, const auto& kinematics) {
        const auto poses = Oracle(d, testing::LayoutOf(mechanism)).Poses(ToReal(at.q));
        for (int b = 1; b < mechanism.num_bodies(); ++b) {
          const auto& X = kinematics.poses()[b];
          for (int i = 0; i < TypeParam::kLin; ++i) {
            // a path of n bodies of about a metre: n roundings of n metres at worst
            const double scale = mechanism.num_bodies() * (1.0 + std::abs(X.p[i]));
            EXPECT_NEAR(X.p[i], static_cast<double>(poses[b].p[i].f), 16 * kEps * scale);
            for (int j = 0; j < TypeParam::kLin; ++j) {
              EXPECT_NEAR(X.R(i, j), static_cast<double>(poses[b].R(i, j).f),
                          16 * kEps * mechanism.num_bodies());
            }
          }
        }
      });
}

/// Matrices of planar bodies are made several at once: of every number of bodies, and of angles
/// that are too large for it beside others that are not.
TEST(PlanarKinematicsTest, MatricesAreThoseOfTheAnglesOfAnyNumberOfBodiesAndTurns) {
  for (const int bodies : {1, 2, 3, 5, 8, 9, 16, 19}) {
    const Mechanism<Planar, double> mechanism(Chain(bodies), Coordinates::kAbsolute);
    Kinematics<Planar, double> kinematics(mechanism), turned(mechanism);
    VectorX<double> q = VectorX<double>::Zero(mechanism.num_q());
    for (const bool far : {false, true}) {
      for (int b = 0; b < bodies; ++b) q[3 * b] = 1.3 * b - 7.0 + (far && b % 3 == 1 ? 3e6 : 0.0);
      kinematics.UpdatePosition(q);
      for (int b = 0; b < bodies; ++b) {
        const auto& X = kinematics.poses()[b + 1];
        // 1.1 units in the last place (lanes.h) and half a unit of the other, of kEps / 2 each
        EXPECT_NEAR(X.R(0, 0), std::cos(X.angle), kEps) << bodies << ' ' << b;
        EXPECT_NEAR(X.R(1, 0), std::sin(X.angle), kEps) << bodies << ' ' << b;
        EXPECT_EQ(X.R(0, 1), -X.R(1, 0));
        EXPECT_EQ(X.R(1, 1), X.R(0, 0));
      }
      // the same angles on other bodies have the same bits
      for (int b = 0; b < bodies && !far; ++b) {
        VectorX<double> alone = VectorX<double>::Zero(mechanism.num_q());
        alone[3 * (bodies - 1 - b)] = q[3 * b];
        turned.UpdatePosition(alone);
        EXPECT_EQ(turned.poses()[bodies - b].R(1, 0), kinematics.poses()[b + 1].R(1, 0));
      }
    }
  }
}

/// One answer of the oracle holds the speeds' accelerations: G udot + A_0, with A_0 from second
/// derivatives of the poses. BodyAccelerations() adds up H udot and g along the tree instead.
/// Parts and rates of all directions against the directions at both sides of the state.
template <class Space>
void ExpectDirections(const Mechanism<Space, double>& mechanism, const VectorX<double>& q,
                      const VectorX<double>& u) {
  const double step = 1e-6;  // central differences: truncation 1e-12, rounding eps / step = 2e-10
  VectorX<double> qdot(mechanism.num_q());
  mechanism.Rates(q, u, Eigen::Map<VectorX<double>>(qdot.data(), qdot.size()));
  Kinematics<Space, double> here(mechanism), ahead(mechanism), behind(mechanism);
  here.UpdatePosition(q);
  here.UpdateVelocity(u);
  ahead.UpdatePosition(q + step * qdot);
  behind.UpdatePosition(q - step * qdot);
  for (int j = 0; j < static_cast<int>(mechanism.joints().size()); ++j) {
    const Joint<Space, double>& joint = mechanism.joints()[j];
    const auto parts = here.PartsOf(j);
    Basis<Space, double> rates;
    here.OwnRates(j, parts, Space::kDim, rates);
    const auto& R = here.poses()[joint.from].R;
    for (int i = 0; i < Space::kDim; ++i) {
      const Direction<Space, double>& direction = here.joints()[j].basis[i];
      EXPECT_TRUE(parts[i].turns || direction.angular.norm() == 0.0) << j << ' ' << i;
      EXPECT_TRUE(parts[i].shifts || direction.linear.norm() == 0.0) << j << ' ' << i;
      EXPECT_TRUE(joint.kind->basis != nullptr || !parts[i].moves) << j << ' ' << i;
      if (joint.kind->basis == nullptr) continue;
      const auto in_P = [&](const Kinematics<Space, double>& kinematics) {
        return Rotate<Space, double>(kinematics.poses()[joint.from].R.transpose(),
                                     kinematics.joints()[j].basis[i]);
      };
      const Direction<Space, double> expected =
          Rotate<Space, double>(R, (in_P(ahead) - in_P(behind)) * (0.5 / step));
      Direction<Space, double> found = Direction<Space, double>::Zero();
      if (parts[i].moves && parts[i].turns) found.angular = rates[i].angular;
      if (parts[i].moves && parts[i].shifts) found.linear = rates[i].linear;
      // third derivatives grow with the cube of the speed
      const double speed = 1.0 + here.joints()[j].V_rel.norm();
      EXPECT_LE((found - expected).norm(), 1e-8 * speed * speed * speed) << j << ' ' << i;
    }
  }
}

TYPED_TEST(KinematicsTest, DirectionsHaveTheirPartsAndRates) {
  testing::ForBothSets<TypeParam>(Samples<TypeParam>(),
                                  [](const auto&, const auto& mechanism, const State& at) {
                                    ExpectDirections<TypeParam>(mechanism, at.q, at.u);
                                  });
}

/// Directions are exact where constraints are redundant.
TEST(SpatialKinematicsTest, ExactDirectionsHaveTheirPartsAndRates) {
  for (const char* name : {"bennett", "screw-jack", "sarrus"}) {
    const MechanismDescription d = testing::Shipped(name);
    const Compiled compiled = Compile(d, {.planar = false});
    const MechanismDescription& part = compiled.parts.front().description;
    for (const auto set : {Coordinates::kJoint, Coordinates::kAbsolute}) {
      const testing::Assembled<Spatial> at(part, set);
      EXPECT_TRUE(at.mechanism.is_redundant());
      VectorX<double> u = at.start.u;
      for (int i = 0; i < u.size(); ++i) u[i] += std::cos(2.3 * i);  // not admissible
      ExpectDirections<Spatial>(at.mechanism, at.start.q, u);
    }
  }
}

TYPED_TEST(KinematicsTest, AccelerationsOfBodiesAreSecondDerivativesOfTheirPoses) {
  ForAll<TypeParam>(
      [](const auto& d, const auto& mechanism, const State& at, const auto& kinematics) {
        const testing::Answer answer =
            Oracle(d, testing::LayoutOf(mechanism)).Solve(ToReal(at.q), ToReal(at.u));
        std::vector<Acceleration<TypeParam, double>> A(mechanism.num_bodies());
        const TreeDynamics<TypeParam, double> dynamics(mechanism);
        dynamics.BodyAccelerations(kinematics, answer.udot.template cast<double>(), A);
        double scale = 0.0;
        for (const auto& expected : answer.accelerations) {
          scale = std::max(scale, static_cast<double>(expected.norm()));
        }
        const int first = TypeParam::kRot == 1 ? 2 : 0;
        for (int b = 1; b < mechanism.num_bodies(); ++b) {
          for (int i = 0; i < TypeParam::kDim; ++i) {
            EXPECT_NEAR(A[b][i], static_cast<double>(answer.accelerations[b][first + i]),
                        32 * kEps * mechanism.num_bodies() * scale);
          }
        }
      });
}

/// g by itself: D^T (A_Q - A_P - g) vanishes on the oracle's accelerations, which know no g. The
/// joints here are cut or not, revolute, prismatic, welded, reversed.
TYPED_TEST(KinematicsTest, JointAccelerationsVanishOnTheOraclesAnswer) {
  ForAll<TypeParam>([](const auto& d, const auto& mechanism, const State& at,
                       const auto& kinematics) {
    const testing::Answer answer =
        Oracle(d, testing::LayoutOf(mechanism)).Solve(ToReal(at.q), ToReal(at.u));
    std::vector<Acceleration<TypeParam, double>> A(mechanism.num_bodies());
    double scale = 0.0;
    const int first = TypeParam::kRot == 1 ? 2 : 0;
    for (int b = 0; b < mechanism.num_bodies(); ++b) {
      A[b] = Acceleration<TypeParam, double>(
          answer.accelerations[b].template segment<TypeParam::kDim>(first).template cast<double>());
      scale = std::max(scale, A[b].norm());
    }
    for (int j = 0; j < static_cast<int>(d.joints.size()); ++j) {
      const auto rest = JointAcceleration<TypeParam, double>(kinematics, j, A);
      EXPECT_LE(rest.norm(), 100 * kEps * mechanism.num_bodies() * scale) << d.joints[j].name;
    }
  });
}

TYPED_TEST(KinematicsTest, ConsistentSpeedsKeepEveryJointTogether) {
  ForAll<TypeParam>(
      [](const auto& d, const auto& mechanism, const State& at, const auto& kinematics) {
        const double scale = mechanism.num_bodies() * (1.0 + at.u.norm());
        for (int j = 0; j < static_cast<int>(d.joints.size()); ++j) {
          const auto& state = kinematics.joints()[j];
          EXPECT_LE(state.Along(state.V_rel, state.rows()).norm(), 100 * kEps * scale);
          for (int i = 0; i < state.num_u; ++i) {
            EXPECT_LE(state.Along(state.H(i), state.rows()).norm(), 8 * kEps) << "D^T H = 0";
          }
          EXPECT_LE(state.Along(kinematics.ConstraintMismatch(j), state.rows()).norm(),
                    100 * kEps * scale);
        }
      });
}

TYPED_TEST(KinematicsTest, SpeedsAreDerivativesOfPoses) {
  ForAll<TypeParam>(
      [](const auto&, const auto& mechanism, const State& at, const auto& kinematics) {
        VectorX<double> qdot(mechanism.num_q());
        mechanism.Rates(at.q, at.u, qdot);
        const double h = 1e-5;  // truncation h^2, round-off eps / h: both about 1e-10
        Kinematics<TypeParam, double> ahead(mechanism), behind(mechanism);
        ahead.UpdatePosition(at.q + h * qdot);
        behind.UpdatePosition(at.q - h * qdot);
        for (int b = 1; b < mechanism.num_bodies(); ++b) {
          const auto& v = kinematics.motions()[b].linear;
          const auto difference = (ahead.poses()[b].p - behind.poses()[b].p) / (2 * h);
          const double speed = 1.0 + kinematics.motions()[b].norm();
          EXPECT_LE((v - difference).norm(), 1e-8 * speed * speed * speed);
        }
      });
}

TYPED_TEST(KinematicsTest, CoordinatesMoveBetweenSetsAndBack) {
  for (const MechanismDescription& d : Samples<TypeParam>()) {
    const Mechanism<TypeParam, double> joint(d, Coordinates::kJoint);
    const Mechanism<TypeParam, double> absolute(d, Coordinates::kAbsolute);
    const State state = testing::ConsistentState(d, joint, 1);
    const State back = testing::StateIn(joint, absolute, testing::StateIn(absolute, joint, state));
    const double scale = joint.num_bodies() * (1.0 + state.u.norm() + state.q.norm());
    EXPECT_LE((back.u - state.u).norm(), 100 * kEps * scale);
    for (const TreeStep& step : joint.tree()) {
      const Joint<TypeParam, double>& at = joint.joints()[step.joint];
      if (at.kind->has_quaternion()) continue;  // a quaternion and its opposite are one orientation
      EXPECT_LE((back.q - state.q).segment(at.q_offset, at.kind->num_q).norm(), 100 * kEps * scale);
    }
  }
}

/// A shaft in two bearings: more than half a turn between steps, in either direction.
TEST(MeasuredAngles, CountTurnsByTheLastSpeedInSpace) {
  MechanismDescription d;
  d.name = "shaft";
  d.space = SpaceKind::kSpatial;
  d.bodies.push_back(Bar("shaft", 1.0, 1.0, 0.1));
  JointDescription bearing;
  bearing.name = "A";
  bearing.type = JointType::kCylindrical;
  bearing.to.body = 1;
  d.joints.push_back(bearing);
  bearing.name = "B";
  bearing.type = JointType::kRevolute;
  bearing.cut = true;
  d.joints.push_back(bearing);
  const Mechanism<Spatial, double> mechanism(d, Coordinates::kJoint);
  for (const double speed : {40.0, -40.0}) {
    Kinematics<Spatial, double> kinematics(mechanism);
    for (int k = 0; k <= 20; ++k) {
      const double t = 0.1 * k, angle = speed * t;
      kinematics.SetTime(t);
      kinematics.UpdatePosition(Eigen::Vector2d(angle, 0.0));
      kinematics.UpdateVelocity(Eigen::Vector2d(speed, 0.0));
      EXPECT_NEAR(kinematics.JointCoordinate(1), angle, 100 * kEps * (1.0 + std::abs(angle)));
      kinematics.AcceptStep();
    }
  }
}

}  // namespace loopbench::kinematics_test
