// Mechanisms written as MJCF and read again: the same bodies, by the same
// names, accelerate as before.
#include "harness/config/formulations.h"
#include "harness/config/mechanism_reader.h"
#include "harness/exchange/import.h"
#include "harness/exchange/model.h"
#include "mechanism/loops/tree_dynamics.h"
#include "mechanism/start/assembly.h"
#include "tests/harness/places.h"

namespace loopbench::harness::round_trip_test {

struct Accelerations {
  std::map<std::string, Eigen::Matrix<double, 6, 1>> of_bodies;  ///< at centres of mass, in space
  double largest = 0.0, rcond = 0.0;
};

template <class Space>
Accelerations AtStart(const MechanismDescription& description) {
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  const Start<double> start = Assemble<Space>(description, mechanism);
  EXPECT_EQ(start.outcome, Outcome::kFinished) << start.message;
  const auto system = MakeFormulation<Space>("odca", mechanism, {Enforcement::kAcceleration});
  EXPECT_EQ(system->Start(0.0, start.q, start.u), Outcome::kFinished);
  std::vector<double> y(static_cast<std::size_t>(system->state_size())), ydot(y.size());
  system->ToState(start.q, start.u, y);
  EXPECT_EQ(system->Examine(0.0, y, ydot), Outcome::kFinished);
  TreeDynamics<Space, double> dynamics(mechanism);
  VectorX<double> h(mechanism.num_u());
  dynamics.Bias(system->kinematics(), h);
  std::vector<Acceleration<Space, double>> A(static_cast<std::size_t>(mechanism.num_bodies()));
  dynamics.BodyAccelerations(system->kinematics(), system->udot(), A);
  Accelerations made;
  made.rcond = system->diagnostics().rcond;
  for (std::size_t b = 1; b < A.size(); ++b) {
    Eigen::Matrix<double, 6, 1>& one = made.of_bodies[mechanism.body_names()[b]];
    one.setZero();
    for (int i = 0; i < Space::kDim; ++i) one[Space::kRot == 1 ? 2 + i : i] = A[b][i];
    made.largest = std::max(made.largest, one.cwiseAbs().maxCoeff());
  }
  return made;
}

Accelerations Of(const MechanismDescription& description) {
  return description.space == SpaceKind::kPlanar ? AtStart<Planar>(description)
                                                 : AtStart<Spatial>(description);
}

TEST(RoundTrip, ThroughMjcfKeepsAccelerations) {
  const auto& mjcf = exchange::ExportFormats().front();
  int compared = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kConfigs / "mechanisms")) {
    const MechanismDescription before = ReadMechanism(entry.path()).description;
    SCOPED_TRACE(before.name);
    std::string text;
    try {
      text = exchange::Export(before, mjcf).text;
    } catch (const exchange::Unsupported&) {
      continue;
    }
    const Imported after = ImportText(text, "exported.xml");
    const bool changed = std::ranges::any_of(after.notes, &ImportNote::changes_motion);
    // a force at a point is an actuator at a site, which is not read: the command says so
    const bool has_point_force = text.find("refsite") != std::string::npos;
    EXPECT_EQ(changed, has_point_force);
    if (changed) continue;
    const Accelerations ours = Of(before), theirs = Of(after.description);
    ASSERT_EQ(ours.of_bodies.size(), theirs.of_bodies.size());
    // gravity, and what holds against it, are summed. Some 100 rounded terms,
    // magnified by the condition of the loops; in singular positions the
    // shipped mechanisms have one lost direction and all others well
    // conditioned
    const double condition = ours.rcond > kEps ? 1.0 / ours.rcond : 1.0;
    for (const auto& [name, acceleration] : ours.of_bodies) {
      ASSERT_TRUE(theirs.of_bodies.contains(name)) << name;
      EXPECT_LE((theirs.of_bodies.at(name) - acceleration).cwiseAbs().maxCoeff(),
                100 * kEps * condition * std::max(ours.largest, before.gravity.norm()))
          << name;
    }
    ++compared;
  }
  EXPECT_EQ(compared, 35);
}

}  // namespace loopbench::harness::round_trip_test
