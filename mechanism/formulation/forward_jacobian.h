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
// The left-hand sides are O(n) (TreeDynamics::Residual); the equations are solved with the factors
// that the solver has from the system's last evaluation, be it a sweep, an LU or a partition. At
// velocity level the speeds that the right-hand side uses have derivatives of the same kind: the
// solver's Correct() of what a direction makes constraints miss at velocity level. Levels of other
// programs that do anything else to the right-hand side have no derivative, and say so.
//
// How often a measured angle has turned round (Kinematics::AcceptStep) is of no consequence here: a
// moment along H changes with H only along D, which lambda takes up.
//
// What is left out: the derivative of softening weights (direction_weights.h), and at velocity
// level that of the metric of the projection, whose effect is as small as the change of speeds it
// makes. The derivative is exact where nothing is softened and speeds satisfy the constraints.
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
