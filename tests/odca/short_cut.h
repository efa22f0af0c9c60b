// Short cuts of right-hand sides held against the general sweep.
#pragma once

#include <algorithm>
#include <limits>
#include <span>

#include "odca/odca.h"
#include "tests/contract/generators.h"
#include "tests/contract/system_with.h"

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
inline double Bound(int n, double rcond) {
  return 100.0 * std::numeric_limits<double>::epsilon() * n / rcond;
}

/// What both make of a state, loops closed or not, at a level with these speeds.
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
