// Everything is in ground axes. Motions, accelerations and wrenches of a body are at its centre of
// mass, those of a joint at Mo (joint.h). With S(r) the shift of a motion by r, S(r)^T shifts a
// wrench back: [m; f] at c + r is [m + r x f; f] at c. Equation numbers refer to the O-DCA paper.
#include "mechanism/loops/tree_dynamics.h"

#include <type_traits>

#include "mechanism/algebra/instantiate.h"
#include "mechanism/loops/loop_speeds.h"

namespace loopbench {

namespace {

/// The two arms of a tree step: from the parent's com to the joint, from the joint to the child's.
template <class Space, class S>
struct Arms {
  Linear<Space, S> parent, child;
  Arms(const TreeStep& step, const JointState<Space, S>& state)
      : parent(step.sign > 0 ? state.r_P : state.r_Q),
        child(step.sign > 0 ? Linear<Space, S>(-state.r_Q) : Linear<Space, S>(-state.r_P)) {}
  /// Computes the same from the centres of these masses.
  Arms(const TreeStep& step, const Kinematics<Space, S>& kinematics, Masses masses)
      : Arms(step, kinematics.joints()[step.joint]) {
    if (masses == Masses::kPhysical) return;
    parent =
        step.sign > 0 ? kinematics.ArmP(step.joint, masses) : kinematics.ArmQ(step.joint, masses);
    child = step.sign > 0 ? Linear<Space, S>(-kinematics.ArmQ(step.joint, masses))
                          : Linear<Space, S>(-kinematics.ArmP(step.joint, masses));
  }
};

/// X^T I X for a shift of the reference point by r: inertia seen from c instead of c + r.
template <class Space, class S>
Block<Space, S> ShiftInertia(const Block<Space, S>& I, const Linear<Space, S>& r) {
  if constexpr (std::is_same_v<S, double> && Space::kRot == 3) {
    // X is the identity with e_i x r below its column i; its zeros are left out, with the same
    // bits.
    Block<Space, S> IX = I;
    for (int i = 0; i < 3; ++i) {
      const Linear<Space, S> x = Linear<Space, S>::Unit(i).cross(r);
      const int low = i == 0 ? 1 : 0, high = i == 2 ? 1 : 2;
      for (int k = 0; k < 6; ++k) {
        IX(k, i) = IX(k, i) + I(k, 3 + low) * x[low] + I(k, 3 + high) * x[high];
      }
    }
    Block<Space, S> shifted = IX;
    for (int i = 0; i < 3; ++i) {
      const Linear<Space, S> x = Linear<Space, S>::Unit(i).cross(r);
      const int low = i == 0 ? 1 : 0, high = i == 2 ? 1 : 2;
      for (int k = 0; k < 6; ++k) {
        shifted(i, k) = IX(i, k) + x[low] * IX(3 + low, k) + x[high] * IX(3 + high, k);
      }
    }
    return shifted;
  }
  Block<Space, S> X;
  for (int i = 0; i < Space::kDim; ++i) {
    const Velocity<Space, S> column = ShiftMotion<Space, S>(Velocity<Space, S>::Unit(i), r);
    for (int k = 0; k < Space::kDim; ++k) X(k, i) = column[k];
  }
  return X.transpose() * (I * X);
}

/// Composite rigid bodies (Featherstone, Rigid Body Dynamics Algorithms, section 6.2). `composite`
/// of a body is the inertia at its centre of mass of all that the tree has outward of it. Column i
/// of M is the momentum that the unit speed i gives the composite body outward of its joint, moved
/// inward and projected on H of each joint on the way:
///
///   M_ki = H_k^T S^T .. S^T I_composite S H_i
template <Masses masses, class Space, class S>
void FillMassMatrix(const Kinematics<Space, S>& kinematics, std::vector<Block<Space, S>>& composite,
                    MatrixX<S>& M) {
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  const std::vector<Inertia<Space, S>>& inertias = mechanism.bodies(masses);
  const auto& tree = mechanism.tree();
  M.setZero(mechanism.num_u(), mechanism.num_u());
  for (int body = 1; body < mechanism.num_bodies(); ++body) {
    composite[body] = DiagonalBlock<Space, S>(kinematics.RotationalInertia(inertias[body], body),
                                              inertias[body].mass);
  }
  for (auto step = tree.rbegin(); step != tree.rend(); ++step) {
    const JointState<Space, S>& state = kinematics.joints()[step->joint];
    const Joint<Space, S>& joint = mechanism.joints()[step->joint];
    const Arms<Space, S> arms(*step, kinematics, masses);
    for (int i = 0; i < joint.num_u(); ++i) {
      // momentum of the subtree moving along direction i, carried rootward
      const Velocity<Space, S> h = state.H(i) * S(step->sign);
      auto F =
          Apply<Wrench<Space, S>>(composite[step->child], ShiftMotion<Space, S>(h, arms.child));
      for (int s = mechanism.step_of_body(step->child); s >= 0;) {
        const TreeStep& at = tree[s];
        const JointState<Space, S>& at_state = kinematics.joints()[at.joint];
        const Joint<Space, S>& at_joint = mechanism.joints()[at.joint];
        const Arms<Space, S> at_arms(at, kinematics, masses);
        F = ShiftForce<Space, S>(F, at_arms.child);
        for (int k = 0; k < at_joint.num_u(); ++k) {
          const S value = S(at.sign) * at_state.H(k).dot(F);
          M(at_joint.u_offset + k, joint.u_offset + i) = value;
          M(joint.u_offset + i, at_joint.u_offset + k) = value;
        }
        F = ShiftForce<Space, S>(F, at_arms.parent);
        s = mechanism.step_of_body(at.parent);
      }
    }
    if (step->parent != kGround) {
      const Linear<Space, S> r = arms.parent + arms.child;
      composite[step->parent] += ShiftInertia<Space, S>(composite[step->child], r);
    }
  }
}

/// D^T (V_Q - V_P) of one constraint by speed, for `count` directions, from row `first` of J on.
template <class Space, class S>
void SetRows(const Kinematics<Space, S>& kinematics, int index, int first, int count,
             MatrixX<S>& J) {
  const JointState<Space, S>& state = kinematics.joints()[index];
  ForEachSpeedOfLoop(kinematics, index, [&](int column, const Velocity<Space, S>& V) {
    for (int r = 0; r < count; ++r) J(first + r, column) = state.D(r).dot(V);
  });
}

}  // namespace

template <class Space, class S>
TreeDynamics<Space, S>::TreeDynamics(const Mechanism<Space, S>& mechanism)
    : A_bias_(mechanism.num_bodies(), Acceleration<Space, S>::Zero()),
      F_(mechanism.num_bodies(), Wrench<Space, S>::Zero()),
      composite_(mechanism.num_bodies(), Block<Space, S>::Zero()) {}

template <class Space, class S>
void TreeDynamics<Space, S>::MassMatrix(const Kinematics<Space, S>& kinematics, Masses masses,
                                        MatrixX<S>& M) {
  if (masses == Masses::kPhysical) {
    FillMassMatrix<Masses::kPhysical>(kinematics, composite_, M);
  } else {
    FillMassMatrix<Masses::kGeometric>(kinematics, composite_, M);
  }
}

/// (7) along the tree, parent before child: with both points at Mo and n = [0; w x (w x r)],
///
///   A at Mo of the parent's side  =  S(r_parent) A_parent + n_parent
///   A at Mo of the child's side   =  that +- (H udot + g)
///   A_child                       =  S(-r_child) (that) + n_child
template <class Space, class S>
template <bool kWithBias>
void TreeDynamics<Space, S>::Outward(const Kinematics<Space, S>& kinematics, const VectorX<S>& udot,
                                     std::span<Acceleration<Space, S>> A) const {
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  A[kGround].setZero();
  for (const TreeStep& step : mechanism.tree()) {
    const JointState<Space, S>& state = kinematics.joints()[step.joint];
    const Joint<Space, S>& joint = mechanism.joints()[step.joint];
    const Arms<Space, S> arms(step, state);
    Acceleration<Space, S> A_rel = kWithBias ? state.g : Acceleration<Space, S>::Zero();
    for (int i = 0; i < joint.num_u(); ++i) A_rel += state.H(i) * udot[joint.u_offset + i];
    Acceleration<Space, S> at_joint = ShiftMotion<Space, S>(A[step.parent], arms.parent);
    if constexpr (kWithBias) at_joint += kinematics.Centripetal(step.parent, arms.parent);
    at_joint += S(step.sign) * A_rel;
    A[step.child] = ShiftMotion<Space, S>(at_joint, arms.child);
    if constexpr (kWithBias) A[step.child] += kinematics.Centripetal(step.child, arms.child);
  }
}

template <class Space, class S>
void TreeDynamics<Space, S>::BodyAccelerations(const Kinematics<Space, S>& kinematics,
                                               const VectorX<S>& udot,
                                               std::span<Acceleration<Space, S>> A) const {
  Outward<true>(kinematics, udot, A);
}

template <class Space, class S>
void TreeDynamics<Space, S>::Motions(const Kinematics<Space, S>& kinematics, const VectorX<S>& udot,
                                     std::span<Acceleration<Space, S>> A) const {
  Outward<false>(kinematics, udot, A);
}

template <class Space, class S>
void TreeDynamics<Space, S>::MassTimes(const Kinematics<Space, S>& kinematics, const VectorX<S>& x,
                                       VectorX<S>& force) {
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  Motions(kinematics, x, A_bias_);
  F_[kGround] = Wrench<Space, S>::Zero();
  for (int body = 1; body < mechanism.num_bodies(); ++body) {
    F_[body] = InertiaTimes<Space, S>(kinematics, body, A_bias_[body]);
  }
  force.setZero(mechanism.num_u());
  AlongForest(kinematics, force);
}

template <class Space, class S>
Wrench<Space, S> InertiaTimes(const Kinematics<Space, S>& kinematics, int body,
                              const Acceleration<Space, S>& A) {
  const Inertia<Space, S>& inertia = kinematics.mechanism().bodies()[body];
  return {kinematics.RotationalInertia(inertia, body) * A.angular, inertia.mass * A.linear};
}

/// Newton and Euler about the centre of mass: [I alpha + w x I w; m a].
template <class Space, class S>
Wrench<Space, S> InertialForce(const Kinematics<Space, S>& kinematics, int body,
                               const Acceleration<Space, S>& A) {
  const Inertia<Space, S>& inertia = kinematics.mechanism().bodies()[body];
  const auto I = kinematics.RotationalInertia(inertia, body);
  const Angular<Space, S>& w = kinematics.motions()[body].angular;
  return {I * A.angular + CrossAngular<S>(w, I * w), inertia.mass * A.linear};
}

/// h by the recursive Newton-Euler method: outwards accelerations for udot = 0, then the wrenches
/// that bodies need for them beyond applied forces, then inwards their components along H.
template <class Space, class S>
void TreeDynamics<Space, S>::Bias(const Kinematics<Space, S>& kinematics, VectorX<S>& h) {
  h.setZero(kinematics.mechanism().num_u());
  BodyAccelerations(kinematics, h, A_bias_);
  NeededWrenches(kinematics);
  AlongForest(kinematics, h);
}

/// A cut joint carries D lambda on Q and -D lambda on P at Mo (13).
template <class Space, class S>
std::span<const Wrench<Space, S>> TreeDynamics<Space, S>::WrenchesLeft(
    const Kinematics<Space, S>& kinematics, const VectorX<S>& udot, const VectorX<S>& lambda) {
  BodyAccelerations(kinematics, udot, A_bias_);
  NeededWrenches(kinematics);
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  const auto carry = [&](int index, const Wrench<Space, S>& F) {
    const Joint<Space, S>& joint = mechanism.joints()[index];
    const JointState<Space, S>& state = kinematics.joints()[index];
    F_[joint.to] -= ShiftForce<Space, S>(F, state.r_Q);
    F_[joint.from] += ShiftForce<Space, S>(F, state.r_P);
  };
  for (int index : mechanism.constraints()) {
    const JointState<Space, S>& state = kinematics.joints()[index];
    Wrench<Space, S> F = Wrench<Space, S>::Zero();
    for (int r = 0; r < state.rows(); ++r) {
      F += state.D(r) * lambda[mechanism.joints()[index].row + r];
    }
    carry(index, F);
  }
  for (int c = 0; mechanism.num_rows() + c < static_cast<int>(lambda.size()); ++c) {
    const S& mu = lambda[mechanism.num_rows() + c];
    if (mechanism.couplings()[c].is_moving_row) {
      const MovingRow& row = kinematics.moving_row(c);
      carry(row.joint, Wrench<Space, S>(kinematics.direction(row) * mu));
    }
    for (const auto& [index, ratio] : mechanism.couplings()[c].parts) {
      carry(index, WrenchOfEffort<Space, S>(kinematics.joints()[index].basis[0],
                                            mechanism.joints()[index].kind->inverse_H_squared,
                                            ratio * mu));
    }
  }
  return F_;
}

/// As h in Bias(), with the accelerations of udot and the forces of lambda.
template <class Space, class S>
void TreeDynamics<Space, S>::Residual(const Kinematics<Space, S>& kinematics,
                                      const VectorX<S>& udot, const VectorX<S>& lambda,
                                      VectorX<S>& force, VectorX<S>& constraint) {
  WrenchesLeft(kinematics, udot, lambda);
  force.setZero(kinematics.mechanism().num_u());
  AlongForest(kinematics, force);
  JacobianBias(kinematics, constraint);
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  for (int c = 0; c < static_cast<int>(mechanism.couplings().size()); ++c) {
    constraint[mechanism.num_rows() + c] =
        -CouplingAcceleration<Space, S>(kinematics, c, &udot, A_bias_);
  }
  constraint = -constraint;
}

template <class Space, class S>
void TreeDynamics<Space, S>::NeededWrenches(const Kinematics<Space, S>& kinematics) {
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  AppliedForces<Space, S>(kinematics, F_);
  for (int body = 1; body < mechanism.num_bodies(); ++body) {
    F_[body] = InertialForce<Space, S>(kinematics, body, A_bias_[body]) - F_[body];
  }
  AddRotorWrenches<Space, S>(kinematics, A_bias_, F_);
}

/// Inwards, child before parent: a joint transmits the total load of all bodies outward of it. H^T
/// of this load at Mo is the force along its coordinates. Leaves in F_ of a body the sum for its
/// subtree.
template <class Space, class S>
void TreeDynamics<Space, S>::AlongForest(const Kinematics<Space, S>& kinematics,
                                         VectorX<S>& force) {
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  const auto& tree = mechanism.tree();
  for (auto step = tree.rbegin(); step != tree.rend(); ++step) {
    const JointState<Space, S>& state = kinematics.joints()[step->joint];
    const Joint<Space, S>& joint = mechanism.joints()[step->joint];
    const Arms<Space, S> arms(*step, state);
    const Wrench<Space, S> at_joint = ShiftForce<Space, S>(F_[step->child], arms.child);
    for (int i = 0; i < joint.num_u(); ++i) {
      force[joint.u_offset + i] = S(step->sign) * state.H(i).dot(at_joint);
    }
    F_[step->parent] += ShiftForce<Space, S>(at_joint, arms.parent);
  }
}

template <class Space, class S>
void TreeDynamics<Space, S>::Jacobian(const Kinematics<Space, S>& kinematics, MatrixX<S>& J) const {
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  J.setZero(mechanism.num_rows(), mechanism.num_u());
  for (int index : mechanism.constraints()) {
    const Joint<Space, S>& joint = mechanism.joints()[index];
    SetRows(kinematics, index, joint.row, joint.num_constraints(), J);
  }
}

template <class Space, class S>
void TreeDynamics<Space, S>::JacobianOf(const Kinematics<Space, S>& kinematics, int index,
                                        Eigen::Ref<MatrixX<S>> rows) const {
  MatrixX<S> J = MatrixX<S>::Zero(rows.rows(), rows.cols());
  SetRows(kinematics, index, 0, static_cast<int>(rows.rows()), J);
  rows = J;
}

template <class Space, class S>
void TreeDynamics<Space, S>::CouplingJacobian(const Kinematics<Space, S>& kinematics, MatrixX<S>& G,
                                              bool with_rotors) const {
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  const std::size_t couplings = mechanism.couplings().size(),
                    rotors = with_rotors ? mechanism.rotors().size() : 0;
  G.setZero(static_cast<Eigen::Index>(couplings + rotors), mechanism.num_u());
  const auto add = [&](std::size_t row, int joint, const S& ratio) {
    ForEachSpeedOfCoordinate(kinematics, joint, [&](int column, const S& rate) {
      G(static_cast<Eigen::Index>(row), column) += ratio * rate;
    });
  };
  for (std::size_t c = 0; c < couplings; ++c) {
    for (const auto& [joint, ratio] : mechanism.couplings()[c].parts) add(c, joint, ratio);
    if (!mechanism.couplings()[c].is_moving_row) continue;
    const MovingRow& row = kinematics.moving_row(static_cast<int>(c));
    ForEachSpeedOfLoop(kinematics, row.joint, [&](int column, const Velocity<Space, S>& V) {
      G(static_cast<Eigen::Index>(c), column) = kinematics.direction(row).dot(V);
    });
  }
  for (std::size_t r = 0; r < rotors; ++r) add(couplings + r, mechanism.rotors()[r].joint, S(1));
}

/// Along H of A_Q - A_P - g, where g has a prescribed acceleration.
template <class Space, class S>
S CoordinateAcceleration(const Kinematics<Space, S>& kinematics, int index,
                         std::span<const Acceleration<Space, S>> A) {
  const Joint<Space, S>& joint = kinematics.mechanism().joints()[index];
  const Acceleration<Space, S> relative = RelativeAcceleration<Space, S>(kinematics, index, A);
  S sum = WrenchOfEffort<Space, S>(kinematics.joints()[index].basis[0],
                                   joint.kind->inverse_H_squared, S(1))
              .dot(relative);
  if (joint.num_drives > 0) sum += kinematics.drives()[joint.first_drive].acceleration;
  return sum;
}

/// A free joint of the forest has its udot.
template <class Space, class S>
S CouplingAcceleration(const Kinematics<Space, S>& kinematics, int coupling, const VectorX<S>* udot,
                       std::span<const Acceleration<Space, S>> A) {
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  if (mechanism.couplings()[coupling].is_moving_row) {
    const MovingRow& row = kinematics.moving_row(coupling);
    return kinematics.direction(row).dot(RelativeAcceleration<Space, S>(kinematics, row.joint, A));
  }
  S sum = S(0);
  for (const auto& [index, ratio] : mechanism.couplings()[coupling].parts) {
    const Joint<Space, S>& joint = mechanism.joints()[index];
    if (!joint.in_tree()) {
      sum += ratio * CoordinateAcceleration<Space, S>(kinematics, index, A);
    } else if (joint.num_drives > 0) {
      sum += ratio * kinematics.drives()[joint.first_drive].acceleration;
    } else if (udot != nullptr) {
      sum += ratio * (*udot)[joint.u_offset];
    }
  }
  return sum;
}

template <class Space, class S>
void AddRotorWrenches(const Kinematics<Space, S>& kinematics,
                      std::span<const Acceleration<Space, S>> A,
                      std::span<Wrench<Space, S>> wrenches) {
  for (const auto& [index, inertia] : kinematics.mechanism().rotors()) {
    const Joint<Space, S>& joint = kinematics.mechanism().joints()[index];
    const JointState<Space, S>& state = kinematics.joints()[index];
    const Wrench<Space, S> F =
        WrenchOfEffort<Space, S>(state.basis[0], joint.kind->inverse_H_squared,
                                 inertia * CoordinateAcceleration<Space, S>(kinematics, index, A));
    wrenches[joint.to] += ShiftForce<Space, S>(F, state.r_Q);
    wrenches[joint.from] -= ShiftForce<Space, S>(F, state.r_P);
  }
}

namespace {

/// Relative motion, along an effort of a joint, of its two bodies if nothing else holds them.
template <class Space, class S>
S FreeResponseTo(const Kinematics<Space, S>& kinematics, Masses masses, int index,
                 const Wrench<Space, S>& effort) {
  const std::vector<Inertia<Space, S>>& inertias = kinematics.mechanism().bodies(masses);
  const Joint<Space, S>& joint = kinematics.mechanism().joints()[index];
  S sum = S(0);
  for (const auto& [body, r] : {std::pair{joint.to, kinematics.ArmQ(index, masses)},
                                std::pair{joint.from, kinematics.ArmP(index, masses)}}) {
    if (body == kGround) continue;
    const Wrench<Space, S> F = ShiftForce<Space, S>(effort, r);
    const Acceleration<Space, S> A(kinematics.RotationalInverse(inertias[body], body) * F.angular,
                                   F.linear / inertias[body].mass);
    sum += F.dot(A);
  }
  return sum;
}

}  // namespace

template <class Space, class S>
S FreeResponseOfCoordinate(const Kinematics<Space, S>& kinematics, Masses masses, int index) {
  const Joint<Space, S>& joint = kinematics.mechanism().joints()[index];
  if (joint.num_drives > 0) return S(0);
  return FreeResponseTo(kinematics, masses, index,
                        WrenchOfEffort<Space, S>(kinematics.joints()[index].basis[0],
                                                 joint.kind->inverse_H_squared, S(1)));
}

template <class Space, class S>
S FreeResponseOf(const Kinematics<Space, S>& kinematics, Masses masses, int coupling) {
  if (kinematics.mechanism().couplings()[coupling].is_moving_row) {
    const MovingRow& row = kinematics.moving_row(coupling);
    return FreeResponseTo(kinematics, masses, row.joint,
                          Wrench<Space, S>(kinematics.direction(row)));
  }
  S sum = S(0);
  for (const auto& [joint, ratio] : kinematics.mechanism().couplings()[coupling].parts) {
    sum += ratio * ratio * FreeResponseOfCoordinate(kinematics, masses, joint);
  }
  return sum;
}

/// Motions with zero free speeds come from prescribed motions alone.
template <class Space, class S>
void SpeedBias(Kinematics<Space, S>& kinematics, const VectorX<S>& zero, VectorX<S>& bias) {
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  bias.setZero(mechanism.num_rows());
  if (mechanism.drives().empty()) return;
  kinematics.UpdateVelocity(zero);
  for (int index : mechanism.constraints()) {
    const Joint<Space, S>& joint = mechanism.joints()[index];
    bias.segment(joint.row, joint.num_constraints()) =
        kinematics.ConstraintSpeed(index).head(joint.num_constraints());
  }
}

/// Computes gamma = -D^T (A_Q - A_P - g) with the accelerations for udot = 0; the missing part is J
/// udot.
template <class Space, class S>
void TreeDynamics<Space, S>::JacobianBias(const Kinematics<Space, S>& kinematics,
                                          VectorX<S>& gamma) const {
  const Mechanism<Space, S>& mechanism = kinematics.mechanism();
  gamma.resize(mechanism.num_equations());
  for (int index : mechanism.constraints()) {
    const Joint<Space, S>& joint = mechanism.joints()[index];
    const int rows = joint.num_constraints();
    const Components<Space, S> bias = JointAcceleration<Space, S>(kinematics, index, A_bias_);
    gamma.segment(joint.row, rows) = -bias.head(rows);
  }
  for (int c = 0; c < static_cast<int>(mechanism.couplings().size()); ++c) {
    gamma[mechanism.num_rows() + c] =
        -CouplingAcceleration<Space, S>(kinematics, c, nullptr, A_bias_);
  }
}

/// D^T of (7), both sides at Mo; H udot drops out because D^T H = 0 (9).
template <class Space, class S>
Acceleration<Space, S> RelativeAcceleration(const Kinematics<Space, S>& kinematics, int index,
                                            std::span<const Acceleration<Space, S>> A) {
  const Joint<Space, S>& joint = kinematics.mechanism().joints()[index];
  const JointState<Space, S>& state = kinematics.joints()[index];
  const Acceleration<Space, S> A_Q =
      ShiftMotion<Space, S>(A[joint.to], state.r_Q) + kinematics.Centripetal(joint.to, state.r_Q);
  const Acceleration<Space, S> A_P = ShiftMotion<Space, S>(A[joint.from], state.r_P) +
                                     kinematics.Centripetal(joint.from, state.r_P);
  return A_Q - A_P - state.g;
}

template <class Space, class S>
Components<Space, S> JointAcceleration(const Kinematics<Space, S>& kinematics, int index,
                                       std::span<const Acceleration<Space, S>> A) {
  return kinematics.joints()[index].Along(RelativeAcceleration<Space, S>(kinematics, index, A),
                                          kinematics.joints()[index].directions());
}

/// X of (16) for two bodies that nothing else holds: the sum over both sides of
/// (S^T D)^T M^-1 (S^T D), the wrenches S^T D being at the centres that the masses are at.
template <class Space, class S>
JointMatrix<S> FreeResponse(const Kinematics<Space, S>& kinematics, Masses masses, int index,
                            bool all_directions) {
  const Joint<Space, S>& joint = kinematics.mechanism().joints()[index];
  const std::vector<Inertia<Space, S>>& inertias = kinematics.mechanism().bodies(masses);
  const JointState<Space, S>& state = kinematics.joints()[index];
  const int rows = all_directions ? joint.num_directions() : joint.num_constraints();
  JointMatrix<S> X = JointMatrix<S>::Zero(rows, rows);
  for (int side = 0; side < 2; ++side) {
    const int body = side == 0 ? joint.to : joint.from;
    if (body == kGround) continue;
    const Linear<Space, S> r =
        side == 0 ? kinematics.ArmQ(index, masses) : kinematics.ArmP(index, masses);
    const auto inverse = kinematics.RotationalInverse(inertias[body], body);
    for (int a = 0; a < rows; ++a) {
      const Wrench<Space, S> F = ShiftForce<Space, S>(state.D(a), r);
      const Acceleration<Space, S> A(inverse * F.angular, F.linear / inertias[body].mass);
      for (int b = 0; b < rows; ++b) X(b, a) += ShiftForce<Space, S>(state.D(b), r).dot(A);
    }
  }
  return X;
}

#define LOOPBENCH_INSTANTIATE(Space, S)                                                          \
  template class TreeDynamics<Space, S>;                                                         \
  template Wrench<Space, S> InertiaTimes(const Kinematics<Space, S>&, int,                       \
                                         const Acceleration<Space, S>&);                         \
  template Wrench<Space, S> InertialForce(const Kinematics<Space, S>&, int,                      \
                                          const Acceleration<Space, S>&);                        \
  template void SpeedBias(Kinematics<Space, S>&, const VectorX<S>&, VectorX<S>&);                \
  template Acceleration<Space, S> RelativeAcceleration(const Kinematics<Space, S>&, int,         \
                                                       std::span<const Acceleration<Space, S>>); \
  template Components<Space, S> JointAcceleration(const Kinematics<Space, S>&, int,              \
                                                  std::span<const Acceleration<Space, S>>);      \
  template S CoordinateAcceleration(const Kinematics<Space, S>&, int,                            \
                                    std::span<const Acceleration<Space, S>>);                    \
  template S CouplingAcceleration(const Kinematics<Space, S>&, int, const VectorX<S>*,           \
                                  std::span<const Acceleration<Space, S>>);                      \
  template void AddRotorWrenches(const Kinematics<Space, S>&,                                    \
                                 std::span<const Acceleration<Space, S>>,                        \
                                 std::span<Wrench<Space, S>>);                                   \
  template S FreeResponseOfCoordinate(const Kinematics<Space, S>&, Masses, int);                 \
  template S FreeResponseOf(const Kinematics<Space, S>&, Masses, int);                           \
  template JointMatrix<S> FreeResponse(const Kinematics<Space, S>&, Masses, int, bool);
LOOPBENCH_FOR_EACH_SPACE_AND_MODEL_SCALAR(LOOPBENCH_INSTANTIATE)
#undef LOOPBENCH_INSTANTIATE

}  // namespace loopbench
