// Baumgarte's stabilisation: mismatches of positions and speeds come back as accelerations.
#include <cmath>

#include "tests/contract/contract.h"

namespace loopbench::testing {
namespace {

constexpr BaumgarteGains kGains{3.0, 4.0};  // different, so that neither stands in for the other

std::vector<Case> BaumgarteCases() {
  std::vector<Case> cases = AllCases();
  std::erase_if(cases, [](const Case& c) { return c.enforcement != Enforcement::kBaumgarte; });
  for (Case& c : cases) c.gains = kGains;
  return cases;
}

std::vector<Case> CasesWithoutGains() {
  std::vector<Case> cases = BaumgarteCases();
  for (Case& c : cases) c.gains.reset();
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

/// e'' + 2 alpha e' + beta^2 e of every row, by the oracle. Its rows are the mismatches themselves,
/// the formulations' are in the joints' axes: they differ in the second order of e, and so does
/// this from zero. Seeds 6 and 10 have prescribed motions.
TEST_P(BaumgarteContractTest, MismatchesObeyTheEquationOfTheGains) {
  for (std::uint64_t seed : {5, 6, 8, 10}) {
    Run(Description(seed), seed, [&](auto bench) {
      const auto left = [&](double size) {
        std::vector<double> off = Off(bench.y, size);
        EXPECT_EQ(bench.Derivative(off), Outcome::kFinished);
        Oracle oracle(bench.sample.description(), LayoutOf(bench.mechanism));
        const RealVector q = ToReal(bench.formulation->q()), u = ToReal(bench.formulation->u());
        const Equations e = oracle.Form(q, u);
        const RealVector acceleration = e.J * ToReal(bench.formulation->udot()) - e.gamma;
        const RealVector feedback = 2 * kGains.alpha * oracle.ClosureRates(q, u) +
                                    kGains.beta * kGains.beta * oracle.ClosureMismatches(q);
        EXPECT_GT(double(feedback.norm()), size) << "nothing to feed back";
        return static_cast<double>((acceleration + feedback).norm() / feedback.norm());
      };
      // relative to the feedback what is left falls in proportion to the mismatch
      const double coarse = left(1e-4), fine = left(1e-5);
      EXPECT_LE(coarse, 0.05) << seed;
      EXPECT_LE(fine, 0.2 * coarse + bench.Bound() / 1e-5) << seed;
    });
  }
}

/// In proportion to 1/h of the longest step, once steps no longer double; set again when it has doubled.
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

INSTANTIATE_TEST_SUITE_P(Baumgarte, BaumgarteContractTest, ::testing::ValuesIn(BaumgarteCases()),
                         NameOf);
INSTANTIATE_TEST_SUITE_P(Baumgarte, BaumgarteGainsTest, ::testing::ValuesIn(CasesWithoutGains()),
                         NameOf);

}  // namespace
}  // namespace loopbench::testing
