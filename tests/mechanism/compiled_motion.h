// Accelerations of the user's bodies in a compiled description, against the oracle's.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "mechanism/formulation/system.h"
#include "mechanism/loops/tree_dynamics.h"
#include "mechanism/simplify/compile.h"
#include "odca/odca.h"
#include "tests/contract/generators.h"

namespace loopbench::testing {

/// What the savings may change, relative to the largest acceleration, where loops are conditioned
/// better than 1e-2: rounding of frames and masses (16 eps) over that, with a factor for sums.
inline constexpr double kSame = 1e-11;

struct Truth {
  MechanismDescription description;  ///< with its whole state as initial values
  std::vector<Real6> A;              ///< of the centres of mass, ground axes
  double rcond = 1.0;
};

template <class Space>
Truth MakeTruth(const MechanismDescription& description, std::uint64_t seed) {
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  const State state = ConsistentState(description, mechanism, seed);
  Truth truth{description, {}, 1.0};
  InitialDescription& initial = truth.description.initial;
  initial = {};
  for (const TreeStep& step : mechanism.tree()) {
    const Joint<Space, double>& joint = mechanism.joints()[step.joint];
    const double *q = state.q.data() + joint.q_offset, *u = state.u.data() + joint.u_offset;
    if (joint.description < 0 || joint.kind->num_u == 0) continue;
    initial.coordinates.push_back({joint.description, {q, q + joint.kind->num_q}});
    initial.speeds.push_back({joint.description, {u, u + joint.kind->num_u}});
    initial.held.push_back(joint.description);
  }
  // floating parts start at rest: their virtual joints take no initial values
  const Mechanism<Space, double> with_state(truth.description, Coordinates::kJoint);
  const Start<double> start = Assemble<Space>(truth.description, with_state);
  EXPECT_EQ(start.outcome, Outcome::kFinished) << start.message;
  Answer answer =
      Oracle(truth.description, LayoutOf(with_state)).Solve(ToReal(start.q), ToReal(start.u));
  truth.A = std::move(answer.accelerations);
  truth.rcond = answer.rcond;
  return truth;
}

/// Poses and accelerations of the user's bodies that one part carries.
template <class Space>
void AddPart(const Truth& truth, const Compiled& compiled, int part, double* error, double* size) {
  const MechanismDescription& description = compiled.parts[part].description;
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  const Start<double> start = Assemble<Space>(description, mechanism);
  ASSERT_EQ(start.outcome, Outcome::kFinished) << start.message;
  const auto odca = MakeSystem<odca::Odca>(mechanism);
  VectorX<double> udot(mechanism.num_u());
  ASSERT_EQ(odca->Start(0.0, start.q, start.u), Outcome::kFinished);
  ASSERT_EQ(odca->Evaluate(0.0, start.q, start.u, udot), Outcome::kFinished);
  TreeDynamics<Space, double> dynamics(mechanism);
  std::vector<Acceleration<Space, double>> A(mechanism.num_bodies());
  dynamics.BodyAccelerations(odca->kinematics(), udot, A);
  const Eigen::Matrix3d& R_WC = compiled.parts[part].R_WC;
  for (std::size_t b = 1; b < compiled.bodies.size(); ++b) {
    const BodyImage& image = compiled.bodies[b];
    if (image.part != part) continue;
    const auto X = UserPose<Space>(compiled, static_cast<int>(b), &odca->kinematics());
    const Eigen::Vector3d com = X.R * truth.description.bodies[b].com + X.p;
    Eigen::Vector3d w = Eigen::Vector3d::Zero(), alpha = w, a = w, from = w;
    w.tail<Space::kRot>() = odca->kinematics().motions()[image.body].angular.eigen();
    alpha.tail<Space::kRot>() = A[image.body].angular.eigen();
    a.head<Space::kLin>() = A[image.body].linear.eigen();
    from.head<Space::kLin>() = odca->kinematics().poses()[image.body].p.eigen();
    w = (R_WC * w).eval();
    alpha = (R_WC * alpha).eval();
    const Eigen::Vector3d r = com - R_WC * from;
    Eigen::Matrix<double, 6, 1> here;
    here << alpha, R_WC * a + alpha.cross(r) + w.cross(w.cross(r));
    // across the plane the way from the compiled centre of mass has a part along the normal, about
    // which the body turns: it adds nothing
    *error = std::max(*error, (here - truth.A[b].cast<double>()).norm());
    *size = std::max(*size, truth.A[b].cast<double>().norm());
  }
}

inline void ExpectSameMotion(const Truth& truth, const CompileOptions& options,
                             Compiled* compiled) {
  *compiled = Compile(truth.description, options);
  double error = 0.0, size = 0.0;
  for (std::size_t b = 1; b < compiled->bodies.size(); ++b) {
    if (compiled->bodies[b].part >= 0) continue;
    error = std::max(error, truth.A[b].cast<double>().norm());  // fixed: it must not accelerate
  }
  for (int part = 0; part < static_cast<int>(compiled->parts.size()); ++part) {
    if (compiled->parts[part].description.space == SpaceKind::kPlanar) {
      AddPart<Planar>(truth, *compiled, part, &error, &size);
    } else {
      AddPart<Spatial>(truth, *compiled, part, &error, &size);
    }
  }
  EXPECT_GT(size, 0.0);
  EXPECT_LE(error, kSame * std::max(1.0, 1e-2 / truth.rcond) * size)
      << truth.description.name << ", rcond " << truth.rcond;
}

inline constexpr CompileOptions kOnlyPlanar{.planar = true, .welds = false, .immovable = false};
inline constexpr CompileOptions kOnlyWelds{.planar = false, .welds = true, .immovable = false};

}  // namespace loopbench::testing
