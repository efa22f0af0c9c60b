// What every short cut of right-hand sides must do, whatever it serves.
#include "lagrange/lagrange.h"
#include "odca/pins.h"
#include "odca/revolutes.h"
#include "tests/contract/allocations.h"
#include "tests/odca/served.h"

namespace loopbench::odca::short_cut_test {

template <class Served>
class ShortCutTest : public ::testing::Test {
 public:
  using Space = typename Served::Space;
  using Model = Mechanism<Space, double>;

  static Model Make(const MechanismDescription& description) {
    return Model(description, Coordinates::kJoint);
  }
  static MechanismDescription Chain(int n, std::uint64_t seed) {
    MechanismDescription chain = Served::Closed(n, seed);
    chain.forces.clear();
    return chain;
  }
  /// A state with any angles and speeds; where loops are to be closed, as multipliers at level
  /// position close them, or nothing where they cannot.
  static std::optional<testing::State> AnyState(const MechanismDescription& description,
                                                const Model& model, std::uint64_t seed) {
    Random random(seed);
    const Numbers q = RandomNumbers(random, model.num_q(), 4.0);
    const Numbers u = RandomNumbers(random, model.num_u(), 2.0);
    if (model.num_rows() == 0) return testing::State{q, u};
    testing::SystemWith<lagrange::Lagrange, Space, double> system(
        model, {.enforcement = Enforcement::kPosition});
    EXPECT_EQ(system->Start(0.0, q, u), Outcome::kFinished);
    Numbers y(2 * model.num_q());
    y << q, u;
    system->BeginStep(0.0, In(y));
    const testing::State state{y.head(model.num_q()), y.tail(model.num_u())};
    const auto mismatches = testing::Oracle(description, testing::LayoutOf(model))
                                .ClosureMismatches(state.q.template cast<testing::Real>());
    if (mismatches.cwiseAbs().maxCoeff() > 1e-9) return std::nullopt;
    return state;
  }
};

struct Names {
  template <class Served>
  static std::string GetName(int) {
    return Served::kName;
  }
};
using All = ::testing::Types<AlongPaths, OverAssemblies, AlongArms>;
TYPED_TEST_SUITE(ShortCutTest, All, Names);

/// Masses over eight decades, several pins in one point of a body, a pin at its centre of mass: a
/// force that is right to eps of the heavy body is not for the light one, so neither sweep has more
/// digits than the ratio of masses leaves, and which one has more in a given state is chance. Along
/// many states they must be alike: the median and the worst error against long double within ten
/// times, for hundreds of states spread over seven decades. A join that divides cofactors by det
/// has errors ten thousand times as large in one of a hundred.
TYPED_TEST(ShortCutTest, LosesNoMoreAtExtremesThanTheGeneralSweep) {
  std::vector<double> errors, errors_general;
  for (int n = 2; n <= 24; ++n) {
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
      MechanismDescription drawn = TypeParam::Draw(n, seed);
      Random random(seed);
      double lightest = 1.0, heaviest = 1.0;
      for (std::size_t body = 1; body < drawn.bodies.size(); ++body) {
        const double times = std::pow(10.0, random.Uniform(-4.0, 4.0));
        lightest = std::min(lightest, times);
        heaviest = std::max(heaviest, times);
        drawn.bodies[body].mass *= times;
        drawn.bodies[body].inertia *= times;
        for (JointDescription& joint : drawn.joints) {
          for (JointSide* side : {&joint.from, &joint.to}) {
            if (side->body != static_cast<int>(body)) continue;
            if (body % 4 == 0) side->position = {0.3, 0.4, 0.0};
            if (body % 4 == 1 && random.Chance(0.5)) side->position = drawn.bodies[body].com;
          }
        }
      }
      const auto model = TestFixture::Make(drawn);
      const auto state = TestFixture::AnyState(drawn, model, seed);
      if (!state) continue;
      const Numbers &q = state->q, &u = state->u;
      Numbers qdot(u.size()), own(u.size()), general;
      const auto sweep = TypeParam::Make(model);
      if (!sweep || !sweep->Evaluate(SpeedsUsed::kGiven, nullptr, In(q), In(u), In(qdot), In(own)))
        continue;
      // of the same joins: arms that Ground holds lose a tenth of that, or less
      testing::SystemWith<Odca, typename TypeParam::Space, double> odca(model, {}, PlanOptions());
      ASSERT_EQ(odca->Evaluate(0.0, q, u, general), Outcome::kFinished) << drawn.name;
      const Numbers exact = testing::Oracle(drawn, testing::LayoutOf(model))
                                .Solve(q.cast<testing::Real>(), u.cast<testing::Real>())
                                .udot.template cast<double>();
      // where loops leave no freedom, nothing is left of what was added up
      const double size =
          std::max({exact.cwiseAbs().maxCoeff(), drawn.gravity.norm(), u.squaredNorm()});
      const auto error = [&](const Numbers& udot) {
        return (udot - exact).cwiseAbs().maxCoeff() / size;
      };
      errors.push_back(error(own));
      errors_general.push_back(error(general));
      EXPECT_LE(errors.back(), Bound(n, lightest / heaviest)) << drawn.name;
    }
  }
  std::ranges::sort(errors);
  std::ranges::sort(errors_general);
  const std::size_t middle = errors.size() / 2;
  std::printf("%zu answered, median %.2g (general sweep %.2g), worst %.2g (%.2g)\n", errors.size(),
              errors[middle], errors_general[middle], errors.back(), errors_general.back());
  EXPECT_GT(errors.size(), 300u) << "else this test says little";
  EXPECT_LE(errors[middle], 10.0 * errors_general[middle]);
  EXPECT_LE(errors.back(), 10.0 * errors_general.back());
}

/// Returns the round-off of a sum along all bodies [m]. Each position is rounded, and in the plane
/// each angle, which moves the body's arm by as much. Along paths of 941 states, each way to add up
/// differs from long double by at most 1.9 times the part of the positions.
template <class Space>
double RoundOff(const Mechanism<Space, double>& model, const Numbers& y) {
  double sum = model.num_bodies();
  if constexpr (Space::kRot == 1) {
    Kinematics<Space, double> kinematics(model);
    kinematics.UpdatePosition(y.head(model.num_q()));
    for (const auto& X : kinematics.poses()) sum += std::abs(X.angle);
  }
  return 4.0 * kEps * model.length() * sum;
}

/// Level `projection` after an accepted step, by the fast path and by multipliers, which have none
/// and whose Newton steps are as long.
TYPED_TEST(ShortCutTest, ProjectsAsTheGeneralWayDoes) {
  int projected = 0;
  double worst = 0.0, least_rcond = 1.0;
  for (int n = 2; n <= 60; n += n < 20 ? 1 : 4) {
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
      const MechanismDescription drawn = TypeParam::Draw(n, seed);
      const auto model = TestFixture::Make(drawn);
      if (model.num_rows() == 0) continue;
      const auto closed = TestFixture::AnyState(drawn, model, seed);
      if (!closed) continue;
      // what a step of 1e-6 leaves of it
      Random random(seed);
      const auto half = static_cast<std::size_t>(model.num_q());
      Numbers y(2 * model.num_q());
      y << closed->q, closed->u;
      y += RandomNumbers(random, static_cast<int>(y.size()), 1e-6);
      Numbers expected = y, own = y, served = y;
      testing::SystemWith<lagrange::Lagrange, typename TypeParam::Space, double> general(
          model, {.enforcement = Enforcement::kPosition});
      ASSERT_EQ(general->Start(0.0, closed->q, closed->u), Outcome::kFinished);
      if (!general->BeginStep(0.0, In(expected))) continue;
      const Correction<double> by_parts = general->level().correction();
      const double rcond = general->diagnostics().rcond;
      if (general->diagnostics().smallest_weight < 1.0) continue;
      const double goal = 4.0 * kEps * model.num_bodies() * model.length();
      const auto sweep = TypeParam::Make(model, 2, n > 40 ? 2 * kLanes : n);
      const auto correction = sweep->Project(In(own).first(half), In(own).subspan(half), goal);
      // a short cut is refused near degenerate positions only, and none of these is near one
      ASSERT_TRUE(correction) << drawn.name << " rcond " << rcond;
      ++projected;
      least_rcond = std::min(least_rcond, rcond);
      // what was open before: each adds up all bodies
      const double round_off = RoundOff(model, y);
      EXPECT_NEAR(correction->shift, by_parts.shift, 2.0 * round_off);
      EXPECT_NEAR(correction->rotation, by_parts.rotation, 2.0 * round_off / model.length());
      EXPECT_GE(correction->iterations, by_parts.iterations > 0 ? 1 : 0);
      // both stop within some round-offs of the mismatch; what that leaves in q is its inverse
      const double size = std::max(1.0, expected.tail(model.num_u()).cwiseAbs().maxCoeff());
      const double of_bound = (own - expected).cwiseAbs().maxCoeff() / size / Bound(n, rcond);
      EXPECT_LE(of_bound, 1.0) << drawn.name << " rcond " << rcond;
      worst = std::max(worst, of_bound);
    }
  }
  std::printf("%d states, least rcond %.2g, worst %.2g of the bound\n", projected, least_rcond,
              worst);
  EXPECT_GT(projected, 50) << "else this test says little";
}

/// A system by O-DCA goes by the short cut where it serves, for rates and for projections.
TYPED_TEST(ShortCutTest, IsWhatTheSystemGoesByWhereItServes) {
  const MechanismDescription chain = TestFixture::Chain(2 * TypeParam::kOneFreedom, 2);
  const auto model = TestFixture::Make(chain);
  const auto [q, u] = testing::ConsistentState(chain, model, 2);
  const auto sweep = TypeParam::Make(model);
  const auto n = static_cast<std::size_t>(model.num_q());
  Numbers y(2 * model.num_q()), shortest(y), examined(y), own(y);
  for (const Enforcement level : {Enforcement::kAcceleration, Enforcement::kPosition,
                                  Enforcement::kVelocity, Enforcement::kBaumgarte}) {
    testing::SystemWith<Odca, typename TypeParam::Space, double> odca(model,
                                                                      {.enforcement = level});
    ASSERT_EQ(odca->Start(0.0, q, u), Outcome::kFinished);
    odca->ToState(q, u, In(y));
    ASSERT_EQ(odca->Derivative(0.0, In(y), In(shortest)), Outcome::kFinished);
    ASSERT_EQ(odca->Examine(0.0, In(y), In(examined)), Outcome::kFinished);
    const bool completed = level == Enforcement::kVelocity;
    const bool serves = level != Enforcement::kBaumgarte;
    ASSERT_TRUE(sweep->Evaluate(completed ? SpeedsUsed::kCompleted : SpeedsUsed::kGiven, nullptr,
                                In(q), In(u), In(own).first(n), In(own).last(n)));
    EXPECT_EQ(shortest == own, serves) << ToString(level);
    EXPECT_EQ(shortest == examined, !serves) << ToString(level);
    if (level != Enforcement::kPosition) continue;
    y.array() += 1e-6;
    Numbers expected = y;
    ASSERT_TRUE(sweep->Project(In(expected).first(n), In(expected).last(n), 0.0));
    ASSERT_TRUE(odca->solver().Project(In(y).first(n), In(y).last(n), 0.0));
    EXPECT_EQ(y, expected);
  }
}

/// Classical Runge-Kutta, as a formulation with its level has it.
template <template <class, class> class Solver, class Served>
Numbers WholeRun(const Mechanism<typename Served::Space, double>& model, Enforcement level,
                 const testing::State& start, int steps, double h, int* refused = nullptr) {
  testing::SystemWith<Solver, typename Served::Space, double> system(model, {.enforcement = level});
  EXPECT_EQ(system->Start(0.0, start.q, start.u), Outcome::kFinished);
  const auto sweep = Served::Make(model);
  Kinematics<typename Served::Space, double> kinematics(model);
  Numbers y(start.q.size() + start.u.size()), k[4], out_of_use = y;
  y << start.q, start.u;
  const auto n = static_cast<std::size_t>(start.q.size());
  for (int step = 0; step < steps; ++step) {
    const double t = h * step;
    system->BeginStep(t, In(y));
    const SpeedsUsed speeds =
        level == Enforcement::kVelocity ? SpeedsUsed::kCompleted : SpeedsUsed::kGiven;
    if (refused != nullptr && !sweep->Evaluate(speeds, &kinematics, In(y).first(n), In(y).last(n),
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
/// come near degenerate positions, where O-DCA changes to the general sweep and back. Where forces
/// other than gravity are taken, half of them have some, of time and speeds, too. Rounding
/// differs by 100 eps n / rcond per evaluation, and the least rcond is the limit of 1e-4.
TYPED_TEST(ShortCutTest, WholeRunsAgreeWithMultipliers) {
  constexpr int kSteps = 250;
  for (const Enforcement level :
       {Enforcement::kAcceleration, Enforcement::kVelocity, Enforcement::kPosition}) {
    int refused = 0, runs = 0;
    double worst = 0.0;
    for (std::uint64_t seed = 1; seed <= 30; ++seed, ++runs) {
      MechanismDescription chain = TestFixture::Chain(TypeParam::kOneFreedom, seed);
      if (TypeParam::kTakesForces && seed % 2 == 0) {
        testing::Builder builder("", TypeParam::kSpace, seed);
        builder.description = chain;
        builder.AddForces(6);
        chain = builder.description;
      }
      const auto model = TestFixture::Make(chain);
      const testing::State start = testing::ConsistentState(chain, model, seed);
      const Numbers own = WholeRun<Odca, TypeParam>(model, level, start, kSteps, 4e-3, &refused);
      const Numbers other =
          WholeRun<lagrange::Lagrange, TypeParam>(model, level, start, kSteps, 4e-3);
      const double size = std::max(1.0, other.cwiseAbs().maxCoeff());
      worst = std::max(worst, (own - other).cwiseAbs().maxCoeff() / size);
    }
    std::printf("level %s: %d runs, %d of %d steps refused, largest difference %.1e\n",
                std::string(ToString(level)).c_str(), runs, refused, runs * kSteps, worst);
    EXPECT_LE(worst, Bound(TypeParam::kOneFreedom, 1e-4));
    EXPECT_EQ(refused > 0, TypeParam::kNearDegenerate) << "else nothing changes on the way";
    // one in seven hundred is; were it one in ten, these would be runs of the general sweep
    EXPECT_LT(10 * refused, runs * kSteps);
  }
}

TYPED_TEST(ShortCutTest, LeavesOthersToTheGeneralSweep) {
  const MechanismDescription chain = TestFixture::Chain(2 * TypeParam::kOneFreedom, 1);
  const auto model = TestFixture::Make(chain);
  EXPECT_NE(TypeParam::Make(model), nullptr);
  EXPECT_EQ(TypeParam::Make(typename TestFixture::Model(chain, Coordinates::kAbsolute)), nullptr);
  MechanismDescription sprung = chain, slides = chain;
  sprung.forces.push_back(JointSpring{.joint = 1, .stiffness = 2.0});
  EXPECT_EQ(TypeParam::Make(TestFixture::Make(sprung)) != nullptr, TypeParam::kTakesForces);
  slides.joints[1].type = JointType::kPrismatic;
  EXPECT_EQ(TypeParam::Make(TestFixture::Make(slides)), nullptr);
  Kinematics<typename TypeParam::Space, double> kinematics(model);
  Odca<typename TypeParam::Space, double> published(model, {.solver = SolverKind::kAsPublished});
  Numbers q = Numbers::Zero(model.num_q()), u = q, qdot = q, udot = q;
  EXPECT_FALSE(
      published.RightHandSide(SpeedsUsed::kGiven, kinematics, In(q), In(u), In(qdot), In(udot)));
}

TYPED_TEST(ShortCutTest, RefusesWhatItCannotJudge) {
  const auto model = TestFixture::Make(TestFixture::Chain(2 * TypeParam::kOneFreedom, 1));
  const auto sweep = TypeParam::Make(model);
  const Numbers ones = Numbers::Ones(model.num_q());
  for (const SpeedsUsed speeds : {SpeedsUsed::kGiven, SpeedsUsed::kCompleted}) {
    Numbers q = 1.1 * ones, u = ones, qdot = ones, udot = ones;
    const auto evaluate = [&] {
      return sweep->Evaluate(speeds, nullptr, In(q), In(u), In(qdot), In(udot));
    };
    EXPECT_TRUE(evaluate());
    q[1] = 2.0 * kLargestAngle;
    EXPECT_FALSE(evaluate());
    q[1] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(evaluate());
    q[1] = 1.1;
    u[2] = std::numeric_limits<double>::infinity();
    EXPECT_FALSE(evaluate());
  }
}

TYPED_TEST(ShortCutTest, AllocatesNothing) {
  for (const int n : {8, 9, 100, 500}) {
    const auto model = TestFixture::Make(TestFixture::Chain(n, 3));
    const auto sweep = TypeParam::Make(model, 2, 40);
    Random random(1);
    Numbers q = RandomNumbers(random, model.num_q(), 1.0), u = q, qdot = q, udot = q;
    const long before = testing::CountAllocations();
    for (const SpeedsUsed speeds : {SpeedsUsed::kGiven, SpeedsUsed::kCompleted}) {
      EXPECT_TRUE(sweep->Evaluate(speeds, nullptr, In(q), In(u), In(qdot), In(udot)));
    }
    sweep->Project(In(q), In(u), 0.0);
    EXPECT_EQ(testing::CountAllocations(), before);
  }
}

/// Of joints with n rows, and of a last handle with k.
template <int n, int k>
void HoldOperations() {
  Response<Counted, n> B;
  Response<Counted, n, k> last;
  InnerCut<Counted, n> cut;
  EndCut<Counted, n, k> end_cut;
  OneHandle<Counted, n> end;
  TwoHandle<Counted, n> all;
  Counted slack, F[k], force[n], zeta[k];
  using Work = Operations<n>;
  EXPECT_EQ(ProductsOf([&] { JoinSeries(all, B, zeta, zeta, Counted(0.0), cut, slack); }),
            Work::kJoin);
  EXPECT_EQ(ProductsOf([&] { JoinSeries(end, last, zeta, zeta, Counted(0.0), end_cut, slack); }),
            Work::EndJoin(k));
  EXPECT_EQ(ProductsOf([&] { ForceIn(cut, B, F, F, force); }), Work::kForceIn);
  EXPECT_EQ(ProductsOf([&] { ForceIn(end_cut, F, force); }), Work::ForceInEnd(k));
}

TEST(HandleKernels, TakeAsManyOperationsAsTheySay) {
  HoldOperations<pins::kRows, pins::kRows>();
  HoldOperations<arms::kRows, arms::kRows>();
  HoldOperations<arms::kRows, arms::kAll>();
}

TEST(PinKernels, TakeAsManyOperationsAsTheySay) {
  pins::Link<Counted> link;
  pins::TurnedLink<Counted> at;
  Counted speed, F[pins::kRows];
  const auto count = [&]<Unknowns unknowns>() {
    EXPECT_EQ(ProductsOf([&] { pins::FreeMotion<unknowns>(link, at, speed); }),
              pins::FreeMotionWork(unknowns));
  };
  count.operator()<Unknowns::kAccelerations>();
  count.operator()<Unknowns::kSpeeds>();
  count.operator()<Unknowns::kCompleted>();
  EXPECT_EQ(ProductsOf([&] { pins::ResponseOf(link, at); }), pins::kResponseWork);
  EXPECT_EQ(ProductsOf([&] { pins::AngularAcceleration<Unknowns::kCompleted>(at, F, F); }),
            pins::kAngularAccelerationWork);
}

TEST(RevoluteKernels, TakeAsManyOperationsAsTheySay) {
  using namespace arms;
  OneHandle<Counted, kRows> one;
  TwoHandle<Counted, kRows> two;
  Turn<Counted> turn;
  Counted free, F[kAll], row[kRows], all[kAll];
  EXPECT_EQ(ProductsOf([&] { TurnHandle(turn, one); }), kTurnOneWork);
  EXPECT_EQ(ProductsOf([&] { TurnHandle(turn, two); }), kTurnTwoWork);
  EXPECT_EQ(ProductsOf([&] { About(free, row, row, F, F); }), AboutWork(kRows));
  EXPECT_EQ(ProductsOf([&] { About(free, row, all, F, F); }), AboutWork(kAll));
  EXPECT_EQ(ProductsOf([&] { OppositeBefore(turn, F, F); }), kOppositeWork);
}

}  // namespace loopbench::odca::short_cut_test
