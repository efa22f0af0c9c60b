// The assembly tree: what is in it, how deep it is, how large its joins are, and that its options
// change the order of the work but not the result.
#include "odca/plan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "mechanism/library.h"
#include "odca/odca.h"
#include "tests/contract/comparison.h"

namespace loopbench::odca {
namespace {

using testing::ConsistentState;
using testing::RelativeError;
using testing::State;
using testing::ToReal;

const std::vector<PlanOptions> kAllOptions = {{Grounding::kEager, Closing::kTogether},
                                              {Grounding::kEager, Closing::kOneByOne},
                                              {Grounding::kAtRoot, Closing::kTogether},
                                              {Grounding::kAtRoot, Closing::kOneByOne}};

Plan PlanOf(const MechanismDescription& description, const PlanOptions& options = {}) {
  return MakePlan(Mechanism<Planar, double>(description, Coordinates::kJoint), options);
}

/// Every leaf and every inner node is used once at most, children come first, joints occur once.
void ExpectProper(const Plan& plan, int num_joints) {
  std::vector<int> uses(plan.num_nodes(), 0);
  std::multiset<int> joints;
  for (int k = 0; k < static_cast<int>(plan.nodes().size()); ++k) {
    const PlanNode& node = plan.nodes()[k];
    for (int child : node.children) {
      if (child < 0) continue;
      EXPECT_LT(child, plan.num_leaves() + k) << "children come before parents";
      ++uses[child];
    }
    int rows = 0;
    for (const NodeJoint& joint : node.joints) {
      joints.insert(joint.index);
      rows += joint.rows;
    }
    EXPECT_EQ(rows, node.rows);
    for (int kept : node.kept) EXPECT_TRUE(node.handles[kept].kept);
  }
  for (int use : uses) EXPECT_LE(use, 1) << "no assembly is joined twice";
  EXPECT_EQ(static_cast<int>(joints.size()), num_joints);
  EXPECT_EQ(std::set<int>(joints.begin(), joints.end()).size(), joints.size());
}

TEST(PlanTest, EachBodyAndEachJointOccursOnce) {
  for (const PlanOptions& options : kAllOptions) {
    for (int n : {3, 10, 100}) {
      const MechanismDescription chain = Chain(n);
      ExpectProper(PlanOf(chain, options), static_cast<int>(chain.joints.size()));
      const MechanismDescription ladder = Ladder(n, -1.0, 0.5);
      const Plan plan = PlanOf(ladder, options);
      ExpectProper(plan, static_cast<int>(ladder.joints.size()));
      EXPECT_EQ(plan.num_leaves(), static_cast<int>(ladder.bodies.size()) - 1);
    }
  }
}

TEST(PlanTest, DepthOfChainsAndLaddersIsLogarithmic) {
  // Pairing neighbours shrinks their number by a third at least per round of a greedy matching;
  // closing to Ground adds one join at a leaf or two at the root.
  for (const PlanOptions& options : kAllOptions) {
    for (int n : {10, 100, 1000}) {
      const double rounds = std::log(n) / std::log(1.5);
      EXPECT_LE(PlanOf(Chain(n), options).depth(), rounds + 4) << "chain of " << n;
      const int depth = PlanOf(Ladder(n, -1.0, 0.5), options).depth();
      const int per_round = options.closing == Closing::kOneByOne ? 2 : 1;
      EXPECT_LE(depth, per_round * (std::log(2 * n + 1) / std::log(1.5) + 4)) << "ladder of " << n;
    }
  }
}

TEST(PlanTest, JoinsOfChainsAndLaddersStaySmall) {
  for (const PlanOptions& options : kAllOptions) {
    const Plan chain = PlanOf(Chain(1000), options);
    EXPECT_LE(chain.largest_join(), options.grounding == Grounding::kAtRoot ? 4 : 2);
    EXPECT_LE(chain.most_handles(), 4);
    if (options.grounding == Grounding::kAtRoot) continue;
    const Plan ladder = PlanOf(Ladder(1000, -1.0, 0.5), options);
    EXPECT_LE(ladder.largest_join(), 4) << "two pins between two parts of a ladder";
    EXPECT_LE(ladder.most_handles(), 8);
  }
}

TEST(PlanTest, LoopsAreMarkedWhereTheyClose) {
  EXPECT_EQ(PlanOf(Chain(10)).loop_joins(), 1);
  EXPECT_EQ(PlanOf(Ladder(10, -1.0, 0.5), {.closing = Closing::kOneByOne}).loop_joins(), 10);
  EXPECT_EQ(PlanOf(testing::RandomTree(20, SpaceKind::kPlanar, 1)).loop_joins(), 0);
}

TEST(PlanTest, OneByOneNeverJoinsSeveralJointsAtOnce) {
  const Plan plan =
      PlanOf(testing::RandomGraph(5, SpaceKind::kPlanar, 1), {.closing = Closing::kOneByOne});
  for (const PlanNode& node : plan.nodes()) EXPECT_EQ(node.joints.size(), 1u);
}

TEST(PlanTest, PartsWithoutConnectionHaveTheirOwnRoots) {
  const std::vector<PlanJoint> joints = {{0, 0, 1, 2}, {1, 1, 2, 2}, {2, 3, 4, 2}};
  const Plan plan(6, joints);
  ExpectProper(plan, 3);
  std::vector<bool> has_parent(plan.num_nodes(), false);
  for (const PlanNode& node : plan.nodes()) {
    for (int child : node.children) {
      if (child >= 0) has_parent[child] = true;
    }
  }
  EXPECT_EQ(std::ranges::count(has_parent, false), 3) << "two parts and a body alone";
}

TEST(PlanTest, AHubWithManyArmsKeepsSmallJoins) {
  std::vector<PlanJoint> joints = {{0, 0, 1, 2}};
  for (int arm = 1; arm <= 100; ++arm) joints.push_back({arm, 1, arm + 1, 2});
  const Plan plan(102, joints);
  ExpectProper(plan, 101);
  EXPECT_EQ(plan.largest_join(), 2);
  EXPECT_LE(plan.most_handles(), 2);
}

TEST(PlanTest, PlanIsAFunctionOfTheGraph) {
  const MechanismDescription graph = testing::RandomGraph(5, SpaceKind::kPlanar, 2);
  const Plan a = PlanOf(graph), b = PlanOf(graph);
  ASSERT_EQ(a.nodes().size(), b.nodes().size());
  for (std::size_t k = 0; k < a.nodes().size(); ++k) {
    EXPECT_EQ(a.nodes()[k].children[0], b.nodes()[k].children[0]);
    EXPECT_EQ(a.nodes()[k].children[1], b.nodes()[k].children[1]);
    EXPECT_TRUE(std::ranges::equal(a.nodes()[k].kept, b.nodes()[k].kept));
  }
}

TEST(PlanTest, EveryOptionGivesTheSameAccelerations) {
  for (SpaceKind space : {SpaceKind::kPlanar, SpaceKind::kSpatial}) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      const MechanismDescription graph = testing::RandomGraph(4, space, seed);
      const auto run = [&]<class Space>(Space) {
        const testing::Sample<Space> sample(graph, seed);
        const State& state = sample.state(Coordinates::kJoint);
        for (const PlanOptions& options : kAllOptions) {
          for (SolverKind solver : {SolverKind::kAsPublished, SolverKind::kRankRevealing}) {
            Odca<Space, double> odca(sample.mechanism(Coordinates::kJoint), {.solver = solver},
                                     options);
            VectorX<double> udot;
            ASSERT_EQ(odca.Evaluate(0.0, state.q, state.u, udot), Outcome::kFinished);
            EXPECT_LE(RelativeError(udot, sample.udot(Coordinates::kJoint)), sample.Bound());
          }
        }
      };
      space == SpaceKind::kPlanar ? run(Planar{}) : run(Spatial{});
    }
  }
}

}  // namespace
}  // namespace loopbench::odca
