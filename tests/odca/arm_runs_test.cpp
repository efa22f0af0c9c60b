// Projections and whole runs by the sweep along arms, against multipliers, which have no short cut.
#include <gtest/gtest.h>

#include <cstdio>
#include <limits>
#include <string>

#include "lagrange/lagrange.h"
#include "odca/arm_sweep.h"
#include "tests/odca/short_cut.h"

namespace loopbench::odca::arms {
namespace {

using testing::Random;

constexpr double kEps = std::numeric_limits<double>::epsilon();

/// What level position makes of an accepted step, by the short cut and in all generality:
/// multipliers have no short cut, and their Newton steps are as long.
TEST(ArmSweep, ProjectsAsTheGeneralWayDoes) {
  int projected = 0, refused = 0;
  double worst = 0.0;
  for (const int n : {7, 8, 9, 12, 16, 30, 60}) {
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
      MechanismDescription chain = testing::RandomChain(n, SpaceKind::kSpatial, seed);
      chain.forces.clear();
      const Mechanism<Spatial, double> mechanism(chain, Coordinates::kJoint);
      const testing::State state = testing::ConsistentState(chain, mechanism, seed);
      Random random(seed);
      testing::SystemWith<lagrange::Lagrange, Spatial, double> general(
          mechanism, {.enforcement = Enforcement::kPosition});
      const auto half = static_cast<std::size_t>(mechanism.num_q());
      Numbers y(2 * mechanism.num_q());
      y << state.q, state.u;
      ASSERT_EQ(general->Start(0.0, state.q, state.u), Outcome::kFinished);
      y += RandomNumbers(random, static_cast<int>(y.size()), 1e-6);
      Numbers expected = y, own = y;
      if (!general->BeginStep(0.0, In(expected))) continue;
      const Correction<double> by_parts = general->level().correction();
      const double rcond = general->diagnostics().rcond;
      if (general->diagnostics().smallest_weight < 1.0) continue;
      const auto sweep = ArmSweep::Make(mechanism, 2, 2 * kLanes);
      const double goal = 4.0 * kEps * mechanism.num_bodies() * mechanism.length();
      const auto correction = sweep->Project(In(own).first(half), In(own).subspan(half), goal);
      if (!correction) {
        ++refused;
        EXPECT_EQ(own, y) << chain.name << ": refused, so left alone";
        continue;
      }
      ++projected;
      EXPECT_NEAR(correction->shift, by_parts.shift, 1e-3 * by_parts.shift + goal);
      EXPECT_NEAR(correction->rotation, by_parts.rotation, 1e-3 * by_parts.rotation + goal);
      EXPECT_GE(correction->iterations, 1);
      // both stop within some round-offs of the mismatch; what that leaves in q is its inverse
      const double size = std::max(1.0, expected.tail(mechanism.num_u()).cwiseAbs().maxCoeff());
      const double of_bound = (own - expected).cwiseAbs().maxCoeff() / size / Bound(n, rcond);
      EXPECT_LE(of_bound, 1.0) << chain.name << " rcond " << rcond;
      worst = std::max(worst, of_bound);
    }
  }
  std::printf("%d states, %d refused, worst %.2g of the bound\n", projected, refused, worst);
  EXPECT_GT(projected, 50) << "else this test says little";
  EXPECT_LE(5 * refused, projected);
}

/// Classical Runge-Kutta, as a formulation with its level has it.
template <template <class, class> class Solver>
Numbers WholeRun(const Mechanism<Spatial, double>& mechanism, Enforcement level, const Numbers& q,
                 const Numbers& u, int steps, double h, int* refused = nullptr) {
  testing::SystemWith<Solver, Spatial, double> system(mechanism, {.enforcement = level});
  EXPECT_EQ(system->Start(0.0, q, u), Outcome::kFinished);
  const auto sweep = ArmSweep::Make(mechanism);
  Numbers y(q.size() + u.size()), k[4], out_of_use = y;
  y << q, u;
  const auto n = static_cast<std::size_t>(q.size());
  for (int step = 0; step < steps; ++step) {
    const double t = h * step;
    system->BeginStep(t, In(y));
    const SpeedsUsed speeds =
        level == Enforcement::kVelocity ? SpeedsUsed::kCompleted : SpeedsUsed::kGiven;
    if (refused != nullptr && !sweep->Evaluate(speeds, In(y).first(n), In(y).last(n),
                                               In(out_of_use).first(n), In(out_of_use).last(n))) {
      ++*refused;
    }
    for (int stage = 0; stage < 4; ++stage) {
      const double part = stage == 0 ? 0.0 : stage == 3 ? h : h / 2;
      const Numbers at = stage == 0 ? y : Numbers(y + part * k[stage - 1]);
      k[stage] = Numbers::Zero(y.size());
      EXPECT_EQ(system->Derivative(t + part, In(at), In(k[stage])), Outcome::kFinished);
    }
    y += h / 6 * (k[0] + 2.0 * k[1] + 2.0 * k[2] + k[3]);
  }
  return y;
}

/// Whole runs by O-DCA and by multipliers, which have no short cut. Of chains with one freedom some
/// come near degenerate positions, where O-DCA changes to the general sweep and back. Rounding
/// differs by 100 eps n / rcond per evaluation, and the least rcond is the limit of 1e-4.
TEST(ArmSweep, WholeRunsAgreeWithMultipliers) {
  constexpr int kSteps = 250;
  for (const Enforcement level :
       {Enforcement::kAcceleration, Enforcement::kVelocity, Enforcement::kPosition}) {
    int refused = 0, runs = 0;
    double worst = 0.0;
    for (std::uint64_t seed = 1; seed <= 30; ++seed, ++runs) {
      MechanismDescription chain = testing::RandomChain(6, SpaceKind::kSpatial, seed);
      chain.forces.clear();
      const Mechanism<Spatial, double> mechanism(chain, Coordinates::kJoint);
      const auto [q, u] = testing::ConsistentState(chain, mechanism, seed);
      const Numbers own = WholeRun<Odca>(mechanism, level, q, u, kSteps, 4e-3, &refused);
      const Numbers other = WholeRun<lagrange::Lagrange>(mechanism, level, q, u, kSteps, 4e-3);
      const double size = std::max(1.0, other.cwiseAbs().maxCoeff());
      worst = std::max(worst, (own - other).cwiseAbs().maxCoeff() / size);
    }
    std::printf("level %s: %d runs, %d of %d steps refused, largest difference %.1e\n",
                std::string(ToString(level)).c_str(), runs, refused, runs * kSteps, worst);
    EXPECT_LE(worst, Bound(6, 1e-4));
    EXPECT_GT(refused, 0) << "else nothing changes on the way";
    EXPECT_LT(10 * refused, runs * kSteps);
  }
}

}  // namespace
}  // namespace loopbench::odca::arms
