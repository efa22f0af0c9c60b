// Redundant constraints off the loops: rows are derivatives of their mismatch, and accelerations do
// not depend on the released rows.
#include "mechanism/loops/self_stress.h"

#include "lagrange/lagrange.h"
#include "mechanism/formulation/system.h"
#include "mechanism/simplify/redundancy.h"
#include "odca/odca.h"
#include "reduction/reduction.h"
#include "tests/mechanism/shipped.h"

namespace loopbench {
namespace {

using testing::Door;
using testing::Shipped;

/// A door whose second joint releases everything.
MechanismDescription ReleasedDoor(JointType type) {
  MechanismDescription d = Door(type);
  d.joints[1].cut = true;
  const int rows = KindOf<Spatial, double>(type).num_constraints();
  for (int i = 0; i < rows; ++i) d.joints[1].released.push_back(i);
  return d;
}

/// The mismatch of the first joint by row, its rate and its second rate for udot = 0.
struct Rows {
  Components<Spatial, double> e, rate, second;
};

Rows RowsAt(Kinematics<Spatial, double>& kinematics, const VectorX<double>& q,
            const VectorX<double>& u) {
  kinematics.UpdatePosition(q);
  kinematics.UpdateVelocity(u);
  const Mechanism<Spatial, double>& mechanism = kinematics.mechanism();
  std::vector<Acceleration<Spatial, double>> A(2, Acceleration<Spatial, double>::Zero());
  TreeDynamics<Spatial, double>(mechanism).BodyAccelerations(
      kinematics, VectorX<double>::Zero(mechanism.num_u()), A);
  const JointState<Spatial, double>& joint = kinematics.joints()[0];
  return {joint.Along(kinematics.ConstraintMismatch(0), joint.rows()),
          joint.Along(joint.V_rel, joint.rows()),
          JointAcceleration<Spatial, double>(kinematics, 0, A)};
}

/// q after a time with constant speeds, by the classical method of order four.
VectorX<double> After(const Mechanism<Spatial, double>& mechanism, const VectorX<double>& q,
                      const VectorX<double>& u, double time) {
  VectorX<double> k1(q.size()), k2(q.size()), k3(q.size()), k4(q.size());
  mechanism.Rates(q, u, k1);
  mechanism.Rates(q + 0.5 * time * k1, u, k2);
  mechanism.Rates(q + 0.5 * time * k2, u, k3);
  mechanism.Rates(q + time * k3, u, k4);
  return q + time / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
}

class ExactRows : public ::testing::TestWithParam<JointType> {};

TEST_P(ExactRows, AreDerivativesOfTheMismatchToFirstOrder) {
  const Mechanism<Spatial, double> mechanism(ReleasedDoor(GetParam()), Coordinates::kAbsolute);
  Kinematics<Spatial, double> kinematics(mechanism);
  constexpr double kTilt = 1e-3, kStep = 1e-3;
  VectorX<double> q(7), u(6);
  // turned about a free axis
  const int axis = GetParam() == JointType::kUniversal ? 0 : 2;
  q << 1.0, 0.4 * kTilt, -0.7 * kTilt, 0.3 * kTilt, 0.2 * kTilt, 0.5 * kTilt, -0.6 * kTilt;
  u << 0.3 * kTilt, -0.2 * kTilt, 0.2 * kTilt, 0.5 * kTilt, 0.1 * kTilt, -0.4 * kTilt;
  q[1 + axis] = 0.3;
  u[axis] = 2.0;
  mechanism.Normalise(q);
  const Rows at = RowsAt(kinematics, q, u);
  const Rows ahead = RowsAt(kinematics, After(mechanism, q, u, kStep), u);
  const Rows behind = RowsAt(kinematics, After(mechanism, q, u, -kStep), u);
  // terms of second order in the tilt, times the square of the speed, and the differences' own
  // error
  const double bound = 20.0 * kTilt * kTilt * 4.0 + kStep * kStep * kTilt * 16.0;
  for (int i = 0; i < kinematics.joints()[0].rows(); ++i) {
    EXPECT_NEAR((ahead.e[i] - behind.e[i]) / (2.0 * kStep), at.rate[i], bound) << i;
    EXPECT_NEAR((ahead.e[i] - 2.0 * at.e[i] + behind.e[i]) / (kStep * kStep), at.second[i], bound)
        << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, ExactRows,
                         ::testing::Values(JointType::kRevolute, JointType::kCylindrical,
                                           JointType::kPinInSlot, JointType::kPlanar,
                                           JointType::kUniversal, JointType::kHelical,
                                           JointType::kSchoenflies),
                         [](const auto& one) {
                           std::string name(ToString(one.param));
                           std::erase(name, '-');
                           return name;
                         });

using Solver = std::unique_ptr<System<Spatial, double>> (*)(const Mechanism<Spatial, double>&,
                                                            const FormulationOptions&);

struct Off {
  const char* mechanism;
  Coordinates coordinates;
  bool is_coupled = false;  ///< keeps the sum of the first three coordinates
};

class ReleasedRows : public ::testing::TestWithParam<Off> {};

/// Accelerations at a state that misses the loops by about `off`, and their largest difference
/// between two choices of the rows that the joint that closes the loop releases.
struct Accelerations {
  VectorX<double> udot;
  double spread = 0.0;
};

Accelerations Evaluate(const Off& scene, Solver make, double off) {
  MechanismDescription description = Shipped(scene.mechanism);
  if (scene.is_coupled) description.couplings = {{"sum", {{0, 1.0}, {1, 1.0}, {2, 1.0}}}};
  const Redundancy redundancy = FindRedundancy(description);
  EXPECT_EQ(redundancy.couplings.empty(), !scene.is_coupled);
  description = Release(description, redundancy);
  const int cut = redundancy.released[0].joint;
  const auto count = redundancy.released[0].directions.size();
  Accelerations result;
  for (unsigned rows = 0; rows < 32; ++rows) {
    std::vector<int>& released = description.joints[cut].released;
    released.clear();
    for (int i = 0; i < 5; ++i) {
      if (rows >> i & 1) released.push_back(i);
    }
    if (released.size() != count) continue;
    const Mechanism<Spatial, double> mechanism(description, scene.coordinates);
    Start<double> start = Assemble<Spatial>(description, mechanism);
    for (int i = 0; i < start.q.size(); ++i) start.q[i] += off * std::sin(1.0 + 2.3 * i);
    for (int i = 0; i < start.u.size(); ++i) start.u[i] += off * std::cos(1.0 + 1.7 * i);
    mechanism.Normalise(start.q);
    FormulationOptions options;
    options.solver = SolverKind::kRankRevealing;
    options.enforcement = Enforcement::kAcceleration;
    const auto system = make(mechanism, options);
    // a choice that is lost here is replaced
    EXPECT_EQ(system->Start(0.0, start.q, start.u), Outcome::kFinished);
    VectorX<double> udot;
    EXPECT_EQ(system->Evaluate(0.0, start.q, start.u, udot), Outcome::kFinished);
    if (result.udot.size() == 0) result.udot = udot;
    result.spread = std::max(result.spread, (udot - result.udot).lpNorm<Eigen::Infinity>());
  }
  return result;
}

TEST_P(ReleasedRows, ChangeAccelerationsToSecondOrderInTheMismatchAlone) {
  const std::vector<Solver> solvers = {
      [](const auto& m, const auto& o) { return MakeSystem<odca::Odca>(m, o); },
      [](const auto& m, const auto& o) { return MakeSystem<lagrange::Lagrange>(m, o); },
      [](const auto& m, const auto& o) { return MakeSystem<reduction::Reduction>(m, o); }};
  // O-DCA and multipliers solve the same equations at any mismatch; condition numbers are below 1e5
  const VectorX<double> odca = Evaluate(GetParam(), solvers[0], 1e-3).udot;
  const VectorX<double> lagrange = Evaluate(GetParam(), solvers[1], 1e-3).udot;
  const double bound = 1e5 * 16 * kEps;
  EXPECT_LT((odca - lagrange).lpNorm<Eigen::Infinity>(),
            bound * lagrange.lpNorm<Eigen::Infinity>());
  for (const Solver make : solvers) {
    const double coarse = Evaluate(GetParam(), make, 1e-3).spread;
    const Accelerations fine = Evaluate(GetParam(), make, 1e-5);
    // a factor of 1e4 but for third order and round-off
    EXPECT_LT(fine.spread, 2e-4 * coarse + 1e-10);
    // the mismatch itself changes accelerations to first order
    const VectorX<double> closed = Evaluate(GetParam(), make, 0.0).udot;
    EXPECT_GT((fine.udot - closed).lpNorm<Eigen::Infinity>(), 30.0 * fine.spread);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Linkages, ReleasedRows,
    ::testing::Values(Off{"bennett", Coordinates::kJoint}, Off{"goldberg", Coordinates::kJoint},
                      Off{"bennett", Coordinates::kAbsolute},
                      Off{"goldberg", Coordinates::kAbsolute},
                      Off{"sarrus", Coordinates::kJoint, true},
                      Off{"sarrus", Coordinates::kAbsolute, true}),
    [](const auto& one) {
      std::string name(one.param.mechanism);
      std::erase(name, '-');
      return name + (one.param.coordinates == Coordinates::kJoint ? "Joint" : "Absolute");
    });

/// One system goes through a turn both ways, so that rows move between joints and back. At 0 and pi
/// the rows of the joint that closes the loop of two cranks depend on each other.
TEST(MovingRows, HaveTheRightAccelerationsInAllPositions) {
  const MechanismDescription given = Shipped("../experiments/overconstrained/plate-on-cranks");
  const MechanismDescription description = Release(given, FindRedundancy(given));
  // the plate does not turn, so each crank moves as a pendulum
  constexpr double kPendulum = 9.81 * (3 * 0.2 + 2 * 0.4) / (3 * 0.06 + 2 * 0.16);
  const auto check = [&]<class Maker>(const Maker& make, Coordinates set, SolverKind kind) {
    const Mechanism<Planar, double> mechanism(description, set), joints(given, Coordinates::kJoint);
    ASSERT_EQ(mechanism.num_moving_rows(), 1);
    const Start<double> start = Assemble<Planar>(description, mechanism);
    FormulationOptions options;
    options.solver = kind;
    const std::unique_ptr<System<Planar, double>> system = make(mechanism, options);
    ASSERT_EQ(system->Start(0.0, start.q, start.u), Outcome::kFinished);
    Kinematics<Planar, double> at(joints), there(mechanism);
    std::set<std::vector<int>> choices;
    std::vector<double> y(static_cast<std::size_t>(system->size())), ydot = y;
    for (int k = 0; k <= 240; ++k) {
      const double angle = kPi / 60.0 * (k <= 120 ? k : 240 - k);
      VectorX<double> q(4), u(4);
      q << angle, angle, angle, -angle;
      u << 1.3, 1.3, 1.3, -1.3;
      at.UpdatePosition(q);
      at.UpdateVelocity(u);
      q = at.CoordinatesIn(mechanism);
      there.UpdatePosition(q);
      system->ToState(q, at.SpeedsIn(there), y);
      ASSERT_EQ(system->Examine(0.0, y, ydot), Outcome::kFinished) << angle;
      // round-off times the condition of the rows, whose coefficients are at most ten
      EXPECT_NEAR(system->udot()[0], -kPendulum * std::cos(angle), 1e-11) << angle;
      std::vector<int> choice;
      for (const MovingRow& row : system->kinematics().moving_rows()) choice.push_back(row.joint);
      choices.insert(choice);
      system->BeginStep(0.0, y);
    }
    EXPECT_EQ(choices.size(), 2u) << "either joint that closes a loop has the moving row";
  };
  for (const Coordinates set : {Coordinates::kJoint, Coordinates::kAbsolute}) {
    for (const SolverKind kind : {SolverKind::kRankRevealing, SolverKind::kAsPublished}) {
      check([](const auto& m, const auto& o) { return MakeSystem<odca::Odca>(m, o); }, set, kind);
      check([](const auto& m, const auto& o) { return MakeSystem<lagrange::Lagrange>(m, o); }, set,
            kind);
      // plain reduction keeps its dependent speeds, which other rows need not determine
      if (kind == SolverKind::kAsPublished) continue;
      check([](const auto& m, const auto& o) { return MakeSystem<reduction::Reduction>(m, o); },
            set, kind);
    }
  }
}

}  // namespace
}  // namespace loopbench
