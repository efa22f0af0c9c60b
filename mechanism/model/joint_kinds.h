// The kinds of joints of each space, in the order of JointType; for joint.cpp and registry.cpp
// alone.
#pragma once

#include <vector>

#include "mechanism/model/joint.h"

namespace loopbench {

template <class S>
std::vector<JointKind<Planar, S>> PlanarKinds();

template <class S>
std::vector<JointKind<Spatial, S>> SpatialKinds();

/// Adds a kind's functions under the number that its traits have got.
template <class Space, class S>
void AddKind(JointType type, const JointKind<Space, S>& kind);

/// qdot = u, for kinds whose speeds are the rates of their coordinates.
template <class S, int n>
void SameRates(const S*, const S* u, S* qdot) {
  for (int i = 0; i < n; ++i) qdot[i] = u[i];
}

/// The distance |p| has the second derivative n . p'' + |v_t|^2 / |p|, v_t the part of v across n.
template <class Space, class S>
Acceleration<Space, S> RodBias(const Pose<Space, S>& X, const Velocity<Space, S>& V) {
  const S distance = X.p.norm();
  const Linear<Space, S> n = X.p / distance;
  const S across = (V.linear - n * n.dot(V.linear)).squaredNorm();
  return {Angular<Space, S>::Zero(), -n * (across / distance)};
}

}  // namespace loopbench
