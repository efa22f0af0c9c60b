#include "harness/precision/exact.h"

#include <algorithm>
#include <vector>

#include "harness/precision/scalars.h"
#include "lagrange/lagrange.h"
#include "mechanism/start/assembly.h"

namespace loopbench::harness {

template <class Space, class S>
ClosedStart<Space, S> CloseStart(const MechanismDescription& description) {
  ClosedStart<Space, S> closed;
  const Mechanism<Space, double> in_double(description, Coordinates::kJoint);
  const Start<double> start = Assemble<Space>(description, in_double);
  closed.outcome = start.outcome;
  closed.message = start.message;
  if (closed.outcome != Outcome::kFinished) return closed;
  closed.mechanism = std::make_unique<Mechanism<Space, S>>(description, Coordinates::kJoint);
  closed.system =
      MakeSystem<lagrange::Lagrange>(*closed.mechanism, {.enforcement = Enforcement::kPosition});
  const VectorX<S> q = start.q.template cast<S>(), u = start.u.template cast<S>();
  closed.outcome = closed.system->Start(S(0), q, u);
  std::vector<S> y(static_cast<std::size_t>(closed.system->state_size())), ydot(y.size());
  if (closed.outcome == Outcome::kFinished) {
    closed.system->ToState(q, u, y);
    closed.system->BeginStep(S(0), y);
    // the outcome is a failure if the projection failed
    closed.outcome = closed.system->Derivative(S(0), y, ydot);
  }
  if (closed.outcome != Outcome::kFinished) {
    closed.message = "the start does not close in the wide scalar";
  }
  return closed;
}

#define LOOPBENCH_INSTANTIATE(SPACE, S) \
  template ClosedStart<SPACE, S> CloseStart<SPACE, S>(const MechanismDescription&);
LOOPBENCH_INSTANTIATE(Planar, long double)
LOOPBENCH_INSTANTIATE(Planar, ::loopbench::Float128)
LOOPBENCH_INSTANTIATE(Spatial, long double)
#undef LOOPBENCH_INSTANTIATE

Exact::Exact(const MechanismDescription& description, Coordinates coordinates)
    : mechanism_(description, coordinates), kinematics_(mechanism_) {
  const auto start = CloseStart<Planar, Float128>(description);
  outcome_ = start.outcome;
  message_ = start.message;
  if (outcome_ != Outcome::kFinished) return;
  q_ = start.system->q();
  u_ = start.system->u();
  if (coordinates != Coordinates::kJoint) {
    q_ = start.system->kinematics().CoordinatesIn(mechanism_);
    kinematics_.UpdatePosition(q_);
    u_ = start.system->kinematics().SpeedsIn(kinematics_);
  }
  kinematics_.UpdatePosition(q_);
  kinematics_.UpdateVelocity(u_);
  kinematics_.AcceptStep();
  kinematics_.CountTurns();
}

Float128 Exact::Drift(const Float128& t, const VectorX<Float128>& q) {
  kinematics_.SetTime(t);
  kinematics_.UpdatePosition(q);
  Float128 largest = 0;
  for (int index : mechanism_.constraints()) {
    const JointState<Planar, Float128>& state = kinematics_.joints()[index];
    const int all = state.directions();
    // free directions of a joint have no violation
    const Direction<Planar, Float128> constrained =
        state.Sum(state.Along(kinematics_.ConstraintMismatch(index), all), all);
    largest = std::max(largest, constrained.linear.norm());
  }
  for (int c = 0; c < std::ssize(mechanism_.couplings()); ++c) {
    const Float128 by = abs(kinematics_.OfFirstJoint(c, kinematics_.CouplingMismatch(c)));
    largest = std::max(largest, kinematics_.FirstTurns(c) ? by * mechanism_.length() : by);
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
