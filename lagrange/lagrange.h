// Acceleration-level Lagrange multipliers: the equations of constraint_solver.h with all
// multipliers solved at once.
//
// As published they are those of the cut joints, and the equations dense (dense_equations.h).
// Rank-revealing they are those of all joints, and the equations sparse (joint_response.h), where
// that is less work. Where a pivot leaves rank in doubt, the dense equations decide it, and soften;
// where these would be too large to be kept ready for that, the evaluation ends as `singular`.
#pragma once

#include <memory>

#include "lagrange/dense_equations.h"
#include "mechanism/loops/body_equations.h"
#include "mechanism/loops/joint_response.h"

namespace loopbench::lagrange {

template <class Space, class S>
class Lagrange final : public ConstraintSolver<Space, S> {
 public:
  /// `mechanism` must outlive the solver. Throws TooDense (dense_memory.h).
  Lagrange(const Mechanism<Space, S>& mechanism, const FormulationOptions& options);

  Outcome Factor(const Kinematics<Space, S>& kinematics) override;
  void Solve(const VectorX<S>& force, const VectorX<S>& target, VectorX<S>& x,
             VectorX<S>* lambda) override;
  bool Accelerate(const Kinematics<Space, S>& kinematics, const VectorX<S>& feedback,
                  VectorX<S>& udot, VectorX<S>* lambda) override;
  bool CompleteSpeeds(Kinematics<Space, S>& kinematics, VectorX<S>& u) override;

  std::string WhySingular() const override;

  /// Whether the last Factor() was sparse.
  bool is_sparse() const { return is_sparse_; }

 private:
  /// The equations as they are set.
  void SolveSparsely(VectorX<S>& x, VectorX<S>* lambda);

  const Mechanism<Space, S>& mechanism_;
  std::unique_ptr<JointResponse<Space>> joints_;  ///< null where they are not less work
  std::unique_ptr<DenseEquations<Space, S>> dense_;
  BodyEquations<Space, S> equations_;
  const Kinematics<Space, S>* kinematics_ = nullptr;  ///< of the last Factor()
  bool is_sparse_ = false;
  VectorX<S> change_;
};

}  // namespace loopbench::lagrange
