#include "tests/contract/sample.h"

#include <limits>

namespace loopbench::testing {

namespace {

constexpr int kLargestAbsolute = 20;

}  // namespace

double RelativeError(const VectorX<double>& a, const RealVector& b) {
  if (!a.allFinite()) return std::numeric_limits<double>::quiet_NaN();
  if (b.size() == 0) return 0.0;
  const Real scale = b.lpNorm<Eigen::Infinity>();
  return static_cast<double>((ToReal(a) - b).lpNorm<Eigen::Infinity>() / scale);
}

template <class Space>
Sample<Space>::Sample(const MechanismDescription& description, std::uint64_t seed,
                      const std::optional<VectorX<double>>& q)
    : description_(description),
      joint_(description, Coordinates::kJoint),
      absolute_(description, Coordinates::kAbsolute) {
  joint_state_ = q ? WithRandomSpeeds(description, joint_, *q, seed)
                   : ConsistentState(description, joint_, seed);
  absolute_state_ = StateIn(absolute_, joint_, joint_state_);
  joint_answer_ =
      Oracle(description, LayoutOf(joint_)).Solve(ToReal(joint_state_.q), ToReal(joint_state_.u));
  if (num_bodies() <= kLargestAbsolute) {
    absolute_answer_ = Oracle(description, LayoutOf(absolute_))
                           .Solve(ToReal(absolute_state_.q), ToReal(absolute_state_.u));
  }
}

template <class Space>
RealVector Sample<Space>::udot(Coordinates coordinates) const {
  if (coordinates == Coordinates::kJoint) return joint_answer_.udot;
  if (absolute_answer_) return absolute_answer_->udot;
  RealVector udot(absolute_.num_u());
  for (const TreeStep& step : absolute_.tree()) {
    const int offset = absolute_.joints()[step.joint].u_offset;
    udot.segment<Space::kDim>(offset) =
        OwnComponents<Space>(joint_answer_.accelerations[step.child]);
  }
  return udot;
}

template <class Space>
double Sample<Space>::Bound() const {
  return 100 * std::numeric_limits<double>::epsilon() * num_bodies() / joint_answer_.rcond;
}

MechanismDescription CoupledLoops(SpaceKind space, std::uint64_t seed) {
  const int loops = space == SpaceKind::kPlanar ? 2 : 1;
  return seed % 2 == 0 ? MixedGraph(loops, space, seed, seed % 4 == 2 ? 2 : 0)
                       : RandomGraph(loops, space, seed);
}

MechanismDescription LoopOfAllKinds(std::uint64_t seed) {
  return MixedGraph(1, SpaceKind::kSpatial, seed, seed % 2 == 0 ? 1 : 0, DrawnKinds::kAll);
}

template class Sample<Planar>;
template class Sample<Spatial>;

}  // namespace loopbench::testing
