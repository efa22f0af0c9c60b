// Joints of SDF that follow others, over runs, against closed forms: gears, a rack, a screw.
#include "harness/exchange/import.h"
#include "tests/reference/cases.h"
#include "tests/reference/simulate.h"

namespace loopbench::harness::reference::import_couplings_test {

constexpr double kTolerance = 1e-10, kHorizon = 2.0, kGravity = 9.8;
constexpr double kMass = 2.0, kInertia = 1.0;

std::string Link(const std::string& name, const std::string& pose = "0 0 0 0 0 0") {
  return "<link name=\"" + name + "\"><pose>" + pose +
         "</pose><inertial><mass>2</mass></inertial>" + "</link>";
}

std::string Joint(const std::string& name, const std::string& type, const std::string& parent,
                  const std::string& child, const std::string& inside) {
  return "<joint name=\"" + name + "\" type=\"" + type + "\"><parent>" + parent +
         "</parent><child>" + child + "</child>" + inside + "</joint>";
}

MechanismDescription Import(const std::string& inside) {
  return ImportText("<sdf version=\"1.11\"><model name=\"m\">" + inside + "</model></sdf>",
                    "file.sdf")
      .description;
}

/// Runs all formulations in both coordinate sets and checks the end of each.
void RunAll(const MechanismDescription& description,
            const std::function<double(const Snapshot&)>& error) {
  for (const Method& method : PositionMethods()) {
    const Simulation run = Simulate(description, method, Options("ode45", kTolerance), kHorizon);
    ASSERT_EQ(run.result.outcome, Outcome::kFinished) << ToString(method) << run.result.message;
    // each accepted step adds an error below the tolerance; speeds of order 10
    const double worst = error(run.last);
    EXPECT_LE(worst, 10.0 * kTolerance * static_cast<double>(run.result.steps)) << ToString(method);
    std::cout << ToString(method) << ": " << worst << ", " << run.result.steps << " steps\n";
  }
}

TEST(ImportCouplings, BevelGearsOfAGearboxTurnByItsRatio) {
  // the output is turned by a quarter: its z is the ground's x, its -x the ground's z
  MechanismDescription gears =
      Import(Link("in") + Link("out", "1 0 0 0 1.5707963267948966 0") +
             Joint("j", "revolute", "world", "in", "<axis/>") +
             Joint("k", "revolute", "world", "out", "<axis/>") +
             Joint("g", "gearbox", "in", "out",
                   "<axis><xyz>-1 0 0</xyz></axis><axis2/><gearbox_ratio>3</gearbox_ratio>"
                   "<gearbox_reference_body>world</gearbox_reference_body>"));
  constexpr double kTorque = 4.0;
  gears.forces.emplace_back(JointTorque{0, Polynomial{{kTorque}}});
  const int in = BodyNamed(gears, "in"), out = BodyNamed(gears, "out");
  RunAll(gears, [&](const Snapshot& last) {
    const double speed = kTorque / (kInertia + 9.0 * kInertia) * kHorizon;
    return std::max((last.bodies[in].w - Eigen::Vector3d(0, 0, speed)).norm(),
                    (last.bodies[out].w - Eigen::Vector3d(-3.0 * speed, 0, 0)).norm());
  });
}

TEST(ImportCouplings, ARackFallsWithThePinionThatItTurns) {
  // rack = 0.5 (pinion - 0.2) + 0.3
  const MechanismDescription rack =
      Import(Link("pinion") + Link("rack") + Joint("p", "revolute", "world", "pinion", "<axis/>") +
             Joint("r", "prismatic", "world", "rack",
                   "<axis><mimic joint=\"p\"><multiplier>0.5</multiplier><offset>0.3</offset>"
                   "<reference>0.2</reference></mimic></axis>"));
  const int p = BodyNamed(rack, "pinion"), r = BodyNamed(rack, "rack");
  RunAll(rack, [&](const Snapshot& last) {
    const double v = -kMass * kGravity / (kMass + kInertia / 0.25) * kHorizon;
    const Eigen::Matrix3d& R = last.bodies[p].R;
    const double open = std::remainder(
        2.0 * (last.bodies[r].p.z() - 0.3) + 0.2 - std::atan2(R(1, 0), R(0, 0)), 2.0 * kPi);
    return std::max({std::abs(last.bodies[r].v.z() - v), std::abs(last.bodies[p].w.z() - 2.0 * v),
                     std::abs(open)});
  });
}

TEST(ImportCouplings, ScrewsSlideByTheirLeadPerTurn) {
  constexpr double kLead = 0.5, kPerAngle = kLead / (2.0 * kPi);
  // right-handed; rad/m are positive for a left-handed thread
  for (const char* pitch : {"<screw_thread_pitch>0.5</screw_thread_pitch>",
                            "<thread_pitch>-12.566370614359172</thread_pitch>"}) {
    const MechanismDescription nut =
        Import(Link("nut") + Joint("j", "screw", "world", "nut", std::string("<axis/>") + pitch));
    RunAll(nut, [&](const Snapshot& last) {
      const double v = -kMass * kGravity / (kMass + kInertia / (kPerAngle * kPerAngle)) * kHorizon;
      const BodyState& body = last.bodies[1];
      return std::max(
          {std::abs(body.v.z() - v), std::abs(body.w.z() - v / kPerAngle),
           std::abs(body.p.z() - 0.5 * v * kHorizon),
           std::abs(std::remainder(body.p.z() / kPerAngle - std::atan2(body.R(1, 0), body.R(0, 0)),
                                   2.0 * kPi))});
    });
  }
}

}  // namespace loopbench::harness::reference::import_couplings_test
