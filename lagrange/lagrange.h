// Lagrange multipliers at acceleration level: solves the equations of constraint_solver.h for all
// multipliers at once.
//
// As published, only cut joints have multipliers, and the equations are dense (dense_equations.h).
// Rank-revealing, all joints have them, and the equations are sparse (joint_response.h), if that is
// less work. If a pivot leaves the rank uncertain, the dense equations decide it and regularize. If
// these would be too large to keep ready, the evaluation ends as `singular`.
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
  bool AccelerateWithShare(const Kinematics<Space, S>& kinematics, const VectorX<S>& feedback,
                           SelfStress<Space, S>& stress, VectorX<S>& udot,
                           VectorX<S>* lambda) override;
  bool CompleteSpeeds(Kinematics<Space, S>& kinematics, VectorX<S>& u) override;

  std::string WhySingular() const override;

  /// Returns true if the last Factor() was sparse.
  bool is_sparse() const { return is_sparse_; }

 private:
  /// Solves the equations as they are set.
  void SolveEquations();
  void SolveSparsely(VectorX<S>& x, VectorX<S>* lambda);

  const Mechanism<Space, S>& mechanism_;
  std::unique_ptr<JointResponse<Space>> joints_;  ///< null unless they are less work
  std::unique_ptr<DenseEquations<Space, S>> dense_;
  BodyEquations<Space, S> equations_;
  const Kinematics<Space, S>* kinematics_ = nullptr;  ///< of the last Factor()
  bool is_sparse_ = false;
  VectorX<S> change_;
};

}  // namespace loopbench::lagrange
