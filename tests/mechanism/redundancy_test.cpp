// Which constraints are redundant at generic positions, and what is left without them.
#include "mechanism/redundancy.h"

#include <gtest/gtest.h>

#include <cmath>

#include "mechanism/assembly.h"
#include "mechanism/direction_rows.h"
#include "mechanism/library.h"
#include "mechanism/release_review.h"
#include "mechanism/scaled_loops.h"
#include "tests/mechanism/shipped.h"

namespace loopbench {
namespace {

using testing::Shipped;

int Count(const std::vector<Released>& released) {
  int count = 0;
  for (const Released& out : released) count += static_cast<int>(out.directions.size());
  return count;
}

struct Known {
  const char* name;
  int rows, rank;  ///< of the loops at generic positions, from the literature or by counting
};

void PrintTo(const Known& known, std::ostream* out) { *out << known.name; }

class RedundancyOf : public ::testing::TestWithParam<Known> {};

TEST_P(RedundancyOf, IsWhatIsKnown) {
  const auto& [name, rows, rank] = GetParam();
  const Redundancy found = FindRedundancy(Shipped(name));
  EXPECT_EQ(found.rows, rows);
  EXPECT_EQ(found.rank, rank);
  EXPECT_EQ(Count(found.released), rows - rank);
}

template <class Space>
void ExpectIndependent(const MechanismDescription& description, int rank) {
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  EXPECT_EQ(mechanism.num_rows(), rank);
  const Start<double> start = Assemble<Space>(description, mechanism);
  Kinematics<Space, double> kinematics(mechanism);
  kinematics.UpdatePosition(start.q);
  const LoopSpectrum spectrum = SpectrumOfLoops(kinematics);
  EXPECT_EQ(spectrum.rank, rank) << "what is imposed is independent";
  EXPECT_LT(spectrum.largest / spectrum.singular_values[rank - 1], 50.0) << "and well so";
}

TEST_P(RedundancyOf, LeavesIndependentConstraints) {
  const auto& [name, rows, rank] = GetParam();
  const MechanismDescription description = Shipped(name);
  const MechanismDescription released = Release(description, FindRedundancy(description));
  if (description.space == SpaceKind::kPlanar) {
    ExpectIndependent<Planar>(released, rank);
  } else {
    ExpectIndependent<Spatial>(released, rank);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Mechanisms, RedundancyOf,
    ::testing::Values(Known{"bennett", 5, 2}, Known{"sarrus", 5, 4}, Known{"goldberg", 5, 3},
                      Known{"four-bar-in-space", 5, 2}, Known{"parallelogram-in-space", 5, 2},
                      Known{"three-cranks", 4, 3}, Known{"locomotive", 4, 3},
                      Known{"seven-bar", 4, 4}, Known{"spatial-four-bar", 3, 3},
                      Known{"stewart-platform", 15, 15}, Known{"screw-jack", 5, 1},
                      Known{"driven-four-bar", 2, 2}),
    [](const auto& one) {
      std::string name = one.param.name;
      std::erase(name, '-');
      return name;
    });

TEST(RedundancyTest, ASingularStartIsNoRedundancy) {
  for (const char* name : {"parallelogram-singular-start", "toggle-singular-start"}) {
    const Redundancy found = FindRedundancy(Shipped(name));
    EXPECT_EQ(found.rank_at_start, 1) << name;
    EXPECT_EQ(found.rank, 2) << name;
    EXPECT_TRUE(found.released.empty()) << name;
  }
}

TEST(RedundancyTest, NothingIsReleasedWhereEverythingNearIsSingular) {
  for (const int windows : {2, 10, 40}) {  // flat: few of the windows open on a walk
    const Redundancy found = FindRedundancy(Ladder(windows, 0.0, 0.0));
    EXPECT_EQ(found.rank_at_start, windows);
    EXPECT_EQ(found.rank, 2 * windows);
    EXPECT_TRUE(found.released.empty()) << windows;
  }
}

TEST(RedundancyTest, AChoiceThatServesBadlyIsReplaced) {
  // self-stress of the parallel cranks is along them: of a pin seen from its crank x can be given
  // up and y cannot
  MechanismDescription description = Shipped("three-cranks");
  for (int joint : FindRedundancy(description).cut) description.joints[joint].cut = true;
  for (const int given_up : {0, 1}) {
    description.joints[5].released = {given_up};
    const Mechanism<Planar, double> mechanism(description, Coordinates::kJoint);
    for (const double angle : {0.2, 1.4}) {
      Kinematics<Planar, double> kinematics(mechanism);
      VectorX<double> q(mechanism.num_q());
      q << angle, angle, angle, -angle;
      kinematics.UpdatePosition(q);
      kinematics.UpdateVelocity(VectorX<double>::Ones(mechanism.num_u()));
      ReleaseReview<Planar, double> review;
      EXPECT_EQ(review.Review(kinematics, 0.01), nullptr) << "moved by a hundredth of a turn only";
      const std::vector<Released>* better = review.Review(kinematics, 1.0);
      const int best = 0;
      if (given_up == best) {
        EXPECT_EQ(better, nullptr) << angle;
        continue;
      }
      ASSERT_NE(better, nullptr) << angle;
      ASSERT_EQ(better->size(), 1u);
      EXPECT_EQ(better->front().joint, 5);
      EXPECT_EQ(better->front().directions, std::vector<int>{best}) << angle;
      kinematics.Release(*better);
      kinematics.UpdatePosition(q);
      EXPECT_EQ(kinematics.DirectionOf(5, 0), 1 - best);
      EXPECT_EQ(review.Review(kinematics, 1.0), nullptr) << "and then it stays";
    }
  }
}

TEST(RedundancyTest, ReleasedDirectionsAreStillMeasured) {
  MechanismDescription description = Shipped("bennett");
  const Mechanism<Spatial, double> all(description, Coordinates::kJoint);
  const MechanismDescription less = Release(description, FindRedundancy(description));
  const Mechanism<Spatial, double> released(less, Coordinates::kJoint);
  VectorX<double> q(3);
  q << 1.0, -2.7, -0.9;  // open
  Kinematics<Spatial, double> a(all), b(released);
  a.UpdatePosition(q);
  b.UpdatePosition(q);
  const auto mismatch = [](const Kinematics<Spatial, double>& kinematics) {
    const auto D = kinematics.joints()[3].AllD();
    return Motion<Spatial, double>(D * (D.transpose() * kinematics.ConstraintMismatch(3)));
  };
  EXPECT_GT(mismatch(a).norm(), 0.01);
  EXPECT_LT((mismatch(a) - mismatch(b)).norm(), 1e-15 * 8);  // the same sums in another order
  EXPECT_EQ(b.joints()[3].rows(), 2);
}

}  // namespace
}  // namespace loopbench
