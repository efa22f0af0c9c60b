// Short cuts of right-hand sides held against the general sweep.
#pragma once

#include "odca/odca.h"
#include "tests/contract/allocations.h"
#include "tests/contract/builder.h"
#include "tests/contract/system_with.h"
#include "tests/standard.h"

namespace loopbench::odca {

using Numbers = VectorX<double>;

inline std::span<const double> In(const Numbers& numbers) {
  return {numbers.data(), static_cast<std::size_t>(numbers.size())};
}
inline std::span<double> In(Numbers& numbers) {
  return {numbers.data(), static_cast<std::size_t>(numbers.size())};
}

inline Numbers RandomNumbers(testing::Random& random, int n, double size) {
  Numbers numbers(n);
  for (double& x : numbers) x = random.Uniform(-size, size);
  return numbers;
}

/// The contract's bound: sums along n bodies, magnified by the condition of what is inverted.
inline double Bound(int n, double rcond) { return 100.0 * kEps * n / rcond; }

/// Results of the fast path and of the general sweep for a state at a level with these speeds.
struct Both {
  Outcome outcome = Outcome::kFinished;
  Diagnostics general;
  bool evaluated = false;
  /// Over the largest speed or acceleration of those that were added up: where loops leave no
  /// freedom, nothing is left of them.
  double difference = 0.0;
};
/// `sweep` may be null. The general sweep is made with `plan`, if given.
template <class Space, class Sweep, class... Plan>
Both Compare(const Mechanism<Space, double>& mechanism, Sweep* sweep, SpeedsUsed speeds,
             const Numbers& q, const Numbers& u, const Plan&... plan) {
  const auto level =
      speeds == SpeedsUsed::kGiven ? Enforcement::kAcceleration : Enforcement::kVelocity;
  testing::SystemWith<Odca, Space, double> odca(mechanism, {.enforcement = level}, plan...);
  Both both;
  both.outcome = odca->Start(0.0, q, u);
  const Eigen::Index n = q.size();
  Numbers y(2 * n), general(y), own = Numbers::Zero(2 * n);
  odca->ToState(q, u, In(y));
  constexpr double kTime = 0.7;  // functions of it are forces of some
  both.outcome = odca->Examine(kTime, In(y), In(general));
  both.general = odca->diagnostics();
  const std::span<double> rates = In(own);
  Kinematics<Space, double> kinematics(mechanism);
  kinematics.SetTime(kTime);
  both.evaluated = sweep != nullptr && sweep->Evaluate(speeds, &kinematics, In(q), In(u),
                                                       rates.first(n), rates.last(n));
  const auto largest = [](const Numbers& numbers) { return numbers.cwiseAbs().maxCoeff(); };
  const double speed = std::max(largest(general.head(n)), largest(u));
  // forces of a newton or some, on bodies of a kilogram or so, as gravity
  const double acceleration =
      std::max({largest(general.tail(n)), mechanism.gravity().norm(), speed * speed});
  both.difference = std::max(largest(own.head(n) - general.head(n)) / speed,
                             largest(own.tail(n) - general.tail(n)) / acceleration);
  return both;
}

/// Comparisons of many states with the general sweep.
struct Tally {
  int states = 0, refused = 0, regularized = 0, answered_though_regularized = 0;
  double worst = 0.0;  ///< difference over its bound

  /// Adds a state of `n` bodies. A short cut may reject states that the general sweep regularizes,
  /// and states near them, with rcond below 0.01. Its bounds on eigenvalues are up to a hundred
  /// times their limit of 1e-4.
  void Add(const Both& both, int n, const std::string& name) {
    ++states;
    if (both.outcome != Outcome::kFinished || both.general.smallest_weight < 1.0) {
      ++regularized;
      answered_though_regularized += both.evaluated;
      return;
    }
    if (!both.evaluated) {
      EXPECT_LT(both.general.rcond, 0.01) << name;
      ++refused;
      return;
    }
    const double of_bound = both.difference / Bound(n, both.general.rcond);
    EXPECT_LE(of_bound, 1.0) << name << " rcond " << both.general.rcond;
    worst = std::max(worst, of_bound);
  }
  /// Prints the counts, and expects at most `share` of the states to be refused near regularized
  /// ones.
  void Finish(double share) const {
    std::printf("%d states, %d regularized, %d more refused, worst %.2g of the bound\n", states,
                regularized, refused, worst);
    EXPECT_EQ(answered_though_regularized, 0);
    EXPECT_LE(refused, share * states);
  }
};

/// The described coordinates, moved at random by up to `size`, and random speeds.
template <class Space>
std::pair<Numbers, Numbers> StateNear(const MechanismDescription& description,
                                      const Mechanism<Space, double>& mechanism, double size,
                                      testing::Random& random) {
  Numbers q = RandomNumbers(random, mechanism.num_q(), size);
  q += testing::DescribedCoordinates(description, mechanism);
  return {q, RandomNumbers(random, mechanism.num_u(), 1.0)};
}

/// All that a sweep finds: rates by given and by completed speeds, positions and speeds of a
/// projection, and at last whether it accepted each. Nothing allocates.
template <class Space>
std::vector<Numbers> AllOf(ShortCut<Space>& sweep, const Mechanism<Space, double>& mechanism,
                           const Numbers& q, const Numbers& u) {
  Kinematics<Space, double> kinematics(mechanism);
  std::vector<Numbers> all;
  Numbers accepted = Numbers::Zero(3), moved = q, changed = u;
  for (const SpeedsUsed speeds : {SpeedsUsed::kGiven, SpeedsUsed::kCompleted}) {
    Numbers qdot = Numbers::Zero(u.size()), udot = qdot;
    double& each = accepted[speeds == SpeedsUsed::kGiven ? 0 : 1];
    const long before = testing::CountAllocations();
    for (int round = 0; round < 3; ++round) {
      each = sweep.Evaluate(speeds, &kinematics, In(q), In(u), In(qdot), In(udot));
    }
    EXPECT_EQ(testing::CountAllocations(), before);
    EXPECT_EQ(udot.isZero(0.0), each == 0.0);
    all.insert(all.end(), {qdot, udot});
  }
  const long before = testing::CountAllocations();
  accepted[2] = sweep.Project(In(moved), In(changed), 1e-12).has_value();
  EXPECT_EQ(testing::CountAllocations(), before);
  all.insert(all.end(), {moved, changed, accepted});
  return all;
}

/// The same bits with 1, 2, 3 and 7 threads. `make` takes threads and makes a sweep of four groups.
template <class Space>
void ExpectTheSameBits(const auto& make, const Mechanism<Space, double>& mechanism,
                       const Numbers& q, const Numbers& u, bool accepted) {
  const auto found = [&](int threads) {
    const auto sweep = make(threads);
    EXPECT_EQ(sweep->threads(), std::min(threads, 4)) << "no more than groups";
    return AllOf(*sweep, mechanism, q, u);
  };
  const auto alone = found(1);
  EXPECT_EQ(alone.back(), Numbers::Constant(3, accepted));
  for (const int threads : {2, 3, 7}) EXPECT_TRUE(found(threads) == alone) << threads;
}

/// A number that counts its products.
struct Counted {
  double value = 0.0;
  inline static int products = 0;
  Counted() = default;
  Counted(double number) : value(number) {}
  friend Counted operator+(Counted a, Counted b) { return a.value + b.value; }
  friend Counted operator-(Counted a, Counted b) { return a.value - b.value; }
  friend Counted operator-(Counted a) { return -a.value; }
  friend Counted operator*(Counted a, Counted b) { return ++products, a.value * b.value; }
  friend Counted operator/(Counted a, Counted b) { return ++products, a.value / b.value; }
  friend bool operator<(Counted a, Counted b) { return a.value < b.value; }
};

inline int ProductsOf(auto call) {
  Counted::products = 0;
  call();
  return Counted::products;
}

}  // namespace loopbench::odca
