// Mechanisms in every scalar: closed forms, levels, and which part of an error rules.
#include "harness/precision/ladder.h"

#include "harness/precision/exact.h"
#include "harness/precision/integrator.h"
#include "lagrange/lagrange.h"
#include "mechanism/formulation/system.h"
#include "odca/odca.h"
#include "reduction/reduction.h"
#include "tests/harness/places.h"
#include "tests/precision/pendulum.h"

namespace loopbench::harness {
namespace {

/// The cranks of the parallelogram move as a pendulum with w^2 = 2 g / 3.5: between two bars of
/// I + m L^2 / 4 = 1.25 and the coupler, whose mass moves with their tips, 3.5 kg m^2 in all.
TEST(ClosedFormTest, ParallelogramFollowsItsPendulumInFloat128) {
  const MechanismDescription description = Shipped("parallelogram").description;
  Exact exact(description, Coordinates::kJoint);
  ASSERT_EQ(exact.outcome(), Outcome::kFinished) << exact.message();
  // loops close to a few roundings of lengths of a metre
  const Float128 eps = std::numeric_limits<Float128>::epsilon();
  EXPECT_LE(exact.Drift(Float128(0), exact.q()), 16 * eps);
  const Mechanism<Planar, Float128> mechanism(description, Coordinates::kJoint);
  const auto odca = MakeSystem<odca::Odca>(mechanism);
  ASSERT_EQ(odca->Start(Float128(0), exact.q(), exact.u()), Outcome::kFinished);
  std::vector<Float128> y(odca->state_size());
  odca->ToState(exact.q(), exact.u(), y);
  const Problem<Float128> system{
      odca->state_size(),
      [&](const Float128& t, std::span<const Float128> state, std::span<Float128> rates) {
        return odca->Derivative(t, state, rates);
      },
      [&](const Float128& t, std::span<Float128> state) { return odca->BeginStep(t, state); }};
  const Float128 pi = std::numbers::pi_v<Float128>, end = Float128(1) / 4;
  const OneStepResult result = IntegrateSystem<Float128>(
      system, end, y, {.method = OneStepMethod::kGragg, .tolerance = Float128(1e-29)});
  ASSERT_EQ(result.outcome, Outcome::kFinished);
  const Float128 w = sqrt(2 * Float128(9.81) / (Float128(7) / 2));
  const Float128 theta = y[0] + pi / 2;
  const Float128 miss = theta - PendulumAngle(w, exact.q()[0] + pi / 2, end);
  EXPECT_LE(std::abs(static_cast<double>(miss)), 1e-27) << result.steps;
}

LadderTask Task(const std::string& mechanism, const std::string& formulation,
                Enforcement enforcement) {
  LadderTask task;
  task.description = Shipped(mechanism).description;
  task.method = {.formulation = formulation, .enforcement = enforcement};
  task.horizon = 1.0;
  task.precision.scalars = {Scalar::kFloat, Scalar::kDouble, Scalar::kLongDouble,
                            Scalar::kFloat128};
  task.precision.tolerances = {1e-4, 1e-15};
  return task;
}

const SweepLevel& At(const Ladder& ladder, Scalar scalar, double tolerance) {
  for (const SweepLevel& rung : ladder.rungs) {
    if (rung.scalar == scalar && rung.tolerance == tolerance) return rung;
  }
  throw std::invalid_argument("no such rung");
}

class LadderTest : public ::testing::TestWithParam<std::pair<std::string, Enforcement>> {};

/// At 1e-4 truncation is the same in all scalars but float's; float ends at 1e-15.
TEST_P(LadderTest, WideScalarsShareTheirTruncation) {
  const auto [formulation, enforcement] = GetParam();
  const Ladder ladder = RunLadder(Task("four-bar", formulation, enforcement));
  ASSERT_EQ(ladder.start, Outcome::kFinished) << ladder.message;
  ASSERT_EQ(ladder.rungs.size(), 8u);
  EXPECT_EQ(ladder.reference.outcome, Outcome::kFinished);
  // two references 10^4 apart in tolerance: far below the finest rung
  EXPECT_LE(ladder.reference.error, 1e-18);
  EXPECT_LE(ladder.reference.drift, 1e-18);
  const SweepLevel& wide = At(ladder, Scalar::kFloat128, 1e-4);
  EXPECT_GT(wide.error, 1e-8) << "an error that says something";
  for (const Scalar scalar : {Scalar::kDouble, Scalar::kLongDouble}) {
    const SweepLevel& rung = At(ladder, scalar, 1e-4);
    EXPECT_EQ(rung.steps, wide.steps);
    EXPECT_NEAR(rung.error, wide.error, 1e-6 * wide.error);
    EXPECT_EQ(rung.error_ruled_by, "truncation");
  }
  EXPECT_EQ(wide.error_ruled_by, "truncation");
  const SweepLevel& lost = At(ladder, Scalar::kFloat, 1e-15);
  EXPECT_EQ(lost.outcome, Outcome::kStepTooSmall);
  EXPECT_TRUE(std::isnan(lost.error));
  EXPECT_EQ(lost.error_ruled_by, "");
}

/// In joint coordinates the closure of a parallelogram is linear, and no Runge-Kutta method makes
/// drift of it: all of it is round-off, and shrinks with the scalar's eps.
TEST_P(LadderTest, DriftOfAParallelogramIsRoundOff) {
  const auto [formulation, enforcement] = GetParam();
  LadderTask task = Task("parallelogram", formulation, enforcement);
  task.precision.tolerances = {1e-4};
  const Ladder ladder = RunLadder(task);
  ASSERT_EQ(ladder.start, Outcome::kFinished) << ladder.message;
  double last = 1.0;
  for (const Scalar scalar :
       {Scalar::kFloat, Scalar::kDouble, Scalar::kLongDouble, Scalar::kFloat128}) {
    const SweepLevel& rung = At(ladder, scalar, 1e-4);
    ASSERT_EQ(rung.outcome, Outcome::kFinished);
    // widening by a scalar takes at least 2^11 of its eps away; a walk of round-off varies by ten
    EXPECT_LE(rung.drift, last / 100) << ToString(scalar);
    last = rung.drift;
    if (scalar != Scalar::kFloat128) {
      EXPECT_EQ(rung.drift_ruled_by, "round-off");
    }
  }
}

/// A prescribed coordinate has the value of its time, in both coordinate sets.
TEST(DrivenLadder, FollowsItsDrive) {
  LadderTask task = Task("driven-four-bar", "odca", Enforcement::kPosition);
  task.precision.scalars = {Scalar::kDouble};
  task.precision.tolerances = {1e-8};
  for (const Coordinates coordinates : {Coordinates::kJoint, Coordinates::kAbsolute}) {
    task.method.coordinates = coordinates;
    const Ladder ladder = RunLadder(task);
    ASSERT_EQ(ladder.start, Outcome::kFinished) << ladder.message;
    const SweepLevel& rung = At(ladder, Scalar::kDouble, 1e-8);
    ASSERT_EQ(rung.outcome, Outcome::kFinished);
    // kinematics decides: what projections leave of lengths of a metre, some hundred roundings
    EXPECT_LE(rung.drift, 1e-13);
    EXPECT_LE(rung.error, 1e-13);
    EXPECT_LE(ladder.reference.drift, 1e-18);
  }
}

std::string NameOf(const ::testing::TestParamInfo<LadderTest::ParamType>& info) {
  return info.param.first + "_" + std::string(ToString(info.param.second));
}
INSTANTIATE_TEST_SUITE_P(Methods, LadderTest,
                         ::testing::Values(std::pair{"odca", Enforcement::kAcceleration},
                                           std::pair{"odca", Enforcement::kPosition},
                                           std::pair{"lagrange", Enforcement::kVelocity},
                                           std::pair{"reduction", Enforcement::kVelocity},
                                           std::pair{"reduction", Enforcement::kPosition}),
                         NameOf);

/// A level of another program, for double only.
template <class Space, class S>
class Own final : public Level<Space, S> {
 public:
  Own(const Mechanism<Space, S>&, const FormulationOptions&) {}
};

TEST(LadderLevels, OfOtherProgramsAreRefusedByName) {
  const Enforcement own =
      RegisterLevel(LevelRowOf<Own>({.name = "own-in-double", .sentence = "as acceleration."}));
  const MechanismDescription description = Shipped("four-bar").description;
  const Mechanism<Planar, double> mechanism(description, Coordinates::kJoint);
  EXPECT_NO_THROW(MakeSystem<odca::Odca>(mechanism, {.enforcement = own}));
  try {
    RunLadder(Task("four-bar", "odca", own));
    FAIL();
  } catch (const std::invalid_argument& refusal) {
    EXPECT_STREQ(
        refusal.what(),
        "level \"own-in-double\": found a scalar other than double, expected double, which "
        "levels of other programs are made in");
  }
}

TEST(RuledByTest, RoundOffIsWhatAWiderScalarTakesAway) {
  EXPECT_EQ(DominatedBy(1e-6, 1e-6), "truncation");
  EXPECT_EQ(DominatedBy(1.9e-6, 1e-6), "truncation");
  EXPECT_EQ(DominatedBy(2.1e-6, 1e-6), "round-off");
  EXPECT_EQ(DominatedBy(1e-6, 1e-12), "round-off");
  EXPECT_EQ(DominatedBy(4e-7, 1e-6), "round-off") << "some of the truncation cancelled";
  EXPECT_EQ(DominatedBy(std::numeric_limits<double>::quiet_NaN(), 1e-6), "");
  EXPECT_EQ(DominatedBy(1e-6, std::numeric_limits<double>::quiet_NaN()), "");
}

}  // namespace
}  // namespace loopbench::harness
