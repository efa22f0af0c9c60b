// Families of mechanisms: their loops, degrees of freedom and starts.
#include "mechanism/description/library.h"

#include <gtest/gtest.h>

#include "mechanism/formulation/system.h"
#include "mechanism/start/assembly.h"
#include "odca/odca.h"

namespace loopbench {
namespace library_test {

struct Shape {
  int loops, freedom;
};

template <class Space = Planar>
Shape ShapeOf(const MechanismDescription& description) {
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  const Start<double> start = Assemble<Space>(description, mechanism);
  EXPECT_EQ(start.outcome, Outcome::kFinished) << description.name << ": " << start.message;
  const auto formulation = MakeSystem<odca::Odca>(mechanism);
  VectorX<double> udot;
  EXPECT_EQ(formulation->Evaluate(0.0, start.q, start.u, udot), Outcome::kFinished);
  return {mechanism.num_loops(), mechanism.num_joint_speeds() - formulation->diagnostics().rank};
}

TEST(LibraryTest, ChainsHaveOneLoop) {
  const Shape shape = ShapeOf(Chain(7));
  EXPECT_EQ(shape.loops, 1);
  EXPECT_EQ(shape.freedom, 5);
}

TEST(LibraryTest, LaddersHaveALoopPerWindowAndOneFreedom) {
  const Shape shape = ShapeOf(Ladder(5, -1.0, 0.5));
  EXPECT_EQ(shape.loops, 5);
  EXPECT_EQ(shape.freedom, 1);
}

TEST(LibraryTest, GridsHaveALoopPerWindowAndAFreedomPerStorey) {
  const Shape shape = ShapeOf(Grid(3, 4, -1.0, 0.5));
  EXPECT_EQ(shape.loops, 12);
  EXPECT_EQ(shape.freedom, 3);
}

TEST(LibraryTest, TreesHaveNoLoopAndTwoBarsOnEachTip) {
  const MechanismDescription tree = Tree(10, 0.1);
  const Shape shape = ShapeOf(tree);
  EXPECT_EQ(shape.freedom, 10);
  EXPECT_EQ(shape.loops, 0);
  EXPECT_EQ(tree.joints[7].from.body, 4);
  EXPECT_EQ(tree.joints[8].from.body, 4);
}

TEST(LibraryTest, HubsHaveALoopPerClosedArm) {
  const Shape open = ShapeOf(Hub(5, 2, false));
  EXPECT_EQ(open.loops, 0);
  EXPECT_EQ(open.freedom, 11);
  const Shape closed = ShapeOf(Hub(5, 3, true));
  EXPECT_EQ(closed.loops, 5);
  EXPECT_EQ(closed.freedom, 6);
}

TEST(LibraryTest, AGridStartsWhereItSays) {
  const MechanismDescription grid = Grid(3, 2, -1.0, 0.5);
  const Mechanism<Planar, double> mechanism(grid, Coordinates::kJoint);
  const Start<double> start = Assemble<Planar>(grid, mechanism);
  ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
  Kinematics<Planar, double> kinematics(mechanism);
  kinematics.UpdatePosition(start.q);
  kinematics.UpdateVelocity(start.u);
  for (int body = 1; body < mechanism.num_bodies(); ++body) {
    const std::string& name = mechanism.body_names()[body];
    const int storey = name[name.find_first_of("123")] - '0';
    const bool crank = name.starts_with("crank");
    // the start is given exactly: what is left is a few sums of angles
    EXPECT_NEAR(kinematics.poses()[body].angle, crank ? -1.0 + 0.1 * (storey - 1) : 0.0, 1e-14);
    EXPECT_NEAR(kinematics.motions()[body][0], crank ? 0.5 * storey : 0.0, 1e-13) << name;
  }
}

TEST(LibraryTest, ArmsAreOpenAndRingsHaveOneLoopThatTakesSixSpeeds) {
  const Shape open = ShapeOf<Spatial>(Arm(9, false));
  EXPECT_EQ(open.loops, 0);
  EXPECT_EQ(open.freedom, 9);
  const Shape closed = ShapeOf<Spatial>(Arm(9, true));
  EXPECT_EQ(closed.loops, 1);
  EXPECT_EQ(closed.freedom, 4);  // nine speeds, five constraints of the joint that is cut
  EXPECT_EQ(ShapeOf<Spatial>(Arm(6, true)).freedom, 1);
}

}  // namespace library_test
}  // namespace loopbench
