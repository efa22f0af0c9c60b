// The kinds of joints of each space, in the order of JointType; for joint.cpp alone.
#pragma once

#include <vector>

#include "mechanism/model/joint.h"

namespace loopbench {

template <class S>
std::vector<JointKind<Planar, S>> PlanarKinds();

template <class S>
std::vector<JointKind<Spatial, S>> SpatialKinds();

/// qdot = u, for kinds whose speeds are the rates of their coordinates.
template <class S, int n>
void SameRates(const S*, const S* u, S* qdot) {
  for (int i = 0; i < n; ++i) qdot[i] = u[i];
}

/// The distance |p| has the second derivative n . p'' + |v_t|^2 / |p|, v_t the part of v across n.
template <class Space, class S>
void RodBias(const Pose<Space, S>& X, const Motion<Space, S>& V, Motion<Space, S>& Hdot_u) {
  const S distance = X.p.norm();
  const Linear<Space, S> n = X.p / distance, v = V.template tail<Space::kLin>();
  Hdot_u.setZero();
  Hdot_u.template tail<Space::kLin>() = -n * ((v - n * n.dot(v)).squaredNorm() / distance);
}

}  // namespace loopbench
