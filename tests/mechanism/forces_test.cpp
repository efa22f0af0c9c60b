// Wrenches of all forces against the oracle, against their potential and against their power.
#include "mechanism/description/library.h"
#include "mechanism/model/kinematics.h"
#include "tests/mechanism/samples.h"

namespace loopbench::forces_test {

using testing::ForBothSets;
using testing::kKind;
using testing::Oracle;
using testing::Real;
using testing::Real6;
using testing::State;
using testing::ToReal;

template <class Space>
std::vector<MechanismDescription> Samples() {
  std::vector<MechanismDescription> samples;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    samples.push_back(testing::RandomTree(20, kKind<Space>, seed));
    samples.push_back(testing::RandomGraph(2, kKind<Space>, seed));
    samples.push_back(testing::MixedGraph(1, kKind<Space>, seed));
  }
  return samples;
}

/// Current at a state and time.
template <class Space, class S>
Kinematics<Space, S> KinematicsAt(const Mechanism<Space, S>& mechanism, S t, const VectorX<S>& q,
                                  const VectorX<S>& u) {
  Kinematics<Space, S> kinematics(mechanism);
  kinematics.SetTime(t);
  kinematics.UpdatePosition(q);
  kinematics.UpdateVelocity(u);
  return kinematics;
}

template <class Space, class S>
std::vector<Wrench<Space, S>> Wrenches(const Kinematics<Space, S>& kinematics) {
  std::vector<Wrench<Space, S>> wrenches(kinematics.mechanism().num_bodies());
  AppliedForces<Space, S>(kinematics, wrenches);
  return wrenches;
}

template <class Space>
class ForcesTest : public ::testing::Test {};
using Spaces = ::testing::Types<Planar, Spatial>;
TYPED_TEST_SUITE(ForcesTest, Spaces);

TYPED_TEST(ForcesTest, WrenchesAgreeWithTheOracleAtAnyTime) {
  using Space = TypeParam;
  std::vector<int> kinds(ForceKinds().size());
  int timed = 0;
  ForBothSets<Space>(Samples<Space>(), [&](const auto& d, const auto& mechanism, const State& at) {
    for (const ForceDescription& force : d.forces) ++kinds[force.index()];
    for (ForceDescription force : d.forces) {
      const TimeFunctionDescription* value = PartsOf(force).value;
      if (value != nullptr && !std::holds_alternative<Polynomial>(*value)) ++timed;
    }
    Oracle oracle(d, testing::LayoutOf(mechanism));
    for (const double t : {-1.7, 0.0, 0.77}) {
      oracle.SetTime(t);
      const std::vector<Real6> expected = oracle.Applied(ToReal(at.q), ToReal(at.u));
      const auto wrenches = Wrenches<Space, double>(KinematicsAt(mechanism, t, at.q, at.u));
      double scale = 0.0;
      for (const Real6& F : expected) {
        scale = std::max(scale, static_cast<double>(F.template lpNorm<Eigen::Infinity>()));
      }
      const int first = Space::kRot == 1 ? 2 : 0;
      for (int b = 1; b < mechanism.num_bodies(); ++b) {
        for (int i = 0; i < Space::kDim; ++i) {
          // positions of paths of n bodies are n roundings off, forces of springs with them
          EXPECT_NEAR(wrenches[b][i], static_cast<double>(expected[b][first + i]),
                      32 * kEps * mechanism.num_bodies() * scale)
              << "body " << b << " at " << t;
        }
      }
    }
  });
  for (std::size_t kind = 0; kind < kinds.size(); ++kind) EXPECT_GT(kinds[kind], 0) << kind;
  EXPECT_GT(timed, 0);
}

#ifdef LOOPBENCH_PRECISIONS

/// As the random mechanisms draw forces: with damping and drag that are not zero.
bool HasNoPotential(const ForceDescription& force) {
  if (const auto* torque = std::get_if<JointTorque>(&force)) {
    const auto* polynomial = std::get_if<Polynomial>(&torque->value);
    return polynomial == nullptr || polynomial->coefficients.size() > 1;
  }
  if (const auto* point = std::get_if<PointForce>(&force)) return point->in_body_axes;
  return !std::holds_alternative<JointSpring>(force);
}

/// Force by force: what its wrenches do with the motions of the bodies is what its potential loses
/// (by differences along the motion) and what it supplies less what it dissipates.
TYPED_TEST(ForcesTest, EveryForceTakesItsWorkFromItsPotentialOrItsPower) {
  using Space = TypeParam;
  int with_power = 0;
  ForBothSets<Space>(Samples<Space>(), [&](const auto& d, const auto& in_double, const State& at) {
    const Coordinates coordinates = in_double.coordinates();
    MechanismDescription one = d;
    one.gravity.setZero();
    for (const ForceDescription& force : d.forces) {
      one.forces = {force};
      const Mechanism<Space, Real> mechanism(one, coordinates);
      const VectorX<Real> q = ToReal(at.q), u = ToReal(at.u);
      ASSERT_EQ(mechanism.num_q(), q.size());
      const Real t = 0.4L;
      const Kinematics<Space, Real> kinematics = KinematicsAt<Space, Real>(mechanism, t, q, u);
      const auto wrenches = Wrenches<Space, Real>(kinematics);
      Real work = 0, size = 1;
      for (int b = 1; b < mechanism.num_bodies(); ++b) {
        work += wrenches[b].dot(kinematics.motions()[b]);
        size += wrenches[b].norm() * kinematics.motions()[b].norm();
      }
      VectorX<Real> qdot(mechanism.num_q());
      mechanism.Rates(q, u, qdot);
      const auto potential = [&](Real step) {
        const VectorX<Real> moved = q + step * qdot;
        return ComputeEnergy(KinematicsAt<Space, Real>(mechanism, t, moved, u)).potential;
      };
      // truncation h^2 times third derivatives, some speed^2 times the size; round-off 1e-19 / h
      const Real h = 1e-6L, speed = 1 + u.norm() * mechanism.num_bodies();
      const Real lost = (potential(-h) - potential(h)) / (2 * h);
      const Power<Real> power = AppliedPower(kinematics);
      EXPECT_NEAR(static_cast<double>(work - (lost + power.supplied - power.dissipated)), 0.0,
                  static_cast<double>(1e-10L * size + h * h * speed * speed * size))
          << "force kind " << force.index();
      EXPECT_GE(power.dissipated, 0);
      EXPECT_EQ(mechanism.has_power(), HasNoPotential(force)) << "force kind " << force.index();
      EXPECT_TRUE(mechanism.has_power() || (power.supplied == 0 && power.dissipated == 0));
      if (power.supplied != 0 || power.dissipated != 0) ++with_power;
    }
  });
  EXPECT_GT(with_power, 10);
}

#endif

/// A bar on a free joint, its end tied to the ground.
MechanismDescription TiedBar(SpaceKind space, const SpringDamper& spring) {
  MechanismDescription d;
  d.name = "tied bar";
  d.space = space;
  d.bodies.push_back(Bar("bar", 1.0, 2.0, 0.5));
  d.forces.push_back(spring);
  return d;
}

TYPED_TEST(ForcesTest, SpringBetweenPointsPullsThemTogether) {
  using Space = TypeParam;
  const SpringDamper spring{.from = {kGround, {1.0, 0.0, 0.0}},
                            .to = {1, {1.0, 0.0, 0.0}},
                            .stiffness = 2.0,
                            .damping = 3.0,
                            .length = 4.0,
                            .preload = 0.5};
  const Mechanism<Space, double> mechanism(TiedBar(kKind<Space>, spring), Coordinates::kJoint);
  VectorX<double> q = VectorX<double>::Zero(mechanism.num_q()),
                  u = VectorX<double>::Zero(mechanism.num_u());
  if (Space::kRot == 3) q[0] = 1.0;
  // the centre of mass at (3.5, 4), the bar along x: its end is (3, 4) from the ground's point
  q[q.size() - Space::kLin] = 3.5;
  q[q.size() - Space::kLin + 1] = 4.0;
  u[u.size() - Space::kLin] = 10.0;  // the distance grows by 6 m/s
  const auto kinematics = KinematicsAt<Space, double>(mechanism, 0.0, q, u);
  const auto wrenches = Wrenches<Space, double>(kinematics);
  const double tension = 0.5 + 2.0 * (5.0 - 4.0) + 3.0 * 6.0;
  const Linear<Space, double>& f = wrenches[1].linear;
  EXPECT_NEAR(f[0], -0.6 * tension, 8 * kEps * tension);
  EXPECT_NEAR(f[1], -0.8 * tension, 8 * kEps * tension);
  EXPECT_NEAR(wrenches[1][Space::kRot - 1], 0.5 * f[1], 8 * kEps * tension) << "about the com";
  EXPECT_NEAR(ComputeEnergy(kinematics).potential, 0.5 * 2.0 + 0.5, 8 * kEps * 10.0);
  EXPECT_NEAR(AppliedPower(kinematics).dissipated, 3.0 * 36.0, 8 * kEps * 108.0);
  EXPECT_EQ(AppliedPower(kinematics).supplied, 0.0);
}

TYPED_TEST(ForcesTest, WherePointsMeetASpringHasNoDirectionAndNoForce) {
  using Space = TypeParam;
  const SpringDamper spring{.from = {kGround, {1.0, 0.0, 0.0}},
                            .to = {1, {1.0, 0.0, 0.0}},
                            .stiffness = 2.0,
                            .damping = 3.0,
                            .length = 4.0};
  const Mechanism<Space, double> mechanism(TiedBar(kKind<Space>, spring), Coordinates::kJoint);
  VectorX<double> q = VectorX<double>::Zero(mechanism.num_q());
  if (Space::kRot == 3) q[0] = 1.0;
  q[q.size() - Space::kLin] = 0.5;
  const VectorX<double> u = VectorX<double>::Ones(mechanism.num_u());
  const auto kinematics = KinematicsAt<Space, double>(mechanism, 0.0, q, u);
  EXPECT_EQ((Wrenches<Space, double>(kinematics)[1].norm()), 0.0);
  EXPECT_EQ(AppliedPower(kinematics).dissipated, 0.0);
  EXPECT_EQ(ComputeEnergy(kinematics).potential, 0.5 * 2.0 * 16.0);
  // a hair away there is all of it
  q[q.size() - Space::kLin] += 1e-12;
  const auto apart =
      Wrenches<Space, double>(KinematicsAt<Space, double>(mechanism, 0.0, q, 0.0 * u));
  EXPECT_NEAR(apart[1].linear[0], 8.0, 1e-11);
}

TEST(ForceElementsTest, StopTimesAreTheKnotsOfAllTablesOnce) {
  MechanismDescription d = Chain(3);
  EXPECT_TRUE((Mechanism<Planar, double>(d, Coordinates::kJoint).stop_times().empty()));
  d.forces = {JointTorque{0, TimeTable{{0.0, 2.0, 3.0}, {1.0, 0.0, 1.0}}},
              JointTorque{1, TimeTable{{-1.0, 1.0, 2.0}, {1.0, 0.0, 1.0}, false}},
              JointTorque{1, Harmonic{.amplitude = 1.0, .omega = 1.0}}};
  const Mechanism<Planar, double> mechanism(d, Coordinates::kJoint);
  EXPECT_EQ(mechanism.stop_times(), (std::vector<double>{-1.0, 0.0, 1.0, 2.0, 3.0}));
}

TEST(ForceElementsTest, WhatIsWrongWithAForceIsNamed) {
  const Eigen::Vector3d o = Eigen::Vector3d::Zero(), up = Eigen::Vector3d::UnitZ();
  const std::vector<std::pair<ForceDescription, std::string>> wrong = {
      {JointTorque{7}, "joint index 7 does not exist"},
      {JointTorque{0, Polynomial{}}, "a polynomial needs at least one coefficient"},
      {JointSpring{0, -1.0}, "must not be negative"},
      {JointSpring{0, 1.0, NAN}, "must be finite"},
      {JointSpring{0, 1.0, 0.0, INFINITY}, "must be finite"},
      {JointDamper{0, -1.0}, "must not be negative"},
      {JointDamper{0, NAN}, "must not be negative"},
      {PointForce{kGround, o, o}, "expected a moving body"},
      {PointForce{1, up, o}, "leaves the plane"},
      {PointForce{1, o, up}, "leaves the plane"},
      {SpringDamper{.from = {1, o}, .to = {1, o}}, "joins a body with itself"},
      {SpringDamper{.from = {9, o}, .to = {1, o}}, "body index 9"},
      {SpringDamper{.from = {0, o}, .to = {1, up}}, "leaves the plane"},
      {SpringDamper{.from = {0, o}, .to = {1, o}, .damping = -1.0}, "must not be negative"},
      {SpringDamper{.from = {0, o}, .to = {1, o}, .length = -1.0}, "must not be negative"},
      {SpringDamper{.from = {0, o}, .to = {1, o}, .preload = NAN}, "must be finite"},
      {Drag{.point = {kGround, o}}, "expected a moving body"},
      {Drag{.point = {1, o}, .quadratic = -1.0}, "must not be negative"}};
  for (const auto& [force, text] : wrong) {
    MechanismDescription d = Chain(3);
    d.forces = {force};
    EXPECT_NE(Validate(d).find(text), std::string::npos) << text << ": " << Validate(d);
  }
}

}  // namespace loopbench::forces_test
