// The order of every profile on whole mechanisms: for each formulation at each level, with steps of
// fixed length. A projection after a step, a projection in its stages or a feedback may cost no
// order; nor may a formulation.
#include "harness/config/formulations.h"
#include "harness/config/options.h"
#include "tests/reference/cases.h"
#include "tests/reference/simulate.h"

namespace loopbench::harness::reference::orders_test {

struct Profiled {
  std::string name;
  int order;
  int steps;  ///< of the coarse run; the fine one takes twice as many
};

/// Orders as harness/config/options.h has them. With these steps errors are 1e-4 to 1e-10 in the
/// coarse runs and 1e-13 and more in the fine ones: above the reference's rounding, and of implicit
/// profiles above what Newton's iteration leaves (1e-12).
const std::vector<Profiled>& Profiles() {
  static const std::vector<Profiled> kProfiles = {{"ode45", 5, 12},
                                                  {"dormand-prince", 5, 12},
                                                  {"bogacki-shampine", 3, 24},
                                                  {"cash-karp", 5, 12},
                                                  {"fehlberg", 5, 12},
                                                  {"verner", 6, 12},
                                                  {"fehlberg-78", 8, 6},
                                                  {"trbdf2", 2, 48},
                                                  {"kennedy-carpenter-32", 3, 24},
                                                  {"kennedy-carpenter-43", 4, 16},
                                                  {"kvaerno-54", 5, 12},
                                                  {"kennedy-carpenter-54", 5, 12}};
  return kProfiles;
}

struct Motion {
  const char* mechanism;
  double horizon;  ///< [s]
  int factor;      ///< times as many steps as a profile's
};
constexpr Motion kMotions[] = {{"four-bar", 1.6, 2}, {"stewart-platform", 0.4, 4}};

/// Positions and velocities of all bodies, one after the other: [m, m/s].
using Numbers = std::vector<double>;

/// After each of so many steps.
std::vector<Numbers> StatesOf(const MechanismDescription& description, const Method& method,
                              const std::string& profile, double horizon, int steps) {
  IntegratorOptions options = Options(profile, kToleranceOfFixedSteps);
  options.fixed_step = horizon / steps;
  std::vector<Numbers> states;
  const Simulation run =
      Simulate(description, method, options, horizon, [&](const Snapshot& snapshot) {
        Numbers& numbers = states.emplace_back();
        for (const BodyState& body : snapshot.bodies) {
          numbers.insert(numbers.end(), body.p.begin(), body.p.end());
          numbers.insert(numbers.end(), body.v.begin(), body.v.end());
        }
      });
  EXPECT_EQ(run.result.outcome, Outcome::kFinished) << profile << " " << ToString(method);
  return states;
}

/// A multiple of all others below, times the motion's factor. The coarse run of order 8 has a
/// sixteenth of them, and 16^8 = 4e9 times the error.
constexpr int kExactSteps = 96;

/// The same for all methods: one of them, by the method of the highest order with steps so short
/// that they leave rounding alone.
const std::vector<Numbers>& Exact(const Motion& motion) {
  static std::map<std::string, std::vector<Numbers>> known;
  const auto [place, is_new] = known.try_emplace(motion.mechanism);
  if (is_new) {
    const Method method{.formulation = "lagrange", .enforcement = Enforcement::kPosition};
    place->second = StatesOf(Shipped(motion.mechanism).description, method, "fehlberg-78",
                             motion.horizon, kExactSteps * motion.factor);
  }
  return place->second;
}

/// Root of the mean square over all steps: at one time alone the leading term may happen to vanish.
double ErrorOf(const std::vector<Numbers>& states, const std::vector<Numbers>& exact) {
  const std::size_t every = (exact.size() - 1) / (states.size() - 1);
  double square = 0.0;
  for (std::size_t i = 0; i < states.size(); ++i) {
    for (std::size_t j = 0; j < states[i].size(); ++j) {
      square += std::pow(states[i][j] - exact[every * i][j], 2);
    }
  }
  return std::sqrt(square / static_cast<double>(states.size()));
}

constexpr Enforcement kLevelsOfTables[] = {Enforcement::kAcceleration, Enforcement::kVelocity};

/// Multipliers at the levels of OrdersOfTables are left out: it runs the tables of all profiles
/// with the same steps.
std::vector<Method> AllMethods() {
  std::vector<Method> methods;
  for (const char* name : {"odca", "lagrange", "reduction"}) {
    for (const Enforcement level : {Enforcement::kAcceleration, Enforcement::kVelocity,
                                    Enforcement::kPosition, Enforcement::kBaumgarte}) {
      if (!FindFormulation(name)->Has(level)) continue;
      if (name == std::string("lagrange") && std::ranges::count(kLevelsOfTables, level)) continue;
      Method method{.formulation = name, .enforcement = level};
      // default gains grow with the longest step, which a fixed one leaves open
      if (level == Enforcement::kBaumgarte) method.gains = BaumgarteGains{5.0, 5.0};
      methods.push_back(method);
    }
  }
  return methods;
}

class Orders : public testing::TestWithParam<Method> {};

TEST_P(Orders, OfEveryProfileAreThoseOfItsPair) {
  for (const Motion& motion : kMotions) {
    const MechanismDescription description = Shipped(motion.mechanism).description;
    for (const Profiled& one : Profiles()) {
      const auto error = [&](int steps) {
        return ErrorOf(StatesOf(description, GetParam(), one.name, motion.horizon, steps),
                       Exact(motion));
      };
      const double coarse = error(one.steps * motion.factor),
                   fine = error(2 * one.steps * motion.factor);
      const double order = std::log2(coarse / fine);
      // terms of the next order make up to 0.4 at these steps; a lost order would be 1
      EXPECT_NEAR(order, one.order, 0.5)
          << motion.mechanism << " " << one.name << " " << coarse << " " << fine;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, Orders, testing::ValuesIn(AllMethods()), [](const auto& test) {
  return NameOf(test.param).substr(0, NameOf(test.param).find('('));
});

/// Every Butcher table of ARKODE at two levels: with the steps of a profile of the same order.
class OrdersOfTables : public testing::TestWithParam<Enforcement> {};

TEST_P(OrdersOfTables, AreThoseOfTheirNames) {
  const Method method{.formulation = "lagrange", .enforcement = GetParam()};
  const std::map<int, int> steps = {{2, 48}, {3, 24}, {4, 16}, {5, 12}, {6, 12}, {8, 6}};
  for (const Motion& motion : kMotions) {
    const MechanismDescription description = Shipped(motion.mechanism).description;
    for (const ButcherTable& table : ArkodeTables()) {
      const int coarse = steps.at(table.order) * motion.factor;
      const auto error = [&](int count) {
        return ErrorOf(StatesOf(description, method, table.name, motion.horizon, count),
                       Exact(motion));
      };
      const double first = error(coarse), second = error(2 * coarse);
      // above the tolerance of Newton's iteration, or the round-off of some 100 steps
      EXPECT_GT(second, table.is_implicit() ? 1e-12 : 1e-13)
          << motion.mechanism << " " << table.name;
      // as above
      EXPECT_NEAR(std::log2(first / second), table.order, 0.5)
          << motion.mechanism << " " << table.name << " " << first << " " << second;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Levels, OrdersOfTables, testing::ValuesIn(kLevelsOfTables),
                         [](const auto& test) { return std::string(ToString(test.param)); });

TEST(OrdersOfProfiles, AreOrdersOfTables) {
  const std::vector<ButcherTable> tables = ArkodeTables();
  for (const Profiled& one : Profiles()) {
    const ButcherTable& table = FindProfile(one.name)->table;
    EXPECT_TRUE(std::ranges::any_of(tables, [&](const ButcherTable& other) {
      return other.A == table.A && other.b == table.b;
    })) << one.name;
  }
}

TEST(OrdersOfProfiles, LackNone) {
  std::vector<std::string> names;
  for (const Profiled& one : Profiles()) names.push_back(one.name);
  EXPECT_EQ(names, ProfileNames());
}

}  // namespace loopbench::harness::reference::orders_test
