// Accelerations of random mechanisms by Simbody, with joints of every kind in the tree and as
// closures, the other way round too, against the contract's oracle in long double.
#include <gtest/gtest.h>

#include "mechanism/simplify/compile.h"
#include "tests/contract/builder.h"
#include "tests/peers/expressible.h"
#include "tests/peers/registered.h"

namespace loopbench::testing {
namespace {

template <class Space>
int CompareMany(SpaceKind space) {
  int compared = 0;
  const auto compare = [&](MechanismDescription description, std::uint64_t seed) {
    KeepExpressible(description);
    const auto error = PeerError<Space>("peer/simbody", description, seed);
    if (!error) return;
    EXPECT_LE(error->relative, error->bound) << description.name;
    ++compared;
  };
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    compare(AnyMechanism(6, 0, 0, space, seed), seed);
    compare(RandomTree(8, space, seed), seed);
    compare(MixedGraph(2, space, seed), seed);
    compare(TightGraph(space == SpaceKind::kPlanar ? 12 : 24, 2, space, seed), seed);
  }
  return compared;
}

TEST(RandomAccelerations, OfJointsOfEveryKindInThePlaneAreSimbodys) {
  EXPECT_EQ(CompareMany<Planar>(SpaceKind::kPlanar), 120);
}

TEST(RandomAccelerations, OfJointsOfEveryKindInSpaceAreSimbodys) {
  // but for helical joints that close a loop
  EXPECT_GE(CompareMany<Spatial>(SpaceKind::kSpatial), 100);
}

/// Loops of revolute joints and a translation, closed by kinds that mixed graphs do not draw.
TEST(RandomAccelerations, OfClosuresByOtherKindsAreSimbodys) {
  for (const JointType type : {JointType::kTranslation, JointType::kSchoenflies,
                               JointType::kPointOnLine, JointType::kPointInPlane}) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      Builder b("closed-by-" + std::string(ToString(type)), SpaceKind::kSpatial, seed);
      int last = 0;
      for (int i = 0; i < 7; ++i) {
        const int body = b.AddBody(1.0);
        const Eigen::Vector3d at = b.Tip();
        b.AddJoint(i == 3 ? JointType::kTranslation : JointType::kRevolute, last, at, body,
                   b.random.Vector(0.2, true), b.random.Uniform(-2.0, 2.0));
        last = body;
      }
      b.Close(type, 0, last, b.Tip(), 0.0);
      MechanismDescription loop = b.Finish();
      KeepExpressible(loop);
      const auto error = PeerError<Spatial>("peer/simbody", loop, seed);
      ASSERT_TRUE(error.has_value());
      EXPECT_LE(error->relative, error->bound) << loop.name;
    }
  }
}

TEST(RandomAccelerations, OfClosuresWithReleasedDirectionsAreSimbodys) {
  // axes that meet in one point: three of five rows of the closure say nothing, and rotations
  // decide; of the same mechanism with all five the oracle finds the rank
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    MechanismDescription chain = SphericalChain(4, seed);
    KeepExpressible(chain);
    const MechanismDescription released = Compile(chain, {}).parts.front().description;
    ASSERT_EQ(released.joints.size(), chain.joints.size());
    EXPECT_EQ(released.joints.back().released.size(), 3u);
    const auto error = PeerError<Spatial>("peer/simbody", chain, seed, &released);
    ASSERT_TRUE(error.has_value());
    EXPECT_LE(error->relative, error->bound) << chain.name;
  }
}

TEST(RandomAccelerations, WithRotorsAreSimbodys) {
  EXPECT_GE(CompareRotors<Planar>("peer/simbody", SpaceKind::kPlanar), 20);
  EXPECT_GE(CompareRotors<Spatial>("peer/simbody", SpaceKind::kSpatial), 20);
}

}  // namespace
}  // namespace loopbench::testing
