// The assembly tree: what is in it, how deep it is, how large its joins are, and that its options
// change the order of the work but not the result.
#include "odca/plan.h"

#include "mechanism/description/library.h"
#include "odca/join_order.h"
#include "odca/odca.h"
#include "tests/contract/comparison.h"
#include "tests/contract/system_with.h"

namespace loopbench::odca::plan_test {

using testing::ConsistentState;
using testing::RelativeError;
using testing::State;
using testing::ToReal;

const std::vector<PlanOptions> kAllOptions = {{Grounding::kEager}, {Grounding::kAtRoot}};

/// All options, with bodies and with the cheapest basis on each boundary.
const std::vector<PlanOptions> kOptionsOfBothBases = {
    {Grounding::kEager},
    {Grounding::kAtRoot},
    {Grounding::kEager, BoundaryBasis::kCheapest},
    {Grounding::kAtRoot, BoundaryBasis::kCheapest}};

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
      EXPECT_LE(PlanOf(Ladder(n, -1.0, 0.5), options).depth(),
                std::log(2 * n + 1) / std::log(1.5) + 4)
          << "ladder of " << n;
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
  EXPECT_EQ(PlanOf(testing::RandomTree(20, SpaceKind::kPlanar, 1)).loop_joins(), 0);
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

/// The boundary of every node is what the graph says: bodies below it with joints closed elsewhere.
void ExpectBoundaries(const Plan& plan, std::span<const PlanJoint> joints) {
  std::vector<std::vector<int>> bodies(plan.num_nodes()), closed(plan.num_nodes());
  std::vector<std::vector<int>> joints_of(plan.num_leaves() + 1);
  for (const PlanJoint& joint : joints) {
    for (int body : {joint.from, joint.to}) joints_of[body].push_back(joint.index);
  }
  const auto boundary = [&](int n) {
    std::set<int> result;
    const std::set<int> done(closed[n].begin(), closed[n].end());
    for (int body : bodies[n]) {
      for (int joint : joints_of[body]) {
        if (!done.contains(joint)) result.insert(body);
      }
    }
    return result;
  };
  for (int n = 0; n < plan.num_leaves(); ++n) bodies[n] = {n + 1};
  for (int k = 0; k < static_cast<int>(plan.nodes().size()); ++k) {
    const PlanNode& node = plan.nodes()[k];
    const int n = plan.num_leaves() + k;
    std::set<int> before, handles, kept;
    for (int child : node.children) {
      if (child < 0) continue;
      before.merge(boundary(child));
      bodies[n].insert(bodies[n].end(), bodies[child].begin(), bodies[child].end());
      closed[n].insert(closed[n].end(), closed[child].begin(), closed[child].end());
    }
    for (const NodeJoint& joint : node.joints) closed[n].push_back(joint.index);
    for (const Handle& handle : node.handles) handles.insert(handle.body);
    for (int h : node.kept) kept.insert(node.handles[h].body);
    EXPECT_FALSE(node.joints.empty());
    EXPECT_EQ(handles, before);
    EXPECT_EQ(kept, boundary(n));
  }
}

TEST(PlanTest, BoundariesAreThoseOfTheGraph) {
  testing::Random random(7);
  for (const PlanOptions& options : kAllOptions) {
    for (int n : {2, 5, 20, 80}) {
      std::vector<PlanJoint> joints;
      for (int j = 0; j < 3 * n / 2; ++j) {
        const int from = random.Below(n + 1), to = random.Below(n + 1);
        if (from != to) joints.push_back({j, from, to, 1 + random.Below(5)});
      }
      const Plan plan(n + 1, joints, options);
      ExpectProper(plan, static_cast<int>(joints.size()));
      ExpectBoundaries(plan, joints);
    }
  }
}

/// Bodies around a hub, each on it; as a wheel each is on the next one too.
std::vector<PlanJoint> Spokes(int num_arms, bool wheel) {
  std::vector<PlanJoint> joints = {{0, 0, 1, 2}};
  const auto add = [&](int from, int to) {
    joints.push_back({static_cast<int>(joints.size()), from, to, 2});
  };
  for (int arm = 2; arm <= num_arms + 1; ++arm) {
    add(1, arm);
    if (wheel) add(arm, arm <= num_arms ? arm + 1 : 2);
  }
  return joints;
}

TEST(PlanTest, AHubTakesItsArmsOneByOne) {
  for (int arms : {100, 1000}) {
    const std::vector<PlanJoint> joints = Spokes(arms, false);
    const Plan plan(arms + 2, joints);
    ExpectProper(plan, arms + 1);
    EXPECT_EQ(plan.largest_join(), 2);
    EXPECT_LE(plan.most_handles(), 2);
    EXPECT_EQ(plan.depth(), arms + 1) << "and the disc's own pin";
  }
}

TEST(PlanTest, ArmsAreFinishedBeforeTheirHubTakesThem) {
  // an arm of 8 bars in a row is three joins deep, and so is the start of the hub's own line
  const Plan plan = PlanOf(Hub(100, 8, false));
  EXPECT_LE(plan.depth(), 100 + 1 + 3);
  EXPECT_LE(plan.most_handles(), 4) << "two pieces of an arm with two ends each";
}

TEST(PlanTest, AWheelKeepsFewBodiesOnItsBoundaries) {
  // of the rim only what one join brings, the two ends of what is joined, and the hub
  const Plan small(102, Spokes(100, true)), large(1002, Spokes(1000, true));
  EXPECT_LE(small.most_handles(), 8);
  EXPECT_LE(large.most_handles(), 8);
  EXPECT_LE(large.operations(), 11 * small.operations());
}

TEST(PlanTest, BarsBetweenSeveralPlatesAreTakenOneByOne) {
  // each bar is on all plates: pairs of bars and plates alone would leave all bars on the boundary
  for (int plates : {2, 3, 5}) {
    const auto plan_of = [&](int bars) {
      std::vector<PlanJoint> joints = {{0, 0, 1, 2}};
      for (int bar = plates + 1; bar <= plates + bars; ++bar) {
        for (int plate = 1; plate <= plates; ++plate) {
          joints.push_back({static_cast<int>(joints.size()), plate, bar, 2});
        }
      }
      return Plan(plates + bars + 1, joints);
    };
    const Plan small = plan_of(100), large = plan_of(1000);
    // the plates, a bar, and while the plates are collected one bar more
    EXPECT_LE(large.most_handles(), plates + 2);
    EXPECT_LE(large.operations(), 11 * small.operations());
  }
}

TEST(PlanTest, GridsCostNoMoreThanNestedDissection) {
  // least squares of log operations against log bodies; small grids have terms of lower order,
  // with either sign, so that single pairs of sizes lie on both sides
  std::vector<double> x, y;
  for (int k : {5, 10, 15, 20, 30}) {
    const Plan plan = PlanOf(Grid(k, k, -1.0, 0.0));
    x.push_back(std::log(plan.num_leaves()));
    y.push_back(std::log(static_cast<double>(plan.operations())));
    // twice a row of cranks and couplers: both sides of a straight cut
    EXPECT_LE(plan.most_handles(), 2 * (2 * k + 1));
    std::printf("grid %2d: %5d bodies, %9ld operations, %2d handles, depth %d\n", k,
                plan.num_leaves(), plan.operations(), plan.most_handles(), plan.depth());
  }
  const Eigen::Map<Eigen::ArrayXd> X(x.data(), 5), Y(y.data(), 5);
  const Eigen::ArrayXd centred = X - X.mean();
  const double exponent = (centred * (Y - Y.mean())).sum() / centred.square().sum();
  std::printf("exponent of operations against bodies: %.3f\n", exponent);
  EXPECT_LE(exponent, 1.5);
}

TEST(PlanTest, DissectionCostsNoMoreThanAnyNumberingOfTheGrid) {
  // the plan may depend on the numbering, but not its quality
  const MechanismDescription grid = Grid(12, 12, -1.0, 0.0);
  const Mechanism<Planar, double> mechanism(grid, Coordinates::kJoint);
  const long straight = MakePlan(mechanism).operations();
  testing::Random random(3);
  const int n = mechanism.num_bodies();
  for (int draw = 0; draw < 5; ++draw) {
    std::vector<int> number(n);
    std::iota(number.begin(), number.end(), 0);
    for (int i = n - 1; i > 1; --i) std::swap(number[i], number[1 + random.Below(i)]);
    std::vector<PlanJoint> joints;
    for (int j = 0; j < static_cast<int>(mechanism.joints().size()); ++j) {
      const Joint<Planar, double>& joint = mechanism.joints()[j];
      joints.push_back({j, number[joint.from], number[joint.to], joint.kind->num_constraints()});
    }
    // ties are broken by number; that is worth a fifth at most on such a grid
    EXPECT_LE(static_cast<double>(Plan(n, joints, {.dim = 3}).operations()),
              1.2 * static_cast<double>(straight));
  }
}

TEST(PlanTest, OperationsAreThoseOfTheSweep) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const MechanismDescription graph = testing::RandomGraph(6, SpaceKind::kSpatial, seed);
    const Mechanism<Spatial, double> mechanism(graph, Coordinates::kJoint);
    const State state = ConsistentState(graph, mechanism, seed);
    for (const PlanOptions& options : kOptionsOfBothBases) {
      testing::SystemWith<Odca, Spatial, double> odca(mechanism, {}, options);
      VectorX<double> udot;
      ASSERT_EQ(odca->Evaluate(0.0, state.q, state.u, udot), Outcome::kFinished);
      if (odca.solver().sweep().regularized()) continue;
      EXPECT_EQ(odca.solver().plan().operations(), odca.solver().sweep().operations());
    }
  }
}

TEST(PlanTest, PiecesShareNoSubtree) {
  const MechanismDescription grid = Grid(8, 8, -1.0, 0.5);
  const Mechanism<Planar, double> mechanism(grid, Coordinates::kJoint);
  PlanOptions options = PlanOptionsOf(SolverKind::kRankRevealing);
  EXPECT_EQ(MakePlan(mechanism, options).pieces().size(), 1u) << "too small";
  options.piece = 1000;
  const Plan plan = MakePlan(mechanism, options);
  const int last = static_cast<int>(plan.pieces().size()) - 1;
  EXPECT_GE(last, 8);
  std::vector<int> piece(plan.num_nodes(), -1);
  for (int i = 0; i <= last; ++i) {
    for (const auto& list : {plan.pieces()[i].nodes, plan.pieces()[i].leaves}) {
      for (const int n : list) {
        EXPECT_EQ(piece[n], -1);
        piece[n] = i;
      }
    }
  }
  EXPECT_EQ(std::ranges::count(piece, -1), 0);
  for (int n = plan.num_leaves(); n < plan.num_nodes(); ++n) {
    for (const int child : plan.nodes()[n - plan.num_leaves()].children) {
      if (child < 0 || piece[n] == last) continue;
      EXPECT_EQ(piece[child], piece[n]);
    }
  }
  for (int n = 0; n < plan.num_leaves(); ++n) {
    const Leaf& leaf = plan.leaves()[n];
    EXPECT_EQ(piece[n], piece[leaf.end < 0 ? n : leaf.end]);
  }
}

std::vector<PlanJoint> ChainOf(int bodies, int rows = 2) {
  std::vector<PlanJoint> joints;
  for (int j = 0; j <= bodies; ++j) joints.push_back({j, j, j < bodies ? j + 1 : 0, rows});
  return joints;
}

TEST(PlanTest, GroundHoldsArms) {
  PlanOptions options = PlanOptionsOf(SolverKind::kRankRevealing);
  options.dim = 6;
  const auto holders = [](const Plan& plan) {
    std::vector<int> all;
    for (const Leaf& leaf : plan.leaves()) all.push_back(leaf.hold.joint < 0 ? -2 : leaf.holder);
    return all;
  };
  // two arms, from both ends, and one join
  const Plan ring(7, ChainOf(6, 5), options);
  EXPECT_EQ(holders(ring), (std::vector<int>{-1, 0, 1, 4, 5, -1}));
  ASSERT_EQ(ring.nodes().size(), 1u);
  EXPECT_TRUE(ring.nodes()[0].closes_loop);
  for (const int n : {0, 1, 2}) {
    EXPECT_EQ(ring.leaves()[n].end, 2);
    EXPECT_EQ(ring.leaves()[n].path, n + 1);
    EXPECT_EQ(ring.leaves()[n].free, 3);
    EXPECT_EQ(ring.leaves()[n].column, 2 - n);
  }
  std::vector<bool> before(6, false);
  for (const int n : ring.leaf_order()) {
    const int holder = ring.leaves()[n].holder;
    EXPECT_TRUE(holder < 0 || before[holder]);
    before[n] = true;
  }
  // at most four free directions in space, one in the plane
  const std::vector<int> of_twelve = holders(Plan(13, ChainOf(12, 5), options));
  EXPECT_EQ(std::ranges::count(of_twelve, -2), 4);
  options.dim = 3;
  EXPECT_EQ(holders(Plan(4, ChainOf(3), options)), (std::vector<int>{-1, -2, -1}));
}

/// A body on Ground holds three bodies, on which a fourth one closes the loops.
TEST(PlanTest, GroundHoldsTrees) {
  PlanOptions options = PlanOptionsOf(SolverKind::kRankRevealing);
  options.dim = 6;
  std::vector<PlanJoint> joints = {{0, 0, 1, 5}, {1, 1, 2, 5}, {2, 1, 3, 5}, {3, 1, 4, 4},
                                   {4, 2, 5, 3}, {5, 3, 5, 3}, {6, 4, 5, 3}};
  const Plan plan(6, joints, options);
  for (const int n : {0, 1, 2, 3}) {
    EXPECT_EQ(plan.leaves()[n].holder, n == 0 ? -1 : 0);
    EXPECT_EQ(plan.leaves()[n].end, 3);
    EXPECT_EQ(plan.leaves()[n].free, 5);
    EXPECT_EQ(plan.leaves()[n].path, std::vector({1, 2, 2, 3})[n]);
    EXPECT_EQ(plan.leaves()[n].column, std::vector({4, 3, 2, 0})[n]);
  }
  EXPECT_EQ(plan.leaves()[4].hold.joint, -1);
  EXPECT_EQ(plan.leaves()[3].sides.size(), 3u) << "of three bodies";
  ASSERT_EQ(plan.nodes().size(), 1u);
  EXPECT_EQ(plan.nodes()[0].rows, 9);
  // with more than six free directions a body remains
  joints[3].rows = 3;
  joints[1].rows = 4;
  EXPECT_EQ(std::ranges::count_if(Plan(6, joints, options).leaves(),
                                  [](const Leaf& leaf) { return leaf.end >= 0; }),
            3);
  // a joint between two bodies of a tree is closed at its leaf
  const std::vector<PlanJoint> loop = {{0, 0, 1, 5}, {1, 1, 2, 5}, {2, 1, 3, 5}, {3, 2, 3, 5}};
  const Plan closed(4, loop, options);
  ASSERT_EQ(closed.nodes().size(), 1u);
  EXPECT_EQ(closed.leaves()[2].end, 2);
  EXPECT_TRUE(closed.nodes()[0].closes_loop);
  EXPECT_EQ(closed.nodes()[0].handles.size(), 2u);
}

/// Joints looked at while the joins of all bodies are put in order.
long Looks(int num_bodies, const std::vector<PlanJoint>& joints) {
  std::vector<int> waiting(static_cast<std::size_t>(num_bodies), 0);
  long looks = 0;
  OrderJoins(num_bodies, joints, waiting, 3, 0, &looks);
  return looks;
}

TEST(PlanTest, PlanningIsNearlyLinear) {
  const auto arms = [](int n) { return Looks(n + 2, Spokes(n, false)); };
  const auto wheel = [](int n) { return Looks(n + 2, Spokes(n, true)); };
  const auto chain = [](int n) { return Looks(n + 1, ChainOf(n)); };
  for (const auto& looks : std::vector<std::function<long(int)>>{arms, wheel, chain}) {
    const long few = looks(1000);
    EXPECT_GE(few, 1000);
    // n log n would be 16 log(16000) / log(1000) = 22.4 times as many, n^2 256 times
    EXPECT_LE(looks(16000), 22.4 * static_cast<double>(few));
  }
}

TEST(PlanTest, BoundariesStayFewInLargeGraphs) {
  constexpr int kMany = 100000;
  EXPECT_EQ(Plan(kMany + 2, Spokes(kMany, false)).most_handles(), 2);
  EXPECT_LE(Plan(kMany + 2, Spokes(kMany, true)).most_handles(), 8);
  EXPECT_LE(Plan(kMany + 1, ChainOf(kMany)).most_handles(), 4);
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
        for (const PlanOptions& options : kOptionsOfBothBases) {
          for (SolverKind solver : {SolverKind::kAsPublished, SolverKind::kRankRevealing}) {
            testing::SystemWith<Odca, Space, double> odca(sample.mechanism(Coordinates::kJoint),
                                                          {.solver = solver}, options);
            VectorX<double> udot;
            ASSERT_EQ(odca->Evaluate(0.0, state.q, state.u, udot), Outcome::kFinished);
            EXPECT_LE(RelativeError(udot, sample.udot(Coordinates::kJoint)), sample.Bound());
          }
        }
      };
      space == SpaceKind::kPlanar ? run(Planar{}) : run(Spatial{});
    }
  }
}

}  // namespace loopbench::odca::plan_test
