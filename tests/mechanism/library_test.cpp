// Families of mechanisms: their loops, degrees of freedom and starts.
#include "mechanism/formulation/system.h"
#include "odca/odca.h"
#include "tests/mechanism/shipped.h"

namespace loopbench::library_test {

template <class Space>
void ExpectShape(const MechanismDescription& description, int loops, int freedom) {
  SCOPED_TRACE(description.name);
  const testing::Assembled<Space> at(description);
  EXPECT_EQ(at.start.outcome, Outcome::kFinished) << at.start.message;
  const auto formulation = MakeSystem<odca::Odca>(at.mechanism);
  VectorX<double> udot;
  EXPECT_EQ(formulation->Evaluate(0.0, at.start.q, at.start.u, udot), Outcome::kFinished);
  EXPECT_EQ(at.mechanism.num_loops(), loops);
  EXPECT_EQ(at.mechanism.num_joint_speeds() - formulation->diagnostics().rank, freedom);
}

TEST(LibraryTest, FamiliesHaveTheirLoopsAndFreedoms) {
  ExpectShape<Planar>(Chain(7), 1, 5);
  ExpectShape<Planar>(Ladder(5, -1.0, 0.5), 5, 1);
  ExpectShape<Planar>(Grid(3, 4, -1.0, 0.5), 12, 3);
  ExpectShape<Planar>(Tree(10, 0.1), 0, 10);
  ExpectShape<Planar>(Hub(5, 2, false), 0, 11);
  ExpectShape<Planar>(Hub(5, 3, true), 5, 6);
  ExpectShape<Spatial>(Arm(9, false), 0, 9);
  ExpectShape<Spatial>(Arm(9, true), 1, 4);  // nine speeds, five constraints of the joint cut
  ExpectShape<Spatial>(Arm(6, true), 1, 1);
}

TEST(LibraryTest, TreesHaveTwoBarsOnEachTip) {
  const MechanismDescription tree = Tree(10, 0.1);
  EXPECT_EQ(tree.joints[7].from.body, 4);
  EXPECT_EQ(tree.joints[8].from.body, 4);
}

TEST(LibraryTest, AGridStartsWhereItSays) {
  const testing::Assembled<> at(Grid(3, 2, -1.0, 0.5));
  ASSERT_EQ(at.start.outcome, Outcome::kFinished) << at.start.message;
  for (int body = 1; body < at.mechanism.num_bodies(); ++body) {
    const std::string& name = at.mechanism.body_names()[body];
    const int storey = name[name.find_first_of("123")] - '0';
    const bool crank = name.starts_with("crank");
    // the start is given exactly: what is left is a few sums of angles
    EXPECT_NEAR(at.kinematics.poses()[body].angle, crank ? -1.0 + 0.1 * (storey - 1) : 0.0, 1e-14);
    EXPECT_NEAR(at.kinematics.motions()[body][0], crank ? 0.5 * storey : 0.0, 1e-13) << name;
  }
}

}  // namespace loopbench::library_test
