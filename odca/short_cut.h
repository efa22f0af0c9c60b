// Fast path of some mechanisms' right-hand sides instead of the general pass.
#pragma once

#include <optional>
#include <span>

#include "mechanism/formulation/constraint_solver.h"

namespace loopbench::odca {

template <class Space>
class ShortCut {
 public:
  virtual ~ShortCut() = default;
  /// Evaluates like ConstraintSolver::RightHandSide(); `kinematics` may be null if only gravity
  /// acts. Returns false near a degenerate position, for angles beyond kLargestAngle, and if
  /// accelerations are not finite. Allocates nothing.
  virtual bool Evaluate(SpeedsUsed speeds, Kinematics<Space, double>* kinematics,
                        std::span<const double> q, std::span<const double> u,
                        std::span<double> qdot, std::span<double> udot) = 0;
  /// Projects like ConstraintSolver::Project() if loops are closed; nothing if Evaluate() is false.
  virtual std::optional<Correction<double>> Project(std::span<double> q, std::span<double> u,
                                                    double goal) = 0;
  /// Returns true if Evaluate() should be tried in a run that starts at these positions. It would
  /// fail each time if constraints are redundant everywhere.
  virtual bool IsUsable(const Kinematics<Space, double>& /*kinematics*/) { return true; }
  /// Returns the multiply-adds of the last evaluation, or of its completed part.
  virtual long operations() const = 0;
};

}  // namespace loopbench::odca
