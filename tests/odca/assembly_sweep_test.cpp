// The sweep over assemblies of pins against the general one, which the contract suite holds to an
// oracle. What every short cut must do is in short_cut_test.cpp.
#include "mechanism/description/library.h"
#include "tests/odca/served.h"

namespace loopbench::odca::pins::assembly_sweep_test {

using Model = Mechanism<Planar, double>;

std::unique_ptr<ShortCut<Planar>> Make(const Model& mechanism, const PlanOptions& options = {}) {
  return MakeAssemblySweep(mechanism, MakePlan(mechanism, options));
}

/// Joints may have drifted apart by as much as they please.
void Hold(const Model& mechanism, const PlanOptions& options, const Numbers& q, const Numbers& u,
          Tally& tally) {
  for (const SpeedsUsed speeds : {SpeedsUsed::kGiven, SpeedsUsed::kCompleted}) {
    const auto sweep = Make(mechanism, options);
    const Both both = Compare<Planar>(mechanism, sweep.get(), speeds, q, u, options);
    tally.Add(both, mechanism.num_bodies(), mechanism.name());
  }
}

TEST(AssemblySweep, AgreesWithTheGeneralSweepWhereverJointsHaveDrifted) {
  for (const Grounding grounding : {Grounding::kEager, Grounding::kAtRoot}) {
    for (const BoundaryBasis basis : {BoundaryBasis::kBodies, BoundaryBasis::kCheapest}) {
      Tally tally;
      int made = 0;
      for (int n = 1; n <= 40; ++n) {
        for (std::uint64_t seed = 1; seed <= 12; ++seed) {
          const MechanismDescription drawn =
              RandomBranches(n, 100 * seed + n, seed % 2 == 0 ? n : 0);
          const Model mechanism(drawn, Coordinates::kJoint);
          const PlanOptions options = {.grounding = grounding, .basis = basis};
          if (Make(mechanism, options) == nullptr) continue;
          ++made;
          Random random(seed);
          const Numbers q = RandomNumbers(random, mechanism.num_q(), 4.0);
          const Numbers u = RandomNumbers(random, mechanism.num_u(), 2.0);
          Hold(mechanism, options, q, u, tally);
        }
      }
      tally.Finish(0.05);
      EXPECT_GT(made, 400) << "it has less to multiply but for a few";
      EXPECT_LE(2 * tally.regularized, tally.states);
    }
  }
}

TEST(AssemblySweep, AgreesOnTreesAndGrids) {
  Tally tally;
  const auto hold = [&](const MechanismDescription& description) {
    const Model mechanism(description, Coordinates::kJoint);
    Random random(1);
    const auto [q, u] = StateNear(description, mechanism, 1e-4, random);
    Hold(mechanism, {}, q, u, tally);
  };
  for (const int n : {3, 10, 63, 1000}) hold(Tree(n, 1.0));
  for (const int n : {1, 2, 3, 6}) hold(Grid(n, n, 1.1, -0.7));
  for (const int n : {2, 9}) hold(Grid(2, n, 1.1, -0.7));
  hold(Hub(3, 2, false));
  hold(Hub(3, 3, true));
  EXPECT_EQ(tally.regularized, 0);
  EXPECT_EQ(tally.refused, 0);
}

/// A bar with two pins on Ground, whichever of them is cut: it stands still, and X has rank one.
TEST(AssemblySweep, RefusesABodyThatIsHeldTwice) {
  for (const Grounding grounding : {Grounding::kEager, Grounding::kAtRoot}) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      Builder b("held", SpaceKind::kPlanar, seed);
      const int body = b.AddBody(1.0);
      for (const int j : {0, 1}) {
        b.description.joints.push_back(Pin(b.random, kGround, body));
        b.description.joints.back().name = "j" + std::to_string(j);
        b.description.joints.back().cut = j == static_cast<int>(seed % 2);
      }
      const Model mechanism(b.description, Coordinates::kJoint);
      const auto sweep = Make(mechanism, {.grounding = grounding});
      if (sweep == nullptr) continue;
      const Numbers q = Numbers::Constant(1, 0.3), u = Numbers::Ones(1);
      Numbers qdot = q, udot = q;
      EXPECT_FALSE(sweep->Evaluate(SpeedsUsed::kGiven, nullptr, In(q), In(u), In(qdot), In(udot)));
    }
  }
}

/// Redundant pins where a run starts: refused each time, so not tried.
TEST(AssemblySweep, IsNotTriedInRunsThatStartWhereItIsRefused) {
  for (const double angle : {1e-6, 1.1}) {
    const bool usable = angle > 1.0;
    const MechanismDescription grid = Grid(2, 2, angle, 0.5);
    const Model mechanism(grid, Coordinates::kJoint);
    const auto sweep = Make(mechanism);
    ASSERT_NE(sweep, nullptr);
    Numbers q = testing::DescribedCoordinates(grid, mechanism), qdot = q, udot = q;
    const Numbers still = Numbers::Zero(q.size());
    Kinematics<Planar, double> kinematics(mechanism);
    kinematics.UpdatePosition(q);
    EXPECT_EQ(sweep->IsUsable(kinematics), usable);
    testing::SystemWith<Odca, Planar, double> odca(mechanism, {});
    ASSERT_EQ(odca->Start(0.0, q, still), Outcome::kFinished);
    q.array() += 0.2;
    EXPECT_TRUE(sweep->Evaluate(SpeedsUsed::kGiven, nullptr, In(q), In(still), In(qdot), In(udot)));
    EXPECT_EQ(odca->solver().RightHandSide(SpeedsUsed::kGiven, kinematics, In(q), In(still),
                                           In(qdot), In(udot)),
              usable);
  }
}

/// By Derivative(), whether or not the work that forces do is integrated with the motion.
TEST(AssemblySweep, ServesRunsWhoseWorkIsCounted) {
  int served = 0, with_power = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const MechanismDescription drawn = RandomBranches(8, seed, 8);
    const Model mechanism(drawn, Coordinates::kJoint);
    const testing::State state = testing::ConsistentState(drawn, mechanism, seed);
    for (const Enforcement level : {Enforcement::kAcceleration, Enforcement::kVelocity}) {
      testing::SystemWith<Odca, Planar, double> odca(mechanism, {.enforcement = level});
      ASSERT_EQ(odca->Start(0.0, state.q, state.u), Outcome::kFinished);
      const auto derivative = [&](Numbers& rates, bool examine) {
        Numbers y(odca->size());
        odca->ToState(state.q, state.u, In(y));
        rates.setZero(odca->size());
        const long before = testing::CountAllocations();
        const Outcome outcome = examine ? odca->Examine(0.3, In(y), In(rates))
                                        : odca->Derivative(0.3, In(y), In(rates));
        EXPECT_EQ(testing::CountAllocations(), before);
        ASSERT_EQ(outcome, Outcome::kFinished) << seed;
      };
      Numbers alone, own, general;
      derivative(alone, false);
      odca->IntegrateWork(true);
      derivative(own, false);
      derivative(general, true);
      EXPECT_EQ(alone, own.head(alone.size())) << "the motion has the same bits";
      served += own != general;
      const double size = std::max(1.0, general.cwiseAbs().maxCoeff());
      EXPECT_LE((own - general).cwiseAbs().maxCoeff() / size,
                Bound(mechanism.num_bodies(), odca->diagnostics().rcond));
      const double bound =
          Bound(mechanism.num_bodies(), odca->diagnostics().rcond) * std::max(1.0, state.u.norm());
      Numbers y(odca->size());
      odca->ToState(state.q, state.u, In(y));
      ASSERT_EQ(odca->Look(0.3, In(y)), Outcome::kFinished);
      const Numbers seen = odca->u();
      ASSERT_EQ(odca->FromState(0.3, In(y)), Outcome::kFinished);
      EXPECT_LE((seen - odca->u()).cwiseAbs().maxCoeff(), bound);
      with_power += own.tail(2).cwiseAbs().maxCoeff() > 1e-3;
    }
  }
  EXPECT_GT(with_power, 20);
  EXPECT_GT(served, 30) << "but where bodies are held more than once";
}

/// The same bits with small pieces and 1, 2, 3 and 8 threads, and with one piece. Returns true if
/// everything was accepted.
bool ExpectTheSameBits(const Model& mechanism, long piece, const Numbers& q, const Numbers& u) {
  const auto found = [&](long enough, int threads) {
    PlanOptions options = PlanOptionsOf(SolverKind::kRankRevealing);
    options.piece = enough;
    const Plan plan = MakePlan(mechanism, options);
    const int pieces = static_cast<int>(plan.pieces().size());
    EXPECT_EQ(pieces > 4, enough == piece) << pieces;
    const auto sweep = MakeAssemblySweep(mechanism, plan, threads);
    EXPECT_EQ(sweep->threads(), std::clamp(threads, 1, std::max(1, pieces - 1)));
    return AllOf(*sweep, mechanism, q, u);
  };
  const auto alone = found(piece, 1);
  EXPECT_TRUE(found(1L << 40, 1) == alone) << mechanism.name();
  for (const int threads : {2, 3, 8}) {
    EXPECT_TRUE(found(piece, threads) == alone) << mechanism.name() << ' ' << threads << " threads";
  }
  return alone.back().isOnes(0.0);
}

TEST(AssemblySweep, HasTheSameBitsForAnyNumberOfThreads) {
  const auto expect = [](const MechanismDescription& description, long piece, double size,
                         bool accepted) {
    const Model mechanism(description, Coordinates::kJoint);
    Random random(1);
    const auto [q, u] = StateNear(description, mechanism, size, random);
    EXPECT_EQ(ExpectTheSameBits(mechanism, piece, q, u), accepted) << description.name;
  };
  for (const double drift : {1e-4, 0.02}) {
    expect(Tree(1000, 1.0), 2000, drift, true);
    expect(Ladder(300, -1.0, 0.5), 2000, drift, true);
    expect(Grid(8, 8, 1.1, -0.7), 2000, drift, true);
  }
  expect(Tree(10000, 1.0), PlanOptions().piece, 0.3, true);
  expect(Grid(18, 18, 1.1, -0.7), PlanOptions().piece, 1e-4, true);
  expect(Ladder(300, 0.0, 0.5), 2000, 0.0, false);
  expect(Grid(8, 8, 1e-6, 0.5), 2000, 0.0, false);
  int accepted = 0, rejected = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const Model mechanism(RandomBranches(60, seed, 20), Coordinates::kJoint);
    Random random(seed);
    const Numbers q = RandomNumbers(random, mechanism.num_q(), 4.0);
    const Numbers u = RandomNumbers(random, mechanism.num_u(), 2.0);
    ++(ExpectTheSameBits(mechanism, 500, q, u) ? accepted : rejected);
  }
  EXPECT_GT(accepted, 5);
  EXPECT_GT(rejected, 5);
}

TEST(AssemblySweep, LeavesManyPinsOnABodyToTheGeneralSweep) {
  EXPECT_EQ(Make(Model(Hub(300, 1, false), Coordinates::kJoint)), nullptr) << "300 handles";
}

}  // namespace loopbench::odca::pins::assembly_sweep_test
