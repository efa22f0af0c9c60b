// Assembly branches against closed forms and known numbers of solutions.
#include "mechanism/start/branches.h"

#include "mechanism/start/assembly.h"
#include "tests/harness/places.h"

namespace loopbench::harness::branches_test {

double ValueOf(const Branch& branch, const std::string& joint) {
  for (const JointValues& values : branch.description.initial.coordinates) {
    if (branch.description.joints[values.joint].name == joint) return values.values.at(0);
  }
  throw std::invalid_argument("no joint " + joint);
}

double Modulo(double angle) { return std::remainder(angle, 2.0 * std::numbers::pi); }

/// The coupler's tip lies on two circles, which intersect twice.
TEST(Branches, AFourBarHasBothIntersectionsOfItsCircles) {
  const MechanismDescription four_bar = Shipped("four-bar").description;
  const Branches branches = FindBranches(four_bar, 50);
  EXPECT_EQ(branches.freedom, 0);
  ASSERT_EQ(branches.found.size(), 2u);
  // bars of 1 m, ground 1.5 m: OA at -1 rad, tip of bar 2 at 1 m from B and from C
  const double bx = std::cos(-1.0), by = std::sin(-1.0), cx = 1.5;
  const double dx = cx - bx, dy = -by, d = std::hypot(dx, dy), h = std::sqrt(1.0 - d * d / 4.0);
  std::vector<double> expected, found;
  for (const double side : {1.0, -1.0}) {
    const double x = dx / 2.0 - side * h * dy / d, y = dy / 2.0 + side * h * dx / d;
    expected.push_back(Modulo(std::atan2(y, x) + 1.0));
  }
  for (const Branch& branch : branches.found) found.push_back(Modulo(ValueOf(branch, "AB")));
  std::ranges::sort(expected);
  std::ranges::sort(found);
  // closed to round-off, amplified by the condition of the intersection, below 10
  for (int k = 0; k < 2; ++k) EXPECT_NEAR(found[k], expected[k], 1e-13);
  // the first branch is the start of the file
  const Mechanism<Planar, double> mechanism(four_bar, Coordinates::kJoint);
  EXPECT_NEAR(Modulo(ValueOf(branches.found[0], "AB")),
              Modulo(Assemble<Planar>(four_bar, mechanism).q[1]), 1e-14);
  EXPECT_EQ(branches.found[0].distance, 0.0);
  // bar 2 turns by the difference of its angles, more than bar 3 or any centre of mass moves
  const double turn = std::abs(Modulo(expected[1] - expected[0]));
  EXPECT_NEAR(branches.found[1].distance, turn, 1e-12);
}

TEST(Branches, KnownNumbersOfSolutions) {
  struct Row {
    const char* name;
    std::size_t count;
  };
  // two loops in series: 2 x 2; three bars in one line at a fixed crank: 2; in space: 2
  for (const Row& row : {Row{"seven-bar", 4},
                         {"general-seven-bar", 4},
                         {"slider-crank", 2},
                         {"square-four-bar", 2},
                         {"four-bar-in-space", 2}}) {
    const Branches branches = FindBranches(Shipped(row.name).description, 100);
    EXPECT_EQ(branches.freedom, 0) << row.name;
    EXPECT_EQ(branches.found.size(), row.count) << row.name;
    int times = 0;
    for (const Branch& branch : branches.found) times += branch.times;
    EXPECT_EQ(times + branches.movable, branches.closed) << row.name;
  }
}

/// If two of its joints coincide, the rest of the Peaucellier linkage turns about them.
TEST(Branches, PositionsThatStillMoveAreCounted) {
  const Branches branches = FindBranches(Shipped("peaucellier").description, 60);
  EXPECT_GT(branches.movable, 0);
  for (const Branch& branch : branches.found) EXPECT_LT(branch.times, 60);
  EXPECT_LE(branches.found.size(), 8u);
}

TEST(Branches, EachIsAStartOfItsOwn) {
  for (const Branch& branch : FindBranches(Shipped("general-seven-bar").description, 100).found) {
    const Mechanism<Planar, double> mechanism(branch.description, Coordinates::kJoint);
    const Start<double> start = Assemble<Planar>(branch.description, mechanism);
    EXPECT_EQ(start.outcome, Outcome::kFinished);
    for (const MissedGuess& missed : FindMissedGuesses(branch.description, start.q)) {
      ADD_FAILURE() << branch.description.joints[missed.joint].name << " misses by " << missed.by;
    }
  }
}

TEST(Branches, FreeMotionsAndOpenLoopsAreNamed) {
  MechanismDescription free = Shipped("four-bar").description;
  free.initial.held.clear();
  const Branches branches = FindBranches(free, 50);
  EXPECT_EQ(branches.freedom, 1);
  EXPECT_EQ(branches.starts, 0);
  MechanismDescription open = Shipped("four-bar").description;
  open.joints.back().to.position.x() += 10.0;
  EXPECT_THROW(FindBranches(open, 50), std::invalid_argument);
}

}  // namespace loopbench::harness::branches_test
