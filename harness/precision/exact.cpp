#include "harness/precision/exact.h"

#include <algorithm>

#include "harness/precision/closed_start.h"

namespace loopbench::harness {

Exact::Exact(const MechanismDescription& description, Coordinates coordinates)
    : mechanism_(description, coordinates), kinematics_(mechanism_) {
  const auto start = CloseStart<Planar, Float128>(description);
  outcome_ = start.outcome;
  message_ = start.message;
  if (outcome_ != Outcome::kFinished) return;
  q_ = start.system->q();
  u_ = start.system->u();
  if (coordinates == Coordinates::kJoint) return;
  q_ = start.system->kinematics().CoordinatesIn(mechanism_);
  kinematics_.UpdatePosition(q_);
  u_ = start.system->kinematics().SpeedsIn(kinematics_);
}

Float128 Exact::Drift(const Float128& t, const VectorX<Float128>& q) {
  kinematics_.SetTime(t);
  kinematics_.UpdatePosition(q);
  Float128 largest = 0;
  for (int index : mechanism_.constraints()) {
    const JointState<Planar, Float128>& state = kinematics_.joints()[index];
    const int all = state.directions();
    // what a joint leaves free is no mismatch
    const Direction<Planar, Float128> constrained =
        state.Sum(state.Along(kinematics_.ConstraintMismatch(index), all), all);
    largest = std::max(largest, constrained.linear.norm());
  }
  return largest;
}

VectorX<Float128> Exact::Centres(const Float128& t, const VectorX<Float128>& q) {
  kinematics_.SetTime(t);
  kinematics_.UpdatePosition(q);
  VectorX<Float128> centres(Planar::kLin * (mechanism_.num_bodies() - 1));
  for (int body = 1; body < mechanism_.num_bodies(); ++body) {
    centres.segment<Planar::kLin>(Planar::kLin * (body - 1)) = kinematics_.poses()[body].p.eigen();
  }
  return centres;
}

}  // namespace loopbench::harness
