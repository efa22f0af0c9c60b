// What each idea of model.h takes, on mechanisms whose answer is known on paper.
#include "mechanism/simplify/model.h"
#include "mechanism/simplify/restart.h"
#include "tests/contract/generators.h"
#include "tests/mechanism/shipped.h"

namespace loopbench::testing::simplify_test {

const Eigen::Vector3d kOrigin = Eigen::Vector3d::Zero(), kX = Eigen::Vector3d::UnitX();

/// A bar of 1 m and 1 kg on a pin, and on its tip another one of this mass.
MechanismDescription DoublePendulum(double mass) {
  MechanismDescription d;
  d.name = "double-pendulum";
  d.gravity = {0.0, -9.81, 0.0};
  d.bodies.push_back(Bar("upper", 1.0, 1.0, 1.0 / 12.0));
  d.bodies.push_back(Bar("lower", 1.0, mass, mass / 12.0));
  d.joints = {Revolute("O", 0, kOrigin, 1, kOrigin), Revolute("A", 1, kX, 2, kOrigin)};
  d.initial.coordinates = {{0, {0.3}}, {1, {0.5}}};
  return d;
}

TEST(FreedomTest, SharesOfAPendulumOnAPendulum) {
  const Freedom freedom = MeasureFreedom(DoublePendulum(0.01));
  EXPECT_EQ(freedom.speeds, 2);
  // the lower bar can turn alone, and has all of the energy then; the upper one has the more, the
  // less the lower one is moved: 1/3 against the mass that it feels, which is m/4 at right angles
  EXPECT_NEAR(freedom.shares[2], 1.0, 1e-12);
  EXPECT_GT(freedom.shares[1], 1.0 / 3.0 / (1.0 / 3.0 + 0.01));
  EXPECT_LT(freedom.shares[1], 1.0);
  EXPECT_NEAR(freedom.rate, std::sqrt(9.81 / freedom.length), 1e-12);
}

TEST(FreedomTest, ASpringSwingsAtItsFrequency) {
  MechanismDescription d = DoublePendulum(1.0);
  d.joints.pop_back();
  d.bodies.pop_back();
  d.initial.coordinates.pop_back();
  d.forces = {JointSpring{.joint = 0, .stiffness = 3.0, .rest = 0.1, .preload = 0.6}};
  const Freedom freedom = MeasureFreedom(d);
  EXPECT_NEAR(freedom.mobility[0], 1.0 / (1.0 / 3.0), 1e-12);  // about the pin
  EXPECT_NEAR(freedom.travel[0], 0.3 - (0.1 + 0.6 / 3.0), 1e-15);
  // between a point of the bar and the ground, level with it at right angles to the bar
  const double c = std::cos(0.3), s = std::sin(0.3);
  d.forces = {SpringDamper{.from = {0, {c + s, s - c, 0.0}},
                           .to = {1, kX},
                           .stiffness = 5.0,
                           .length = 0.75,
                           .preload = 1.0}};
  const Freedom across = MeasureFreedom(d);
  EXPECT_NEAR(across.mobility[0], 3.0, 1e-12);
  EXPECT_NEAR(across.travel[0], 1.0 - (0.75 - 0.2), 1e-12);
}

TEST(FreedomTest, WhatFollowsAGivenMotionHasEnergy) {
  const Freedom driven = MeasureFreedom(Shipped("driven-four-bar"));
  EXPECT_EQ(driven.why, "");
  EXPECT_EQ(driven.speeds, 0) << "of a run";
  double sum = 0.0;  // of one way to move
  for (const double share : driven.shares) sum += share;
  EXPECT_NEAR(sum, 1.0, 1e-12);
}

TEST(FreedomTest, StillAreJointsThatNoSpeedMoves) {
  const std::vector<bool> truss = FindStill(Shipped("truss"));
  EXPECT_NE(std::ranges::find(truss, true), truss.end());
  const std::vector<bool> four_bar = FindStill(Shipped("four-bar"));
  EXPECT_EQ(four_bar, std::vector<bool>(4, false));
  // a given motion is no freedom of the run, and a joint that follows it does not stand still
  const std::vector<bool> driven = FindStill(Shipped("driven-four-bar"));
  EXPECT_EQ(driven, std::vector<bool>(driven.size(), false));
}

TEST(RestartTest, TheAssembledStartStandsAsItIs) {
  int changed = 0;
  for (const char* name : {"four-bar", "double-wishbone", "stewart-platform", "rod-pendulum",
                           "driven-four-bar", "screw-jack", "bennett", "flyball-governor"}) {
    SCOPED_TRACE(name);
    const MechanismDescription d = Shipped(name);
    std::string why;
    const MechanismDescription whole = WithAssembledStart(d, &why);
    ASSERT_EQ(why, "");
    EXPECT_EQ(whole.initial.held, d.initial.held);
    EXPECT_GE(whole.initial.coordinates.size(), d.initial.coordinates.size());
    changed += whole.initial.coordinates.size() > d.initial.coordinates.size() ||
               whole.initial.speeds.size() > d.initial.speeds.size();
    const BodyStarts before = AssembledStart(d, &why), after = AssembledStart(whole, &why);
    ASSERT_EQ(why, "");
    for (const auto& [body, start] : before) {
      // coordinates from poses and back: some roundings of positions of metres
      EXPECT_LE((after.at(body).X.p - start.X.p).norm(), 1e-12) << body;
      EXPECT_LE((after.at(body).X.R - start.X.R).norm(), 1e-12) << body;
      EXPECT_LE((after.at(body).v - start.v).norm(), 1e-11 * (1.0 + start.v.norm())) << body;
      EXPECT_LE((after.at(body).w - start.w).norm(), 1e-11 * (1.0 + start.w.norm())) << body;
    }
  }
  EXPECT_GT(changed, 3) << "otherwise nothing was assembled";
}

TEST(RestartTest, PartsThatFloatHaveFreeJoints) {
  MechanismDescription d = DoublePendulum(1.0);
  std::string why;
  const BodyStarts starts = AssembledStart(d, &why);
  d.joints.erase(d.joints.begin());  // both float from now on
  d.initial = {};
  ASSERT_EQ(StartAt(starts, &d), "");
  ASSERT_EQ(d.joints.size(), 2u);
  EXPECT_EQ(d.joints[1].type, JointType::kFree);
  EXPECT_EQ(d.joints[1].name, "upper");
  EXPECT_LE((AssembledStart(d, &why).at("lower").X.p - starts.at("lower").X.p).norm(), 1e-14);
}

TEST(LightLinksTest, ALinkOnTheGroundLeavesABobOnARod) {
  // a bob of 1 kg on a link of 1 g: a pendulum on a massless rod, free to turn about itself
  MechanismDescription d = DoublePendulum(1.0);
  d.bodies[1].mass = 1e-3;
  d.bodies[1].inertia *= 1e-3;
  const Simplified simplified = LightenLinks(d, {}, {});
  ASSERT_TRUE(simplified.applies()) << simplified.why_not;
  const MechanismDescription& model = simplified.parts.front();
  ASSERT_EQ(model.bodies.size(), 2u);
  ASSERT_EQ(model.joints.size(), 2u);
  EXPECT_EQ(model.joints[0].name, "upper");
  EXPECT_EQ(model.joints[0].type, JointType::kRod);
  EXPECT_EQ(model.joints[1].type, JointType::kFree);
  EXPECT_EQ(FindPoint(model, "upper", "B").body, 1);
  EXPECT_NEAR(model.bodies[1].mass, 1.0 + 0.5e-3, 1e-15) << "the other half hung on the ground";
  std::string why;
  const BodyStart before = AssembledStart(d, &why).at("lower");
  const BodyStart after = AssembledStart(model, &why).at("lower");
  EXPECT_LE((before.X.p - after.X.p).norm() + (before.X.R - after.X.R).norm(), 1e-14);
}

TEST(LightLinksTest, MassGoesToTheEndsByTheCentreOfMass) {
  MechanismDescription d = Shipped("four-bar");
  d.bodies[2].mass = 1e-3;
  d.bodies[2].inertia *= 1e-3;
  d.bodies[2].com = {0.25, 0.0, 0.0};
  const Simplified simplified = LightenLinks(d, {}, {});
  ASSERT_TRUE(simplified.applies()) << simplified.why_not;
  const MechanismDescription& model = simplified.parts.front();
  ASSERT_EQ(model.bodies.size(), 3u);
  EXPECT_NEAR(model.bodies[1].mass, 1.0 + 0.75e-3, 1e-15);
  EXPECT_NEAR(model.bodies[2].mass, 1.0 + 0.25e-3, 1e-15);
  EXPECT_EQ(model.joints.back().name, "bar2");
  EXPECT_EQ(model.joints.back().parameter, 1.0);
  EXPECT_EQ(FindPoint(model, "bar2", "A").body, 1);
  EXPECT_EQ(FindPoint(model, "bar2", "B").body, 2);
  EXPECT_EQ(FindPoint(model, "bar2", "nowhere").body, -1);
  EXPECT_EQ(FindPoint(model, "bar1", "B").at, kX);
  // half and half, and not at all
  SimplifyOptions options;
  options.lumping = Lumping::kHalf;
  EXPECT_NEAR(LightenLinks(d, {}, options).parts.front().bodies[1].mass, 1.0005, 1e-15);
  options.lumping = Lumping::kNone;
  EXPECT_EQ(LightenLinks(d, {}, options).parts.front().bodies[1].mass, 1.0);
}

std::string WhyNot(const Simplified& simplified, const std::string& what) {
  for (const Candidate& candidate : simplified.candidates) {
    if (candidate.what.starts_with(what)) return candidate.taken ? "taken" : candidate.why;
  }
  return "no candidate";
}

TEST(LightLinksTest, SaysWhatKeepsALinkFromBeingARod) {
  MechanismDescription d = Shipped("four-bar");
  d.bodies[2].mass *= 1e-3;
  d.bodies[2].inertia *= 1e-3;
  const auto why = [](const MechanismDescription& changed) {
    return WhyNot(LightenLinks(changed, {}, {}), "link \"bar2\"");
  };
  EXPECT_EQ(why(d), "taken");
  MechanismDescription other = d;
  other.forces.push_back(PointForce{.point = {2, kX}, .force = {1.0, 0.0, 0.0}});
  EXPECT_EQ(why(other), "a point_force acts on it");
  other = d;
  other.forces.push_back(JointSpring{.joint = 1, .stiffness = 1.0});
  EXPECT_EQ(why(other), "a joint_spring acts in one of its joints");
  other = d;
  other.joints[1].motions = {{0, Polynomial{{0.841188}}}};
  other.initial.held.clear();
  std::erase_if(other.initial.coordinates, [](const JointValues& one) { return one.joint == 1; });
  EXPECT_EQ(why(other), "one of its joints follows a given motion");
  other = d;
  other.bodies.push_back(Bar("third", 1.0, 1.0, 1.0));
  other.joints.insert(other.joints.begin() + 2, Revolute("T", 2, kX, 4, kOrigin));
  EXPECT_EQ(why(other), "no candidate") << "three pins";
  EXPECT_EQ(why(Shipped("four-bar")), "") << "it is heavy: the number says so";
}

TEST(StiffSpringsTest, HoldAJointWhereItsSpringIsFree) {
  MechanismDescription d = DoublePendulum(1.0);
  d.forces = {JointSpring{.joint = 1, .stiffness = 1e6, .rest = 0.4, .preload = 1e5},
              JointDamper{.joint = 1, .damping = 3.0}};
  const Simplified simplified = HoldStiffSprings(d, {}, {});
  ASSERT_TRUE(simplified.applies()) << simplified.why_not;
  const MechanismDescription& model = simplified.parts.front();
  ASSERT_EQ(model.bodies.size(), 2u);
  EXPECT_EQ(model.bodies[1].mass, 2.0);
  EXPECT_TRUE(model.forces.empty());
  // bent by 0.4 + 1e5/1e6 rad, of two masses of 1 kg at 0.5 and 1 + 0.5 at that angle
  EXPECT_NEAR(model.bodies[1].com.x(), 0.5 * (0.5 + 1.0 + 0.5 * std::cos(0.5)), 1e-14);
  EXPECT_NEAR(model.bodies[1].com.y(), 0.25 * std::sin(0.5), 1e-14);
}

TEST(StiffSpringsTest, InSpaceAsInThePlane) {
  // the same about an axis of its own, in a joint whose frames stand askew
  for (const JointType type : {JointType::kRevolute, JointType::kPrismatic, JointType::kHelical}) {
    MechanismDescription d = DoublePendulum(1.0);
    d.space = SpaceKind::kSpatial;
    JointDescription& joint = d.joints[1];
    joint.type = type;
    joint.axis = {0.3, -0.5, 1.0};
    joint.parameter = type == JointType::kHelical ? 0.2 : 0.0;
    joint.from.rotation = {0.1, 0.7, -0.4};
    joint.to.rotation = {-0.9, 0.2, 0.3};
    // it starts where the spring is free, so that the held joint must leave all where it is
    d.initial.coordinates[1].values = {0.8};
    d.forces = {JointSpring{.joint = 1, .stiffness = 1e6, .rest = 0.8}};
    std::string why;
    const BodyStarts before = AssembledStart(d, &why);
    ASSERT_EQ(why, "");
    const Simplified simplified = HoldStiffSprings(d, {}, {});
    ASSERT_TRUE(simplified.applies()) << simplified.why_not;
    const MechanismDescription& model = simplified.parts.front();
    ASSERT_EQ(model.bodies.size(), 2u);
    const BodyStart upper = AssembledStart(model, &why).at("upper");
    const Eigen::Vector3d tip = model.bodies[1].points.at("lower.B");
    const BodyStart& lower = before.at("lower");
    EXPECT_LE(
        (upper.X.R * tip + upper.X.p - (lower.X.R * d.bodies[2].points.at("B") + lower.X.p)).norm(),
        1e-14)
        << ToString(type);
  }
}

TEST(StiffSpringsTest, ASoftSpringIsPartOfTheMotion) {
  MechanismDescription d = DoublePendulum(1.0);
  d.forces = {JointSpring{.joint = 0, .stiffness = 3e3}, JointSpring{.joint = 1, .stiffness = 1e5}};
  const Simplified simplified = HoldStiffSprings(d, {}, {});
  // 3 rad/s swing at first; the first spring has some 60 rad/s, twenty times as much, so it is no
  // stiff one, and the second with some 700 is held against it
  ASSERT_EQ(simplified.candidates.size(), 2u);
  EXPECT_FALSE(simplified.candidates[0].taken);
  EXPECT_LT(simplified.candidates[1].number, 30.0);
  EXPECT_FALSE(simplified.applies());
  EXPECT_EQ(simplified.why_not, "no spring is stiff enough");
  ShortRun fast;
  fast.rate = 1e4;
  EXPECT_LT(HoldStiffSprings(d, fast, {}).candidates[1].number, 1.0);
}

TEST(StiffSpringsTest, WhatWouldLockIsNotHeld) {
  MechanismDescription d = Shipped("four-bar");
  d.forces = {JointSpring{.joint = 0, .stiffness = 1e9, .rest = -1.0}};
  const Simplified simplified = HoldStiffSprings(d, {}, {});
  EXPECT_FALSE(simplified.applies());
  ASSERT_EQ(simplified.candidates.size(), 1u);
  EXPECT_NE(simplified.candidates[0].why.find("there is no start with it held"), std::string::npos)
      << simplified.candidates[0].why;
}

TEST(ConstantPartsTest, ARunMustHaveShownThem) {
  const MechanismDescription d = DoublePendulum(1.0);
  EXPECT_EQ(FreezeConstantParts(d, {}, {}).why_not, "there was no trial run");
  ShortRun run;
  run.travels = {{"O", {1.0, 0.0}}, {"A", {5e-4, 0.0}}};
  const Simplified simplified = FreezeConstantParts(d, run, {});
  ASSERT_TRUE(simplified.applies()) << simplified.why_not;
  ASSERT_EQ(simplified.parts.front().bodies.size(), 2u);
  EXPECT_NEAR(simplified.parts.front().bodies[1].com.y(), 0.25 * std::sin(0.5), 1e-15);
  run.travels["O"] = {1e-5, 0.0};
  EXPECT_EQ(FreezeConstantParts(d, run, {}).why_not, "nothing would move");
  run.travels["O"] = run.travels["A"] = {0.0, 1.0};
  EXPECT_EQ(FreezeConstantParts(d, run, {}).why_not, "no joint is at rest");
}

TEST(ConstantPartsTest, NothingStopsThatMoves) {
  // one joint of a loop of four seems to stand still: held, it would stop all others
  const MechanismDescription d = Shipped("four-bar");
  ShortRun run;
  run.travels = {{"OA", {1.0, 0.0}}, {"AB", {1.0, 0.0}}, {"BC", {1e-5, 0.0}}, {"OC", {1.0, 0.0}}};
  const Simplified simplified = FreezeConstantParts(d, run, {});
  EXPECT_FALSE(simplified.applies());
  EXPECT_EQ(simplified.parts.front().bodies.size(), 4u);
}

TEST(NearlyPlanarTest, WhatIsPlanarExactlyIsForThePlane) {
  EXPECT_EQ(FlattenNearly(Shipped("four-bar"), {}, {}).why_not, "it is planar already");
  EXPECT_EQ(FlattenNearly(Shipped("parallelogram-in-space"), {}, {}).why_not,
            "it is planar exactly: see planar");
}

TEST(NearlyPlanarTest, TiltsBeyondTheLimitAndOtherJointsPreventIt) {
  const Simplified skew = FlattenNearly(Shipped("spatial-four-bar"), {}, {});
  EXPECT_FALSE(skew.applies());
  EXPECT_NE(skew.why_not.find("is tilted by"), std::string::npos) << skew.why_not;
  EXPECT_TRUE(std::ranges::none_of(skew.candidates, &Candidate::taken));
  SimplifyOptions any;
  any.nearly_planar = 1.0;
  const Simplified jack = FlattenNearly(Shipped("screw-jack"), {}, any);
  EXPECT_NE(jack.why_not.find("the plane has no"), std::string::npos) << jack.why_not;
}

TEST(IslandsTest, PartsThatCannotMoveAreNoModels) {
  const SimplificationRule& islands =
      *std::ranges::find(SimplificationRules(), "islands", &SimplificationRule::name);
  const Simplified simplified = islands.apply(Shipped("truss"), {}, {});
  ASSERT_TRUE(simplified.applies());
  EXPECT_EQ(simplified.parts.size(), 1u);
  ASSERT_EQ(simplified.dropped.size(), 2u);
  EXPECT_NE(simplified.dropped[0].find("nothing can move"), std::string::npos);
  EXPECT_EQ(islands.apply(Shipped("four-islands"), {}, {}).parts.size(), 4u);
}

TEST(CombineTest, SaysWhichIdeasDidWhat) {
  std::vector<const SimplificationRule*> ideas;
  for (const SimplificationRule& idea : SimplificationRules()) ideas.push_back(&idea);
  const Simplified nothing = Combine(Shipped("four-bar"), ideas, {}, {});
  EXPECT_FALSE(nothing.applies());
  EXPECT_TRUE(nothing.done.empty());
  const Simplified welded = Combine(Shipped("welded-four-bar"), ideas, {}, {});
  ASSERT_TRUE(welded.applies());
  ASSERT_EQ(welded.ideas.size(), 1u);
  EXPECT_EQ(welded.ideas[0]->name, "welds");
  EXPECT_EQ(welded.done.size(), 6u);
  EXPECT_EQ(welded.done[0], "welds: body \"bar1b\": welded to \"bar1a\"");
}

TEST(SimplifiedTest, RandomMechanismsHaveModelsThatStart) {
  int applied = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    for (const SpaceKind space : {SpaceKind::kPlanar, SpaceKind::kSpatial}) {
      const MechanismDescription d = MixedGraph(2, space, seed);
      ShortRun run;
      for (std::size_t j = 0; j < d.joints.size(); ++j) {
        run.travels[d.joints[j].name] = {j % 3 == 0 ? 0.0 : 1.0, 0.0};
      }
      SimplifyOptions options;
      options.light_links = 1.0;
      options.stiff_springs = 1e-3;
      for (const SimplificationRule& idea : SimplificationRules()) {
        const Simplified simplified = idea.apply(d, run, options);
        if (!simplified.applies()) continue;
        ++applied;
        for (const MechanismDescription& part : simplified.parts) {
          std::string why;
          AssembledStart(part, &why);
          EXPECT_EQ(why, "") << idea.name << " of " << d.name;
          EXPECT_EQ(Validate(part), "");
        }
      }
    }
  }
  EXPECT_GT(applied, 20) << "otherwise nothing was tested";
}

}  // namespace loopbench::testing::simplify_test
