#include "mechanism/model/joint.h"

#include <cmath>
#include <deque>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "mechanism/algebra/instantiate.h"
#include "mechanism/model/joint_kinds.h"

namespace loopbench {

namespace {

/// Kinds that do not exist in the plane have no functions there, or no place behind the last.
template <class Space, class S>
std::deque<JointKind<Space, S>>& KindsOf() {
  static std::deque<JointKind<Space, S>> kinds = [] {
    std::vector<JointKind<Space, S>> built_in;
    if constexpr (Space::kRot == 1) {
      built_in = PlanarKinds<S>();
    } else {
      built_in = SpatialKinds<S>();
    }
    return std::deque<JointKind<Space, S>>(built_in.begin(), built_in.end());
  }();
  return kinds;
}

/// A pose without special values.
template <class Space, class S>
Pose<Space, S> SomePose() {
  Pose<Space, S> X;
  if constexpr (Space::kRot == 1) {
    X.SetAngle(S(0.4));
  } else {
    const S q[] = {S(0.8), S(0.2), S(0.4), S(0.4)};
    X.R = FromQuaternion(q);
  }
  for (int i = 0; i < Space::kLin; ++i) X.p[i] = S(0.3) + S(0.2) * S(i);
  return X;
}

/// Columns of H are as long at every pose, and screws are screws at every pose.
template <class Space, class S>
void ExamineBasis(JointKind<Space, S>* kind) {
  for (const auto directions : {kind->exact_basis, kind->basis}) {
    if (directions == nullptr) continue;
    Basis<Space, S> basis;
    directions(SomePose<Space, S>(), basis, kind->parameter);
    for (int i = 0; i < Space::kDim; ++i) {
      const bool turns = kind->axes[i] < Space::kRot;
      if (turns ? !basis[i].linear.isZero() : !basis[i].angular.isZero()) kind->has_screws = true;
    }
    if (directions != kind->basis || kind->num_u == 0) continue;
    kind->inverse_H_squared = S(1) / basis[0].squaredNorm();
  }
}

}  // namespace

template <class Space, class S>
void AddKind(JointType type, const JointKind<Space, S>& kind) {
  KindsOf<Space, S>().resize(static_cast<std::size_t>(type));
  ExamineBasis(&KindsOf<Space, S>().emplace_back(kind));
}

template <class Space, class S>
const JointKind<Space, S>& KindOf(JointType type) {
  const auto index = static_cast<std::size_t>(type);
  const auto& kinds = KindsOf<Space, S>();
  if (index < kinds.size()) return kinds[index];
  throw std::invalid_argument("joints of kind \"" + std::string(ToString(type)) +
                              "\" do not exist here: not in a plane, or in double alone");
}

template <class Space, class S>
JointKind<Space, S> KindWith(JointType type, S parameter) {
  JointKind<Space, S> kind = KindOf<Space, S>(type);
  kind.parameter = parameter;
  ExamineBasis(&kind);
  return kind;
}

template <class Space, class S>
Velocity<Space, S> Mismatch(const JointKind<Space, S>& kind, const Pose<Space, S>& X_FM) {
  if (kind.coordinates == nullptr) {  // a rod: its excess length along itself
    return {Angular<Space, S>::Zero(), X_FM.p * (S(1) - kind.parameter / X_FM.p.norm())};
  }
  S q[7];
  kind.coordinates(X_FM, q, kind.parameter);
  const Pose<Space, S> nearest = PoseAt(kind, q);
  Velocity<Space, S> mismatch(RotationVector(Compose(X_FM, Inverse(nearest))), X_FM.p - nearest.p);
  // A loop may wind: planar angles along it then differ by whole turns, which are no violation.
  if constexpr (Space::kRot == 1) {
    using std::remainder;
    mismatch.angular[0] = remainder(mismatch.angular[0], S(2 * std::numbers::pi_v<S>));
  }
  return mismatch;
}

#define LOOPBENCH_INSTANTIATE(Space, S)                         \
  template void AddKind(JointType, const JointKind<Space, S>&); \
  template const JointKind<Space, S>& KindOf(JointType);        \
  template JointKind<Space, S> KindWith(JointType, S);          \
  template Velocity<Space, S> Mismatch(const JointKind<Space, S>&, const Pose<Space, S>&);
LOOPBENCH_FOR_EACH_SPACE_AND_MODEL_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
