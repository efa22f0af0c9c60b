// What every formulation owes, whatever its method: one suite for all combinations of formulation,
// level of enforcement, solver, coordinate set and space.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

#include "lagrange/lagrange.h"
#include "odca/odca.h"
#include "reduction/reduction.h"
#include "tests/contract/allocations.h"
#include "tests/contract/comparison.h"

namespace loopbench::testing {
namespace {

constexpr double kEps = std::numeric_limits<double>::epsilon();

struct Case {
  const char* formulation;
  Enforcement enforcement;
  SolverKind solver;
  Coordinates coordinates;
  SpaceKind space;
};

/// Keeps addresses out of the test list.
void PrintTo(const Case& c, std::ostream* out) { *out << c.formulation; }

std::string NameOf(const ::testing::TestParamInfo<Case>& info) {
  std::string name =
      std::string(info.param.formulation) + "_" + std::string(ToString(info.param.enforcement)) +
      "_" + std::string(ToString(info.param.solver)) + "_" +
      std::string(ToString(info.param.coordinates)) + "_" + std::string(ToString(info.param.space));
  for (char& c : name) c = c == '-' ? '_' : c;
  return name;
}

std::vector<Case> AllCases() {
  std::vector<Case> cases;
  for (const char* formulation : {"odca", "lagrange", "reduction"}) {
    for (Enforcement enforcement :
         {Enforcement::kAcceleration, Enforcement::kVelocity, Enforcement::kPosition}) {
      for (SolverKind solver : {SolverKind::kAsPublished, SolverKind::kRankRevealing}) {
        for (Coordinates coordinates : {Coordinates::kJoint, Coordinates::kAbsolute}) {
          for (SpaceKind space : {SpaceKind::kPlanar, SpaceKind::kSpatial}) {
            cases.push_back({formulation, enforcement, solver, coordinates, space});
          }
        }
      }
    }
  }
  return cases;
}

std::vector<Case> VelocityCases() {
  std::vector<Case> cases = AllCases();
  std::erase_if(cases, [](const Case& c) { return c.enforcement != Enforcement::kVelocity; });
  return cases;
}

std::vector<Case> PositionCases() {
  std::vector<Case> cases = AllCases();
  std::erase_if(cases, [](const Case& c) { return c.enforcement != Enforcement::kPosition; });
  return cases;
}

std::vector<Case> ImpulseCases() {
  std::vector<Case> cases = PositionCases();
  std::erase_if(cases, [](const Case& c) { return std::string(c.formulation) == "reduction"; });
  return cases;
}

template <class Space>
std::unique_ptr<Formulation<Space, double>> Make(const Case& c,
                                                 const Mechanism<Space, double>& mechanism) {
  const FormulationOptions options{c.enforcement, c.solver};
  const std::string name = c.formulation;
  if (name == "odca") return std::make_unique<odca::Odca<Space, double>>(mechanism, options);
  if (name == "lagrange") {
    return std::make_unique<lagrange::Lagrange<Space, double>>(mechanism, options);
  }
  return std::make_unique<reduction::Reduction<Space, double>>(mechanism, options);
}

/// Coupled loops with forces of every kind, every second with joints of every kind, every fourth
/// with prescribed motions; independent closures, so that every column can run.
MechanismDescription CoupledLoops(SpaceKind space, std::uint64_t seed) {
  const int loops = space == SpaceKind::kPlanar ? 2 : 1;
  return seed % 2 == 0 ? MixedGraph(loops, space, seed, seed % 4 == 2 ? 2 : 0)
                       : RandomGraph(loops, space, seed);
}

/// A formulation on a sample, started.
template <class Space>
struct Bench {
  Bench(const Case& c, const MechanismDescription& description, std::uint64_t seed)
      : sample(description, seed),
        mechanism(sample.mechanism(c.coordinates)),
        state(sample.state(c.coordinates)),
        formulation(Make(c, mechanism)) {
    EXPECT_EQ(formulation->Start(0.0, state.q, state.u), Outcome::kFinished);
    y.resize(formulation->state_size());
    ydot.resize(formulation->state_size());
    formulation->ToState(state.q, state.u, y);
  }
  Outcome Derivative(std::vector<double>& at) {
    return formulation->Derivative(0.0, std::span<const double>(at), std::span<double>(ydot));
  }
  /// 100 eps N / rcond with the size N of the dense system: elimination of N unknowns.
  double Bound() const {
    return 100 * kEps * (mechanism.num_u() + mechanism.num_rows()) / sample.answer().rcond;
  }

  Sample<Space> sample;
  const Mechanism<Space, double>& mechanism;
  State state;
  std::unique_ptr<Formulation<Space, double>> formulation;
  std::vector<double> y, ydot;
};

class ContractTest : public ::testing::TestWithParam<Case> {
 protected:
  /// Calls `check` with a bench of the parameter's space.
  template <class Check>
  void Run(const MechanismDescription& description, std::uint64_t seed, Check check) {
    if (GetParam().space == SpaceKind::kPlanar) {
      check(Bench<Planar>(GetParam(), description, seed));
    } else {
      check(Bench<Spatial>(GetParam(), description, seed));
    }
  }
  MechanismDescription Description(std::uint64_t seed) const {
    return CoupledLoops(GetParam().space, seed);
  }
};
class VelocityContractTest : public ContractTest {};
class PositionContractTest : public ContractTest {};
class ImpulseContractTest : public ContractTest {};

TEST_P(ContractTest, AccelerationsAgreeWithTheOracle) {
  double worst = 0.0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    Run(Description(seed), seed, [&](auto bench) {
      ASSERT_EQ(bench.Derivative(bench.y), Outcome::kFinished);
      const double error =
          RelativeError(bench.formulation->udot(), bench.sample.udot(GetParam().coordinates));
      EXPECT_LE(error, bench.Bound()) << "rcond " << bench.sample.answer().rcond;
      EXPECT_EQ(bench.formulation->diagnostics().rank, bench.sample.answer().rank);
      worst = std::max(worst, error / bench.Bound());
    });
  }
  RecordProperty("worst_part_of_bound", std::to_string(worst));
}

TEST_P(ContractTest, DerivativeIsAPureFunction) {
  Run(Description(5), 5, [&](auto bench) {
    ASSERT_EQ(bench.Derivative(bench.y), Outcome::kFinished);
    const std::vector<double> first = bench.ydot;
    std::vector<double> other = bench.y;
    for (std::size_t i = 0; i < other.size(); ++i) other[i] += 1e-3 * std::sin(double(i + 1));
    bench.Derivative(other);
    VectorX<double> udot;
    bench.formulation->Evaluate(1.0, bench.state.q, -bench.state.u, udot);
    bench.formulation->FromState(0.0, std::span<const double>(other));
    ASSERT_EQ(bench.Derivative(bench.y), Outcome::kFinished);
    EXPECT_EQ(std::memcmp(first.data(), bench.ydot.data(), first.size() * sizeof(double)), 0);
    ASSERT_EQ(bench.Derivative(bench.y), Outcome::kFinished) << "the same position once more";
    EXPECT_EQ(std::memcmp(first.data(), bench.ydot.data(), first.size() * sizeof(double)), 0);
  });
}

TEST_P(VelocityContractTest, SpeedsSatisfyTheLoops) {
  Run(Description(6), 6, [&](auto bench) {
    std::vector<double> off = bench.y;
    for (std::size_t i = bench.mechanism.num_q(); i < off.size(); ++i) off[i] += 0.1;
    ASSERT_EQ(bench.Derivative(off), Outcome::kFinished);
    Oracle oracle(bench.sample.description(), LayoutOf(bench.mechanism));
    const RealVector q = ToReal(bench.formulation->q()), u = ToReal(bench.formulation->u());
    const RealMatrix J = oracle.Form(q, u).J;
    const Real at_rest = oracle.ClosureRates(q, 0 * u).template lpNorm<Eigen::Infinity>();
    const Real scale =
        at_rest + J.cwiseAbs().rowwise().sum().maxCoeff() * u.template lpNorm<Eigen::Infinity>();
    EXPECT_LE(oracle.ClosureRates(q, u).template lpNorm<Eigen::Infinity>(), bench.Bound() * scale);
  });
}

/// Seeds 6 and 10 have prescribed motions.
TEST_P(PositionContractTest, AcceptedStepsAreProjectedToTheConstraints) {
  for (std::uint64_t seed : {5, 6, 8, 10}) {
    Run(Description(seed), seed, [&](auto bench) {
      for (std::size_t i = 0; i < bench.y.size(); ++i) {
        bench.y[i] += 1e-4 * std::sin(2.0 * static_cast<double>(i + 1));
      }
      ASSERT_TRUE(bench.formulation->BeginStep(0.0, std::span<double>(bench.y)));
      EXPECT_GT(bench.formulation->correction().shift, 0.0);
      Oracle oracle(bench.sample.description(), LayoutOf(bench.mechanism));
      const RealVector q = ToReal(bench.formulation->q()), u = ToReal(bench.formulation->u());
      // rows of lengths and speeds of some metres, through as many bodies
      const double scale = 1.0 + static_cast<double>(q.norm() + u.norm());
      EXPECT_LE(oracle.ClosureMismatches(q).template lpNorm<Eigen::Infinity>(),
                bench.Bound() * scale);
      EXPECT_LE(oracle.ClosureRates(q, u).template lpNorm<Eigen::Infinity>(),
                bench.Bound() * scale * scale);
      // once more: nothing is left to do
      const std::vector<double> first = bench.y;
      bench.formulation->BeginStep(0.0, std::span<double>(bench.y));
      for (std::size_t i = 0; i < first.size(); ++i) {
        EXPECT_NEAR(bench.y[i], first[i], bench.Bound() * scale);
      }
    });
  }
}

/// Impulses of constraints alone change the speeds: M (u' - u) = J^T lambda. Reduction keeps its
/// independent speeds instead.
TEST_P(ImpulseContractTest, SpeedsChangeByImpulsesOfConstraints) {
  Run(Description(8), 8, [&](auto bench) {
    for (std::size_t i = bench.mechanism.num_q(); i < bench.y.size(); ++i) {
      bench.y[i] += 0.1 * std::sin(2.0 * static_cast<double>(i + 1));
    }
    const int n = bench.mechanism.num_q();
    const RealVector before =
        ToReal(Eigen::Map<const VectorX<double>>(bench.y.data() + n, bench.mechanism.num_u()));
    ASSERT_TRUE(bench.formulation->BeginStep(0.0, std::span<double>(bench.y)));
    Oracle oracle(bench.sample.description(), LayoutOf(bench.mechanism));
    const Equations e = oracle.Form(ToReal(bench.formulation->q()), ToReal(bench.formulation->u()));
    const RealVector impulse = e.M * (ToReal(bench.formulation->u()) - before);
    // what is left of it beside the range of J^T
    const RealMatrix S = e.J * e.J.transpose();
    const RealVector lambda = SolveFullPivot(S, e.J * impulse, Real(1e-15L));
    const RealVector rest = impulse - e.J.transpose() * lambda;
    EXPECT_LE(rest.norm(), bench.Bound() * impulse.norm());
  });
}

TEST_P(ContractTest, StateKeepsConsistentPositionsAndSpeeds) {
  Run(Description(7), 7, [&](auto bench) {
    ASSERT_EQ(bench.formulation->FromState(0.0, std::span<const double>(bench.y)),
              Outcome::kFinished);
    EXPECT_EQ(bench.formulation->q(), bench.state.q);
    const double difference =
        (bench.formulation->u() - bench.state.u).template lpNorm<Eigen::Infinity>();
    // at acceleration level speeds are handed through, at velocity level projected
    const bool projected = GetParam().enforcement == Enforcement::kVelocity;
    const double size = bench.state.u.template lpNorm<Eigen::Infinity>();
    EXPECT_LE(difference, projected ? bench.Bound() * size : 0.0);
    std::vector<double> again(bench.y.size());
    bench.formulation->ToState(bench.formulation->q(), bench.formulation->u(), again);
    for (int i = 0; i < bench.mechanism.num_q(); ++i) EXPECT_EQ(again[i], bench.y[i]);
  });
}

TEST_P(ContractTest, NotANumberEndsWithANamedOutcome) {
  Run(Description(8), 8, [&](auto bench) {
    ASSERT_EQ(bench.Derivative(bench.y), Outcome::kFinished);
    const std::vector<double> good = bench.ydot;
    const std::size_t first_speed = bench.mechanism.num_q();
    for (double bad :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
      for (std::size_t i : {std::size_t{0}, first_speed - 1, first_speed, bench.y.size() - 1}) {
        std::vector<double> y = bench.y;
        y[i] = bad;
        const Outcome outcome = bench.Derivative(y);
        EXPECT_TRUE(outcome == Outcome::kNonFinite || outcome == Outcome::kSingular)
            << "y[" << i << "] = " << bad << " ended as " << ToString(outcome);
      }
    }
    ASSERT_EQ(bench.Derivative(bench.y), Outcome::kFinished) << "nothing is left of the bad state";
    EXPECT_EQ(good, bench.ydot);
  });
}

TEST_P(ContractTest, DerivativeDoesNotAllocate) {
  if (CountAllocations() < 0) GTEST_SKIP() << "allocations cannot be counted in this build";
  Run(Description(9), 9, [&](auto bench) {
    std::vector<double> other = bench.y;
    for (std::size_t i = 0; i < other.size(); ++i) other[i] += 1e-3;
    bench.Derivative(other);
    bench.Derivative(bench.y);
    const long before = CountAllocations();
    for (int i = 0; i < 10; ++i) bench.Derivative(i % 2 == 0 ? other : bench.y);
    const long allocations = CountAllocations() - before;
    EXPECT_EQ(allocations, 0);
  });
}

/// It is part of the right-hand side when work is integrated along. Seed 10 has drives.
TEST_P(ContractTest, PowerDoesNotAllocate) {
  if (CountAllocations() < 0) GTEST_SKIP() << "allocations cannot be counted in this build";
  Run(Description(10), 10, [&](auto bench) {
    bench.Derivative(bench.y);
    double sum = bench.formulation->DrivePower();
    const long before = CountAllocations();
    for (int i = 0; i < 10; ++i) {
      bench.Derivative(bench.y);
      sum += bench.formulation->DrivePower() +
             AppliedPower(bench.formulation->kinematics()).dissipated;
    }
    const long allocations = CountAllocations() - before;
    EXPECT_EQ(allocations, 0);
    EXPECT_TRUE(std::isfinite(sum));
  });
}

/// Without all that supplies or dissipates power.
MechanismDescription Conservative(MechanismDescription description) {
  MechanismDescription one = description;
  std::erase_if(description.forces, [&](const ForceDescription& force) {
    one.forces = {force};
    return CompileForces<Spatial, double>(one).has_power();
  });
  return description;
}

TEST_P(ContractTest, AccelerationsFollowTheTime) {
  MechanismDescription description = Description(12);
  for (std::size_t j = 0; j < description.joints.size(); ++j) {
    if (description.joints[j].type != JointType::kRevolute) continue;
    description.forces.push_back(
        JointTorque{static_cast<int>(j), Harmonic{.amplitude = 5.0, .omega = 2.0}});
  }
  Run(description, 12, [&](auto bench) {
    Oracle oracle(bench.sample.description(), LayoutOf(bench.mechanism));
    for (const double t : {-0.4, 0.8}) {
      oracle.SetTime(t);
      VectorX<double> udot;
      ASSERT_EQ(bench.formulation->Evaluate(t, bench.state.q, bench.state.u, udot),
                Outcome::kFinished);
      const RealVector expected = oracle.Solve(ToReal(bench.state.q), ToReal(bench.state.u)).udot;
      EXPECT_LE(RelativeError(udot, expected), bench.Bound()) << t;
    }
  });
}

/// The energy's rate by differences of the oracle's, the power by the formulation: of drives alone
/// (seed 10 has some), of forces alone (seed 11) and of both.
TEST_P(ContractTest, EnergyChangesByThePowerOfForcesAndDrives) {
  const MechanismDescription driven = Description(10);
  for (const MechanismDescription& description :
       {driven, Conservative(driven), Description(11), Conservative(Description(12))}) {
    Run(description, 10, [&](auto bench) {
      SCOPED_TRACE(description.name);
      ASSERT_EQ(bench.Derivative(bench.y), Outcome::kFinished);
      Oracle oracle(bench.sample.description(), LayoutOf(bench.mechanism));
      const RealVector q = ToReal(bench.formulation->q()), u = ToReal(bench.formulation->u());
      const RealVector udot = ToReal(bench.formulation->udot());
      const Eigen::Map<const VectorX<double>> qdot(bench.ydot.data(), q.size());
      const Real step = 1e-6L;  // long double: truncation 1e-12, round-off 1e-13
      const auto energy = [&](Real t) {
        oracle.SetTime(t);
        return oracle.TotalEnergy(q + t * ToReal(qdot), u + t * udot);
      };
      const Real rate = (energy(step) - energy(-step)) / (2 * step);
      const Power<double> forces = AppliedPower(bench.formulation->kinematics());
      const double drives = bench.formulation->DrivePower();
      const bool conservative = CompileForces<Spatial, double>(description).has_power() == false;
      EXPECT_EQ(drives != 0.0, !bench.mechanism.drives().empty());
      EXPECT_EQ(forces.supplied == 0.0 && forces.dissipated == 0.0, conservative);
      EXPECT_EQ(bench.mechanism.has_power(), drives != 0.0 || !conservative);
      // what the rate is small against: the energies' own rates, at least their size per second
      const Real scale = 1 + std::abs(energy(0)) + udot.template lpNorm<Eigen::Infinity>();
      EXPECT_LE(std::abs(rate - (forces.supplied - forces.dissipated + drives)),
                (1e-10L + bench.Bound()) * scale);
      const Energy<double> own = ComputeEnergy(bench.formulation->kinematics());
      EXPECT_NEAR(own.total(), static_cast<double>(energy(0)),
                  100 * kEps * (own.kinetic + std::abs(own.potential) + 10.0));
    });
  }
}

/// Where constraints depend on each other, all rows at once keep what closing loop by loop loses.
TEST(RedundancyTest, MultipliersKeepTheBoundOfOverconstrainedGraphs) {
  for (int loops = 2; loops <= 5; ++loops) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      const MechanismDescription graph =
          RedundantGraph(7 * loops, loops, SpaceKind::kSpatial, seed);
      const Sample<Spatial> sample(graph, seed);
      const State& state = sample.state(Coordinates::kJoint);
      lagrange::Lagrange<Spatial, double> lagrange(sample.mechanism(Coordinates::kJoint), {});
      VectorX<double> udot;
      ASSERT_EQ(lagrange.Evaluate(0.0, state.q, state.u, udot), Outcome::kFinished);
      EXPECT_LE(RelativeError(udot, sample.udot(Coordinates::kJoint)), sample.Bound())
          << graph.name;
    }
  }
}

TEST(AllocationTest, SofteningDoesNotAllocate) {
  if (CountAllocations() < 0) GTEST_SKIP() << "allocations cannot be counted in this build";
  const MechanismDescription ladder = RandomLadder(4, SpaceKind::kPlanar, 1);
  const Mechanism<Spatial, double> mechanism(ladder, Coordinates::kJoint);
  const State state = ConsistentState(ladder, mechanism, 1);
  odca::Odca<Spatial, double> odca(mechanism, {});
  VectorX<double> udot(mechanism.num_u());
  odca.Evaluate(0.0, state.q, state.u, udot);
  ASSERT_LT(odca.diagnostics().smallest_weight, 1.0);
  const long before = CountAllocations();
  for (int i = 0; i < 10; ++i) odca.Evaluate(0.0, state.q, state.u, udot);
  EXPECT_EQ(CountAllocations() - before, 0);
}

INSTANTIATE_TEST_SUITE_P(All, ContractTest, ::testing::ValuesIn(AllCases()), NameOf);
INSTANTIATE_TEST_SUITE_P(PositionLevel, PositionContractTest, ::testing::ValuesIn(PositionCases()),
                         NameOf);
INSTANTIATE_TEST_SUITE_P(PositionLevel, ImpulseContractTest, ::testing::ValuesIn(ImpulseCases()),
                         NameOf);
INSTANTIATE_TEST_SUITE_P(VelocityLevel, VelocityContractTest, ::testing::ValuesIn(VelocityCases()),
                         NameOf);

}  // namespace
}  // namespace loopbench::testing
