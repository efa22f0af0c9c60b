#include "harness/precision/exact.h"

#include <algorithm>

#include "lagrange/lagrange.h"
#include "mechanism/formulation/system.h"
#include "mechanism/start/assembly.h"

namespace loopbench::harness {

Exact::Exact(const MechanismDescription& description, Coordinates coordinates)
    : mechanism_(description, coordinates), kinematics_(mechanism_) {
  const Mechanism<Planar, double> in_double(description, Coordinates::kJoint);
  const Start<double> start = Assemble<Planar>(description, in_double);
  outcome_ = start.outcome;
  message_ = start.message;
  if (outcome_ != Outcome::kFinished) return;
  const Mechanism<Planar, Float128> joints(description, Coordinates::kJoint);
  const auto projection =
      MakeSystem<lagrange::Lagrange>(joints, {.enforcement = Enforcement::kPosition});
  q_ = start.q.cast<Float128>();
  u_ = start.u.cast<Float128>();
  outcome_ = projection->Start(Float128(0), q_, u_);
  std::vector<Float128> y(static_cast<std::size_t>(projection->state_size())), ydot(y.size());
  if (outcome_ == Outcome::kFinished) {
    projection->ToState(q_, u_, y);
    projection->BeginStep(Float128(0), y);
    outcome_ = projection->Derivative(Float128(0), y, ydot);  // says whether the projection failed
  }
  if (outcome_ != Outcome::kFinished) {
    message_ = "the start does not close in float128";
    return;
  }
  q_ = projection->q();
  u_ = projection->u();
  if (coordinates == Coordinates::kJoint) return;
  q_ = projection->kinematics().CoordinatesIn(mechanism_);
  kinematics_.UpdatePosition(q_);
  u_ = projection->kinematics().SpeedsIn(kinematics_);
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
