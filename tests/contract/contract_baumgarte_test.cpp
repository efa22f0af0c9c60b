// Baumgarte's stabilisation: mismatches of positions and speeds come back as accelerations.
#include "tests/contract/contract.h"

namespace loopbench::testing {
namespace {

constexpr BaumgarteGains kGains{3.0, 4.0};  // different, so that neither stands in for the other

std::vector<Case> BaumgarteCases(std::optional<BaumgarteGains> gains) {
  std::vector<Case> cases =
      CasesThat([](const Case& c) { return c.enforcement == Enforcement::kBaumgarte; });
  for (Case& c : cases) c.gains = gains;
  return cases;
}

class BaumgarteContractTest : public ContractTest {};
class BaumgarteGainsTest : public ContractTest {};

/// Off the constraints by `size` in positions and speeds, the same direction for all sizes.
std::vector<double> Off(const std::vector<double>& y, double size) {
  std::vector<double> off = y;
  for (std::size_t i = 0; i < y.size(); ++i) off[i] += size * std::sin(2.0 * (1.0 + double(i)));
  return off;
}

/// Constrained parts of the mismatches of all constraints and of their rates, one motion after the
/// other, in the axes of their bodies P: there they obey the equation. Of rotations in space that
/// holds for small relative speeds only, since a rotation vector's rate is not the angular velocity
/// (docs/theory/constraints-and-drift.md): they are left out, zero.
template <class Space>
std::pair<VectorX<double>, VectorX<double>> Mismatches(System<Space, double>& formulation,
                                                       const std::vector<double>& y) {
  EXPECT_EQ(formulation.FromState(0.0, y), Outcome::kFinished);
  const Kinematics<Space, double>& kinematics = formulation.kinematics();
  const std::vector<int>& constraints = kinematics.mechanism().constraints();
  VectorX<double> e = VectorX<double>::Zero(Space::kDim * constraints.size()), rate = e;
  for (std::size_t k = 0; k < constraints.size(); ++k) {
    const Joint<Space, double>& joint = kinematics.mechanism().joints()[constraints[k]];
    const JointState<Space, double>& state = kinematics.joints()[constraints[k]];
    const auto& R = kinematics.poses()[joint.from].R;
    const auto put = [&](const Components<Space, double>& rows, VectorX<double>& all) {
      const Direction<Space, double> motion = state.Sum(rows, state.rows());
      auto part = all.template segment<Space::kDim>(Space::kDim * k);
      part.template tail<Space::kLin>() = (R.transpose() * motion.linear).eigen();
      if constexpr (Space::kRot == 1) part[0] = motion[0];
    };
    put(state.Along(kinematics.ConstraintMismatch(constraints[k]), state.rows()), e);
    put(kinematics.ConstraintSpeed(constraints[k]), rate);
  }
  return {e, rate};
}

/// From states off the constraints the mismatches follow the closed form of
/// e'' + 2 alpha e' + beta^2 e = 0 with these gains, underdamped, to first order in the mismatch:
/// 1e-5 off, and factors of some tens from speeds of some rad/s. Classic Runge-Kutta steps of 1 ms
/// leave 1e-12.
TEST_P(BaumgarteContractTest, MismatchesObeyTheEquationOfTheGains) {
  for (std::uint64_t seed : {5, 8}) {
    Run(Description(seed), seed, [&](auto bench) {
      constexpr double kOff = 1e-5, kStep = 1e-3;
      std::vector<double> y = Off(bench.y, kOff);
      const auto [e, rate] = Mismatches(*bench.formulation, y);
      ASSERT_GT(e.norm() + rate.norm(), kOff) << "nothing to feed back";
      const std::size_t n = y.size();
      constexpr int kSteps = 100;
      for (int step = 0; step < kSteps; ++step) {
        std::vector<double> sum(n, 0.0), at = y;
        for (const auto& [share, next] :
             {std::pair{1.0, 0.5}, {2.0, 0.5}, {2.0, 1.0}, {1.0, 0.0}}) {
          ASSERT_EQ(bench.Derivative(at), Outcome::kFinished);
          for (std::size_t i = 0; i < n; ++i) {
            sum[i] += share / 6 * bench.ydot[i];
            at[i] = y[i] + next * kStep * bench.ydot[i];
          }
        }
        for (std::size_t i = 0; i < n; ++i) y[i] += kStep * sum[i];
      }
      const auto [e_end, rate_end] = Mismatches(*bench.formulation, y);
      const double t = kSteps * kStep;
      const double damped = std::sqrt(kGains.beta * kGains.beta - kGains.alpha * kGains.alpha);
      const VectorX<double> expected =
          std::exp(-kGains.alpha * t) *
          (e * std::cos(damped * t) + (rate + kGains.alpha * e) * std::sin(damped * t) / damped);
      EXPECT_LE((e_end - expected).norm(), 100 * kOff * expected.norm()) << seed;
      // what would have become of them without gains is far from it
      EXPECT_GT((e + t * rate - expected).norm(), 0.05 * expected.norm());
    });
  }
}

/// In proportion to 1/h of the longest step, once steps no longer double; set again when it has
/// doubled.
TEST_P(BaumgarteGainsTest, FollowTheLongestStep) {
  Run(Description(5), 5, [&](auto bench) {
    std::vector<double> y = Off(bench.y, 1e-4);
    const auto derivative = [&] {
      EXPECT_EQ(bench.Derivative(y), Outcome::kFinished);
      return bench.ydot;
    };
    double t = 0.0;
    const auto accept = [&](double step) {
      t += step;
      return bench.formulation->BeginStep(t, std::span<double>(y));
    };
    const std::vector<double> without = derivative();
    EXPECT_FALSE(accept(0.01));
    EXPECT_FALSE(accept(0.1));
    EXPECT_EQ(derivative(), without);
    EXPECT_TRUE(accept(0.11));
    const std::vector<double> with_two = derivative();
    EXPECT_NE(with_two, without);
    EXPECT_FALSE(accept(0.2));
    EXPECT_FALSE(accept(0.001));
    EXPECT_EQ(derivative(), with_two);
    EXPECT_TRUE(accept(0.25));
    EXPECT_NE(derivative(), with_two);
    EXPECT_EQ(bench.formulation->diagnostics().mode_changes, 2);
  });
}

INSTANTIATE_TEST_SUITE_P(Baumgarte, BaumgarteContractTest,
                         ::testing::ValuesIn(BaumgarteCases(kGains)), NameOf);
INSTANTIATE_TEST_SUITE_P(Baumgarte, BaumgarteGainsTest, ::testing::ValuesIn(BaumgarteCases({})),
                         NameOf);

}  // namespace
}  // namespace loopbench::testing
