// The derivative of a system's right-hand side by the state, by forward differentiation.
//
// Only the mechanism model is evaluated with dual numbers, never a solver. Accelerations satisfy
//
//   M(q) udot + h(q, u) - J(q)^T lambda = 0,      J(q) udot - gamma(q, u) = 0,
//
// so that their derivatives along a direction x of the state satisfy the same equations, with the
// derivatives of the left-hand sides at fixed udot and lambda on the right:
//
//   M udot_x - J^T lambda_x = -d/dx (M udot + h - J^T lambda),   J udot_x = -d/dx (J udot - gamma).
//
// The left-hand sides are O(n) (TreeDynamics::Residual). The equations are solved with the solver's
// factors from the last evaluation: a sweep, an LU or a partition. At velocity level the speeds of
// the right-hand side have similar derivatives: Correct() of the change that a direction causes in
// the velocity violation. User-defined levels with other changes of the right-hand side have no
// derivative (has_derivative).
//
// The turn count of a measured angle (Kinematics::AcceptStep) has no effect here: a moment along H
// changes with H only along D, which lambda absorbs.
//
// Omitted: the derivative of regularization weights (direction_weights.h), and at velocity level
// the derivative of the projection's metric, whose effect is as small as the change of speeds. The
// derivative is exact without regularization if speeds satisfy the constraints.
#pragma once

#include "mechanism/algebra/dual.h"
#include "mechanism/formulation/system.h"

namespace loopbench {

template <class Space>
class ForwardJacobian {
 public:
  /// `system`, of a mechanism compiled from `description`, must outlive the object. Throws
  /// std::invalid_argument at a level without a derivative (LevelTraits::has_derivative).
  ForwardJacobian(const MechanismDescription& description, System<Space, double>& system);

  /// d(ydot)/dy at the state of the system's last call of Examine(), which must have succeeded; to
  /// be evaluated before anything else is asked of the system. `jacobian` is state_size() x
  /// state_size(), or has two more rows: the derivatives of the power supplied (prescribed motions
  /// included) and of the power dissipated. Allocates nothing.
  void Evaluate(Eigen::Ref<MatrixX<double>> jacobian);

  /// Evaluations of the model with dual numbers that Evaluate() takes: one for every eight columns.
  int evaluations() const;

 private:
  /// Directions `first` to first + count of the state, in q_ and u_.
  void Seed(int first, int count);
  void ProjectSpeeds(int count);
  void Accelerate(int count);
  void Write(int first, int count, Eigen::Ref<MatrixX<double>> jacobian);

  System<Space, double>& system_;
  Mechanism<Space, Dual> mechanism_;
  Kinematics<Space, Dual> kinematics_;
  TreeDynamics<Space, Dual> dynamics_;
  Drives<Space, Dual> drives_;
  VectorX<Dual> q_, u_, qdot_, udot_, lambda_, force_left_, constraint_left_;
  VectorX<double> lambda_now_, force_, target_, x_, lambda_x_;
};

}  // namespace loopbench
