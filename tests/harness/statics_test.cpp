// Forces at rest against closed forms: virtual work and the balance of the whole.
#include "harness/observers/trajectory.h"
#include "mechanism/simplify/structure.h"
#include "tests/harness/places.h"

namespace loopbench::harness::statics_test {

constexpr double kEps = 2.220446049250313e-16, kGravity = 9.81;

template <class Space>
Statics At(const MechanismDescription& description) {
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  const Start<double> start = Assemble<Space>(description, mechanism);
  EXPECT_NE(start.outcome, Outcome::kInconsistentStart) << start.message;
  return FindStatics(description, start);
}

Statics Of(const MechanismDescription& description) {
  return description.space == SpaceKind::kPlanar ? At<Planar>(description)
                                                 : At<Spatial>(description);
}

Statics Of(const std::string& text) { return Of(ParseMechanism(text, "text").description); }

/// Values by their labels without the unit.
std::map<std::string, double> Values(const Statics& statics) {
  EXPECT_EQ(statics.why, "");
  std::map<std::string, double> values;
  for (std::size_t i = 0; i < statics.columns.size(); ++i) {
    const TrajectoryColumn& column = statics.columns[i];
    values[fmt::format("{}:{}:{}", column.kind, column.name, column.component)] = statics.values[i];
  }
  return values;
}

std::string Lever(double angle, const std::string& more) {
  return fmt::format(R"({{"name": "lever", "gravity": [0, -9.81],
    "bodies": [{{"name": "lever", "mass": 2, "inertia": 0.1, "com": [0.4, 0]}}],
    "joints": [{{"name": "O", "type": "revolute", "from": {{"body": "ground"}},
                 "to": {{"body": "lever"}}}}],
    "forces": [{{"type": "point_force", "body": "lever", "at": [1, 0], "force": [0, -30]}}{}],
    "initial": {{"coordinates": {{"O": {}}}, "fixed": ["O"], "speeds": {{"O": 7}}}}}})",
                     more, angle);
}

TEST(StaticsTest, ALeverNeedsTheMomentOfItsLoads) {
  for (const double angle : {0.0, 0.3, -2.0, 7.0}) {
    const Statics statics = Of(Lever(angle, ""));
    auto value = Values(statics);
    // moments of a few terms about 40 N m
    EXPECT_NEAR(value["drive:O:angle"], (2 * kGravity * 0.4 + 30) * std::cos(angle),
                100 * kEps * 40);
    EXPECT_NEAR(value["reaction:O:fy"], 2 * kGravity + 30, 100 * kEps * 50);
    EXPECT_NEAR(value["reaction:O:fx"], 0.0, 100 * kEps * 50);
    EXPECT_NEAR(value["reaction:O:mz"], 0.0, 100 * kEps * 40);
    EXPECT_EQ(statics.held, std::vector<std::string>{"O:angle"});
    EXPECT_EQ(statics.free, 0);
  }
}

TEST(StaticsTest, SpringsCarryAndDampersDoNot) {
  const double angle = 0.3, moment = (2 * kGravity * 0.4 + 30) * std::cos(angle);
  auto value = Values(
      Of(Lever(angle, fmt::format(R"(, {{"type": "joint_spring", "joint": "O", "stiffness": 100,
                             "rest": {}}}, {{"type": "joint_damper", "joint": "O", "damping": 50}})",
                                  angle + moment / 100))));
  EXPECT_NEAR(value["drive:O:angle"], 0.0, 100 * kEps * moment);
}

TEST(StaticsTest, ASimplySupportedBeamIsDeterminate) {
  const double length = 3.0, mass = 10.0, load = 400.0, at = 0.8;
  const Statics statics = Of(fmt::format(R"({{"name": "beam", "gravity": [0, -9.81],
    "bodies": [{{"name": "beam", "mass": {0}, "inertia": 7.5, "com": [1.5, 0]}}],
    "joints": [{{"name": "A", "type": "revolute", "from": {{"body": "ground"}},
                 "to": {{"body": "beam"}}}},
               {{"name": "B", "type": "pin-in-slot", "from": {{"body": "ground", "at": [{1}, 0]}},
                 "to": {{"body": "beam", "at": [{1}, 0]}}}}],
    "forces": [{{"type": "point_force", "body": "beam", "at": [{2}, 0], "force": [50, -{3}]}}]}})",
                                         mass, length, at, load));
  auto value = Values(statics);
  const double weight = mass * kGravity, end = (weight * length / 2 + load * at) / length;
  EXPECT_NEAR(value["reaction:B:fy"], end, 100 * kEps * load);
  EXPECT_NEAR(value["reaction:A:fy"], weight + load - end, 100 * kEps * load);
  EXPECT_NEAR(value["reaction:A:fx"], -50.0, 100 * kEps * load);
  EXPECT_TRUE(statics.held.empty());
}

/// Two pins: the axial forces are shared in no one way, the others are known.
TEST(StaticsTest, SharedLoadsAreNotUnique) {
  auto value = Values(Of(R"({"name": "beam", "gravity": [0, -10],
    "bodies": [{"name": "beam", "mass": 10, "inertia": 7.5, "com": [1, 0]}],
    "joints": [{"name": "A", "type": "revolute", "from": {"body": "ground"}, "to": {"body": "beam"}},
               {"name": "B", "type": "revolute", "from": {"body": "ground", "at": [4, 0]},
                "to": {"body": "beam", "at": [4, 0]}}]})"));
  EXPECT_TRUE(std::isnan(value["reaction:A:fx"]));
  EXPECT_TRUE(std::isnan(value["reaction:B:fx"]));
  EXPECT_NEAR(value["reaction:A:fy"], 75.0, 100 * kEps * 100);
  EXPECT_NEAR(value["reaction:B:fy"], 25.0, 100 * kEps * 100);
}

/// A node on two bars of one length, loaded across: 2 F sin(angle) = load.
TEST(StaticsTest, ALockedBraceCarries) {
  const double angle = 0.05, load = 100.0;
  auto value = Values(Of(fmt::format(R"({{"name": "brace", "gravity": [0, 0],
    "bodies": [{{"name": "a", "mass": 1, "inertia": 0.1, "com": [0.5, 0]}},
               {{"name": "b", "mass": 1, "inertia": 0.1, "com": [0.5, 0]}}],
    "joints": [{{"name": "O", "type": "revolute", "from": {{"body": "ground"}}, "to": {{"body": "a"}}}},
               {{"name": "K", "type": "revolute", "from": {{"body": "a", "at": [1, 0]}},
                 "to": {{"body": "b"}}}},
               {{"name": "E", "type": "revolute", "from": {{"body": "ground", "at": [{}, 0]}},
                 "to": {{"body": "b", "at": [1, 0]}}}}],
    "forces": [{{"type": "point_force", "body": "a", "at": [1, 0], "force": [0, -{}]}}],
    "initial": {{"coordinates": {{"O": {}, "K": {}}}}}}})",
                                     2 * std::cos(angle), load, angle, -2 * angle)));
  const double thrust = load / (2 * std::tan(angle));
  // the assembly closes within 16 eps of 4 m, and the thrust changes by its square per metre
  const double slack = 64 * kEps * thrust / (angle * angle);
  EXPECT_NEAR(value["reaction:O:fx"], thrust, slack);
  EXPECT_NEAR(value["reaction:O:fy"], load / 2, slack);
  EXPECT_NEAR(value["reaction:E:fx"], -thrust, slack);
}

/// Torque of the crank by virtual work: torque dphi + force dx = 0, weights do no work.
TEST(StaticsTest, ASliderCrankFollowsVirtualWork) {
  const double r = 0.1, l = 0.35, force = -2000.0;
  for (const double phi : {0.4, 2.0, -1.2}) {
    auto value = Values(Of(fmt::format(R"({{"name": "press", "gravity": [0, 0],
      "bodies": [{{"name": "crank", "mass": 1, "inertia": 0.01}},
                 {{"name": "rod", "mass": 2, "inertia": 0.02, "com": [0.1, 0.01]}},
                 {{"name": "slider", "mass": 3, "inertia": 0.01}}],
      "joints": [{{"name": "O", "type": "revolute", "from": {{"body": "ground"}}, "to": {{"body": "crank"}}}},
                 {{"name": "A", "type": "revolute", "from": {{"body": "crank", "at": [{0}, 0]}},
                   "to": {{"body": "rod"}}}},
                 {{"name": "B", "type": "revolute", "from": {{"body": "rod", "at": [{1}, 0]}},
                   "to": {{"body": "slider"}}}},
                 {{"name": "S", "type": "prismatic", "from": {{"body": "ground"}}, "to": {{"body": "slider"}}}}],
      "forces": [{{"type": "point_force", "body": "slider", "force": [{2}, 0]}}],
      "initial": {{"coordinates": {{"O": {3}, "S": {4}}}, "fixed": ["O"]}}}})",
                                       r, l, force, phi, r * std::cos(phi) + l)));
    const double s = std::sin(phi), root = std::sqrt(l * l - r * r * s * s),
                 rate = -r * s - r * r * s * std::cos(phi) / root;
    // loops close within 16 eps of about 1 m, seen through arms of 0.1 m
    const double slack = 1000 * kEps * std::abs(force);
    EXPECT_NEAR(value["drive:O:angle"], -force * rate, slack) << phi;
    EXPECT_NEAR(value["reaction:A:fx"], -force, slack) << phi;
    EXPECT_NEAR(std::abs(value["reaction:S:fy"]), std::abs(force * r * s / root), slack) << phi;
  }
}

/// Joints with ground carry the weight of the whole, shared by all formulations of geometry.
TEST(StaticsTest, GroundCarriesTheWeight) {
  for (const char* name : {"spatial-four-bar", "four-bar", "seven-bar", "geared-five-bar",
                           "flyball-governor", "stewart-platform"}) {
    const MechanismDescription description = Shipped(name).description;
    const Statics statics = Of(description);
    auto value = Values(statics);
    double weight = 0.0, largest = 0.0;
    for (const BodyDescription& body : description.bodies) weight += body.mass;
    const Eigen::Vector3d load = weight * description.gravity;
    Eigen::Vector3d sum = load;
    for (std::size_t j = 0; j < description.joints.size(); ++j) {
      const JointDescription& joint = description.joints[j];
      const int sign = joint.from.body == kGround ? 1 : joint.to.body == kGround ? -1 : 0;
      for (int i = 0; i < 3; ++i) {
        const auto found = value.find(fmt::format("reaction:{}:f{}", joint.name, "xyz"[i]));
        if (found == value.end()) continue;
        largest = std::max(largest, std::abs(found->second));
        sum[i] += sign * found->second;
      }
    }
    EXPECT_LE(sum.norm(), 1000 * kEps * std::max(largest, load.norm())) << name;
    EXPECT_EQ(statics.held.size(), std::size_t(AnalyseStructure(description).freedom())) << name;
  }
}

/// A lever on gears: one holding moment at the first wheel, 40 q_O = -20 q_W.
TEST(StaticsTest, CouplingsPassTheMomentOn) {
  const double load = 2 * kGravity * 0.4;
  auto value = Values(Of(R"({"name": "hoist", "gravity": [0, -9.81],
    "bodies": [{"name": "wheel", "mass": 1, "inertia": 0.1}, {"name": "lever", "mass": 2, "inertia": 0.1, "com": [0.4, 0]}],
    "joints": [{"name": "W", "type": "revolute", "from": {"body": "ground", "at": [1, 0]}, "to": {"body": "wheel"}},
               {"name": "O", "type": "revolute", "from": {"body": "ground"}, "to": {"body": "lever"}}],
    "couplings": [{"name": "mesh", "coefficients": {"O": 40, "W": 20}}]})"));
  EXPECT_NEAR(value["coupling:mesh:O:effort"], load, 1000 * kEps * load);
  EXPECT_NEAR(value["coupling:mesh:W:effort"], load / 2, 1000 * kEps * load);
  EXPECT_NEAR(value["drive:W:angle"], -load / 2, 1000 * kEps * load);
}

/// A drive is held where it is: its rate and acceleration need no force here.
TEST(StaticsTest, DrivesAreHeldAtTheirStart) {
  MechanismDescription moving = Shipped("driven-four-bar").description;
  const Statics statics = Of(moving);
  EXPECT_TRUE(statics.held.empty());
  for (JointDescription& joint : moving.joints) {
    for (PrescribedMotion& motion : joint.motions) {
      motion.value = Polynomial{{TimeFunction(motion.value).At(0.0).value, 50.0, -300.0}};
    }
  }
  auto value = Values(statics), again = Values(Of(moving));
  for (const auto& [label, number] : value) {
    EXPECT_NEAR(again[label], number, 1e-12 * 100) << label;
  }
}

std::string Ball(double x, double z) {
  return fmt::format(R"({{"name": "ball", "space": "spatial", "gravity": [0, 0, -9.81],
    "bodies": [{{"name": "bob", "mass": 2, "inertia": [0.1, 0.1, 0.1], "com": [{}, 0, {}]}}],
    "joints": [{{"name": "S", "type": "spherical", "from": {{"body": "ground"}},
                 "to": {{"body": "bob"}}}}]}})",
                     x, z);
}

TEST(StaticsTest, WhatNothingHoldsIsNamed) {
  const Statics fallen = Of(Ball(0.1, -1));
  ExpectWords(fallen.why, {"nothing holds bob"});
  EXPECT_TRUE(fallen.values.empty());
  const Statics hanging = Of(Ball(0, -1));
  EXPECT_EQ(hanging.free, 3);
  EXPECT_NEAR(Values(hanging)["reaction:S:fz"], 2 * kGravity, 100 * kEps * 20);
}

/// The torque of a drive holds a nut on a vertical screw: 20 N of weight times 0.5 m/rad. The
/// thread takes the whole weight, and with it the opposite torque.
TEST(StaticsTest, TheThreadOfAScrewCarriesTheWholeWeight) {
  auto value = Values(Of(std::string(R"({"name": "nut", "space": "spatial", "gravity": [0, 0, -10],
    "bodies": [{"name": "nut", "mass": 2, "inertia": 0.1}],
    "joints": [{"name": "H", "type": "helical", "pitch": 0.5, "axis": [0, 0, 1],
                "from": {"body": "ground"}, "to": {"body": "nut"}}],
    "forces": [{"type": "joint_torque", "joint": "H", "value": 10}]})")));
  EXPECT_NEAR(value["reaction:H:fz"], 20.0, 20.0 * 16 * kEps);
  EXPECT_NEAR(value["reaction:H:mz"], -10.0, 10.0 * 16 * kEps);
}

}  // namespace loopbench::harness::statics_test
