// Couplings over whole runs: energy, turns without end, drift by level.
#include "harness/judge/analysis.h"
#include "mechanism/description/library.h"
#include "mechanism/description/transforms.h"
#include "tests/reference/cases.h"
#include "tests/reference/simulate.h"

namespace loopbench::harness::reference::couplings_test {

constexpr double kTurn = 2 * kPi;

TEST(Couplings, ConserveEnergyFor100Seconds) {
  const MechanismDescription description = Shipped("geared-five-bar").description;
  const int left = BodyNamed(description, "left-crank"),
            right = BodyNamed(description, "right-crank");
  for (const Method& method : PositionMethods()) {
    double worst = 0.0, size = 0.0;
    const Simulation run = Simulate(
        description, method, Options("dormand-prince", 1e-9), 100.0, [&](const Snapshot& at) {
          const double open =
              std::remainder(2 * AngleOf(at.bodies[left]) + AngleOf(at.bodies[right]), kTurn);
          worst = std::max(worst, std::abs(open));
          size = std::max(size, at.kinetic);
        });
    ASSERT_EQ(run.result.outcome, Outcome::kFinished) << ToString(method) << run.result.message;
    EXPECT_LE(run.energy_error, 1e-6 * size) << ToString(method);
    // angles of about 600 rad are round to 1e-13, of which the relation takes some
    EXPECT_LE(worst, 2e-12) << ToString(method);
  }
}

/// Along x of Ground.
JointDescription Slide(const std::string& name, int body) {
  JointDescription slide;
  slide.name = name;
  slide.type = JointType::kPrismatic;
  slide.to.body = body;
  return slide;
}

/// A disc turns a smaller one 20 times as fast, and rolls along a rack, which counts its turns.
MechanismDescription GearsAndRack() {
  MechanismDescription d;
  d.name = "gears-and-rack";
  for (const auto& [name, mass, inertia] :
       {std::tuple{"slow", 3.0, 0.4}, {"fast", 1.0, 0.001}, {"rack", 2.0, 0.1}}) {
    BodyDescription body;
    body.name = name;
    body.mass = mass;
    body.inertia = inertia * Eigen::Matrix3d::Identity();
    d.bodies.push_back(body);
  }
  d.joints.push_back(Revolute("slow", 0, {0.0, 0.0, 0.0}, 1, Eigen::Vector3d::Zero()));
  d.joints.push_back(Revolute("fast", 0, {0.6, 0.1, 0.0}, 2, Eigen::Vector3d::Zero()));
  d.joints.push_back(Slide("rack", 3));
  d.couplings.push_back({"mesh", {{0, 20.0}, {1, 1.0}}, 0.0});
  d.couplings.push_back({"rack", {{2, 1.0}, {0, -0.05}}, 0.0});
  d.initial.coordinates.push_back({0, {3.0}});  // near the end of a measured turn
  d.initial.held.push_back(0);
  d.initial.speeds.push_back({0, {kTurn}});
  return d;
}

TEST(Couplings, TurnWithoutEndInAbsoluteCoordinatesOfSpace) {
  const MechanismDescription description = InSpace(GearsAndRack(), AnyTurn());
  constexpr double kTurns = 10.0;  // one in a second
  const Eigen::Matrix3d R = AnyRotation();
  for (const Method& method : MethodsAt({Enforcement::kAcceleration, Enforcement::kVelocity,
                                         Enforcement::kPosition, Enforcement::kBaumgarte},
                                        {Coordinates::kAbsolute})) {
    const Simulation run = Simulate(description, method, Options("dormand-prince", 1e-7), kTurns);
    ASSERT_EQ(run.result.outcome, Outcome::kFinished) << ToString(method);
    const auto angle = [&](int body) {
      const Eigen::Matrix3d turned = R.transpose() * run.last.bodies[body].R;
      return std::atan2(turned(1, 0), turned(0, 0));
    };
    const double s = (R.transpose() * run.last.bodies[3].p).x(),
                 turns = (s - 0.15) / (kTurn * 0.05);
    const double rack = std::remainder(s / 0.05 - angle(1), kTurn);
    const double mesh = std::remainder(20 * angle(1) + angle(2), kTurn);
    EXPECT_NEAR(turns, kTurns, 1e-3) << ToString(method);
    // 200 turns of the small disc: 1260 rad, round to 2e-13
    const double most = method.enforcement == Enforcement::kPosition ? 1e-10 : 2e-2;
    EXPECT_NEAR(rack, 0.0, most) << ToString(method);
    EXPECT_NEAR(mesh, 0.0, most) << ToString(method);
  }
}

/// A slider-crank whose slider drives a pinion. The slide closes the loop: its shift is measured.
MechanismFile SliderWithPinion() {
  MechanismDescription d;
  d.name = "slider-with-pinion";
  d.bodies.push_back(Bar("crank", 0.1, 1.0, 0.001));
  d.bodies.push_back(Bar("rod", 0.3, 0.5, 0.004));
  d.bodies.push_back(Bar("slider", 0.1, 0.4, 0.001));
  d.bodies.push_back(Bar("pinion", 0.1, 0.3, 0.0002));
  d.bodies.back().com.setZero();
  d.joints.push_back(Revolute("A", 0, {0, 0, 0}, 1, {0, 0, 0}));
  d.joints.push_back(Revolute("B", 1, {0.1, 0, 0}, 2, {0, 0, 0}));
  d.joints.push_back(Revolute("C", 2, {0.3, 0, 0}, 3, {0, 0, 0}));
  d.joints.push_back(Revolute("P", 0, {0.3, -0.05, 0}, 4, {0, 0, 0}));
  d.joints.push_back(Slide("slide", 3));
  d.joints.back().cut = true;
  d.couplings.push_back({"rack", {{4, 1.0}, {3, -0.05}}, 0.3});
  d.initial.coordinates = {{0, {1.0}}, {1, {-1.3}}, {2, {0.3}}};
  d.initial.held = {0};
  d.initial.speeds = {{0, {10.0}}};
  MechanismFile file;
  file.description = d;
  return file;
}

TEST(Couplings, DriftAsOtherConstraintsDo) {
  const auto drift = [](const std::string& formulation, Enforcement level, double horizon) {
    const Method method{.formulation = formulation, .enforcement = level};
    const Record record = RunFile(SliderWithPinion(), method, 1e-8, horizon);
    EXPECT_EQ(record.Text("outcome"), "finished") << record.Text("message");
    return record.Number("drift.loop.rack");
  };
  for (const std::string formulation : {"odca", "lagrange", "reduction"}) {
    const double square = drift(formulation, Enforcement::kAcceleration, 40.0) /
                          drift(formulation, Enforcement::kAcceleration, 10.0),
                 linear = drift(formulation, Enforcement::kVelocity, 40.0) /
                          drift(formulation, Enforcement::kVelocity, 10.0),
                 none = drift(formulation, Enforcement::kPosition, 40.0);
    // 4^p over the quadruple time
    EXPECT_NEAR(std::log(square) / std::log(4.0), 2.0, 0.3);
    EXPECT_NEAR(std::log(linear) / std::log(4.0), 1.0, 0.5);
    EXPECT_LE(none, 1e-14);
  }
}

/// Crank and rod of one length, the rod's end on a slide: a gear of 2:1 between them changes no
/// motion, but at 90 degrees the loop alone would let the rod stay at the crank's pivot. The rod's
/// mass is at the crank's end, so that the crank moves as a pendulum; or `motion` drives it.
MechanismFile CardanCircles(const std::string& motion) {
  const bool is_driven = !motion.empty();
  // 9.81 (0.25 + 0.8 * 0.5) over the moment of inertia about the pivot
  const std::string solution = fmt::format(
      R"("closed_form": {{"type": "pendulum", "body": "crank", "down_angle": {:.17g},
                        "frequency_squared": {:.17g}}},)",
      -kPi / 2, 9.81 * 0.65 / (0.05 + 0.0625 + 0.8 * 0.25 + 0.04));
  return ParseMechanism(fmt::format(R"({{
    "name": "cardan-circles", "space": "planar", "gravity": [0, -9.81],
    "bodies": [{{"name": "crank", "mass": 1, "inertia": 0.05, "com": [0.25, 0],
                "points": {{"A": [0.5, 0]}}}},
               {{"name": "rod", "mass": 0.8, "inertia": 0.04, "points": {{"B": [0.5, 0]}}}}],
    "joints": [
      {{"name": "O", "type": "revolute", "from": {{"body": "ground"}}, "to": {{"body": "crank"}}{}}},
      {{"name": "A", "type": "revolute", "from": {{"body": "crank", "at": "A"}},
       "to": {{"body": "rod"}}}},
      {{"name": "S", "type": "pin-in-slot", "from": {{"body": "ground"}},
       "to": {{"body": "rod", "at": "B"}}}}],
    "couplings": [{{"name": "gear", "coefficients": {{"O": 2, "A": 1}}}}],
    "initial": {{{} "coordinates": {{{} "A": -0.8}}}},
    "known_solution": {{{} "branch": [{{"crank": 1, "rod": 1}}], "length": 0.5}}}})",
                                    motion, is_driven ? "" : R"("speeds": {"O": 9},)",
                                    is_driven ? "" : R"("O": 0.4,)", is_driven ? "" : solution),
                        "cardan-circles.json");
}

/// Runs the mechanism for 2 s by every formulation, level and coordinate set: it stays on its
/// branch, with errors of some 200 steps, and nothing is regularized. Then `check(record)`.
template <class Check>
void ExpectRegular(const MechanismFile& file, double tolerance, const Check& check) {
  for (const Method& method :
       MethodsAt({Enforcement::kAcceleration, Enforcement::kVelocity, Enforcement::kPosition})) {
    SCOPED_TRACE(ToString(method));
    const Record record = RunFile(file, method, tolerance, 2.0);
    ASSERT_EQ(record.Text("outcome"), "finished");
    EXPECT_EQ(record.Number("regularized_evaluations"), 0.0);
    EXPECT_LT(record.Number("branch_error_max"), 1e3 * tolerance);
    check(record);
  }
}

TEST(Couplings, ThatFollowFromLoopsKeepTheBranchAtSingularPositions) {
  constexpr double kTolerance = 1e-9;
  ExpectRegular(CardanCircles(""), kTolerance, [](const Record& record) {
    // a pendulum above its pivot multiplies errors by e in 0.24 s
    EXPECT_LT(record.Number("closed_form_error_max"), 1e3 * kTolerance);
  });
  ExpectRegular(CardanCircles(R"(, "motion": {"type": "polynomial", "coefficients": [0.4, 9]})"),
                kTolerance, [](const Record&) {});
}

/// Two parallelograms one after the other, each flat where the other is not, and a coupling of the
/// first crank with the last one: rows move between the loops. The middle crank has two arms.
TEST(Couplings, ThatFollowFromTwoLoopsLetRowsMoveBetweenThem) {
  const MechanismFile file =
      ParseMechanism(TestData("two-parallelograms.json"), "two-parallelograms.json");
  constexpr double kTolerance = 1e-9;
  ExpectRegular(file, kTolerance, [](const Record& record) {
    EXPECT_LT(record.Number("energy_error_relative"), 1e3 * kTolerance);
  });
}

// A planet on the coupler of a parallelogram, and one on each end of it: without gravity all speeds
// are constant, S = 2 O. Rows of couplings follow from the loop or from each other.
TEST(Couplings, PlanetsOnAClosedLoopTurnTheirSunsTwiceAsFast) {
  for (const char* extra : {"", R"(, {"name": "again", "coefficients": {"S": 1, "O": -1, "B": 1}})",
                            R"(, {"name": "suns", "coefficients": {"S": 1, "S2": -1}})"}) {
    std::string text = TestData("planets.json");
    text.insert(text.find("],\n  \"initial\""), extra);
    const MechanismFile file = ParseMechanism(text, "planets.json");
    const double t = 4.0;  // the loop is flat at 1.2 s and 2.8 s
    for (const Method& method : MethodsAt({Enforcement::kVelocity, Enforcement::kPosition})) {
      const Record record = RunFile(file, method, 1e-9, t);
      const double missed = std::hypot(
          std::remainder(record.Numbers("series.final.sun").back() - 1.4 - 4 * t, kTurn),
          std::remainder(record.Numbers("series.final.sun2").back() - 1.4 - 4 * t, kTurn));
      if (method.enforcement == Enforcement::kPosition) {
        EXPECT_EQ(record.Text("outcome"), "finished") << ToString(method) << extra;
        EXPECT_LE(missed, 1e-5) << ToString(method) << extra;
      } else if (record.Text("outcome") == "finished" && !(missed <= 1e-5)) {
        EXPECT_FALSE(OwnWarnings(record).empty()) << ToString(method) << extra << missed;
      }
    }
  }
}

/// A rotor on a screw that closes a loop. Its effort is a moment; the thread carries the force.
TEST(Couplings, RotorsOfScrewsKeepTheEnergyBalance) {
  const MechanismFile file = ParseMechanism(TestData("screw.json"), "screw.json");
  for (const Method& method : PositionMethods()) {
    const Record record = RunFile(file, method, 1e-9, 2.0);
    ASSERT_EQ(record.Text("outcome"), "finished") << ToString(method) << record.Text("message");
    // Some 500 steps with errors of the tolerance.
    EXPECT_LT(record.Number("energy_error_relative"), 500 * 1e-9) << ToString(method);
  }
}

}  // namespace loopbench::harness::reference::couplings_test
