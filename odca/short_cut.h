// What some mechanisms' right-hand sides take instead of the general sweep.
#pragma once

#include <optional>
#include <span>

#include "mechanism/formulation/constraint_solver.h"

namespace loopbench::odca {

template <class Space>
class ShortCut {
 public:
  virtual ~ShortCut() = default;
  /// As ConstraintSolver::RightHandSide(); `kinematics` may be null where no force but gravity
  /// acts. False near a degenerate position, for angles beyond kLargestAngle, and where
  /// accelerations are not finite. Allocates nothing.
  virtual bool Evaluate(SpeedsUsed speeds, Kinematics<Space, double>* kinematics,
                        std::span<const double> q, std::span<const double> u,
                        std::span<double> qdot, std::span<double> udot) = 0;
  /// As ConstraintSolver::Project(), where loops are closed; nothing where Evaluate() is false.
  virtual std::optional<Correction<double>> Project(std::span<double> q, std::span<double> u,
                                                    double goal) = 0;
  /// Whether Evaluate() is to be tried in a run that starts at these positions: where constraints
  /// are redundant all along, it would be refused each time.
  virtual bool Serves(const Kinematics<Space, double>& /*kinematics*/) { return true; }
  /// Multiply-adds of the last evaluation, or what it did of it.
  virtual long operations() const = 0;
};

}  // namespace loopbench::odca
