#include "mechanism/start/branches.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>

#include "mechanism/algebra/singular_values.h"
#include "mechanism/start/closure.h"
#include "mechanism/start/poses.h"

namespace loopbench {

namespace {

/// Differences below it are round-off of a closed position [rad, or mean links]; at a fold of two
/// branches closure errors of 1e-14 move positions by 1e-7.
constexpr double kSame = 1e-5;

template <class Space>
class BranchSearch {
 public:
  explicit BranchSearch(const MechanismDescription& description)
      : description_(description),
        whole_(WithTargets(description)),
        bare_(WithoutGuesses(whole_)),
        mechanism_(bare_, Coordinates::kJoint),
        kinematics_(mechanism_) {}

  Branches Run(int starts) {
    Branches result;
    const Start<double> own = Assemble<Space>(whole_, mechanism_);
    if (own.outcome == Outcome::kInconsistentStart) throw std::invalid_argument(own.message);
    kinematics_.UpdatePosition(own.q);
    units_ = AssemblyUnits<Space>(kinematics_);
    fixed_ = Guesses<Space>(bare_, mechanism_, units_).fixed();
    Add(own.q, &result);
    result.freedom = Freedom();
    if (result.freedom > 0) return result;
    std::mt19937_64 generator;
    for (result.starts = 0; result.starts < starts; ++result.starts) {
      Start<double> start;
      start.q = Scattered(own.q, generator);
      kinematics_.UpdatePosition(start.q);
      ClosePositions(bare_, kinematics_, units_, &start);
      if (start.outcome != Outcome::kFinished) continue;
      ++result.closed;
      kinematics_.UpdatePosition(start.q);
      Add(start.q, &result);
    }
    std::ranges::stable_sort(result.found, {}, &Branch::distance);
    return result;
  }

 private:
  static MechanismDescription WithoutGuesses(MechanismDescription description) {
    std::erase_if(description.initial.coordinates, [&](const JointValues& values) {
      return !description.initial.IsHeld(values.joint);
    });
    std::erase_if(description.initial.poses,
                  [](const PoseTarget& target) { return !target.fixed; });
    return description;
  }

  VectorX<double> Scattered(const VectorX<double>& own, std::mt19937_64& generator) const {
    VectorX<double> u(mechanism_.num_u());
    for (double& value : u) value = std::numbers::pi * (2.0 * UnitNumber(generator) - 1.0);
    ClearFixed(fixed_, &u);
    return mechanism_.Moved(own, u.cwiseProduct(units_.columns));
  }

  /// Free coordinates less the rank of the loops, at the current position.
  int Freedom() const {
    const Guesses<Space> guesses(bare_, mechanism_, units_);
    const auto& held = guesses.held();
    const MatrixX<double> J =
        LoopRows(kinematics_, units_, units_.With(kinematics_, held), held, fixed_);
    const auto free = std::ranges::count(fixed_, false);
    if (J.size() == 0) return static_cast<int>(free);
    SingularValues<double> values;
    values.ComputeValues(J);
    const double least = 1e-8 * values.sigma()[0];  // far above round-off
    return static_cast<int>(free - (values.sigma().array() > least).count());
  }

  /// The largest difference of a body's pose from the present one [rad, or mean links].
  double Apart(const std::vector<Pose<Space, double>>& poses) const {
    double apart = 0.0;
    for (std::size_t body = 0; body < poses.size(); ++body) {
      const Pose<Space, double>&a = poses[body], &b = kinematics_.poses()[body];
      // |A - B| = 2 sqrt(2) sin(angle / 2) for rotations in space, and in the plane
      const double chord = (a.R - b.R).norm() / (2.0 * std::numbers::sqrt2);
      const double angle = 2.0 * std::asin(std::min(1.0, chord));
      apart = std::max({apart, (a.p - b.p).norm() / units_.length, angle});
    }
    return apart;
  }

  /// Adds the present position, unless it is known.
  void Add(const VectorX<double>& q, Branches* result) {
    for (std::size_t k = 0; k < poses_.size(); ++k) {
      if (Apart(poses_[k]) > kSame) continue;
      // the list is sorted at the end only
      ++result->found[k].times;
      return;
    }
    if (!poses_.empty() && Freedom() > 0) {
      ++result->movable;
      return;
    }
    Branch branch{.description = WithoutGuesses(description_), .times = poses_.empty() ? 0 : 1};
    if (!poses_.empty()) branch.distance = Apart(poses_[0]);
    poses_.push_back(kinematics_.poses());
    InitialDescription& initial = branch.description.initial;
    for (JointValues& values : TreeValues(mechanism_, q)) {
      if (!initial.IsHeld(values.joint)) initial.coordinates.push_back(std::move(values));
    }
    result->found.push_back(std::move(branch));
  }

  const MechanismDescription& description_;
  const MechanismDescription whole_;  ///< with targets as joints
  const MechanismDescription bare_;   ///< with fixed coordinates only
  const Mechanism<Space, double> mechanism_;
  Kinematics<Space, double> kinematics_;
  AssemblyUnits<Space> units_;
  std::vector<bool> fixed_;
  std::vector<std::vector<Pose<Space, double>>> poses_;  ///< of the branches found
};

}  // namespace

Branches FindBranches(const MechanismDescription& description, int starts) {
  const MechanismDescription whole = Unreleased(description);
  return ForSpace(whole.space,
                  [&]<class Space>(Space) { return BranchSearch<Space>(whole).Run(starts); });
}

}  // namespace loopbench
