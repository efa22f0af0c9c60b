// Equations of the spanning forest in its own coordinates, with the cut joints as constraints:
//
//   M(q) udot + h(q, u) = J^T lambda,      J(q) udot = gamma(q, u),      J u + b(q, t) = 0.
//
// b, from prescribed motions, is zero without them, and h and gamma then do not depend on time.
// Couplings (mechanism.h) add rows G to J, multipliers mu to lambda and numbers to gamma. Rotors
// add their accelerating forces to h. Solvers add their part of M (coupled_solver.h).
//
// M by the composite-rigid-body method, h by one outward and one inward pass (Featherstone, Rigid
// Body Dynamics Algorithms, ch. 5 and 6), J row by row from D^T (V_Q - V_P) at the joint's point.
// M is dense: O(n depth) to fill, which the dense baselines pay anyway.
#pragma once

#include <span>
#include <vector>

#include "mechanism/loops/loop_solver.h"
#include "mechanism/model/kinematics.h"

namespace loopbench {

template <class Space, class S>
class TreeDynamics {
 public:
  explicit TreeDynamics(const Mechanism<Space, S>& mechanism);

  /// Mass matrix of the forest (num_u x num_u, both triangles).
  void MassMatrix(const Kinematics<Space, S>& kinematics, Masses masses, MatrixX<S>& M);

  /// Computes h: velocity-dependent terms minus applied forces. Keeps the accelerations for udot =
  /// 0 for JacobianBias().
  void Bias(const Kinematics<Space, S>& kinematics, VectorX<S>& h);

  /// J (num_rows x num_u).
  void Jacobian(const Kinematics<Space, S>& kinematics, MatrixX<S>& J) const;
  /// Rows of J for one cut joint, as many as `rows` has: directions imposed, then released ones.
  void JacobianOf(const Kinematics<Space, S>& kinematics, int joint,
                  Eigen::Ref<MatrixX<S>> rows) const;

  /// G: derivatives by u of the couplings' rates (num_equations - num_rows x num_u), then, if asked
  /// for, of the rates of joints with rotors.
  void CouplingJacobian(const Kinematics<Space, S>& kinematics, MatrixX<S>& G,
                        bool with_rotors = false) const;

  /// gamma of joints and couplings (num_equations), after Bias().
  void JacobianBias(const Kinematics<Space, S>& kinematics, VectorX<S>& gamma) const;

  /// The wrench at each body's centre of mass that udot takes beyond applied forces and lambda
  /// (with mu behind it, if any): the joints of the forest must transmit it. Good until the next
  /// call of any member function.
  std::span<const Wrench<Space, S>> WrenchesLeft(const Kinematics<Space, S>& kinematics,
                                                 const VectorX<S>& udot, const VectorX<S>& lambda);

  /// Computes residuals of the equations above for udot and lambda: M udot + h - J^T lambda in
  /// `force`, J udot - gamma in `constraint`. O(n). Overwrites the accelerations kept by Bias().
  void Residual(const Kinematics<Space, S>& kinematics, const VectorX<S>& udot,
                const VectorX<S>& lambda, VectorX<S>& force, VectorX<S>& constraint);

  /// Accelerations of the centres of mass for given udot.
  void BodyAccelerations(const Kinematics<Space, S>& kinematics, const VectorX<S>& udot,
                         std::span<Acceleration<Space, S>> A) const;

  /// Computes the part of these accelerations that is linear in udot. Also for speeds.
  void Motions(const Kinematics<Space, S>& kinematics, const VectorX<S>& udot,
               std::span<Acceleration<Space, S>> A) const;
  /// M x, in O(n) and without M.
  void MassTimes(const Kinematics<Space, S>& kinematics, const VectorX<S>& x, VectorX<S>& force);

 private:
  /// Computes accelerations with or without the terms of speeds and time.
  template <bool kWithBias>
  void Outward(const Kinematics<Space, S>& kinematics, const VectorX<S>& udot,
               std::span<Acceleration<Space, S>> A) const;
  /// Wrenches that bodies with accelerations A_bias_ need beyond applied forces, in F_.
  void NeededWrenches(const Kinematics<Space, S>& kinematics);
  /// Their components along the coordinates of the forest.
  void AlongForest(const Kinematics<Space, S>& kinematics, VectorX<S>& force);

  std::vector<Acceleration<Space, S>> A_bias_;
  std::vector<Wrench<Space, S>> F_;
  std::vector<Block<Space, S>> composite_;
};

/// M of a body times A: the wrench behind an acceleration from rest, the momentum of a velocity.
/// All are at its centre of mass.
template <class Space, class S>
Wrench<Space, S> InertiaTimes(const Kinematics<Space, S>& kinematics, int body,
                              const Acceleration<Space, S>& A);

/// Wrench at its centre of mass that gives a body the acceleration A there.
template <class Space, class S>
Wrench<Space, S> InertialForce(const Kinematics<Space, S>& kinematics, int body,
                               const Acceleration<Space, S>& A);

/// Computes b: the constraint violation if all free speeds were zero. `zero` has num_u zeros. With
/// prescribed motions, the motions of `kinematics` keep these zeros.
template <class Space, class S>
void SpeedBias(Kinematics<Space, S>& kinematics, const VectorX<S>& zero, VectorX<S>& bias);

/// A_Q - A_P - g of one joint from the accelerations A of all centres of mass. Its components D^T
/// of it vanish when the joint is satisfied at acceleration level.
template <class Space, class S>
Acceleration<Space, S> RelativeAcceleration(const Kinematics<Space, S>& kinematics, int joint,
                                            std::span<const Acceleration<Space, S>> A);

/// Returns the components along the directions, imposed ones first.
template <class Space, class S>
Components<Space, S> JointAcceleration(const Kinematics<Space, S>& kinematics, int joint,
                                       std::span<const Acceleration<Space, S>> A);

/// Acceleration along the one coordinate of a joint, prescribed or free, from the accelerations A
/// of all centres of mass.
template <class Space, class S>
S CoordinateAcceleration(const Kinematics<Space, S>& kinematics, int joint,
                         std::span<const Acceleration<Space, S>> A);

/// Second derivative of a coupling's mismatch, from the accelerations A of all centres of mass and
/// the udot that they belong to; null: zero.
template <class Space, class S>
S CouplingAcceleration(const Kinematics<Space, S>& kinematics, int coupling, const VectorX<S>* udot,
                       std::span<const Acceleration<Space, S>> A);

/// Adds the wrenches, at the centres of mass, that rotors need for accelerations A of these.
template <class Space, class S>
void AddRotorWrenches(const Kinematics<Space, S>& kinematics,
                      std::span<const Acceleration<Space, S>> A,
                      std::span<Wrench<Space, S>> wrenches);

/// Response of a joint's coordinate to its own force if only the two bodies of the joint move; 0 if
/// its motion is prescribed.
template <class Space, class S>
S FreeResponseOfCoordinate(const Kinematics<Space, S>& kinematics, Masses masses, int joint);
/// Response of a coupling to its own force, likewise: the scale of its row.
template <class Space, class S>
S FreeResponseOf(const Kinematics<Space, S>& kinematics, Masses masses, int coupling);

/// Response D^T (S M^-1 S^T) D of the two bodies of a joint when nothing else holds them, the scale
/// against which the response of the assembled mechanism is judged (docs/decisions/005): of the
/// directions imposed, or of all.
template <class Space, class S>
JointMatrix<S> FreeResponse(const Kinematics<Space, S>& kinematics, Masses masses, int joint,
                            bool all_directions = false);

}  // namespace loopbench
