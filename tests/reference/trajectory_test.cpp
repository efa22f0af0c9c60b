// Trajectories against closed forms and published numbers, and reactions against statics.
#include "harness/observers/trajectory.h"

#include "harness/observers/observer.h"
#include "mechanism/description/transforms.h"
#include "mechanism/start/assembly.h"
#include "tests/reference/cases.h"
#include "tests/reference/published_numbers.h"
#include "tests/reference/simulate.h"

namespace loopbench::harness::reference::trajectory_test {

const Method kOdcaJoint = {.formulation = "odca"};

/// A run's record and trajectory.
struct Written {
  Record record;
  Trajectory rows;
  std::filesystem::path path;

  double At(std::size_t row, const std::string& kind, const std::string& name,
            const std::string& component) const {
    const auto column = FindColumn(rows.columns, kind, name, component);
    if (!column) throw std::invalid_argument("no column " + kind + ":" + name + ":" + component);
    return rows.At(row, *column);
  }
  double Time(std::size_t row) const { return rows.Time(row); }
  double Energy(std::size_t row) const {
    return At(row, "energy", "", "kinetic") + At(row, "energy", "", "potential");
  }
};

Written WriteTrajectory(const MechanismFile& mechanism, const Method& method,
                        const std::string& integrator, double tolerance, double horizon,
                        const OutputOptions& output, const CompileOptions& compile = {},
                        double step = 0.0) {
  Experiment experiment = Single(mechanism);
  experiment.output = output;
  experiment.compile = compile;
  Case one = CaseOf(experiment, mechanism.description.name, method, tolerance, horizon);
  one.integrator = integrator;
  one.step = step;
  Written written;
  static const TemporaryFolder folder("loopbench-trajectory-test");
  written.path = folder.path() / "motion.csv";
  written.record = RunCase(experiment, one, nullptr, written.path);
  EXPECT_EQ(written.record.Text("outcome"), "finished") << written.record.Text("message");
  written.rows = ReadTrajectory(written.path);
  EXPECT_EQ(static_cast<double>(written.rows.rows()), written.record.Number("trajectory_rows"));
  return written;
}

OutputOptions Times(std::vector<double> times, bool exact = false) {
  return {.times = std::move(times), .exact = exact};
}
OutputOptions Rows(int number) { return {.number = number, .times = {}}; }

/// Returns the allowed error: the tolerance for each step of a stable motion, and the error of
/// interpolation, estimated by the difference of its two degrees.
double BoundOf(const Written& run, double tolerance) {
  const double steps = run.record.Number("steps") * tolerance;
  const double dense = run.record.Number("trajectory_interpolation_max");
  return steps + (std::isnan(dense) ? 0.0 : dense);
}

double Apart(double a, double b) { return std::abs(std::remainder(a - b, 2 * kPi)); }

TEST(Trajectory, OfA01IsTheEllipticFunctionAndItsPinForce) {
  const MechanismFile pendulum = Shipped("simple-pendulum");
  for (const bool exact : {false, true}) {
    OutputOptions output = Times({0.0, 0.3, 0.5, 1.0, 1.5, 7.77, 10.0}, exact);
    const Written run = WriteTrajectory(pendulum, kOdcaJoint, "ode45", 1e-11, 10.0, output);
    ASSERT_EQ(run.rows.rows(), 7u);
    const double bound = BoundOf(run, 1e-11);
    double worst = 0.0, worst_force = 0.0;
    for (std::size_t row = 0; row < 7; ++row) {
      const double t = run.Time(row);
      // theta from hanging down; (-1, 0) is at -pi/2 of it
      const double theta = PendulumAngle(9.81, -kPi / 2, 0.0, t);
      worst = std::max(worst, Apart(run.At(row, "joint", "O", "angle"), theta - kPi / 2));
      EXPECT_NEAR(run.At(row, "body", "bob", "x"), 0.0, bound);
      const double w = run.At(row, "joint", "O", "angle speed");
      // energy: w^2 / 2 = 9.81 (cos theta - cos theta_0)
      EXPECT_NEAR(w * w, 2 * 9.81 * std::cos(theta), 20 * bound);
      // 1 kg at 0.5 m: F = m (a - g), a = r theta'' across the rod and - r theta'^2 along it
      const double along_x = std::sin(theta), along_y = -std::cos(theta);
      const double angular = -9.81 * std::sin(theta), square = 2 * 9.81 * std::cos(theta);
      const double fx = 0.5 * (-angular * along_y - square * along_x);
      const double fy = 0.5 * (angular * along_x - square * along_y) + 9.81;
      worst_force = std::max({worst_force, std::abs(run.At(row, "reaction", "O", "fx") - fx),
                              std::abs(run.At(row, "reaction", "O", "fy") - fy)});
      EXPECT_NEAR(run.At(row, "reaction", "O", "mz"), 0.0, 100 * kEps);  // a pin has none
      EXPECT_NEAR(run.Energy(row), 0.0, 20 * bound);
    }
    EXPECT_LE(worst, bound);
    EXPECT_LE(worst_force, 30 * bound);  // forces change by some 30 N/rad
    std::cout << (exact ? "exact " : "dense ") << worst << " rad, pin force " << worst_force
              << " N of " << bound << '\n';
    for (const PathPoint& point : kA01Published) {
      for (std::size_t row = 0; row < 7; ++row) {
        if (run.Time(row) != point.t) continue;
        EXPECT_NEAR(run.At(row, "point", "bob:B", "x"), point.x, 0.5e-6 + bound);  // six digits
      }
    }
    EXPECT_EQ(run.record.Text("trajectory_output"), exact ? "exact times" : "dense output");
  }
}

TEST(Trajectory, OfTheSliderCrankIsThatOfSundials) {
  std::vector<double> times;
  for (const SliderCrankState& state : kSliderCrankVerified) times.push_back(state.t);
  for (const Method& method : PositionMethods()) {
    const Written run =
        WriteTrajectory(Shipped("slider-crank"), method, "ode45", 1e-11, 10.0, Times(times));
    const double bound = BoundOf(run, 1e-11);
    for (std::size_t row = 0; row < times.size(); ++row) {
      const SliderCrankState& exact = kSliderCrankVerified[row];
      EXPECT_LE(Apart(run.At(row, "body", "crank", "angle"), exact.q), bound) << exact.t;
      EXPECT_NEAR(run.At(row, "body", "rod", "x"), exact.x, bound) << exact.t;
      EXPECT_LE(Apart(run.At(row, "body", "rod", "angle"), exact.p), bound) << exact.t;
    }
    EXPECT_NEAR(run.At(times.size() - 1, "body", "crank", "w"), kSliderCrankSpeedVerified, bound);
  }
}

TEST(Trajectory, OfAndrewsSqueezerIsThatOfTheTestSet) {
  // t = 0.03 s lies between two steps of a run to 0.0301 s
  const Written run = WriteTrajectory(Shipped("andrews-squeezer"), kOdcaJoint, "fehlberg-78", 1e-13,
                                      0.0301, Times({0.03}));
  const auto angle = [&](const char* body) { return run.At(0, "body", body, "angle"); };
  const auto rate = [&](const char* body) { return run.At(0, "body", body, "w"); };
  const std::array<double, 7> q = {
      angle("K1"), angle("K2") - angle("K1"), angle("K3"), angle("K4") - angle("K5"),
      angle("K5"), angle("K6") - angle("K7"), angle("K7")};
  double worst = 0.0;
  for (std::size_t i = 0; i < q.size(); ++i) {
    worst = std::max(worst, Apart(q[i], kA03Verified.q[i]));
  }
  // Steps of order 8 are long for an interpolant of order 6: positions in a mechanism of 0.1 m are
  // off by what the degrees differ by, and angles by that over the shortest arm, 7 mm.
  const double interpolation = run.record.Number("trajectory_interpolation_max");
  EXPECT_LE(worst, 1e-9 + interpolation / 7e-3);
  EXPECT_NEAR(rate("K1") / kA03Published.v[0], 1.0, 2e-7 + interpolation / 7e-3);
  std::cout << "angles " << worst << " rad, degrees apart " << interpolation << " m\n";
  const Written exact = WriteTrajectory(Shipped("andrews-squeezer"), kOdcaJoint, "fehlberg-78",
                                        1e-13, 0.0301, Times({0.03}, true));
  EXPECT_LE(Apart(exact.At(0, "body", "K1", "angle"), kA03Verified.q[0]), 1e-9);
}

TEST(Trajectory, ErrorOfDenseOutputIsOfOrderSix) {
  // Steps of order 8 leave nothing to see at their ends, so rows between them have the error of
  // dense output alone.
  const MechanismFile pendulum = Shipped("simple-pendulum");
  std::vector<double> errors;
  for (const double step : {0.1, 0.05, 0.025}) {
    const Written run =
        WriteTrajectory(pendulum, kOdcaJoint, "fehlberg-78", 1e-8, 4.0, Rows(4001), {}, step);
    double worst = 0.0;
    for (std::size_t row = 0; row < run.rows.rows(); ++row) {
      const double theta = PendulumAngle(9.81, -kPi / 2, 0.0, run.Time(row));
      worst = std::max(worst, Apart(run.At(row, "joint", "O", "angle"), theta - kPi / 2));
    }
    errors.push_back(worst);
    std::cout << step << " s: " << worst << " rad\n";
  }
  // 2^6 = 64, and what higher terms do to steps of a thirtieth of a period
  EXPECT_NEAR(errors[0] / errors[1], 64, 20);
  EXPECT_NEAR(errors[1] / errors[2], 64, 12);
}

/// In space a pose gives an angle within half a turn only; springs and torques follow full turns.
TEST(Trajectory, ForcesInSpaceFollowFullTurns) {
  const MechanismFile mechanism = ParseMechanism(TestData("wound.json"), "wound.json");
  constexpr double kTolerance = 1e-9;
  CompileOptions spatial;
  spatial.planar = false;
  for (const Coordinates set : {Coordinates::kJoint, Coordinates::kAbsolute}) {
    Method method = kOdcaJoint;
    method.coordinates = set;
    // the rows are up to 3 rad apart
    const Written run =
        WriteTrajectory(mechanism, method, "ode45", kTolerance, 2.0, Rows(3), spatial);
    for (std::size_t row = 0; row < run.rows.rows(); ++row) {
      const double angle = run.At(row, "joint", "A", "angle");
      const double bound = 100.0 * BoundOf(run, kTolerance);
      EXPECT_NEAR(run.Energy(row), run.Energy(0), bound);
      EXPECT_NEAR(run.At(row, "energy", "", "potential"), 0.05 * angle * angle - 0.2 * angle,
                  bound);
    }
    EXPECT_GT(run.At(run.rows.rows() - 1, "joint", "A", "angle"), 2.0 * kPi);
  }
}

/// An angle that begins beyond half a turn.
constexpr const char* kDrivenScrew = R"({"name": "driven", "space": "spatial",
  "gravity": [0, 0, -9.81], "bodies": [
  {"name": "a", "mass": 1, "inertia": [0.1, 0.1, 0.1]}],
  "joints": [{"name": "C", "type": "cylindrical", "from": {"body": "ground"}, "to": {"body": "a"},
    "motion": [{"coordinate": 0,
      "value": {"type": "polynomial", "coefficients": [4.0, 9.0]}}]}]})";

TEST(Trajectory, AnglesOfJointsWithSeveralCoordinatesBeginAtTheirGuesses) {
  for (const Coordinates coordinates : {Coordinates::kJoint, Coordinates::kAbsolute}) {
    const Method method{.formulation = "odca", .coordinates = coordinates};
    // a cut slot whose angle, as the difference of angles of bodies, is 8.21
    const MechanismFile mechanism = ParseMechanism(TestData("slot.json"), "slot.json");
    const Written slot = WriteTrajectory(mechanism, method, "ode45", 1e-8, 0.2, Rows(3));
    const double turn = std::remainder(slot.At(0, "joint", "L", "angle") - 0.2168, 2 * kPi);
    EXPECT_EQ(slot.At(0, "joint", "L", "angle"), 0.2168 + turn);
    EXPECT_NEAR(slot.At(1, "joint", "L", "angle"), slot.At(0, "joint", "L", "angle"), kPi)
        << "no turn is added in a tenth of a second from rest";
    const Written screw = WriteTrajectory(ParseMechanism(kDrivenScrew, "driven.json"), method,
                                          "ode45", 1e-8, 1.0, Rows(3));
    for (std::size_t row = 0; row < 3; ++row) {
      EXPECT_EQ(screw.At(row, "joint", "C", "angle"), 4.0 + 9.0 * screw.Time(row));
    }
  }
}

TEST(Trajectory, LeavesTheRunAsItIs) {
  // the parallelogram passes singular positions, near which rows see regularized constraints too
  for (const char* name : {"four-bar", "parallelogram", "driven-four-bar", "bennett"}) {
    const bool passes = std::string(name) == "parallelogram";
    const double horizon = passes ? 3.0 : 0.9;
    const MechanismFile mechanism = Shipped(name);
    std::vector<Method> methods = RankRevealingMethods();
    methods.insert(methods.end(), PositionMethods().begin(), PositionMethods().end());
    for (const Method& method : methods) {
      Experiment experiment = Single(mechanism);
      const Case one = CaseOf(experiment, mechanism.description.name, method, 1e-7, horizon);
      const Record alone = RunCase(experiment, one);
      const Written run = WriteTrajectory(mechanism, method, one.integrator, 1e-7, horizon,
                                          Rows(passes ? 3001 : 97));
      for (const char* key :
           {"state_hash", "steps", "rejected", "rhs_evaluations", "restarts", "drift_position_max",
            "energy_error_max", "regularized_evaluations"}) {
        EXPECT_EQ(alone.Text(key), run.record.Text(key)) << name << ' ' << ToString(method) << key;
      }
    }
  }
}

/// O (0, 0), A (1, 2), B (2, 2), C (3, 0), at rest, the crank held where it is by a drive.
MechanismFile HeldFourBar() { return ParseMechanism(TestData("held-four-bar.json"), "held.json"); }

TEST(Reactions, OfAStaticFourBarAreThoseOfStatics) {
  const double g = 10, m1 = 2, m2 = 3, m3 = 5;
  // of the follower on the coupler: moments about A of the coupler, about C of the follower
  const double by = m2 * g / 2, bx = -(by + m3 * g / 2) / 2;
  const double ax = -bx, ay = m2 * g - by;  // of the crank on the coupler
  const double moment = ay - 2 * ax + m1 * g / 2;
  for (const Method& method : RankRevealingMethods()) {
    const Written run = WriteTrajectory(HeldFourBar(), method, "ode45", 1e-9, 1.0, Rows(3));
    for (std::size_t row = 0; row < 3; ++row) {
      // assembled to 1e-15 of some metres; loads of 100 N, condition below 10
      const double bound = 1000 * 100 * kEps;
      EXPECT_NEAR(run.At(row, "reaction", "A", "fx"), ax, bound) << ToString(method);
      EXPECT_NEAR(run.At(row, "reaction", "A", "fy"), ay, bound);
      EXPECT_NEAR(run.At(row, "reaction", "B", "fx"), -bx, bound);  // on the follower
      EXPECT_NEAR(run.At(row, "reaction", "B", "fy"), -by, bound);
      EXPECT_NEAR(run.At(row, "reaction", "O", "fx"), ax, bound);
      EXPECT_NEAR(run.At(row, "reaction", "O", "fy"), ay + m1 * g, bound);
      EXPECT_NEAR(run.At(row, "reaction", "O", "mz"), 0.0, bound);  // that is the drive's
      EXPECT_NEAR(run.At(row, "drive", "O", "angle"), moment, bound);
    }
  }
}

TEST(Reactions, OfGearsAreThoseOfTheirTorques) {
  // I1 a1 = T + 40 mu, I2 a2 = 20 mu, 40 a1 + 20 a2 = 0
  const double I1 = 0.4, I2 = 0.03, T = 5.0, effort = -2 * I2 * T / (I1 + 4 * I2);
  const MechanismFile gears = ParseMechanism(TestData("gears.json"), "gears.json");
  for (const Method& method : RankRevealingMethods()) {
    const Written run = WriteTrajectory(gears, method, "ode45", 1e-9, 1.0, Rows(3));
    for (std::size_t row = 0; row < 3; ++row) {
      const double bound = 1000 * T * kEps;  // two bodies, condition below 10
      EXPECT_NEAR(run.At(row, "coupling", "mesh:Q", "effort"), effort, bound) << ToString(method);
      EXPECT_NEAR(run.At(row, "coupling", "mesh:P", "effort"), 2 * effort, bound);
    }
  }
}

/// Wrenches of all joints on their second bodies by a formulation's multipliers.
template <class Space>
void ExpectMultipliers(const MechanismDescription& description, const std::string& formulation) {
  const Mechanism<Space, double> mechanism(description, Coordinates::kAbsolute);
  const auto start = Assemble<Space>(description, mechanism);
  ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
  const auto system = MakeFormulation<Space>(
      {.formulation = formulation, .coordinates = Coordinates::kAbsolute}, mechanism);
  ASSERT_EQ(system->Start(0.0, start.q, start.u), Outcome::kFinished);
  VectorX<double> udot(mechanism.num_u());
  ASSERT_EQ(system->Evaluate(0.0, start.q, start.u, udot), Outcome::kFinished);
  const VectorX<double>& lambda = system->Multipliers();
  const Kinematics<Space, double>& kinematics = system->kinematics();
  TreeDynamics<Space, double> dynamics(mechanism);
  std::vector<Acceleration<Space, double>> A(mechanism.num_bodies());
  std::vector<Wrench<Space, double>> applied(A.size());
  dynamics.BodyAccelerations(kinematics, udot, A);
  AppliedForces<Space, double>(kinematics, applied);

  const Compiled compiled = Compile(description, CompileOptions::None());
  RunSample start_row{.bodies = AtRest(compiled),
                      .followed = std::vector(description.joints.size(), std::nan(""))};
  EnterPart<Space>(compiled, 0, kinematics, A, &start_row.bodies);
  const OutputOptions output{.times = {}, .quantities = {OutputPart::kReactions}};
  const auto rows = MakeRowWriter(description, output);
  std::vector<double> row;
  rows->Write(start_row, &row);
  double load = 1.0, worst = 0.0;
  for (const auto& wrench : applied) load = std::max(load, wrench.norm());
  for (const int j : mechanism.constraints()) {
    const auto& joint = mechanism.joints()[j];
    const auto& state = kinematics.joints()[j];
    Wrench<Space, double> expected = Wrench<Space, double>::Zero();
    for (int i = joint.num_drives; i < joint.num_constraints(); ++i) {
      expected += state.D(i) * lambda[joint.row + i];
    }
    load = std::max(load, expected.norm());
    // force first, in a row
    const auto first =
        FindColumn(rows->columns(), "reaction", LabelName(mechanism.joint_names()[j]), "fx");
    ASSERT_TRUE(first);
    for (int i = 0; i < Space::kDim; ++i) {
      const double found = row[*first + static_cast<std::size_t>(i)];
      const double sought =
          i < Space::kLin ? expected.linear[i] : expected.angular[i - Space::kLin];
      ASSERT_FALSE(std::isnan(found)) << mechanism.joint_names()[j];
      worst = std::max(worst, std::abs(found - sought));
    }
  }
  // both solve equations whose condition is some thousand here
  EXPECT_LE(worst, 1e5 * kEps * load) << formulation << ' ' << description.name;
}

TEST(Reactions, AreTheMultipliersOfAllFormulations) {
  for (const std::string formulation : {"odca", "lagrange", "reduction"}) {
    for (const char* name : {"four-bar", "slider-crank", "driven-four-bar", "andrews-squeezer",
                             "general-seven-bar", "elastic-crank"}) {
      ExpectMultipliers<Planar>(Shipped(name).description, formulation);
    }
    for (const char* name : {"double-wishbone", "stewart-platform", "spatial-four-bar"}) {
      ExpectMultipliers<Spatial>(Shipped(name).description, formulation);
    }
  }
}

TEST(Reactions, AreOpenWhereConstraintsAreRedundant) {
  // the plane determines forces in it; a loop of parallel pins in space has three directions too
  // many
  const Written flat =
      WriteTrajectory(Shipped("four-bar"), kOdcaJoint, "ode45", 1e-9, 1.0, Rows(5));
  EXPECT_FALSE(flat.record.Find("trajectory_open"));
  for (const bool planar : {true, false}) {
    CompileOptions compile;
    compile.planar = planar;
    const Written run = WriteTrajectory(Shipped("four-bar-in-space"), kOdcaJoint, "ode45", 1e-9,
                                        1.0, Rows(5), compile);
    EXPECT_GT(run.record.Number("trajectory_open"), 0.0);
  }
  // the same loop in the plane of x and y, as a spatial mechanism
  MechanismFile turned = Shipped("four-bar");
  turned.description = InSpace(turned.description, Eigen::Vector3d::Zero());
  CompileOptions whole = CompileOptions::None();
  for (const CompileOptions& compile : {CompileOptions(), whole}) {
    const Written run = WriteTrajectory(turned, kOdcaJoint, "ode45", 1e-9, 1.0, Rows(5), compile);
    for (std::size_t row = 0; row < 5; ++row) {
      for (const char* joint : {"OA", "AB", "BC", "OC"}) {
        for (const char* known : {"fx", "fy"}) {
          EXPECT_NEAR(run.At(row, "reaction", joint, known), flat.At(row, "reaction", joint, known),
                      1e-6)
              << joint;  // other sums and steps, at 1e-9, of some 100 N
        }
        for (const char* open : {"fz", "mx", "my"}) {
          EXPECT_TRUE(std::isnan(run.At(row, "reaction", joint, open))) << joint << open;
        }
        EXPECT_NEAR(run.At(row, "reaction", joint, "mz"), 0.0, 1e-6);
      }
    }
    EXPECT_NE(ReadFile(run.path).find("# nan, because redundant constraints"), std::string::npos);
  }
}

// A driven parallelogram of bars of 1, 2 and 1 m and 1 kg each, flat at 0.5 s: at a constant speed
// the drive carries the weight alone, 2 m 9.81 cos(angle).
// Rows that are regularized everywhere make no singular configuration.
TEST(Reactions, OfDrivesAreThereIfRedundantConstraintsAreKept) {
  const MechanismFile file = ParseMechanism(TestData("driven-sarrus.json"), "driven-sarrus.json");
  for (const Method& method : PositionMethods()) {
    CompileOptions compile;
    const auto open = [&] {
      return WriteTrajectory(file, method, "ode45", 1e-8, 1.0, Rows(5), compile)
          .record.Number("trajectory_open");
    };
    const double omitted = open();
    compile.redundancy = false;
    EXPECT_EQ(open(), omitted) << ToString(method);
  }
}

TEST(Reactions, OfDrivesAreRightOrMissingAtSingularPositions) {
  const MechanismFile file = ParseMechanism(R"({
    "name": "driven", "space": "planar", "gravity": [0, -9.81],
    "bodies": [{"name": "crank", "mass": 1, "inertia": 0.1, "com": [0.5, 0]},
               {"name": "rod", "mass": 1, "inertia": 0.3, "com": [1, 0]},
               {"name": "rocker", "mass": 1, "inertia": 0.1, "com": [0.5, 0]}],
    "joints": [
      {"name": "A", "type": "revolute", "from": {"body": "ground"}, "to": {"body": "crank"},
       "motion": {"type": "polynomial", "coefficients": [-1, 2]}},
      {"name": "B", "type": "revolute", "from": {"body": "crank", "at": [1, 0]}, "to": {"body": "rod"}},
      {"name": "C", "type": "revolute", "from": {"body": "ground", "at": [2, 0]},
       "to": {"body": "rocker"}},
      {"name": "D", "type": "revolute", "from": {"body": "rod", "at": [2, 0]},
       "to": {"body": "rocker", "at": [1, 0]}}],
    "initial": {"coordinates": {"B": 1, "C": -1}}})",
                                            "driven.json");
  std::vector<double> times = {0.2, 0.4, 0.498};
  for (const double off : {-1e-3, -1e-4, -1e-5, -1e-7, 0.0, 1e-8, 1e-6, 1e-5, 1e-4, 1e-3, 2e-3}) {
    times.push_back(0.5 + off);
  }
  for (const double t : {0.6, 1.0, 1.5}) times.push_back(t);
  for (const Method& method : PositionMethods()) {
    const Written run = WriteTrajectory(file, method, "ode45", 1e-9, 2.0, Times(times, true));
    int missing = 0;
    for (std::size_t row = 0; row < times.size(); ++row) {
      const double effort = run.At(row, "drive", "A", "angle"), t = run.Time(row);
      missing += std::isnan(effort);
      if (std::isnan(effort)) {
        EXPECT_LE(std::abs(t - 0.5), 1.5e-3) << ToString(method);
        continue;
      }
      EXPECT_NEAR(effort, 2 * 9.81 * std::cos(2 * t - 1), 1e-3) << t << ToString(method);
    }
    EXPECT_GE(missing, 5) << ToString(method);
    EXPECT_EQ(run.record.Number("trajectory_open"), 13.0 * missing);  // four joints and the drive
    EXPECT_NE(ReadFile(run.path).find("constraints of a driven mechanism are regularized"),
              std::string::npos);
    EXPECT_EQ(ReadFile(run.path).find("share a load in no one way"), std::string::npos);
  }
}

TEST(Reactions, OfMergedBodiesAreKnown) {
  // the run has one body where the user has two: their weld bears what statics says
  const Written merged =
      WriteTrajectory(Shipped("welded-four-bar"), kOdcaJoint, "ode45", 1e-10, 0.5, Rows(4));
  EXPECT_NE(merged.record.Text("preprocessed").find("welds"), std::string::npos);
  const Written whole = WriteTrajectory(Shipped("welded-four-bar"), kOdcaJoint, "ode45", 1e-10, 0.5,
                                        Rows(4), CompileOptions::None());
  ASSERT_EQ(merged.rows.columns, whole.rows.columns);
  int welds = 0;
  for (std::size_t i = 0; i < merged.rows.columns.size(); ++i) {
    const TrajectoryColumn& column = merged.rows.columns[i];
    for (std::size_t row = 0; row < 4; ++row) {
      const double a = merged.rows.At(row, i), b = whole.rows.At(row, i);
      EXPECT_EQ(std::isnan(a), std::isnan(b)) << column.Label();
      if (!std::isnan(a)) {
        EXPECT_NEAR(a, b, 1e-6) << column.Label() << row;
      }
    }
    welds += column.kind == "reaction";
  }
  EXPECT_GT(welds, 0);
}

}  // namespace loopbench::harness::reference::trajectory_test
