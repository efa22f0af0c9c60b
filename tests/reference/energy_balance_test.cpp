// The energy balance of problems that are not conservative: work supplied and dissipated against
// closed forms, and a balance that closes to the integrator's tolerance.
#include "harness/integrator/arkode.h"
#include "mechanism/description/library.h"
#include "mechanism/start/assembly.h"
#include "tests/reference/cases.h"

namespace loopbench::harness::reference::energy_balance_test {

constexpr double kTolerance = 1e-10;
constexpr double kHorizon = 5.0;  // [s]
/// Errors of at most rtol per step and component, a few hundred steps, forces and speeds of a few
/// units. Seen: 85.
constexpr double kErrorPerTolerance = 1e3;  // [J]

/// The published methods; reduction with a partition that may change: driven bars turn through the
/// dead centres of any fixed one.
std::vector<Method> Methods() {
  std::vector<Method> methods = PublishedMethods();
  for (Method& method : methods) {
    if (method.formulation == "reduction") method.solver = SolverKind::kRankRevealing;
  }
  return methods;
}

/// A bar on a pin, without gravity, of moment of inertia 2 kg m^2 about it.
MechanismFile BarOnPin(const ForceDescription& force, double speed) {
  MechanismFile file;
  file.description.name = "bar";
  file.description.bodies.push_back(Bar("bar", 1.0, 4.0, 1.0));
  file.description.joints.push_back(
      Revolute("O", kGround, Eigen::Vector3d::Zero(), 1, Eigen::Vector3d::Zero()));
  file.description.initial.speeds.push_back({0, {speed}});
  file.description.forces = {force};
  return file;
}

/// Energies of some 10 J, a few hundred steps of errors of 1e-10 each.
constexpr double kClosedForm = 1e-7;  // [J]

TEST(Work, OfADamperIsTheEnergyThatASpinningBarLoses) {
  const double inertia = 2.0, damping = 1.5, speed = 3.0, t = 2.0;
  const MechanismFile file = BarOnPin(JointDamper{0, damping}, speed);
  const Record record = RunFile(file, PublishedMethods()[0], kTolerance, t);
  const double lost =
      0.5 * inertia * speed * speed * (1.0 - std::exp(-2.0 * damping * t / inertia));
  EXPECT_NEAR(record.Number("energy_dissipated"), lost, kClosedForm);
  EXPECT_EQ(record.Number("energy_supplied"), 0.0);
}

TEST(Work, OfDragSlowsABarAsItsClosedFormSays) {
  // quadratic drag c |v| v at 1 m: u' = -c u^2 / I, u = u0 / (1 + c u0 t / I)
  const double inertia = 2.0, drag = 0.7, speed = 3.0, t = 2.0;
  const MechanismFile file =
      BarOnPin(Drag{.point = {1, {1.0, 0.0, 0.0}}, .quadratic = drag}, speed);
  const Record record = RunFile(file, PublishedMethods()[0], kTolerance, t);
  const double end = speed / (1.0 + drag * speed * t / inertia);
  EXPECT_NEAR(record.Number("energy_dissipated"), 0.5 * inertia * (speed * speed - end * end),
              kClosedForm);
}

TEST(Work, OfATorqueIsTheEnergyThatABarGains) {
  const double inertia = 2.0, rate = 1.5, t = 2.0;
  const MechanismFile file = BarOnPin(JointTorque{0, Polynomial{{0.0, rate}}}, 0.0);
  const Record record = RunFile(file, PublishedMethods()[0], kTolerance, t);
  const double speed = rate * t * t / 2.0 / inertia;
  EXPECT_NEAR(record.Number("energy_supplied"), 0.5 * inertia * speed * speed, kClosedForm);
  EXPECT_EQ(record.Number("energy_dissipated"), 0.0);
}

TEST(Work, OfConservativeProblemsHasNoEntry) {
  const MechanismFile file = BarOnPin(JointSpring{0, 2.0, 0.3, 0.1}, 1.0);
  const Record record = RunFile(file, PublishedMethods()[0], kTolerance, 1.0);
  EXPECT_EQ(record.Find("energy_supplied"), nullptr);
  EXPECT_EQ(record.Find("energy_dissipated"), nullptr);
  EXPECT_LE(record.Number("energy_error_max"), kClosedForm);
}

/// The paper's four-bar with forces. Joints OA, AB, BC; bodies by index from 1.
MechanismFile FourBar(const std::string& name, std::vector<ForceDescription> forces) {
  MechanismFile file = ReadMechanism(kConfigs / "mechanisms/four-bar.json");
  file.description.name = name;
  file.description.forces = std::move(forces);
  return file;
}

MechanismFile ProblemOf(const std::string& name) {
  const Eigen::Vector3d tip = Eigen::Vector3d::UnitX();
  const SpringDamper strut{.from = {kGround, {0.3, -0.4, 0.0}},
                           .to = {2, 0.5 * tip},
                           .stiffness = 20.0,
                           .damping = 2.0,
                           .length = 0.5,
                           .preload = 1.0};
  const Drag drag{.point = {2, tip}, .linear = 0.2, .quadratic = 0.3};
  const PointForce thrust{1, tip, {0.0, 2.0, 0.0}, true};
  const JointTorque motor{0, Harmonic{.mean = 1.0, .amplitude = 6.0, .omega = 4.0, .phase = 0.3}};
  const JointTorque smooth{1, TimeTable{{0.5, 1.25, 2.0, 4.0}, {0.0, 3.0, -2.0, 1.0}}};
  const JointTorque kinked{1, TimeTable{{0.5, 1.25, 2.0, 4.0}, {0.0, 3.0, -2.0, 1.0}, false}};
  if (name == "damped") return FourBar(name, {JointDamper{0, 0.5}, strut});
  if (name == "driven") return FourBar(name, {motor, smooth});
  if (name == "dragged") return FourBar(name, {drag, thrust});
  if (name == "kinked") return FourBar(name, {kinked, JointDamper{2, 0.2}});
  if (name == "prescribed") {
    MechanismFile problem = FourBar(name, {JointDamper{2, 0.5}, strut});
    // from the angle that the file starts at
    problem.description.joints[0].motions = {
        {0, Harmonic{.mean = -1.0, .amplitude = 0.4, .omega = 3.0}}};
    problem.description.initial.speeds.clear();
    return problem;
  }
  return FourBar(name, {JointDamper{0, 0.5}, JointSpring{1, 5.0, 0.2, 1.0}, strut, drag, thrust,
                        motor, smooth, kinked});
}

class BalanceTest : public testing::TestWithParam<std::tuple<std::string, Method>> {};

TEST_P(BalanceTest, ClosesToTheTolerance) {
  const auto& [name, method] = GetParam();
  const MechanismFile problem = ProblemOf(name);
  double coarse = 0.0;
  for (const double rtol : {1e-6, 1e-8, 1e-10}) {
    const Record record = RunFile(problem, method, rtol, kHorizon);
    ASSERT_EQ(record.Text("outcome"), "finished") << record.Text("message");
    const double error = record.Number("energy_error_max");
    const double supplied = record.Number("energy_supplied");
    const double dissipated = record.Number("energy_dissipated");
    EXPECT_LE(error, kErrorPerTolerance * rtol) << rtol;
    // there is something to balance
    EXPECT_GT(std::abs(supplied) + dissipated, 0.1);
    EXPECT_EQ(supplied == 0.0, name == "damped");
    EXPECT_EQ(dissipated == 0.0, name == "driven");
    EXPECT_EQ(dissipated > 0.1, name != "driven");
    // 1e4 in tolerance; 1e2 in error leaves room for chance and for the quadratures' own order
    if (rtol == 1e-6) coarse = error;
    if (rtol == 1e-10) {
      EXPECT_LE(error, 1e-2 * coarse);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(FourBar, BalanceTest,
                         testing::Combine(testing::Values("damped", "driven", "dragged", "kinked",
                                                          "prescribed", "everything"),
                                          testing::ValuesIn(Methods())),
                         NameOfParam());

TEST(Balance, ClosesInSpaceToo) {
  MechanismFile problem = ProblemOf("everything");
  problem.description.space = SpaceKind::kSpatial;
  for (Method method : PublishedMethods()) {
    method.solver = SolverKind::kRankRevealing;  // a planar loop in space has redundant rows
    const Record record = RunFile(problem, method, 1e-8, kHorizon);
    ASSERT_EQ(record.Text("outcome"), "finished") << record.Text("message");
    EXPECT_LE(record.Number("energy_error_max"), kErrorPerTolerance * 1e-8) << ToString(method);
  }
}

/// Timings integrate without work, accuracy runs with it: the motion must be one.
TEST(Balance, IntegratingWorkLeavesTheBitsOfTheMotion) {
  const MechanismDescription description = ProblemOf("everything").description;
  const Mechanism<Planar, double> mechanism(description, Coordinates::kJoint);
  const Start<double> start = Assemble<Planar>(description, mechanism);
  ASSERT_EQ(start.outcome, Outcome::kFinished);
  std::vector<std::vector<double>> ends;
  for (const bool with_work : {false, true}) {
    const auto formulation = MakeFormulation<Planar>(PublishedMethods()[0], mechanism);
    ASSERT_EQ(formulation->Start(0.0, start.q, start.u), Outcome::kFinished);
    formulation->IntegrateWork(with_work);
    std::vector<double> y(static_cast<std::size_t>(formulation->size()), 0.0);
    formulation->ToState(start.q, start.u, y);
    IntegratorOptions options;
    options.stop_times = mechanism.stop_times();
    ASSERT_EQ(Integrate(*formulation, 0.0, kHorizon, y, options).outcome, Outcome::kFinished);
    y.resize(static_cast<std::size_t>(formulation->state_size()));
    ends.push_back(y);
  }
  EXPECT_EQ(ends[0], ends[1]);
}

}  // namespace loopbench::harness::reference::energy_balance_test
