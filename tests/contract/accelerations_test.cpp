// Accelerations and joint forces of O-DCA against the oracle, family by family: within
// 100 eps n / rcond for every sample, within 1e-12 where rcond is above 1e-2, in both coordinate
// sets. The worst of each family is printed.
#include "harness/config/mechanism_reader.h"
#include "tests/contract/comparison.h"

namespace loopbench::testing {
namespace {

constexpr SpaceKind kPlane = SpaceKind::kPlanar, kSpace = SpaceKind::kSpatial;

/// Nine of ten samples of a family must be well conditioned.
constexpr double kShare = 0.9;

/// Planar loops in space carry self-stress: as published must say so, and where both spaces run
/// their accelerations agree to the bound. Both samples are the same state.
void HoldInSpace(const MechanismDescription& description, std::uint64_t seed, Family& family) {
  const Sample<Planar> plane(description, seed);
  const Sample<Spatial> space(description, seed);
  ASSERT_EQ(plane.state(Coordinates::kJoint).q, space.state(Coordinates::kJoint).q);
  EXPECT_LT(RelativeError(space.udot(Coordinates::kJoint).cast<double>(), plane.answer().udot),
            plane.Bound());
  family.Hold(space, false);
  EXPECT_EQ(space.answer().rank, plane.answer().rank);
  for (Coordinates coordinates : {Coordinates::kJoint, Coordinates::kAbsolute}) {
    const Comparison published = CompareOdca(space, coordinates, SolverKind::kAsPublished);
    EXPECT_EQ(published.outcome, Outcome::kSingular) << description.name;
  }
}

/// Sizes and seeds of samples.
using Draws = std::vector<std::pair<int, std::uint64_t>>;

Draws Each(const std::vector<int>& sizes, std::uint64_t seeds) {
  Draws draws;
  for (int n : sizes) {
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) draws.emplace_back(n, seed);
  }
  return draws;
}

/// Different seeds for every size from 1 on.
Draws EachOfItsOwn(int sizes, int draws) {
  Draws all;
  for (int n = 1; n <= sizes; ++n) {
    for (int k = 1; k <= draws; ++k) all.emplace_back(n, 100 * n + k);
  }
  return all;
}

Draws With(Draws draws, int n) {
  draws.emplace_back(n, 1);
  return draws;
}

/// Holds a family of `draw(size, space, seed)` in this space.
template <class Space>
void Hold(const std::string& name, const Draws& draws, const auto& draw, bool as_published = true,
          double share = kShare) {
  Family family(name, share);
  const SpaceKind space = Space::kRot == 1 ? kPlane : kSpace;
  for (const auto& [n, seed] : draws) {
    family.Hold(Sample<Space>(draw(n, space, seed), seed), as_published);
  }
  family.Finish();
}

/// Compares planar mechanisms with the same ones in space.
void HoldInSpace(const std::string& name, const Draws& draws, const auto& draw) {
  Family family(name, kShare);
  for (const auto& [n, seed] : draws) HoldInSpace(draw(n, kPlane, seed), seed, family);
  family.Finish();
}

TEST(AccelerationsTest, PaperScenesAgreeWithTheOracle) {
  Family plane("paper problems", kShare), space("paper problems in space", kShare);
  for (const char* name : {"square-four-bar", "square-seven-bar", "four-bar", "seven-bar",
                           "general-seven-bar", "parallelogram", "toggle", "dead-centre"}) {
    const MechanismDescription scene =
        harness::ReadMechanism(std::string(LOOPBENCH_SOURCE_DIR) + "/configs/mechanisms/" + name +
                               ".json")
            .description;
    const Mechanism<Planar, double> mechanism(scene, Coordinates::kJoint);
    const Start<double> start = Assemble(scene, mechanism);
    ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      plane.Hold(Sample<Planar>(scene, seed, start.q), true);
      space.Hold(Sample<Spatial>(scene, seed, start.q), false);
    }
  }
  plane.Finish();
  space.Finish();
}

TEST(AccelerationsTest, ClosedChainsAgreeWithTheOracle) {
  Hold<Planar>("closed chains, plane", With(Each({3, 4, 5, 7, 10, 20, 50}, 6), 200), RandomChain);
  Hold<Spatial>("closed chains, space", With(Each({7, 8, 9, 12, 20, 50}, 6), 200), RandomChain);
}

TEST(AccelerationsTest, SphericalChainsAgreeWithTheOracle) {
  Family family("spherical chains, space", kShare);
  for (const auto& [n, seed] : Each({3, 4, 5, 6, 8}, 4)) {
    const Sample<Spatial> sample(SphericalChain(n, seed), seed);
    EXPECT_EQ(sample.answer().rank, 2) << "of 5 rows, three are redundant";
    family.Hold(sample, false);
  }
  family.Finish();
}

TEST(AccelerationsTest, PlanarOnesInSpaceAgreeWithTheOracleWhereRankIsRevealed) {
  HoldInSpace("planar chains in space", Each({3, 4, 5, 8, 20}, 4), RandomChain);
  HoldInSpace("planar ladders in space", EachOfItsOwn(4, 6), RandomLadder);
  HoldInSpace("planar graphs in space", EachOfItsOwn(6, 3), RandomGraph);
}

TEST(AccelerationsTest, TreesAgreeWithTheOracle) {
  Hold<Planar>("trees, plane", Each({2, 5, 12, 40}, 4), RandomTree);
  Hold<Spatial>("trees, space", With(Each({2, 5, 12, 40}, 4), 120), RandomTree);
}

TEST(AccelerationsTest, LaddersAgreeWithTheOracle) {
  Hold<Planar>("ladders, plane", With(EachOfItsOwn(4, 6), 40), RandomLadder);
  Hold<Spatial>("ladders, space", EachOfItsOwn(4, 6), RandomLadder);
}

TEST(AccelerationsTest, GraphsAgreeWithTheOracle) {
  Hold<Planar>("graphs, plane", EachOfItsOwn(6, 5), RandomGraph);
  Hold<Spatial>("graphs, space", EachOfItsOwn(6, 3), RandomGraph);
}

TEST(AccelerationsTest, GraphsOfEveryJointAgreeWithTheOracle) {
  const auto draw = [](int loops, SpaceKind space, std::uint64_t seed) {
    return MixedGraph(loops, space, seed);
  };
  Hold<Planar>("every joint, plane", EachOfItsOwn(6, 4), draw);
  Hold<Spatial>("every joint, space", EachOfItsOwn(6, 4), draw);
}

/// Kinds that random graphs got later, too: draws of their own.
TEST(AccelerationsTest, GraphsOfAllKindsInSpaceAgreeWithTheOracle) {
  const auto draw = [](int loops, SpaceKind space, std::uint64_t seed) {
    return MixedGraph(loops, space, seed, static_cast<int>(seed) % 3, DrawnKinds::kAll);
  };
  Hold<Spatial>("all kinds, space", EachOfItsOwn(6, 4), draw);
}

TEST(AccelerationsTest, DrivenGraphsOfEveryJointAgreeWithTheOracle) {
  const auto draw = [](int loops, SpaceKind space, std::uint64_t seed) {
    return MixedGraph(loops, space, seed, 1 + static_cast<int>(seed) % 4);
  };
  Hold<Planar>("driven, plane", EachOfItsOwn(6, 4), draw);
  Hold<Spatial>("driven, space", EachOfItsOwn(6, 4), draw);
}

/// No condition on rcond: an early closure may be ill-conditioned where all of them are not.
TEST(AccelerationsTest, OverconstrainedGraphsAgreeWithTheOracleWhereRankIsRevealed) {
  const auto draw = [](int loops, SpaceKind space, std::uint64_t seed) {
    return RedundantGraph((space == kPlane ? 3 : 7) * loops, loops, space, seed);
  };
  Hold<Planar>("redundant graphs, plane", Each({2, 3, 4, 5, 6}, 4), draw, false, 0.0);
  Hold<Spatial>("redundant graphs, space", Each({2, 3, 4, 5, 6}, 4), draw, false, 0.0);
}

/// Loops of the same links: rcond is 1e-2 to 1e-6.
TEST(AccelerationsTest, GraphsWithTightLoopsKeepTheBound) {
  const auto draw = [](int n, SpaceKind space, std::uint64_t seed) {
    return TightGraph(n, space == kPlane ? 6 : 4, space, seed);
  };
  Hold<Planar>("tight graphs, plane", Each({30}, 6), draw, true, 0.0);
  Hold<Spatial>("tight graphs, space", Each({45}, 6), draw, true, 0.0);
}

}  // namespace
}  // namespace loopbench::testing
