// A random mechanism with a consistent state, and what the oracle says about it.
#pragma once

#include <optional>
#include <vector>

#include "tests/contract/generators.h"

namespace loopbench::testing {

/// A sample in one space: mechanism and consistent state in both coordinate sets, the oracle's
/// answers. Absolute coordinates of more than 20 bodies take their answer from the bodies'
/// accelerations in joint coordinates: a dense system of six speeds per body grows too slow.
template <class Space>
class Sample {
 public:
  /// `q`: joint coordinates where the description itself has none that close its loops.
  Sample(const MechanismDescription& description, std::uint64_t seed,
         const std::optional<VectorX<double>>& q = {});

  const MechanismDescription& description() const { return description_; }
  const Answer& answer() const { return joint_answer_; }
  int num_bodies() const { return joint_.num_bodies() - 1; }
  const Mechanism<Space, double>& mechanism(Coordinates coordinates) const {
    return coordinates == Coordinates::kJoint ? joint_ : absolute_;
  }
  const State& state(Coordinates coordinates) const {
    return coordinates == Coordinates::kJoint ? joint_state_ : absolute_state_;
  }
  /// The oracle's udot in either set.
  RealVector udot(Coordinates coordinates) const;
  /// The oracle's forces of the user's joints, in absolute coordinates its own where it has them.
  const std::vector<Real6>& forces(Coordinates coordinates) const {
    const bool own = coordinates == Coordinates::kAbsolute && absolute_answer_;
    return own ? absolute_answer_->forces : joint_answer_.forces;
  }
  /// Allowed error: 100 eps n / rcond, round-off of n bodies magnified by the condition of the
  /// closures.
  double Bound() const;

 private:
  const MechanismDescription description_;
  const Mechanism<Space, double> joint_, absolute_;
  State joint_state_, absolute_state_;
  Answer joint_answer_;
  std::optional<Answer> absolute_answer_;
};

/// Components of [angular; linear] that the space has.
template <class Space>
Eigen::Matrix<Real, Space::kDim, 1> OwnComponents(const Real6& v) {
  if constexpr (Space::kRot == 1) {
    return v.segment<3>(2);
  } else {
    return v;
  }
}

/// max |a - b| / max |b|; NaN stays NaN.
double RelativeError(const VectorX<double>& a, const RealVector& b);

/// Coupled loops with forces of every kind, every second with joints of every kind, every fourth
/// with prescribed motions; independent closures, so that every column can run.
MechanismDescription CoupledLoops(SpaceKind space, std::uint64_t seed);

/// One loop in space through joints of all kinds, every second with a prescribed motion.
MechanismDescription LoopOfAllKinds(std::uint64_t seed);

}  // namespace loopbench::testing
