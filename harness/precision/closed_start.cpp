#include "harness/precision/closed_start.h"

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
    // says whether the projection failed
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

}  // namespace loopbench::harness
