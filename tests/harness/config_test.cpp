// What the readers of harness/config accept: the shipped files and the values they carry.
#include "harness/base/file_kind.h"
#include "harness/config/experiment_reader.h"
#include "harness/judge/judge.h"
#include "tests/harness/places.h"

namespace loopbench::harness::config_test {

namespace fs = std::filesystem;

TEST(ShippedMechanisms, AllReadAndBearTheNamesOfTheirFiles) {
  const std::vector<fs::path> files = JsonFilesIn(kConfigs / "mechanisms");
  EXPECT_GE(files.size(), 11u);
  for (const fs::path& file : files) {
    const MechanismFile mechanism = ReadMechanism(file);
    EXPECT_EQ(mechanism.description.name, file.stem().string());
    EXPECT_EQ(Validate(mechanism.description), "") << file;
  }
}

TEST(ShippedMechanisms, HoldAsManyJointsAsTheyHaveDegreesOfFreedom) {
  int planar = 0;
  for (const fs::path& file : JsonFilesIn(kConfigs / "mechanisms")) {
    const MechanismDescription mechanism = ReadMechanism(file).description;
    const bool revolute = std::ranges::all_of(
        mechanism.joints, [](const auto& joint) { return joint.type == JointType::kRevolute; });
    // Grueebler's count for planar revolute joints; it holds for all of these problems but two,
    // whose loop is redundant. The others are run (tests/reference/shipped_mechanisms_test.cpp).
    if (mechanism.space != SpaceKind::kPlanar || !revolute) continue;
    if (mechanism.name == "locomotive" || mechanism.name == "three-cranks") continue;
    const auto bodies = static_cast<int>(mechanism.bodies.size()) - 1;
    int freedom = 3 * bodies - 2 * static_cast<int>(mechanism.joints.size());
    for (const auto& joint : mechanism.joints) freedom -= static_cast<int>(joint.motions.size());
    freedom -= static_cast<int>(mechanism.couplings.size());
    EXPECT_EQ(static_cast<int>(mechanism.initial.held.size()), freedom) << file;
    // One name for joint coordinates and one for absolute ones; without any they are chosen.
    if (mechanism.independent.empty()) continue;
    EXPECT_EQ(static_cast<int>(mechanism.independent.size()), 2 * freedom) << file;
    ++planar;
  }
  EXPECT_GE(planar, 11);
}

TEST(ShippedMechanisms, CutEachLoopOnceAtTheJointListedLast) {
  const MechanismDescription four_bar = Shipped("four-bar").description;
  ASSERT_EQ(four_bar.joints.size(), 4u);
  EXPECT_TRUE(four_bar.joints[3].cut);
  EXPECT_EQ(four_bar.joints[3].name, "OC");
  const MechanismDescription seven_bar = Shipped("seven-bar").description;
  ASSERT_EQ(seven_bar.joints.size(), 8u);
  EXPECT_TRUE(seven_bar.joints[6].cut && seven_bar.joints[7].cut);
}

TEST(MechanismReader, FillsEveryFieldOfEveryForce) {
  const MechanismDescription m = ParseMechanism(TestData("every-force.json"), "m.json").description;
  const auto function = [&](int force) {
    return std::get<JointTorque>(m.forces[static_cast<std::size_t>(force)]).value;
  };
  EXPECT_EQ(Validate(m), "");
  EXPECT_EQ(std::get<JointSpring>(m.forces[0]).preload, -2.0);
  EXPECT_EQ(std::get<Polynomial>(function(1)).coefficients, (std::vector<double>{1, 2}));
  const Harmonic harmonic = std::get<Harmonic>(function(2));
  EXPECT_EQ(harmonic.amplitude, 3.0);
  EXPECT_EQ(harmonic.omega, 4.0);
  EXPECT_EQ(harmonic.mean, 5.0);
  EXPECT_EQ(harmonic.phase, 6.0);
  EXPECT_EQ(std::get<TimeTable>(function(3)).times, (std::vector<double>{0, 1, 3}));
  EXPECT_EQ(std::get<TimeTable>(function(3)).values, (std::vector<double>{4, 5, 4}));
  EXPECT_TRUE(std::get<TimeTable>(function(3)).cubic);
  EXPECT_FALSE(std::get<TimeTable>(function(4)).cubic);
  const SpringDamper spring = std::get<SpringDamper>(m.forces[5]);
  EXPECT_EQ(spring.from.body, kGround);
  EXPECT_EQ(spring.from.at, Eigen::Vector3d(1, 2, 0));
  EXPECT_EQ(spring.to.body, 1);
  EXPECT_EQ(spring.to.at, Eigen::Vector3d(1, 0, 0));
  EXPECT_EQ(spring.stiffness, 1.0);
  EXPECT_EQ(spring.damping, 2.0);
  EXPECT_EQ(spring.length, 3.0);
  EXPECT_EQ(spring.preload, -4.0);
  EXPECT_EQ(std::get<SpringDamper>(m.forces[6]).stiffness, 0.0);
  const Drag drag = std::get<Drag>(m.forces[7]);
  EXPECT_EQ(drag.point.body, 1);
  EXPECT_EQ(drag.point.at, Eigen::Vector3d(0, 1, 0));
  EXPECT_EQ(drag.linear, 0.5);
  EXPECT_EQ(drag.quadratic, 0.25);
}

/// "" or the complaint about a body in space with this inertia.
std::string InertiaError(const std::string& inertia, const std::string& space = "spatial") {
  return MessageOf([&] {
    ParseMechanism(R"({"name": "m", "space": ")" + space + R"(", "gravity": [0, 0],
      "bodies": [{"name": "a", "mass": 1, "inertia": )" +
                       inertia + R"(}],
      "joints": [{"name": "F", "type": "free", "from": {"body": "ground"}, "to": {"body": "a"}}]})",
                   "m.json");
  });
}

TEST(MechanismReader, TakesInertiasOfBodiesOnly) {
  // a thin rod, a thin plate, and a plate in three significant digits, whose sum is off by 0.8 %
  for (const char* body : {"[1, 1, 1e-9]", "[0.1, 0.2, 0.3]", "[0.125, 0.125, 0.252]",
                           "[0.55, 0.55, 1.0, 0.45, 0, 0]"}) {
    EXPECT_EQ(InertiaError(body), "") << body;
  }
  // the last has the principal moments 1, 0.1 and 0.1, in turned axes
  for (const char* none :
       {"[1, 0.1, 0.1]", "[0.125, 0.125, 0.253]", "[0.55, 0.55, 0.1, 0.45, 0, 0]"}) {
    EXPECT_NE(InertiaError(none).find("triangle inequality"), std::string::npos)
        << none << " " << InertiaError(none);
  }
  EXPECT_EQ(InertiaError("[1, 0.1, 0.1]", "planar"), "") << "only Izz counts in the plane";
}

TEST(MechanismReader, FillsEveryFieldOfASpatialMechanism) {
  const MechanismFile file = ParseMechanism(TestData("every-field.json"), "m.json");
  const MechanismDescription& m = file.description;
  EXPECT_EQ(m.space, SpaceKind::kSpatial);
  ASSERT_EQ(m.bodies.size(), 3u);
  EXPECT_EQ(m.bodies[kGround].points.at("O"), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(m.bodies[1].inertia(2, 1), 0.3);
  EXPECT_EQ(m.bodies[1].com, Eigen::Vector3d(0, 0, 1));
  EXPECT_EQ(m.bodies[2].inertia, Eigen::Matrix3d::Identity());
  EXPECT_EQ(m.joints[0].type, JointType::kPrismatic);
  EXPECT_EQ(m.joints[0].from.position, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(m.joints[0].to.rotation, Eigen::Vector3d(0.1, 0, 0));
  EXPECT_EQ(m.joints[0].axis, Eigen::Vector3d(0, 1, 0));
  EXPECT_EQ(m.joints[1].from.rotation, Eigen::Vector3d(0, 0, 0.5));
  EXPECT_EQ(std::get<JointSpring>(m.forces[0]).rest, 0.25);
  EXPECT_EQ(std::get<JointDamper>(m.forces[1]).damping, 8.0);
  EXPECT_EQ(std::get<Polynomial>(std::get<JointTorque>(m.forces[2]).value).coefficients,
            std::vector<double>{-9.0});
  EXPECT_TRUE(std::get<PointForce>(m.forces[3]).in_body_axes);
  EXPECT_EQ(std::get<PointForce>(m.forces[3]).point.at, Eigen::Vector3d(1, 0, 0));
  EXPECT_EQ(m.initial.coordinates[1].values.size(), 7u);
  EXPECT_EQ(m.initial.speeds[0].joint, 1);
  EXPECT_EQ(m.initial.held, std::vector<int>{0});
  EXPECT_EQ(file.observe.length, 1.0);
}

TEST(MechanismReader, ReadsWhatObserversCompareWith) {
  const ObservedQuantities toggle = Shipped("toggle").observe;
  ASSERT_EQ(toggle.branch_invariants.size(), 2u);
  EXPECT_EQ(toggle.branch_invariants[0], (AngleCombination{{"bar1", 1.0}, {"bar2", -1.0}}));
  ASSERT_TRUE(toggle.closed_form.has_value());
  EXPECT_DOUBLE_EQ(toggle.closed_form->frequency_squared, 9.81 / 2.5);
  const ObservedQuantities parallelogram = Shipped("parallelogram").observe;
  EXPECT_EQ(parallelogram.closed_form->body, "bar1");
  EXPECT_DOUBLE_EQ(parallelogram.closed_form->frequency_squared, 2.0 * 9.81 / 3.5);
  EXPECT_DOUBLE_EQ(parallelogram.closed_form->down_angle, -std::acos(0.0));
  EXPECT_FALSE(Shipped("four-bar").observe.closed_form.has_value());
}

TEST(ShippedExperiments, AllReadAndExpand) {
  int count = 0;
  for (const fs::path& file : JsonFilesIn(kConfigs / "experiments")) {
    const FileKind kind = KindOfFile(file);
    if (kind == FileKind::kMap) {
      EXPECT_FALSE(ReadMapRules(file).groups.empty()) << file;
    }
    if (kind == FileKind::kClaims) {
      EXPECT_FALSE(ReadClaims(file).empty()) << file;
    }
    if (kind == FileKind::kClaims || kind == FileKind::kMap || kind == FileKind::kMechanism)
      continue;
    for (const Experiment& experiment : ReadExperiments(file)) {
      EXPECT_EQ(experiment.name, file.stem().string());
      EXPECT_FALSE(Expand(experiment).empty()) << file;
    }
    ++count;
  }
  EXPECT_GE(count, 4);
}

TEST(ShippedExperiments, PaperRunsEveryProblemColumnToleranceAndHorizon) {
  const Experiment paper = ReadExperiment(kConfigs / "experiments/paper/paper.json");
  const std::vector<Case> cases = Expand(paper);
  // Five problems have two horizons, five have one. Each runs 12 methods at 4 tolerances; short
  // runs also have 3 methods at level projection.
  EXPECT_EQ(paper.methods.size(), 15u);
  EXPECT_EQ(cases.size(), ((5u * 2u + 5u) * 12u + 10u * 3u) * 4u);
  const auto ensembles =
      std::count_if(cases.begin(), cases.end(), [](const Case& one) { return one.ensemble == 16; });
  // Long runs of five problems; the 6 plain methods; 3 tolerances.
  EXPECT_EQ(ensembles, 5 * 6 * 3);
  EXPECT_EQ(ExpandTiming(paper).size(), 10u * 15u);
}

TEST(ShippedExperiments, LevelsCrossesEveryFactorOnce) {
  const Experiment levels = ReadExperiment(kConfigs / "experiments/paper/levels.json");
  std::set<std::string> methods;
  for (const Method& method : levels.methods) methods.insert(ToString(method));
  EXPECT_EQ(methods.size(), 3u * 2u * 2u);
  EXPECT_EQ(Expand(levels).size(), 4u * 2u * 12u);
  EXPECT_TRUE(ExpandTiming(levels).empty());
}

TEST(Expand, KeepsTheOrderProblemHorizonColumnTolerance) {
  const Experiment paper = ReadExperiment(kConfigs / "experiments/paper/paper.json");
  const std::vector<Case> cases = Expand(paper);
  EXPECT_EQ(cases[0].mechanism, "square-four-bar");
  EXPECT_EQ(ToString(cases[0].method), "odca/acceleration/joint/plain");
  EXPECT_EQ(cases[1].rtol, 1e-8);
  EXPECT_EQ(ToString(cases[4].method), "odca/acceleration/joint/rank-revealing");
  EXPECT_EQ(cases[15 * 4].horizon, 100.0);
  EXPECT_EQ(cases[(15 + 12) * 4].problem, 1u);
  for (const Case& one : cases) {
    EXPECT_EQ(one.rtol, one.atol);
    EXPECT_EQ(one.limits.cpu_s, 10.0);
    EXPECT_EQ(one.integrator, "ode45");
  }
}

TEST(ExperimentReader, DefaultsAreTheRecommendedOnes) {
  const Experiment experiment = ParseExperiment(R"({
    "name": "small", "tolerances": 1e-8,
    "problems": [{"mechanism": "mechanisms/pendulum.json", "horizon": 10, "name": "p"}],
    "methods": {"formulation": "odca", "enforcement": "velocity"}})",
                                                kConfigs / "small.json");
  ASSERT_EQ(experiment.methods.size(), 1u);
  EXPECT_EQ(ToString(experiment.methods[0]), "odca/velocity/joint/rank-revealing");
  EXPECT_EQ(experiment.integrators, std::vector<std::string>{"ode45"});
  EXPECT_EQ(experiment.series_points, 200);
  EXPECT_EQ(experiment.problems[0].name, "p");
  EXPECT_EQ(experiment.timing.methods, experiment.methods);
  EXPECT_EQ(Expand(experiment)[0].ensemble, 1);
}

TEST(ExperimentReader, SavingsAreSwitchedOneByOne) {
  const auto read = [](const std::string& compile) {
    return ParseExperiment(R"({"name": "small", "tolerances": 1e-8, )" + compile + R"(
      "problems": [{"mechanism": "mechanisms/pendulum.json", "horizon": 10}],
      "methods": {"formulation": "odca", "enforcement": "velocity"}})",
                           kConfigs / "small.json")
        .compile;
  };
  const CompileOptions usual = read("");
  EXPECT_EQ(usual,
            (CompileOptions{.planar = true, .welds = true, .immovable = true, .islands = false}));
  EXPECT_EQ(read(R"("preprocess": {"welds": false, "islands": true},)"),
            (CompileOptions{.planar = true, .welds = false, .immovable = true, .islands = true}));
  EXPECT_EQ(read(R"("preprocess": {"planar": false, "immovable": false},)"),
            (CompileOptions{.planar = false, .welds = true, .immovable = false, .islands = false}));
  EXPECT_THROW(read(R"("preprocess": {"weld": false},)"), ConfigError);
  EXPECT_THROW(read(R"("preprocess": {"welds": 1},)"), ConfigError);
}

TEST(EnumNames, ParseReturnsWhatToStringWrote) {
  // The names of the reader and those of mechanism/ are written in two places.
  for (const auto value : {Coordinates::kJoint, Coordinates::kAbsolute}) {
    EXPECT_EQ(Parse<Coordinates>(ToString(value)), value);
  }
  for (const auto value : {Enforcement::kAcceleration, Enforcement::kVelocity}) {
    EXPECT_EQ(Parse<Enforcement>(ToString(value)), value);
  }
  for (const auto value : {SolverKind::kAsPublished, SolverKind::kRankRevealing}) {
    EXPECT_EQ(Parse<SolverKind>(ToString(value)), value);
  }
  EXPECT_EQ(Parse<SolverKind>("As-Published"), std::nullopt);
}

}  // namespace loopbench::harness::config_test
